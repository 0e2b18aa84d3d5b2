"""The dialect: standard messages are MAVLink's own, and pymavlink's generated class and our codec read each other."""

from __future__ import annotations

import importlib
import importlib.util
import math
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from firmware_protocol.events import Received
from firmware_protocol.generate.names import STANDARD_ENUMS, Enumeration
from firmware_protocol.generate.outputs import ROOT
from firmware_protocol.generate.vectors import Vector, vectors
from firmware_protocol.messages import MESSAGES, STANDARD_MESSAGES
from firmware_protocol.wire.fields import Message, Wire, wire_fields, wire_order
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.mavlink_layout import C_TYPES, crc_extra, offsets, payload_length

if TYPE_CHECKING:
    from types import ModuleType

DIALECT = ROOT / "firmware_protocol/dialect/junior.xml"
STANDARD = Path(importlib.import_module("pymavlink.dialects.v20").__path__[0])
VECTORS = vectors()
NEWER_EXTENSIONS = {"TIMESYNC": [("target_system", "uint8_t", 0), ("target_component", "uint8_t", 0)]}
"""Extension fields of MAVLink's own common.xml (its description speaks of them) that pymavlink's copy lacks."""


Column = tuple[str, str, int]
"""Name, C type and array length of a field."""


@dataclass
class Standard:
    """The standard MAVLink files as pymavlink ships them.

    Attributes:
        names: Name of each message, by id.
        declared: Its field names as declared.
        ordered: Its fields in the order of the payload.
        crc_extra: Its checksum seed.
        enums: Values by name, by name of the enumeration.
    """

    names: dict[int, str] = field(default_factory=dict)
    declared: dict[int, list[str]] = field(default_factory=dict)
    ordered: dict[int, list[Column]] = field(default_factory=dict)
    crc_extra: dict[int, int] = field(default_factory=dict)
    enums: dict[str, dict[str, int]] = field(default_factory=dict)


@pytest.fixture(scope="module")
def standard() -> Standard:
    parser = importlib.import_module("pymavlink.generator.mavparse")
    found = Standard()
    for name in ("minimal", "standard", "common"):
        xml = parser.MAVXML(str(STANDARD / f"{name}.xml"), "2.0")
        for message in xml.message:
            found.names[message.id] = message.name
            found.declared[message.id] = [column.name for column in message.fields]
            found.ordered[message.id] = [(column.name, column.type, column.array_length) for column in message.ordered_fields]
            found.crc_extra[message.id] = message.crc_extra
        for enum in xml.enum:
            found.enums.setdefault(enum.name, {}).update({entry.name: entry.value for entry in enum.entry})
    return found


def mavgen(language: str, output: Path) -> None:
    module = importlib.import_module("pymavlink.generator.mavgen")
    options = module.Opts(str(output), wire_protocol="2.0", language=language, validate=True, strict_units=True)
    assert module.mavgen(options, [str(DIALECT)])


@pytest.fixture(scope="module")
def generated(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """The Python module that mavgen makes of the dialect."""
    path = tmp_path_factory.mktemp("mavgen") / "junior_from_mavgen.py"
    mavgen("Python3", path)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


def ours(message: type[Message]) -> list[Column]:
    return [(name, C_TYPES[wire.type], wire.count) for name, wire in wire_order(message)]


@pytest.mark.parametrize("message", STANDARD_MESSAGES, ids=lambda message: message.NAME)
def test_standard_messages_are_the_standard_ones(message: type[Message], standard: Standard) -> None:
    newer = NEWER_EXTENSIONS.get(message.NAME, [])
    assert standard.names[message.ID] == message.NAME
    assert standard.ordered[message.ID] + newer == ours(message)
    assert standard.declared[message.ID] + [name for name, *_ in newer] == [name for name, _ in wire_fields(message)]
    assert standard.crc_extra[message.ID] == crc_extra(message)


@pytest.mark.parametrize("enum", STANDARD_ENUMS, ids=lambda enum: enum.name)
def test_standard_enumerations_have_the_standard_values(enum: Enumeration, standard: Standard) -> None:
    original = standard.enums[enum.name]
    assert {name: original.get(name) for name, _, _ in enum.entries} == {name: value for name, value, _ in enum.entries}


@pytest.mark.parametrize("message", MESSAGES.values(), ids=lambda message: message.NAME)
def test_mavgen_computes_what_we_compute(message: type[Message], generated: ModuleType) -> None:
    theirs = generated.mavlink_map[message.ID]
    assert theirs.crc_extra == crc_extra(message)
    assert theirs.unpacker.size == payload_length(message)
    assert list(theirs.ordered_fieldnames) == list(offsets(message))


def test_mavgen_knows_nothing_else(generated: ModuleType) -> None:
    assert set(generated.mavlink_map) - set(MESSAGES) <= {-1, -2}


def test_mavgen_makes_c_of_it(tmp_path: Path) -> None:
    mavgen("C", tmp_path)
    assert "MAVLINK_MSG_ID_JUNIOR_MANEUVER_CRC 142" in (tmp_path / "junior/mavlink_msg_junior_maneuver.h").read_text()
    constants = (tmp_path / "junior/junior.h").read_text()
    for name in ("JUNIOR_ACTION_LFRB=16", "ROBOT_REASON_BUSY=5", "MAV_CMD_REQUEST_MESSAGE=512", "ROBOT_STATE_STOPPED=6"):
        assert name in constants


def raw_value(value: float | str | None, wire: Wire) -> float | str | None:
    divisor = round(1 / wire.scale)
    if value is None:
        return wire.invalid
    return value if isinstance(value, str) or divisor == 1 else round(value * divisor)


def raw_values(message: Message) -> dict[str, object]:
    """What pymavlink shows of a message: wire units, and lists for arrays."""
    values: dict[str, object] = {}
    for name, wire in wire_fields(type(message)):
        value = getattr(message, name)
        values[name] = [raw_value(item, wire) for item in value] if isinstance(value, tuple) else raw_value(value, wire)
    return values


@pytest.mark.parametrize("vector", VECTORS, ids=lambda vector: vector.name)
def test_pymavlink_reads_what_we_write(vector: Vector, generated: ModuleType) -> None:
    link = generated.MAVLink(None)
    link.robust_parsing = True
    (message,) = link.parse_buffer(vector.frame)
    shown = message.to_dict()
    assert shown.pop("mavpackettype") == vector.message.NAME
    assert shown == raw_values(vector.message)


@pytest.mark.parametrize("vector", VECTORS, ids=lambda vector: vector.name)
def test_we_read_what_pymavlink_writes(vector: Vector, generated: ModuleType) -> None:
    link = generated.MAVLink(None, srcSystem=7, srcComponent=8)
    link.seq = 77
    kind = generated.mavlink_map[vector.message.ID]
    values = {name: value.encode() if isinstance(value, str) else value for name, value in raw_values(vector.message).items()}
    frame = bytes(kind(**values).pack(link))
    (event,) = MavlinkCodec(system=1, component=1).receive(frame, 3.0)
    assert event == Received(vector.message, 7, 8, 77, 3.0, frame)


def test_nan_crosses_as_not_given(generated: ModuleType) -> None:
    message = generated.MAVLink_command_long_message(1, 1, 400, 0, 1.0, math.nan, 0, 0, 0, 0, 0)
    (event,) = MavlinkCodec(system=1, component=1).receive(bytes(message.pack(generated.MAVLink(None))), 0.0)
    assert isinstance(event, Received)
    assert math.isnan(event.message.param2)  # type: ignore[attr-defined]


def test_signed_frames_are_read_and_counted(generated: ModuleType) -> None:
    link = generated.MAVLink(None, srcSystem=7, srcComponent=8)
    link.signing.secret_key = bytes(32)
    link.signing.link_id = 1
    link.signing.timestamp = 1
    link.signing.sign_outgoing = True
    frame = bytes(generated.MAVLink_ping_message(1, 2, 0, 0).pack(link))
    codec = MavlinkCodec(system=1, component=1)
    (event,) = codec.receive(frame, 0.0)
    assert isinstance(event, Received)
    assert event.raw == frame
    assert (codec.good, codec.signed) == (1, 1)
