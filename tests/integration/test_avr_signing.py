"""The firmware with signing on an ATmega328P: the start input held at power-on, and power cuts while it forgets its time."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import pytest
from avr_bench import AvrBench
from firmware_bench import FirmwareBench
from signed_pair import KEY, NOW, signed_at, signed_codec

from firmware_protocol.messages import Ping
from firmware_protocol.wire.signing import TIME_LIMIT
from simdevice._host import lib
from simdevice.avr.board import CYCLES
from simdevice.avr.build import FIRMWARE, build

if TYPE_CHECKING:
    from simdevice.avr.build import AvrFirmware

pytestmark = [pytest.mark.avr, pytest.mark.slow]
BOOT: Final = 12 * CYCLES
"""Clock cycles that booting takes with something to store, about."""
HEARING: Final = 60
"""Control periods in which a signed frame is heard, what it takes is stored, and an answer has come."""


@pytest.fixture(scope="module")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> AvrFirmware:
    """The firmware with signing, which is not the one that is in the cache."""
    folder = tmp_path_factory.mktemp("signing")
    command = ["make", "-C", str(FIRMWARE), "avr", "SIGNING=1", f"BUILD={folder}", f"PYTHON={sys.executable}"]
    made = subprocess.run(  # noqa: S603
        command, capture_output=True, text=True, check=False, env=os.environ | {"MAKEFLAGS": ""}
    )
    assert made.returncode == 0, made.stdout + made.stderr
    return replace(build(), elf=folder / "avr_signing" / "junior.elf")


@pytest.fixture(scope="module")
def near_the_end() -> bytes:
    """The EEPROM of a robot that has believed a frame from the last moment before 2100."""
    bench = FirmwareBench()
    lib.host_give_key(bench.robot, KEY.secret)
    bench.power_on()
    assert any(isinstance(answer, Ping) for answer in bench.tick(raw=signed_at(TIME_LIMIT - 1, Ping(1, 1))))
    return bench.nvm


def answers(bench: AvrBench, frame: bytes) -> list[int]:
    """Numbers of the pings answered when a frame comes, twice: the first time what it takes may have to be stored."""
    bench.sent.clear()
    for _ in range(2):
        bench.tick(raw=frame)
        for _ in range(HEARING):
            bench.tick()
    return [message.seq for message in bench.sent if isinstance(message, Ping)]


def test_the_start_input_held_at_power_on_forgets_the_time_and_not_the_key(firmware: AvrFirmware, near_the_end: bytes) -> None:
    bench = AvrBench(near_the_end, firmware)
    assert answers(bench, signed_codec().encode(Ping(1, 1))) == []
    bench.board.start = True
    bench.power_on()
    bench.board.start = False
    frame = signed_codec().encode(Ping(1, 2))
    assert answers(bench, frame) == [2]
    bench.power_on()
    assert answers(bench, frame) == []
    assert answers(bench, signed_codec(now=NOW + (1000 << 16)).encode(Ping(1, 3))) == [3]


def boot(bench: AvrBench, cycles: int, *, start: bool) -> None:
    """Go on with booting, with the start input on or off."""
    bench.board.start = start
    bench.board.run(cycles)


@pytest.mark.parametrize(
    ("held", "answered"),
    [((True, True), [1]), ((True, False), []), ((False, True), []), ((False, False), [])],
    ids=["held", "on-when-the-power-comes", "on-later", "off"],
)
def test_the_start_input_must_be_held_until_the_boot_is_counted(
    firmware: AvrFirmware,
    near_the_end: bytes,
    held: tuple[bool, bool],
    answered: list[int],
) -> None:
    bench = AvrBench(near_the_end, firmware)
    bench.board.cut()
    boot(bench, CYCLES, start=held[0])
    boot(bench, BOOT, start=held[1])
    bench.board.start = False
    bench.power_on()
    assert answers(bench, signed_codec().encode(Ping(1, 1))) == answered


def test_a_cut_while_it_forgets_leaves_the_time_or_none(firmware: AvrFirmware, near_the_end: bytes) -> None:
    outcomes = []
    for number, cycles in enumerate(range(CYCLES, BOOT, CYCLES // 2)):
        bench = AvrBench(near_the_end, firmware)
        bench.board.cut()
        boot(bench, cycles, start=True)
        bench.board.start = False
        bench.power_on(torn=(0, 255, 85)[number % 3])
        outcomes.append(answers(bench, signed_codec().encode(Ping(1, 1))) == [1])
    assert outcomes == sorted(outcomes)
    assert {True, False} == set(outcomes)
