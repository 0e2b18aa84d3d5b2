"""What the firmware makes of what its EEPROM may hold: copies, slots, turns, and what has rotted."""

from __future__ import annotations

import math
import struct

import pytest
from fastcrc.crc16 import mcrf4xx
from firmware_bench import BLANK, FirmwareBench

from firmware_protocol.messages import (
    ContestCommand,
    JuniorMemoryEntry,
    ManeuverOption,
    ParamRequestRead,
    ParamSet,
    ParamValue,
    Reason,
    State,
    Statustext,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from firmware_protocol.vocabulary import Action
from simdevice._host import lib

RECORD, COPY, FIRST_PARAMETER = 14, 7, 1
"""Bytes of a record in EEPROM, of each of its two copies, and the record of the first parameter."""
MEMORY = 1024 - 33 * 16
"""Where the memory begins in EEPROM; a slot is 16 bytes."""


# --- memory ---------------------------------------------------------------------------------------------------------


def remembering(state: State) -> FirmwareBench:
    """A robot that remembers what to do when it sees nothing, in this state."""
    bench = FirmwareBench().armed()
    assert bench.ask(bench.write_message((Action.FF,), current=0)) is Reason.NONE
    if state is not State.READY:
        assert bench.ask(bench.contest_message(ContestCommand.START, 0.0 if state is State.CONTEST else 60.0)) is Reason.NONE
        bench.run(100)
    assert bench.state() is state
    return bench


@pytest.mark.parametrize("state", [State.COUNTDOWN, State.CONTEST])
def test_nothing_is_stored_while_it_plays(state: State) -> None:
    bench = remembering(state)
    assert bench.ask(bench.write_message((Action.SB,), current=1)) is Reason.BUSY
    assert bench.ask(bench.read_message(1)) is Reason.NOT_FOUND


def test_a_slot_that_rots_while_it_plays_is_not_played() -> None:
    bench = remembering(State.CONTEST)
    assert bench.wheels == (1000, 1000)
    bench.io.nvm[MEMORY + 15] = 9  # actions: more than there are
    bench.run(300)
    assert bench.wheels == (-350, 350), "it looks around"
    assert bench.state() is State.CONTEST


def test_a_slot_that_rots_while_it_is_on_is_not_there() -> None:
    bench = remembering(State.READY)
    bench.io.nvm[MEMORY + 15] = 0
    assert bench.ask(bench.read_message(0)) is Reason.NOT_FOUND
    assert not bench.got(JuniorMemoryEntry)


# --- stored parameters ----------------------------------------------------------------------------------------------


def place(name: str) -> int:
    """Where a parameter's record is in EEPROM."""
    return RECORD * (FIRST_PARAMETER + [parameter.name for parameter in JUNIOR_PARAMETERS].index(name))


def copy_of(name: str, value: float, turn: int) -> bytes:
    """One copy of a record."""
    data = struct.pack("<f", value)
    crc = mcrf4xx(name.encode().ljust(16, b"\0") + data + bytes([turn]))
    return data + struct.pack("<HB", crc, turn)


def stored(name: str, first: bytes = b"", second: bytes = b"") -> FirmwareBench:
    """A robot whose EEPROM holds these two copies of a parameter, and nothing else."""
    nvm = bytearray(BLANK)
    at = place(name)
    nvm[at : at + len(first)] = first
    nvm[at + COPY : at + COPY + len(second)] = second
    bench = FirmwareBench(bytes(nvm))
    bench.run(300)
    return bench


def value_of(bench: FirmwareBench, name: str) -> float:
    """A parameter's value in force."""
    bench.tick(ParamRequestRead(1, 1, name))
    return bench.latest(ParamValue).param_value


def test_of_two_copies_the_newer_one_counts() -> None:
    for first, second, newer in [(0, 1, 301.0), (1, 2, 301.0), (2, 0, 301.0), (1, 0, 300.0), (2, 1, 300.0), (0, 2, 300.0)]:
        bench = stored("EYE_L_ON", copy_of("EYE_L_ON", 300.0, first), copy_of("EYE_L_ON", 301.0, second))
        assert value_of(bench, "EYE_L_ON") == newer, (first, second)
        assert not bench.got(Statustext)


def test_a_copy_whose_turn_is_none_is_spoilt() -> None:
    bench = stored("EYE_L_ON", copy_of("EYE_L_ON", 300.0, 3))
    assert value_of(bench, "EYE_L_ON") == 250.0
    assert "defaults" in bench.latest(Statustext).text


@pytest.mark.parametrize("position", range(6))
def test_a_spoilt_second_copy_without_a_first_one_is_said(position: int) -> None:
    copy = bytearray(copy_of("EYE_L_ON", 300.0, 0))
    copy[position] ^= 0x40
    bench = stored("EYE_L_ON", b"", bytes(copy))
    assert value_of(bench, "EYE_L_ON") == 250.0
    assert "defaults" in bench.latest(Statustext).text


def test_a_second_copy_alone_counts() -> None:
    bench = stored("EYE_L_ON", b"", copy_of("EYE_L_ON", 300.0, 2))
    assert value_of(bench, "EYE_L_ON") == 300.0
    assert not bench.got(Statustext)


@pytest.mark.parametrize("value", [1024.0, -1.0, 300.5, math.nan])
def test_a_stored_value_that_is_not_allowed_any_more_is_not_taken(value: float) -> None:
    bench = stored("EYE_L_ON", copy_of("EYE_L_ON", value, 0))
    assert value_of(bench, "EYE_L_ON") == 250.0


def test_the_record_of_another_parameter_is_not_taken() -> None:
    bench = stored("EYE_L_ON", copy_of("EYE_R_ON", 300.0, 0))
    assert value_of(bench, "EYE_L_ON") == 250.0


def test_a_value_changed_and_changed_back_at_once_is_not_written() -> None:
    bench = FirmwareBench()
    bench.tick(ParamSet(1, 1, "EYE_L_ON", 300.0))
    bench.run(100)
    writes = lib.host_nvm_writes(bench.robot)
    bench.tick(ParamSet(1, 1, "EYE_L_ON", 301.0), ParamSet(1, 1, "EYE_L_ON", 300.0))
    bench.run(100)
    assert lib.host_nvm_writes(bench.robot) == writes
    bench.power_on()
    assert value_of(bench, "EYE_L_ON") == 300.0


def test_every_parameter_is_stored_in_its_own_place() -> None:
    bench = FirmwareBench()
    wanted = {}
    for parameter in JUNIOR_PARAMETERS:
        if not parameter.read_only:
            wanted[parameter.name] = parameter.maximum if parameter.default != parameter.maximum else parameter.minimum
    wanted["SYS_ID"] = 1.0
    bench.tick(*(ParamSet(1, 1, name, value) for name, value in wanted.items()))
    bench.run(1000)
    bench.power_on()
    assert {name: value_of(bench, name) for name in wanted} == pytest.approx(wanted, rel=1e-7)


def slot(action: Action, turn: int, current: int = 3) -> bytes:
    """A slot of memory: one action, and whose turn it is."""
    data = bytes([255, current, ManeuverOption.EYES | turn << 6, action, *bytes(7)]) + struct.pack("<H", 250)
    return data + struct.pack("<HB", mcrf4xx(data + b"\1"), 1)


@pytest.mark.parametrize(("turns", "newer"), [((0, 1), 1), ((1, 2), 1), ((2, 0), 1), ((1, 0), 0), ((2, 1), 0), ((0, 2), 0)])
def test_of_two_slots_for_the_same_the_newer_one_counts_and_the_other_is_blanked(turns: tuple[int, int], newer: int) -> None:
    nvm = bytearray(BLANK)
    nvm[MEMORY : MEMORY + 32] = slot(Action.FF, turns[0]) + slot(Action.SB, turns[1])
    bench = FirmwareBench(bytes(nvm))
    bench.open()
    bench.tick(bench.read_message(0))
    entry = bench.latest(JuniorMemoryEntry)
    assert (entry.used, entry.actions[0]) == (1, (Action.FF, Action.SB)[newer])
    assert bench.nvm[MEMORY + 15 + 16 * (1 - newer)] == 0xFF


def test_a_value_that_differs_in_its_last_byte_is_stored() -> None:
    bench = FirmwareBench()
    for value in (2.0, 8.0):  # 0x40000000, 0x41000000
        bench.tick(ParamSet(1, 1, "MAN_HOLD", value))
        bench.run(100)
        bench.power_on()
        assert value_of(bench, "MAN_HOLD") == value
