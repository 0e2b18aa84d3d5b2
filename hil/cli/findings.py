"""What was found at a port, in words."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

from hil.connecting.listening import Signed

if TYPE_CHECKING:
    from pathlib import Path

    from hil.connecting.discovery import Finding
    from hil.connecting.listening import HeardRobot


def lines_of(finding: Finding, signing_key: Path | None) -> list[str]:
    """A place and what is there, for a person.

    Args:
        finding: What was found.
        signing_key: Key file that robots were recognised by.
    """
    place = finding.place
    ids = ":".join(str(part) for key in ("vendor_id", "product_id") if (part := place.details.get(key)))
    extra = [f"serial number {place.serial_number}"] if place.serial_number else []
    hardware = "  ".join(part for part in (place.description, ids and f"({', '.join((ids, *extra))})") if part)
    lines = [f"{place.device}  {hardware}".rstrip()]
    lines += [_robot(finding, robot, signing_key) for robot in finding.robots]
    if finding.reason:
        lines.append(f"    {finding.reason}")
    if finding.remedy:
        lines.append(f"    {finding.remedy}")
    return lines


def _robot(finding: Finding, robot: HeardRobot, signing_key: Path | None) -> str:
    if not robot.usable:
        return f"    {robot}"
    address = finding.url if robot.micro else finding.address(robot)
    which = f" --robot {robot.system}" if robot.micro else ""
    key = f" --signing-key {shlex.quote(str(signing_key))}" if robot.signed is Signed.OUR_KEY else ""
    return f"    {robot}: hil monitor {_quoted(address)}{which}{key}"


def _quoted(address: str) -> str:
    """As a shell takes it."""
    return f"'{address}'" if set("?&*; ") & set(address) else address
