"""The wiring as a drawing: docs/figures/wiring.svg, from the pins of the board.

The Nano stands in the middle with its pins where they are; what is wired to a pin stands beside it, so that every signal
is one straight line. Supply and ground are flags, as in a circuit diagram.
"""

from __future__ import annotations

import re
from html import escape
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.generate.board import Pin

LEFT: Final = ("D13", "3V3", "REF", "A0", "A1", "A2", "A3", "A4", "A5", "A6", "A7", "5V", "RST", "GND", "VIN")
RIGHT: Final = ("D12", "D11", "D10", "D9", "D8", "D7", "D6", "D5", "D4", "D3", "D2", "GND", "RST", "RX0", "TX1")
"""Pins of an Arduino Nano from above, its USB socket at the top, from top to bottom."""
_WIDTH: Final = 1040
_TOP: Final = 110
_PITCH: Final = 34
_NANO: Final = (440, 600)
_BOX: Final = 26
_FLAGS: Final = {"5V": "#b3261e", "GND": "#3c4043", "BAT": "#8a4b00"}
_INK: Final = "#202124"
_WIRES: Final = ("#1565c0", "#2e7d32", "#6a1b9a", "#00838f", "#ad1457", "#4e342e", "#283593")
_NEEDS: Final = {
    "EYE": ("5V", "GND"),
    "FLOOR": ("5V", "GND"),
    "ARM": ("GND",),
    "START": ("5V", "GND"),
    "BATTERY": ("BAT", "GND"),
}
"""Supply of what is wired, by the beginning of the pin's name."""


def draw(pins: Sequence[Pin]) -> str:
    """The drawing.

    Args:
        pins: What is wired.

    Returns:
        SVG text.

    Raises:
        ValueError: A pin's label is not on a Nano.
    """
    rows = {pin.label: pin for pin in pins}
    unknown = set(rows) - set(LEFT) - set(RIGHT)
    if unknown:
        raise ValueError(f"an Arduino Nano has no {', '.join(sorted(unknown))}")
    parts = [_nano()]
    parts += [_side(rows, LEFT, left=True), _side(rows, RIGHT, left=False), _driver(rows), _power(rows), _pins()]
    height = _TOP + len(LEFT) * _PITCH + 150
    body = "\n".join(parts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" font-family="sans-serif" font-size="13" '
        f'role="img" aria-label="Wiring of Junior on an Arduino Nano">\n'
        f'<rect width="{_WIDTH}" height="{height}" fill="#ffffff"/>\n'
        f"{_text(_WIDTH / 2, 32, 'Junior on an Arduino Nano, seen from above', size=20)}\n{body}\n</svg>\n"
    )


def _y(index: int) -> int:
    return _TOP + index * _PITCH


def _text(x: float, y: float, text: str, *, anchor: str = "middle", size: int = 13, fill: str = _INK) -> str:
    return f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}" font-size="{size}" fill="{fill}">{escape(text)}</text>'


def _rect(x: float, y: float, width: float, height: float, fill: str) -> str:
    return f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="5" fill="{fill}" stroke="{_INK}"/>'


def _line(x1: float, y1: float, x2: float, y2: float, colour: str) -> str:
    return f'<line x1="{x1:g}" y1="{y1:g}" x2="{x2:g}" y2="{y2:g}" stroke="{colour}" stroke-width="2.5"/>'


def _flag(x: float, y: float, name: str) -> str:
    """A supply or ground, centred at a point."""
    box = f'<rect x="{x - 19:g}" y="{y - 10:g}" width="38" height="20" rx="10" fill="{_FLAGS[name]}"/>'
    return box + _text(x, y + 4, name, size=11, fill="#ffffff")


def _nano() -> str:
    """The board with the names of its pins."""
    left, right = _NANO
    parts = [_rect(left, _TOP - 50, right - left, len(LEFT) * _PITCH + 62, "#d7ecf0")]
    parts += [_rect(left + 55, _TOP - 62, right - left - 110, 34, "#c4c7c5"), _text((left + right) / 2, _TOP - 40, "USB")]
    for index, (one, other) in enumerate(zip(LEFT, RIGHT, strict=True)):
        y = _y(index)
        parts += [_text(left + 20, y + 5, one, anchor="start"), _text(right - 20, y + 5, other, anchor="end")]
    return "\n".join(parts)


def _pins() -> str:
    """The Nano's pins themselves, over the wires' ends."""
    at = [(x, _y(index)) for index in range(len(LEFT)) for x in (_NANO[0] + 10, _NANO[1] - 10)]
    return "\n".join(f'<circle cx="{x}" cy="{y}" r="4" fill="#c9a227" stroke="{_INK}"/>' for x, y in at)


def _side(rows: dict[str, Pin], labels: Sequence[str], *, left: bool) -> str:
    """What is wired on one side, but for the motor driver."""
    parts = []
    edge = _NANO[0] + 10 if left else _NANO[1] - 10
    for index, label in enumerate(labels):
        y = _y(index)
        if label in _FLAGS or label == "VIN":
            x = edge - 62 if left else edge + 62
            parts += [
                _line(edge, y, x, y, _FLAGS[label if label in _FLAGS else "BAT"]),
                _flag(x, y, "BAT" if label == "VIN" else label),
            ]
        pin = rows.get(label)
        if pin is None or pin.use.startswith("driver"):
            continue
        x, width = (30, 330) if left else (680, 330)
        near = x + width if left else x
        parts.append(_line(edge, y, near, y, _WIRES[index % len(_WIRES)]))
        parts.append(_rect(x, y - _BOX / 2, width, _BOX, "#fff3d6"))
        supplies = next((flags for start, flags in _NEEDS.items() if pin.name.startswith(start)), None)
        if supplies is None:
            raise ValueError(f"nobody says what supply the pin {pin.name} needs: `_NEEDS` has no beginning of its name")
        for number, flag in enumerate(supplies):
            parts.append(_flag((x + 24 if left else x + width - 24) + (44 if left else -44) * number, y, flag))
        words = re.split(r"[,;:]", pin.use)[0]
        parts.append(_text(near - 10 if left else near + 10, y + 4, words, anchor="end" if left else "start", size=12))
    return "\n".join(parts)


def _driver(rows: dict[str, Pin]) -> str:
    """The motor driver, its pins beside those of the Nano, and both motors."""
    wired = [
        (index, rows[label]) for index, label in enumerate(RIGHT) if label in rows and rows[label].use.startswith("driver")
    ]
    first, last = wired[0][0], wired[-1][0]
    x, width = 680, 130
    parts = [_rect(x, _y(first) - 18, width, (last - first) * _PITCH + 36, "#e3d7f0")]
    middle = (_y(first) + _y(last)) / 2
    parts.append(_text(x + width / 2, middle - 6, "TB6612"))
    parts.append(_text(x + width / 2, middle + 12, "driver"))
    for index, pin in wired:
        name = re.sub(r"^driver (\w+).*", r"\1", pin.use)
        parts.append(_line(_NANO[1] - 10, _y(index), x, _y(index), _WIRES[index % len(_WIRES)]))
        parts.append(_text(x + 6, _y(index) + 5, name, anchor="start", size=12))
    for motor, top, pair in (("right motor", first, ("BO1", "BO2")), ("left motor", first + 2, ("AO1", "AO2"))):
        y = (_y(top) + _y(top + 1)) / 2
        for row, name in enumerate(pair):
            parts.append(_line(x + width, _y(top + row), 950, _y(top + row), _INK))
            parts.append(_text(x + width - 6, _y(top + row) + 5, name, anchor="end", size=12))
        parts += [f'<circle cx="950" cy="{y:g}" r="32" fill="#dfe8d8" stroke="{_INK}"/>', _text(950, y + 4, motor, size=11)]
    for row, (name, flag) in enumerate((("VM", "BAT"), ("VCC", "5V"), ("GND", "GND")), first + 4):
        parts += [_line(x + width, _y(row), x + width + 40, _y(row), _FLAGS[flag]), _flag(x + width + 59, _y(row), flag)]
        parts.append(_text(x + width - 6, _y(row) + 5, name, anchor="end", size=12))
    return "\n".join(parts)


def _power(rows: dict[str, Pin]) -> str:
    """Battery, switch, and what the flags mean."""
    y = _y(len(LEFT)) + 62
    parts = [
        _rect(30, y - 26, 170, 52, "#f7dfd3"),
        _text(115, y - 4, "battery 7.4 V"),
        _text(115, y + 14, "(two LiPo cells)", size=11),
    ]
    parts += [
        _line(200, y - 10, 262, y - 10, _FLAGS["BAT"]),
        _rect(262, y - 24, 90, 28, "#ffffff"),
        _text(307, y - 5, "switch"),
    ]
    parts += [_line(352, y - 10, 411, y - 10, _FLAGS["BAT"]), _flag(430, y - 10, "BAT")]
    parts += [_line(200, y + 16, 411, y + 16, _FLAGS["GND"]), _flag(430, y + 16, "GND")]
    notes = (
        "Flags of one name are joined. All grounds meet at the driver.",
        "A capacitor of 100 uF or more lies across VM and GND of the driver.",
        *(f"{pin.label}: {pin.use}." for pin in rows.values() if "kohm" in pin.use),
    )
    parts += [_text(480, y - 24 + 20 * row, note, anchor="start", size=12) for row, note in enumerate(notes)]
    return "\n".join(parts)
