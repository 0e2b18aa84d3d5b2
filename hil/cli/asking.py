"""Options by which a person is asked for something while a run goes on."""

from __future__ import annotations

import sys

from hil.cli import common


def check_asked(option: str | None, *, in_real_time: bool, live: bool) -> None:
    """See that a person is needed, and can be asked.

    Args:
        option: The option that asks a person, as on the command line; None: none does.
        in_real_time: The robot is none of this process.
        live: There is a live page.

    Raises:
        UsageError: Nobody need, or can.
    """
    if option is None:
        return
    if not in_real_time:
        raise common.UsageError(f"a robot that is emulated in this process has a referee: leave {option} out, or name a LINK")
    if not live and (sys.stdin is None or not sys.stdin.isatty()):
        raise common.UsageError(f"{option} asks a person, and nobody can be asked here: run it on a terminal, or add --live")
