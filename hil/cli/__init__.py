"""The console script `hil`: one file per sub-command."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line and leave the process."""
    try:
        from hil.cli.app import main as run  # noqa: PLC0415 - loading takes a moment, in which Ctrl-C may come
    except KeyboardInterrupt:
        sys.exit(130)
    run()


__all__ = ["main"]
