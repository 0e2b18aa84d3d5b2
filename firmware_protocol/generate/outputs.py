"""Which files are generated, and whether they are up to date."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from firmware_protocol.generate.board import build_page, own_robot_page, pins
from firmware_protocol.generate.can_database import can_database
from firmware_protocol.generate.dialect import dialect
from firmware_protocol.generate.host import host_layout, host_stub
from firmware_protocol.generate.reference import reference
from firmware_protocol.generate.tables import core_tables, junior_tables, micro_tables, roles
from firmware_protocol.generate.vectors import can_text, golden_binary, golden_text
from firmware_protocol.generate.wiring import draw

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT: Final = Path(__file__).resolve().parents[2]
"""Root of the source tree; the files below are relative to it."""

OUTPUTS: Final[dict[str, Callable[[], str]]] = {
    "firmware_protocol/dialect/junior.xml": dialect,
    "firmware_protocol/dialect/junior.dbc": can_database,
    "firmware_protocol/firmware/core/tables.h": core_tables,
    "firmware_protocol/firmware/junior/tables.h": junior_tables,
    "firmware_protocol/firmware/micro/tables.h": micro_tables,
    "firmware_protocol/firmware/roles.h": roles,
    "firmware_protocol/firmware/host_io.py": host_layout,
    "simdevice/_host.pyi": host_stub,
    "docs/protocol.md": reference,
    "docs/build.md": build_page,
    "docs/own-robot.md": own_robot_page,
    "docs/figures/wiring.svg": lambda: draw(pins()),
}
"""Every generated file, with the function that makes its text."""

GOLDEN: Final[dict[str, Callable[[], bytes]]] = {
    "tests/golden/mavlink.bin": golden_binary,
    "tests/golden/mavlink.txt": lambda: golden_text().encode(),
    "tests/golden/can.txt": lambda: can_text().encode(),
}
"""The golden vectors, written on demand only."""


def stale(root: Path = ROOT) -> list[str]:
    """The generated files that are missing or not what the messages say.

    Args:
        root: Root of the source tree.

    Returns:
        Paths relative to the root.
    """
    found = []
    for name, make in OUTPUTS.items():
        path = root / name
        if not path.is_file() or path.read_text(encoding="utf-8") != make():
            found.append(name)
    return found
