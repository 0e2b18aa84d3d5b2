"""What damage on the way to the robot can do: nothing, as long as it is one to three bits of a payload."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Final

import numpy as np
import pytest
from fastcrc.crc16 import mcrf4xx
from firmware_bench import HOST, SESSION, FirmwareBench

from firmware_protocol.events import Rejected
from firmware_protocol.messages import (
    Command,
    CommandLong,
    CommandResult,
    ContestCommand,
    JuniorContest,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorWheels,
    ManualControl,
    Reason,
    RobotStatus,
    State,
)
from firmware_protocol.vocabulary import Action
from firmware_protocol.wire.mavlink import MavlinkCodec

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

FRAMES: Final = 20_000
HEADER, TRAILER = 10, 2
LONGEST: Final = 9 + 255 + 1
"""Bytes that a checksum covers at most: header but its first byte, payload, CRC_EXTRA."""
PUSHES: Final[dict[str, Message]] = {
    "wheels": JuniorWheels(SESSION, 900, (1.0, -1.0), 1.0, 1, 1),
    "maneuver": JuniorManeuver(SESSION, 900, 0.25, 4, 1, 1, 8, (5, 6, 7, 8, 9, 10, 11, 12)),
    "stick": ManualControl(1, 1000, 0, 0, 1000, 0),
    "contest": JuniorContest(SESSION, 900, 0.0, 1, 1, ContestCommand.START),
    "arming": CommandLong(1, 1, Command.ARM_DISARM, param1=1.0),
}


def flipped(frame: bytes, rng: random.Random) -> bytes:
    """One to three different bits of the payload are the other way round."""
    damaged = bytearray(frame)
    for place in rng.sample(range(HEADER * 8, (len(frame) - TRAILER) * 8), rng.randint(1, 3)):
        damaged[place >> 3] ^= 1 << (place & 7)
    return bytes(damaged)


def test_the_checksum_tells_any_one_two_or_three_bits_in_the_longest_frame() -> None:
    """The Hamming distance of CRC-16/MCRF4XX (x^16 + x^12 + x^5 + 1) is 4 for all that a MAVLink 2 frame may hold.

    The code is linear: a pattern of flipped bits goes unseen if the checksum changes that its bits make alone (their
    syndromes) cancel out. So no syndrome may be zero, no two equal, and none the sum of two others; and, for damage
    that hits the checksum too, none a single bit of it or the sum of two. A shorter frame has the last of the same syndromes.
    """
    zero = mcrf4xx(bytes(LONGEST))
    syndromes = []
    for place in range(LONGEST * 8):
        one = bytearray(LONGEST)
        one[place >> 3] = 1 << (place & 7)
        syndromes.append(mcrf4xx(bytes(one)) ^ zero)
    syndromes += [1 << bit for bit in range(16)]
    seen = np.zeros(65536, bool)
    seen[syndromes] = True
    assert not seen[0]
    assert seen.sum() == len(syndromes)
    values = np.array(syndromes)
    for number, value in enumerate(syndromes):
        assert not seen[values[number + 1 :] ^ value].any()


@pytest.mark.parametrize("name", ["wheels", "maneuver", "stick", "contest"])
def test_no_damaged_command_moves_an_armed_robot(name: str) -> None:
    bench = FirmwareBench().armed()
    assert bench.ask(bench.write_message([Action.FF], 0)) is Reason.NONE  # a contest has something to play
    if name == "stick":  # drives what a ground station has armed
        assert bench.command(Command.ARM_DISARM, 1.0) is CommandResult.ACCEPTED
    frame = MavlinkCodec(system=255, component=190).encode(PUSHES[name])
    before = bench.state()
    rng = random.Random(name)
    for _ in range(FRAMES):
        bench.tick(raw=flipped(frame, rng))
        assert bench.wheels == (0, 0)
    assert bench.state() is before is State.READY
    assert not bench.got(JuniorManeuverResult)
    bench.run(1200)
    status = bench.latest(RobotStatus)
    assert status.bad_checksum >= FRAMES
    assert status.maneuvers == 0
    # It is the damage that kept it from moving.
    bench.tick(raw=frame)
    bench.tick()
    assert bench.state() is not State.READY


def test_no_damaged_command_arms_a_robot() -> None:
    bench = FirmwareBench()
    bench.tick()
    bench.open()
    frame = MavlinkCodec(system=255, component=190).encode(PUSHES["arming"])
    rng = random.Random("arming")
    for _ in range(FRAMES):
        bench.tick(raw=flipped(frame, rng))
        assert bench.state() is State.DISARMED
    bench.tick(raw=frame)
    assert bench.state() is State.READY


def test_damaged_commands_among_good_ones_drive_no_longer_than_the_good_ones_say() -> None:
    bench = FirmwareBench().armed()
    rng = random.Random(3)
    moved = 0
    for number in range(1000):
        good = number % 10 == 0
        frame = bench.host.encode(bench.wheels_message(0.5, 0.5, 0.01))
        bench.tick(HOST, raw=frame if good else flipped(frame, rng))
        assert bench.wheels in {(0, 0), (500, 500)}
        moved += bench.wheels != (0, 0)
    assert moved == 100 * 2


def test_the_host_takes_none_for_good_either() -> None:
    codec, sender = MavlinkCodec(system=255, component=190), MavlinkCodec(system=1, component=1)
    rng = random.Random(4)
    frame = sender.encode(RobotStatus(12.0, 3, 4, 5, 6, 7, 8, SESSION, 9, 1))
    rejected = 0
    for _ in range(FRAMES):
        for event in codec.receive(flipped(frame, rng), 0.0):
            assert isinstance(event, Rejected)
            rejected += 1
    assert rejected >= FRAMES
