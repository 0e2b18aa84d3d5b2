"""The pins of the boards, read from the headers that the firmware is compiled with."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

BOARD_H: Final = Path(__file__).resolve().parents[1] / "firmware" / "targets" / "avr" / "board.h"
MICRO_BOARD_H: Final = BOARD_H.with_name("board_micro.h")
_DOCS: Final = Path(__file__).resolve().parents[2] / "docs"
PAGE: Final = _DOCS / "build.md"
"""The page with the table of Junior's pins, in the source tree."""
MICRO_PAGE: Final = _DOCS / "own-robot.md"
"""The page with that of a micro-robot's."""
_BEGIN: Final = "<!-- pins: python -m firmware_protocol.generate -->\n"
_END: Final = "<!-- end of pins -->\n"
_DIGITAL: Final = re.compile(r'X\((\w+), ([BCD]), (\d), "(\w+)", "([^"]*)"\)')
_ANALOG: Final = re.compile(r'X\((\w+), (\d), "(\w+)", "([^"]*)"\)')


@dataclass(frozen=True)
class Pin:
    """A pin that something is wired to.

    Attributes:
        name: What the firmware calls it.
        label: What is printed on the board.
        use: What is wired to it, in words.
        port: The processor's name of it, as PD2 or ADC0.
    """

    name: str
    label: str
    use: str
    port: str


def read_pins(header: str) -> list[Pin]:
    """Digital, then analog pins, in the header's order.

    Args:
        header: Text of board.h.

    Raises:
        ValueError: It names no pin, or one label twice.
    """
    found = [Pin(name, label, use, f"P{port}{bit}") for name, port, bit, label, use in _DIGITAL.findall(header)]
    found += [Pin(name, label, use, f"ADC{channel}") for name, channel, label, use in _ANALOG.findall(header)]
    labels = [pin.label for pin in found]
    if not found or len(set(labels)) != len(labels):
        raise ValueError(f"board.h names no pin, or one twice: {labels}")
    return found


def pins() -> list[Pin]:
    """The pins of Junior's board in the source tree."""
    return read_pins(BOARD_H.read_text(encoding="utf-8"))


def micro_pins() -> list[Pin]:
    """The pins of a micro-robot's board: its own, and those of Junior's that it has not put to another use."""
    own = read_pins(MICRO_BOARD_H.read_text(encoding="utf-8"))
    taken = {pin.label for pin in own}
    return sorted(
        [*own, *(pin for pin in pins() if pin.label not in taken)], key=lambda pin: (pin.label[0] != "D", int(pin.label[1:]))
    )


def build_page() -> str:
    """The page on building a Junior, with the table as it must be.

    Raises:
        ValueError: The page has no place for the table.
    """
    return _with_table(PAGE, pins())


def own_robot_page() -> str:
    """The page on robots of one's own, with the table of a micro-robot's pins as it must be.

    Raises:
        ValueError: The page has no place for the table.
    """
    return _with_table(MICRO_PAGE, micro_pins())


def _with_table(path: Path, wired: list[Pin]) -> str:
    page = path.read_text(encoding="utf-8")
    head, begin, rest = page.partition(_BEGIN)
    _, end, tail = rest.partition(_END)
    if not begin or not end:
        raise ValueError(f"{path.name} lacks {_BEGIN.strip()} or {_END.strip()}")
    return f"{head}{begin}\n{pin_table(wired)}\n{end}{tail}"


def pin_table(wired: list[Pin]) -> str:
    """The pins as a Markdown table.

    Args:
        wired: What is wired.
    """
    rows = ["| on the Nano | of the processor | wire it to |", "|---|---|---|"]
    rows += [f"| {pin.label} | {pin.port} | {pin.use} |" for pin in wired]
    return "\n".join(rows) + "\n"
