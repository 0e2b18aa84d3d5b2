"""The console script `hil`: one file per sub-command, imported when it is called."""

from __future__ import annotations

import os
import sys

from hil.cli.loading import loading


def main() -> None:
    """Run the command line and leave the process."""
    open_standard_streams()
    try:
        with loading():
            from hil.cli.app import main as run  # noqa: PLC0415 - loading takes a moment, in which Ctrl-C may come
    except KeyboardInterrupt:
        sys.exit(130)
    run()


def open_standard_streams() -> None:
    """Put nothing in the place of a standard stream that is closed.

    Else the next file or port that is opened gets its number, and what is printed somewhere goes there.
    """
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:  # the lowest number that is free
        os.set_inheritable(number, True)  # noqa: FBT003 - the system's
    os.close(number)
    if sys.stdin is None:
        sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115 - as long as the process
    for name, descriptor in (("stdout", 1), ("stderr", 2)):
        if getattr(sys, name) is None:
            setattr(sys, name, open(descriptor, "w", encoding="utf-8", closefd=False))  # noqa: SIM115


__all__ = ["main"]
