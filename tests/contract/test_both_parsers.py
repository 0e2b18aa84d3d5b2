"""The firmware's parser and the host's accept the same frames out of the same damaged stream."""

from __future__ import annotations

import random
from itertools import pairwise
from typing import Any, cast

import pytest

from firmware_protocol.events import Received
from firmware_protocol.generate.vectors import vectors
from firmware_protocol.messages import Command, CommandLong, RobotStatus
from firmware_protocol.wire.fields import Direction, Party
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice._host import ffi, lib

INBOUND = [
    vector.frame
    for vector in vectors()
    if type(vector.message).DIRECTION is not Direction.UP and type(vector.message).PARTY in {Party.ROBOT, Party.JUNIOR}
]
TICK = 0.005


class Robot:
    """The firmware, and what it says it has counted."""

    def __init__(self) -> None:
        self.robot = cast("Any", ffi.new("host_robot *"))
        self.io = self.robot.io
        self.io.nvm = b"\xff" * 1024
        lib.host_power_on(self.robot, 0)
        self.codec = MavlinkCodec(system=254, component=190)
        self.time = 0.0
        self.asked = 0

    def tick(self, data: bytes = b"") -> list[RobotStatus]:
        self.time += TICK
        length = lib.host_tick(self.robot, round(self.time * 1e6), data, len(data))
        events = self.codec.receive(bytes(ffi.buffer(self.io.tx, length)), self.time)
        messages = [event.message for event in events if isinstance(event, Received)]
        return [message for message in messages if isinstance(message, RobotStatus)]

    def good(self) -> int:
        """Good frames so far, this question aside."""
        self.asked += 1
        question = CommandLong(1, 1, Command.REQUEST_MESSAGE, 0, float(RobotStatus.ID))
        (status,) = self.tick(self.codec.encode(question))[-1:]
        return status.good - self.asked


def damage(frame: bytes, rng: random.Random) -> bytes:
    data = bytearray(frame)
    for _ in range(rng.randrange(1, 3)):
        at = rng.randrange(len(data))
        match rng.randrange(3):
            case 0:
                data[at] = rng.choice((0xFD, 0x00, rng.randrange(256)))
            case 1:
                del data[at + 1 : at + rng.randrange(2, 12)]
            case _:
                data[at:at] = rng.randbytes(rng.randrange(1, 12))
    return bytes(data)


@pytest.mark.parametrize("seed", range(4))
def test_the_same_frames_are_good_to_both(seed: int) -> None:
    rng = random.Random(seed)
    robot, host = Robot(), MavlinkCodec(system=1, component=1)
    for _ in range(100):
        frames = [damage(frame, rng) if rng.random() < 0.3 else frame for frame in rng.choices(INBOUND, k=5)]
        stream = b"".join(frames)
        edges = sorted({0, len(stream), *(rng.randrange(len(stream)) for _ in range(4))})
        for start, stop in pairwise(edges):
            robot.tick(stream[start:stop])
            host.receive(stream[start:stop], robot.time)
        for _ in range(6):  # 30 ms of silence
            robot.tick()
            host.flush(robot.time)
        assert robot.good() == host.good
    assert 300 < host.good < 500
    assert sum(host.rejected.values()) > 50
