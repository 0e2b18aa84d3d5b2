"""C and Python decode each other's every message at the limits of every field; cantools decodes both."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import pytest
from cantools.database import load_file
from cantools.database.can import Database

from firmware_protocol.events import Received
from firmware_protocol.generate.outputs import ROOT
from firmware_protocol.generate.vectors import NODE, CanVector, can_text, can_vectors
from firmware_protocol.messages import JuniorWheels, ParamSet
from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.can.frame import CanFrame, pack_frames, split_records
from firmware_protocol.wire.can.layout import FUNCTION_MASK, FUNCTION_SHIFT, TRANSFER_UP_FUNCTION, single_frames
from firmware_protocol.wire.fields import Direction, Party
from firmware_protocol.wire.payload import PAYLOADS
from simdevice._host import ffi, lib

VECTORS = can_vectors()
OF_ROBOT = [vector for vector in VECTORS if type(vector.message).PARTY in {Party.ROBOT, Party.JUNIOR}]
UP = [vector for vector in OF_ROBOT if type(vector.message).DIRECTION is not Direction.DOWN]
DOWN = [vector for vector in OF_ROBOT if type(vector.message).DIRECTION is not Direction.UP]


def name(vector: CanVector) -> str:
    return vector.name


class Robot:
    """Node 42, in C."""

    def __init__(self) -> None:
        self.robot = cast("Any", ffi.new("host_robot *"))
        self.io = self.robot.io
        self.io.nvm = b"\xff" * 1024
        self.io.can = 1
        lib.host_power_on(self.robot, 0)
        host = CanCodec(system=255, component=190)
        self.tick(5, host.encode(ParamSet(1, 1, "SYS_ID", float(NODE))))
        for ms in range(10, 1000, 5):  # until it is stored
            self.tick(ms)
        lib.host_power_on(self.robot, 0)

    def tick(self, ms: int, data: bytes = b"") -> bytes:
        return bytes(ffi.buffer(self.io.tx, lib.host_tick(self.robot, ms * 1000, data, len(data))))


@pytest.fixture(scope="module")
def robot() -> Robot:
    return Robot()


def test_the_vectors_are_the_golden_ones() -> None:
    assert (ROOT / "tests/golden/can.txt").read_text(encoding="utf-8") == can_text()


@pytest.mark.parametrize("vector", VECTORS, ids=name)
def test_python_reads_what_it_writes(vector: CanVector) -> None:
    (event,) = CanCodec(system=255, component=190).receive_frames(vector.frames, 0.0)
    assert isinstance(event, Received)
    assert event.message == vector.message or repr(event.message) == repr(vector.message)  # NaN is not equal to itself


@pytest.mark.parametrize("vector", DOWN, ids=name)
def test_c_reads_what_python_writes(vector: CanVector, robot: Robot) -> None:
    payload = ffi.new("uint8_t[255]")
    data = pack_frames(vector.frames)
    assert lib.host_can_take(robot.robot, data, len(data), payload) == vector.message.ID
    expected = vector.message
    if isinstance(expected, JuniorWheels):
        expected = replace(expected, session=0)  # the one that is open: none
    packed = PAYLOADS[expected.ID].pack(expected)
    assert bytes(ffi.buffer(payload, len(packed))) == packed


@pytest.mark.parametrize("vector", UP, ids=name)
def test_python_reads_what_c_writes(vector: CanVector, robot: Robot) -> None:
    kind = type(vector.message)
    packed = PAYLOADS[kind.ID].pack(vector.message)
    length = lib.host_can_send(robot.robot, kind.ID, packed, len(packed))
    frames = [CanFrame.unpack(record) for record in split_records(bytes(ffi.buffer(robot.io.tx, length)))]
    (event,) = CanCodec(system=255, component=190).receive_frames(frames, 0.0)
    assert isinstance(event, Received)
    assert (event.system, event.component) == (NODE, 1)
    targets = {"target_system": 255, "target_component": 190}
    told = {name: value for name, value in targets.items() if hasattr(vector.message, name)}
    assert repr(event.message) == repr(replace(vector.message, **told))  # type: ignore[type-var]
    expected = CanCodec(system=NODE, component=1).encode_frames(vector.message)
    first = 1 if frames[0].identifier >> FUNCTION_SHIFT == TRANSFER_UP_FUNCTION else 0  # the number of a transfer aside
    assert [(frame.identifier, frame.data[first:]) for frame in frames] == [(f.identifier, f.data[first:]) for f in expected]


def test_cantools_reads_the_single_frames_as_we_do() -> None:
    database = load_file(str(ROOT / "firmware_protocol/dialect/junior.dbc"), strict=True, frame_id_mask=FUNCTION_MASK)
    assert isinstance(database, Database)
    singles = {frame.name for frame in single_frames()}
    seen = set()
    for vector in VECTORS:
        shown: dict[str, Any] = {}
        for frame in vector.frames:
            if frame.identifier >> 7 in {10, 11, 12, 13}:
                continue
            message = database.get_message_by_frame_id(frame.identifier)
            assert message.name in singles
            seen.add(message.name)
            decoded = cast("dict[str, Any]", message.decode(frame.data, decode_choices=False))
            assert message.encode(decoded, strict=False) == frame.data
            shown |= decoded
        for field, value in shown.items():
            base, _, side = field.rpartition("_")
            ours = getattr(vector.message, field, None)
            if ours is None and side in {"left", "right"}:
                ours = getattr(vector.message, base)[side == "right"]
            if ours is not None:
                assert value == pytest.approx(ours)
    assert seen == singles - {"JUNIOR_ESTOP"}
