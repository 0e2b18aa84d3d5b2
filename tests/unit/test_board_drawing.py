"""The board's pins, and the drawing made of them."""

from __future__ import annotations

import re
from xml.etree import ElementTree as ET

import pytest

from firmware_protocol.generate.board import BOARD_H, Pin, build_page, micro_pins, own_robot_page, pin_table, pins, read_pins
from firmware_protocol.generate.wiring import draw

SVG = "{http://www.w3.org/2000/svg}"


def texts(drawing: str) -> list[str]:
    return [element.text or "" for element in ET.fromstring(drawing).iter(f"{SVG}text")]  # noqa: S314 - our own


def test_every_pin_of_the_header_is_found() -> None:
    header = BOARD_H.read_text(encoding="utf-8")
    found = pins()
    assert len(found) == len(re.findall(r"\bX\([A-Z]\w+, ", header))
    assert next(pin for pin in found if pin.name == "ARM_LEFT").port == "PD2"


def test_the_drawing_shows_each_pin_and_what_is_on_it() -> None:
    drawing = draw(pins())
    shown = texts(drawing)
    for pin in pins():
        words = re.sub(r"^driver (\w+).*", r"\1", pin.use) if pin.use.startswith("driver") else re.split(r"[,;:]", pin.use)[0]
        assert words in shown
        assert pin.label in shown
    assert drawing.count("<line") >= len(pins())


def test_a_signal_is_one_straight_line_beside_its_pin() -> None:
    moved = [Pin("EYE_LEFT", "A5", "left eye's output", "ADC5")] + [pin for pin in pins() if pin.name != "EYE_LEFT"]
    before, after = (
        next(
            float(element.attrib["y"])
            for element in ET.fromstring(draw(wired)).iter(f"{SVG}text")  # noqa: S314
            if element.text == "left eye's output"
        )
        for wired in (pins(), moved)
    )
    assert after - before == pytest.approx(5 * 34)


def test_a_pin_that_the_nano_lacks_is_refused() -> None:
    with pytest.raises(ValueError, match="has no D99"):
        draw([Pin("ARM_LEFT", "D99", "left arm's switch", "PD2")])


def test_a_pin_used_twice_is_refused() -> None:
    row = '    X({}, D, 2, "D2", "an arm") \\\n'
    with pytest.raises(ValueError, match="twice"):
        read_pins(row.format("ARM_LEFT") + row.format("ARM_RIGHT"))


def test_the_page_holds_the_table() -> None:
    assert pin_table(pins()) in build_page()


def test_a_micro_robot_has_its_own_pins_and_what_is_left_of_juniors() -> None:
    found = {pin.name: pin.label for pin in micro_pins()}
    assert {"BUMPER_LEFT": "D2", "LEFT_A": "A0", "STANDBY": "D5", "BATTERY": "A6"}.items() <= found.items()
    assert not {"ARM_LEFT", "EYE_LEFT", "FLOOR_RIGHT"} & found.keys()
    assert len(set(found.values())) == len(found)
    assert pin_table(micro_pins()) in own_robot_page()
