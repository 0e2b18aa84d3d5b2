"""The pins of the board, read from the header that the firmware is compiled with."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

BOARD_H: Final = Path(__file__).resolve().parents[1] / "firmware" / "targets" / "avr" / "board.h"
PAGE: Final = Path(__file__).resolve().parents[2] / "docs" / "build.md"
"""The page with the table of pins, in the source tree."""
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
    """The pins of the board in the source tree."""
    return read_pins(BOARD_H.read_text(encoding="utf-8"))


def build_page() -> str:
    """The page on building a robot, with the table as it must be.

    Raises:
        ValueError: The page has no place for the table.
    """
    page = PAGE.read_text(encoding="utf-8")
    head, begin, rest = page.partition(_BEGIN)
    _, end, tail = rest.partition(_END)
    if not begin or not end:
        raise ValueError(f"{PAGE.name} lacks {_BEGIN.strip()} or {_END.strip()}")
    return f"{head}{begin}\n{pin_table(pins())}\n{end}{tail}"


def pin_table(wired: list[Pin]) -> str:
    """The pins as a Markdown table.

    Args:
        wired: What is wired.
    """
    rows = ["| on the Nano | of the processor | wire it to |", "|---|---|---|"]
    rows += [f"| {pin.label} | {pin.port} | {pin.use} |" for pin in wired]
    return "\n".join(rows) + "\n"
