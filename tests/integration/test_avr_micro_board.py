"""A micro-robot's ELF on an emulated ATmega328P: encoders, bumpers, wheels, its system id, and with signing."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import pytest
from avr_bench import UID, AvrMicroBench
from micro_bench import MicroBench
from signed_pair import KEY, signed_codec

from firmware_protocol.messages import (
    AutopilotVersion,
    Command,
    CommandResult,
    Heartbeat,
    ParamSet,
    Ping,
    Reason,
    SwarmMove,
    SwarmObservation,
)
from firmware_protocol.vocabulary import ObservationFlag
from simdevice._host import lib
from simdevice.avr.build import FIRMWARE, build
from simdevice.avr.micro_board import FASTEST, UM_PER_COUNT

if TYPE_CHECKING:
    from pathlib import Path

    from simdevice.avr.build import AvrFirmware

pytestmark = pytest.mark.avr
RAM_LIMIT: Final = 1600
RAM_BEGIN: Final = 0x100
HEARING: Final = 60
"""Control periods in which a signed frame is heard, what it takes is stored, and an answer has come."""


def counted(bench: AvrMicroBench) -> tuple[int, int]:
    """What the firmware has counted of the encoders since it booted."""
    at = bench.board.address("counted")
    left, right = struct.unpack("<ii", bytes(bench.board.peek(at + i) for i in range(8)))
    return left, right


def make(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Make the micro-robot's ELF otherwise than it is in the cache."""
    command = ["make", "-C", str(FIRMWARE), "avr", "ROLE=micro", *words, f"BUILD={folder}", f"PYTHON={sys.executable}"]
    return subprocess.run(  # noqa: S603
        command, capture_output=True, text=True, check=False, env=os.environ | {"MAKEFLAGS": ""}
    )


def made(folder: Path, name: str, *words: str) -> AvrFirmware:
    """What was made so, in this folder of the build."""
    done = make(folder, *words)
    assert done.returncode == 0, done.stdout + done.stderr
    return replace(build(role="micro"), elf=folder / name / "micro.elf")


def test_it_says_what_it_is() -> None:
    bench = AvrMicroBench()
    assert bench.command(Command.REQUEST_MESSAGE, float(AutopilotVersion.ID)) is CommandResult.ACCEPTED
    assert (bench.latest(AutopilotVersion).product_id, bench.latest(AutopilotVersion).uid) == (2, UID)


def test_encoders_are_counted_both_ways_at_different_speeds() -> None:
    bench = AvrMicroBench()
    ways = [(0.002, 0.002), (0.0013, -0.0004), (-0.0021, 0.0001), (0.0, 0.002), (-0.0005, -0.0017)]
    left = right = 0.0
    for way_left, way_right in ways * 8:
        left += way_left
        right += way_right
        bench.around.travel_left, bench.around.travel_right = left, right
        bench.tick()
        assert counted(bench) == tuple(int(way * 1e6 // UM_PER_COUNT) for way in (left, right))


def test_what_is_too_fast_for_a_period_comes_in_the_next() -> None:
    bench = AvrMicroBench()
    bench.around.travel_left = 1.5 * FASTEST * UM_PER_COUNT * 1e-6
    bench.tick()
    assert counted(bench) == (FASTEST, 0)
    bench.tick()
    assert counted(bench) == (1.5 * FASTEST, 0)


@pytest.mark.parametrize("place", range(5))
def test_it_takes_up_encoders_where_they_stand_at_power_on(place: int) -> None:
    bench = AvrMicroBench()
    bench.around.travel_left = bench.around.travel_right = (place + 0.5) * UM_PER_COUNT * 1e-6
    bench.run(50)  # what it says at power-on has left the line
    bench.power_on()
    bench.around.travel_left += UM_PER_COUNT * 1e-6
    bench.around.travel_right -= UM_PER_COUNT * 1e-6
    bench.tick()
    assert counted(bench) == (1, -1)


@pytest.mark.parametrize("left", [False, True])
@pytest.mark.parametrize("right", [False, True])
def test_bumpers_are_contact(left: bool, right: bool) -> None:  # noqa: FBT001 - they are parameters of the test
    bench = AvrMicroBench()
    bench.around.bumper_left, bench.around.bumper_right = left, right
    bench.command(Command.REQUEST_MESSAGE, float(SwarmObservation.ID), 1.0)
    flags = bench.latest(SwarmObservation).flags
    assert bool(flags & ObservationFlag.CONTACT) == (left or right)
    assert flags & ObservationFlag.RING_NOT_READ


def test_it_turns_its_wheels_by_a_move_and_stops_when_nobody_is_heard() -> None:
    bench = AvrMicroBench()
    bench.open()
    bench.arm()
    move = SwarmMove(bench.session, bench.next(), 1.5, 0.0, None, 0.0, 1, 1, 0, 0, 0, 0)
    assert bench.ask(move) is Reason.NONE
    assert bench.wheels[0] == -bench.wheels[1] < 0
    bench.run(400, alive=False)
    assert bench.wheels == (0, 0)


def test_its_stack_ends_before_its_variables() -> None:
    bench = AvrMicroBench()
    bench.open()
    bench.arm()
    for _ in range(5):
        bench.tick(SwarmMove(bench.session, bench.next(), 1.5, 0.1, 0.0, 0.0, 1, 1, 0, 0, 0, 0))
        bench.run(200)
    assert bench.board.stack > 100
    assert bench.board.address("_end") - RAM_BEGIN + bench.board.stack <= RAM_LIMIT


@pytest.mark.slow
def test_a_board_that_has_stored_no_system_id_has_that_of_its_program(tmp_path: Path) -> None:
    firmware = made(tmp_path, "avr_micro_id7", "ID=7")
    bench = AvrMicroBench(firmware=firmware)
    bench.run(100)
    assert bench.raw[5] == 7
    bench.tick(ParamSet(7, 1, "SYS_ID", 9.0))
    bench.run(200)
    bench.power_on()
    bench.run(100)
    assert bench.got(Heartbeat)
    assert bench.raw[5] == 9


@pytest.mark.parametrize("word", ["0", "255", "-1", "seven", ""])
def test_an_id_that_no_robot_can_have_is_refused(tmp_path: Path, word: str) -> None:
    done = make(tmp_path, f"ID={word}")
    assert done.returncode != 0
    assert "from 1 to 254" in done.stderr


@pytest.mark.slow
def test_one_that_signs_believes_who_has_the_key(tmp_path: Path) -> None:
    bench = MicroBench()
    lib.host_give_key(bench.robot, KEY.secret)
    signing = AvrMicroBench(bench.nvm, made(tmp_path, "avr_micro_signing", "SIGNING=1"))
    codec = signed_codec()
    for said in (codec.encode(Ping(1, 1)), codec.encode(Ping(1, 2)), signing.host.encode(Ping(1, 3))):
        signing.tick(raw=said)
        for _ in range(HEARING):
            signing.tick()
    answered = {message.seq for message in signing.sent if isinstance(message, Ping)}
    assert 2 in answered, "the first one may have been waiting for what it takes to be stored"
    assert 3 not in answered, "it is not signed"
