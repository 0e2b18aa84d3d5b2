"""The table of checks in docs/check.md: `python -m hil.conformance.page` writes it anew."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Final

from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.wire.fields import CAN, MAVLINK
from hil.conformance.suite import CHECKS, LAST

if TYPE_CHECKING:
    from hil.conformance.registry import Check

PAGE: Final = Path(__file__).resolve().parents[2] / "docs" / "check.md"
"""The page, in the source tree."""
BEGIN: Final = "<!-- checks: python -m hil.conformance.page -->\n"
"""The table stands between this and `END`."""
END: Final = "<!-- end of checks -->\n"

_OVER: Final = {MAVLINK: " *MAVLink.*", CAN: " *CAN.*"}
"""What a check is about that is not run on every link."""


def wheels_of(check: Check) -> str:
    """Whose wheels turn in a check, and how much room that takes; empty where none turn."""
    if check.room:
        return f"yes, {check.room:g} m of free room"
    if check.moving:
        return "yes"
    return f"{MICRO_ROBOT.name} only" if check.motion else ""


def table() -> str:
    """All checks, group by group, as Markdown."""
    lines: list[str] = []
    for title, checks in groupby((*CHECKS, LAST), key=lambda check: check.group):
        lines += [f"### {title[0].upper()}{title[1:]}", "", "| check | what the protocol demands | says |", "|---|---|---|"]
        for check in checks:
            key = " *With a key.*" if check.keyed else ""
            role = f" *{check.role[0].upper()}{check.role[1:]}.*" if check.role else ""
            second = " *Two robots.*" if check.second else ""
            wheels = f" *Wheels turn: {wheels_of(check)}.*" if wheels_of(check) else ""
            marks = f"{_OVER.get(check.wire, '')}{role}{key}{second}{wheels}"
            lines.append(f"| `{check.name}` | {check.demands}{marks} | {check.rule} |")
        lines.append("")
    return "\n".join(lines)


def renewed(page: str) -> str:
    """A page with the table as it must be.

    Args:
        page: The page as it is.

    Raises:
        ValueError: It has no place for a table.
    """
    head, begin, rest = page.partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"the page lacks {BEGIN.strip()} or {END.strip()}")
    return f"{head}{begin}\n{table()}\n{end}{tail}"


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
