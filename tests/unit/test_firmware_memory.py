"""What survives power-off: maneuvers, parameters, the count of boots; and a power cut at any byte."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import pytest
from fastcrc.crc16 import mcrf4xx
from firmware_bench import BLANK, FirmwareBench, forge

from firmware_protocol.messages import (
    Command,
    ContestCommand,
    JuniorMemoryEntry,
    ManeuverOption,
    ParamRequestRead,
    ParamSet,
    ParamValue,
    Reason,
    RobotAck,
    RobotStatus,
    Statustext,
)
from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from simdevice._host import lib

if TYPE_CHECKING:
    from collections.abc import Callable

ONE = (Action.FF, Action.SB)
TWO = (Action.LBRF, Action.MF, Action.MF)


def connected(nvm: bytes = BLANK) -> FirmwareBench:
    bench = FirmwareBench(nvm)
    bench.open()
    return bench


def entries(bench: FirmwareBench) -> list[JuniorMemoryEntry]:
    """Read everything, by index."""
    bench.clear()
    for index in range(255):
        if bench.ask(bench.read_message(index)) is Reason.NOT_FOUND:
            break
    return bench.got(JuniorMemoryEntry)


def contents(bench: FirmwareBench) -> dict[tuple[int, int], tuple[int, ...]]:
    return {(entry.previous, entry.current): entry.actions[: entry.count] for entry in entries(bench)}


def test_a_maneuver_is_stored_read_and_erased() -> None:
    bench = connected()
    assert contents(bench) == {}
    options = ManeuverOption.ARMS | ManeuverOption.END_ON_CHANGE | ManeuverOption.HOLD
    assert bench.ask(bench.write_message(TWO, current=3, previous=7, period=0.123, options=options)) is Reason.NONE
    (entry,) = entries(bench)
    assert (entry.previous, entry.current, entry.period, entry.options) == (7, 3, 0.123, options)
    assert (entry.count, entry.actions) == (3, (13, 6, 6, 0, 0, 0, 0, 0))
    assert (entry.used, entry.index) == (1, 0)
    assert bench.ask(bench.read_message(255, previous=7, current=3)) is None, "the entry is the answer"
    assert bench.latest(JuniorMemoryEntry).actions == entry.actions
    assert bench.ask(bench.read_message(255, previous=6, current=3)) is Reason.NOT_FOUND
    assert bench.ask(bench.write_message((), current=3, previous=7)) is Reason.NONE
    assert bench.ask(bench.write_message((), current=3, previous=7)) is Reason.NONE, "erasing nothing is done already"
    assert contents(bench) == {}


def test_it_survives_power_off() -> None:
    bench = connected()
    for current in range(4):
        bench.ask(bench.write_message(ONE if current % 2 else TWO, current))
    before = entries(bench)
    bench.power_on()
    bench.open()
    after = entries(bench)
    assert [vars(e) | {"sequence": 0} for e in after] == [vars(e) | {"sequence": 0} for e in before]


def test_32_slots_and_no_more_but_every_one_can_be_replaced() -> None:
    bench = connected()
    keys = [(previous, current) for previous, current in product((ANY_STIMULUS, *range(16)), range(16))][:33]
    for previous, current in keys[:32]:
        assert bench.ask(bench.write_message(ONE, current, previous)) is Reason.NONE
    assert bench.ask(bench.write_message(ONE, keys[32][1], keys[32][0])) is Reason.MEMORY_FULL
    for previous, current in keys[:32]:
        assert bench.ask(bench.write_message(TWO, current, previous)) is Reason.NONE
    assert contents(bench) == dict.fromkeys(keys[:32], tuple(int(action) for action in TWO))
    assert bench.ask(bench.write_message((), ANY_STIMULUS, ANY_STIMULUS)) is Reason.NONE
    assert contents(bench) == {}


def test_entries_come_sorted_and_the_checksum_depends_on_what_is_stored_alone() -> None:
    one, other = connected(), connected()
    keys = [(ANY_STIMULUS, 1), (0, 3), (2, 0), (0, 1)]
    for previous, current in keys:
        one.ask(one.write_message(ONE, current, previous))
    for previous, current in reversed(keys):
        other.ask(other.write_message(TWO, current, previous))
        other.ask(other.write_message(ONE, current, previous))
    found = entries(one)
    assert [(entry.previous, entry.current) for entry in found] == sorted(keys)
    assert {entry.checksum for entry in [*found, *entries(other)]} == {found[0].checksum}
    stored = b"".join(
        bytes((entry.previous, entry.current, entry.options, *entry.actions))
        + round(entry.period * 1000).to_bytes(2, "little")
        + bytes((entry.count,))
        for entry in found
    )
    assert found[0].checksum == mcrf4xx(stored)


@pytest.mark.parametrize(
    "changes",
    [
        {"current": 16}, {"current": 255}, {"previous": 16}, {"previous": 254}, {"count": 9}, {"period": 0.019},
        {"period": 5.001}, {"options": 32}, {"actions": (17,) + (0,) * 7},
    ],
    ids=str,
)  # fmt: skip
def test_what_cannot_be_performed_is_not_stored(changes: dict[str, object]) -> None:
    bench = connected()
    bench.tick(raw=forge(bench.write_message(ONE, 1), **changes))
    assert bench.latest(RobotAck).reason == Reason.BAD_VALUE
    assert contents(bench) == {}


def test_a_rotten_slot_is_not_there() -> None:
    bench = connected()
    bench.ask(bench.write_message(ONE, 1))
    bench.ask(bench.write_message(TWO, 2))
    good = bench.nvm
    used = [i for i in range(1024) if i >= 496 and good[i] != 0xFF]
    for address in used:
        rotten = bytearray(good)
        rotten[address] ^= 0x10
        again = connected(bytes(rotten))
        assert len(contents(again)) == 1, f"byte {address} is not protected"


def test_one_slot_too_many_is_not_taken() -> None:
    bench = connected()
    keys = [(previous, current) for previous in (ANY_STIMULUS, 0) for current in range(16)]
    for previous, current in keys:
        bench.ask(bench.write_message(ONE, current, previous))
    nvm = bytearray(bench.nvm)
    slot = bytearray(nvm[496:512])
    slot[0] = 1
    slot[13:15] = mcrf4xx(bytes([*slot[:13], slot[15]])).to_bytes(2, "little")
    free = next(at for at in range(496, 1024, 16) if nvm[at + 15] == 0xFF)
    nvm[free : free + 16] = slot
    bench = connected(bytes(nvm))
    assert len(contents(bench)) == 32
    for previous, current in contents(bench):
        assert bench.ask(bench.write_message(TWO, current, previous)) is Reason.NONE


def cut_everywhere(nvm: bytes, change: Callable[[FirmwareBench], None], look: Callable[[FirmwareBench], object]) -> None:
    """Whatever byte the power goes at, what is found afterwards is what was before or what was to be."""
    bench = connected(nvm)
    before = look(bench)
    bench = connected(nvm)
    booted = lib.host_nvm_writes(bench.robot)
    change(bench)
    writes = lib.host_nvm_writes(bench.robot) - booted
    after = look(connected(bench.nvm))
    assert writes > 0
    assert before != after
    seen = []
    for cut in range(writes + 1):
        bench = connected(nvm)
        lib.host_cut_power(bench.robot, cut)
        change(bench)
        found = look(connected(bench.nvm))
        assert found in (before, after), f"after {cut} of {writes} bytes"
        seen.append(found)
        bench = connected(bench.nvm)  # and it is not lame afterwards
        change(bench)
        assert look(connected(bench.nvm)) == after
    assert seen[0] == before
    assert seen[-1] == after
    assert seen == sorted(seen, key=[before, after].index), "once new, it stays new"


def stored(*writes: tuple[tuple[Action, ...], int]) -> bytes:
    bench = connected()
    for actions, current in writes:
        assert bench.ask(bench.write_message(actions, current)) is Reason.NONE
    return bench.nvm


@pytest.mark.parametrize(
    ("nvm", "actions", "current"),
    [
        (BLANK, ONE, 1),
        (stored((ONE, 1)), TWO, 1),
        (stored((ONE, 1), (TWO, 1)), ONE, 1),
        (stored((ONE, 1), (TWO, 1), (ONE, 1), (ONE, 2)), TWO, 2),
        (stored((ONE, 1), (ONE, 2)), (), 1),
        (stored((ONE, 1), ((), 1)), (*ONE, Action.S), 1),
    ],
    ids=["first", "replace", "replace again", "replace behind", "erase", "over an erased one"],
)
def test_a_power_cut_leaves_the_old_maneuver_or_the_new_one(nvm: bytes, actions: tuple[Action, ...], current: int) -> None:
    def change(bench: FirmwareBench) -> None:
        bench.tick(bench.write_message(actions, current))

    cut_everywhere(nvm, change, contents)


def parameter(bench: FirmwareBench, name: str) -> float:
    (value,) = bench.tick(ParamRequestRead(1, 1, name))
    assert isinstance(value, ParamValue)
    return value.param_value


@pytest.mark.parametrize("changes", range(5))
def test_a_power_cut_leaves_the_old_parameter_or_the_new_one(changes: int) -> None:
    bench = connected()
    for i in range(changes):
        bench.tick(ParamSet(1, 1, "EYE_L_ON", 300.0 + i))

    def change(bench: FirmwareBench) -> None:
        bench.tick(ParamSet(1, 1, "EYE_L_ON", 777.0))

    cut_everywhere(bench.nvm, change, lambda bench: parameter(bench, "EYE_L_ON"))


@pytest.mark.parametrize("changes", [2, 3, 4])
def test_a_torn_turn_does_not_bring_an_older_parameter_back(changes: int) -> None:
    bench = connected()
    for i in range(changes):
        bench.tick(ParamSet(1, 1, "EYE_L_ON", 300.0 + i))
    nvm = bench.nvm
    first = next(i for i in range(14, 496) if nvm[i] != 0xFF)
    older, newer = (first, first + 7) if changes % 2 == 0 else (first + 7, first)
    for turn in range(256):
        torn = bytearray(nvm)
        torn[older + 6] = turn
        assert parameter(connected(bytes(torn)), "EYE_L_ON") == 300.0 + changes - 1
        torn = bytearray(nvm)
        torn[newer + 6] = turn
        assert parameter(connected(bytes(torn)), "EYE_L_ON") in {300.0 + changes - 1, 300.0 + changes - 2}


def test_parameters_survive_and_are_written_only_when_they_change() -> None:
    bench = connected()
    for name, value in (("SPD_TURN", 0.123), ("REFLEX_TURN", 400.0), ("SYS_ID", 9.0)):
        bench.tick(ParamSet(1, 1, name, value))
    writes = lib.host_nvm_writes(bench.robot)
    for _ in range(10):
        bench.tick(ParamSet(1, 1, "SPD_TURN", 0.123))
    assert lib.host_nvm_writes(bench.robot) == writes
    bench.tick(ParamSet(1, 1, "SYS_ID", 1.0))
    bench.power_on()
    assert parameter(bench, "SPD_TURN") == pytest.approx(0.123, rel=1e-7)
    assert parameter(bench, "REFLEX_TURN") == 400.0
    assert not bench.got(Statustext)


def test_damaged_parameters_fall_back_to_their_defaults_and_say_so() -> None:
    bench = connected()
    bench.tick(ParamSet(1, 1, "SPD_TURN", 0.123))
    nvm = bytearray(bench.nvm)
    addresses = [i for i in range(14, 496) if nvm[i] != 0xFF]
    assert len(addresses) == 7, "value, checksum, turn"
    nvm[addresses[2]] ^= 1
    bench = connected(bytes(nvm))
    assert parameter(bench, "SPD_TURN") == pytest.approx(0.35, rel=1e-7)
    assert "defaults" in bench.latest(Statustext).text


def test_an_eeprom_of_anything_is_survived() -> None:
    for fill in (b"\x00", b"\x55", b"\xa5\x01", bytes(range(256))):
        bench = connected((fill * 1024)[:1024])
        assert contents(bench) == {}
        assert parameter(bench, "SPD_TURN") == pytest.approx(0.35, rel=1e-7)
        assert bench.ask(bench.write_message(ONE, 1)) is Reason.NONE
        assert len(contents(bench)) == 1


def boots(bench: FirmwareBench) -> int:
    bench.command(Command.REQUEST_MESSAGE, RobotStatus.ID)
    return bench.latest(RobotStatus).boot_count


def test_boots_are_counted_and_a_power_cut_does_not_lose_the_count() -> None:
    bench = FirmwareBench()
    for count in range(1, 600):
        assert boots(bench) == count
        bench.power_on()
    nvm = bytearray(bench.nvm)
    for address in range(14):
        torn = bytearray(nvm)
        torn[address] = 0xFF
        assert boots(FirmwareBench(bytes(torn))) in {600, 601}
    nvm[:14] = b"\xff" * 14
    assert boots(FirmwareBench(bytes(nvm))) == 1


def test_memory_can_be_read_while_it_is_used_but_not_written() -> None:
    bench = connected()
    bench.ask(bench.write_message(ONE, 0))
    bench.arm()
    assert bench.ask(bench.contest_message(ContestCommand.START, 0.0)) is Reason.NONE
    bench.run(100)
    assert bench.ask(bench.write_message(TWO, 0)) is Reason.BUSY
    assert len(contents(bench)) == 1
