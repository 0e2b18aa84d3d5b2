"""The firmware's signing at its limits: counters, links, what a key's copies may hold, and a control period that is over."""

from __future__ import annotations

import pytest
from firmware_bench import BLANK
from signed_bench import AHEAD, SignedBench
from signed_pair import KEY, NOW, OTHER_KEY, signed_codec

from firmware_protocol.messages import Command, Heartbeat, JuniorSensors, ParamSet, Ping, RobotStatus, SysStatus
from firmware_protocol.wire.mavlink import MavlinkCodec, split_frames
from firmware_protocol.wire.signing import setup_signing
from simdevice._host import ffi, lib

SLOT = 35
"""Bytes of a copy of the key: key, checksum, mark."""
KEYS = 1024 - 33 * 16 - 2 * SLOT
"""Where the copies are in EEPROM."""


def unsigned() -> MavlinkCodec:
    """A host without a key."""
    return MavlinkCodec(system=255, component=190)


def test_each_kind_of_refusal_is_an_error_of_sys_status() -> None:
    bench = SignedBench()
    bench.tick(raw=unsigned().encode(Ping(1, 1)) * 3)
    bench.tick(raw=b"".join(signed_codec(OTHER_KEY).encode(Ping(1, 2)) for _ in range(5)))
    good = bench.host.encode(Ping(1, 3))
    bench.tick(raw=good * 8)
    bench.command(Command.REQUEST_MESSAGE, SysStatus.ID)
    assert bench.latest(SysStatus).errors_comm == 3 + 5 + 7
    assert bench.refused() == (3, 5, 7)


def test_counters_of_refusals_stop_at_the_greatest_number() -> None:
    bench = SignedBench()
    frame = unsigned().encode(Ping(1, 1))
    bench.tick(raw=frame * 65534)
    assert bench.refused()[0] == 65534
    bench.tick(raw=frame)
    assert bench.refused()[0] == 65535
    bench.tick(raw=frame)
    assert bench.refused()[0] == 65535


def test_links_of_one_sender_are_streams_of_their_own() -> None:
    bench = SignedBench()
    links = [signed_codec(now=NOW + 1000 - 100 * link, link=link) for link in range(3)]
    for codec in links:
        assert bench.answers(codec.encode(Ping(1, 1))) == [1], "behind another link, not behind its own"
    for link in range(3):
        assert bench.answers(signed_codec(now=NOW + 1000 - 100 * link, link=link).encode(Ping(1, 1))) == []


@pytest.mark.parametrize(("system", "component"), [(254, 190), (255, 191)])
def test_senders_are_told_apart_by_system_and_component(system: int, component: int) -> None:
    bench = SignedBench()
    assert bench.answers(signed_codec(now=NOW + 1000).encode(Ping(1, 1))) == [1]
    other = signed_codec(system=system, component=component, now=NOW)
    assert bench.answers(other.encode(Ping(1, 2))) == [2]


def test_a_time_is_later_by_its_lower_part_alone() -> None:
    bench = SignedBench()
    now = NOW | 0xFFFF
    assert bench.answers(signed_codec(now=now - 2).encode(Ping(1, 1))) == [1]
    assert bench.answers(signed_codec(now=now - 2).encode(Ping(1, 2))) == []
    assert bench.answers(signed_codec(now=now - 1).encode(Ping(1, 3))) == [3]
    assert bench.answers(signed_codec(now=now + 1).encode(Ping(1, 4))) == [4], "the lower part has wrapped"
    assert bench.answers(signed_codec(now=now - 1).encode(Ping(1, 5))) == []


def test_it_signs_by_its_only_link_which_is_0() -> None:
    bench = SignedBench()
    bench.now += 2000
    length = lib.host_tick(bench.robot, bench.now * 1000, b"", 0)
    frame, *_ = split_frames(bytes(ffi.buffer(bench.io.tx, length)))
    assert frame[2] == 1
    assert frame[-13] == 0


# --- the copies of the key ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("position", range(SLOT))
@pytest.mark.parametrize("copy", [0, 1])
def test_a_spoilt_copy_of_the_key_is_made_good_from_the_other(position: int, copy: int) -> None:
    good = SignedBench().nvm
    spoilt = bytearray(good)
    spoilt[KEYS + SLOT * copy + position] ^= 0x11
    bench = SignedBench(None, bytes(spoilt))
    assert bench.signs()
    assert bench.nvm[KEYS : KEYS + 2 * SLOT] == good[KEYS : KEYS + 2 * SLOT]
    bench.sign(KEY)
    assert bench.answers(bench.host.encode(Ping(1, 1))) == [1]


def test_two_spoilt_copies_are_no_key() -> None:
    spoilt = bytearray(SignedBench().nvm)
    spoilt[KEYS + 3] ^= 1
    spoilt[KEYS + SLOT + 3] ^= 1
    bench = SignedBench(None, bytes(spoilt))
    assert not bench.signs()


def test_of_two_good_copies_the_first_counts() -> None:
    nvm = bytearray(SignedBench().nvm)
    nvm[KEYS + SLOT : KEYS + 2 * SLOT] = SignedBench(OTHER_KEY).nvm[KEYS : KEYS + SLOT]
    bench = SignedBench(None, bytes(nvm))
    assert bench.nvm[KEYS : KEYS + SLOT] == bench.nvm[KEYS + SLOT : KEYS + 2 * SLOT]
    assert bench.answers(bench.host.encode(Ping(1, 1))) == [1]


def test_a_key_taken_away_stays_away_and_no_time_is_stored_for_it() -> None:
    bench = SignedBench()
    bench.give(None)
    bench.power_on()
    assert not bench.signs()
    bench.sign(None)
    assert bench.answers(bench.host.encode(Ping(1, 1))) == [1]
    begun = lib.host_nvm_writes(bench.robot)
    bench.run(10_000, alive=False)
    assert lib.host_nvm_writes(bench.robot) == begun


def test_a_second_key_is_not_heard_while_the_first_is_stored() -> None:
    bench = SignedBench(None)
    bench.sign(None)
    lib.host_slow_down(bench.robot, 1, 0, 0)
    bench.tick(setup_signing(1, KEY, NOW))
    for _ in range(100):
        bench.tick(setup_signing(1, OTHER_KEY, NOW))
    bench.run(500, alive=False)
    bench.sign(KEY, NOW + AHEAD)
    lib.host_slow_down(bench.robot, 0, 0, 0)
    assert bench.answers(bench.host.encode(Ping(1, 5))) == [5]
    assert OTHER_KEY.secret not in bench.nvm


def test_no_key_is_heard_while_a_parameter_is_stored() -> None:
    bench = SignedBench(None)
    bench.sign(None)
    lib.host_slow_down(bench.robot, 1, 0, 0)
    bench.tick(ParamSet(1, 1, "EYE_L_ON", 300.0))
    bench.tick(setup_signing(1, KEY, NOW))
    bench.run(500, alive=False)
    assert not bench.signs()


def test_an_eeprom_that_is_worn_out_keeps_the_key_before() -> None:
    bench = SignedBench()
    lib.host_cut_power(bench.robot, 0)  # nothing is written any more
    bench.give(OTHER_KEY)
    assert bench.signs()
    assert bench.answers(signed_codec(KEY, now=NOW + 100).encode(Ping(1, 1))) == [1]


# --- time -----------------------------------------------------------------------------------------------------------


def test_what_is_beyond_the_stored_time_is_heard_when_that_is_stored() -> None:
    bench = SignedBench()
    bench.tick(Ping(1, 1))
    lib.host_slow_down(bench.robot, 1, 0, 0)
    host = signed_codec(now=NOW + 3 * AHEAD)
    for number in range(2, 4):
        assert bench.answers(host.encode(Ping(1, number))) == []
    bench.run(300, alive=False)
    assert bench.answers(host.encode(Ping(1, 9))) == [9]


# --- a control period that is over ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("used", "late"), [(4999, False), (5000, True)])
def test_where_a_control_period_is_over_one_frame_is_taken_and_no_stream_sent(used: int, late: bool) -> None:  # noqa: FBT001
    bench = SignedBench()
    bench.run(1000, alive=False)
    bench.clear()
    lib.host_be_busy(bench.robot, used)
    frames = b"".join(bench.host.encode(Ping(1, number)) for number in range(3))
    assert bench.answers(frames) == ([0] if late else [0, 1, 2]), "the rest waits in the line's buffer"
    bench.run(2000, alive=False)
    assert bool(bench.got(JuniorSensors)) is not late
    assert bool(bench.got(Heartbeat)) is not late
    lib.host_be_busy(bench.robot, 0)
    bench.run(50, alive=False)
    assert bench.got(JuniorSensors)


def test_without_a_key_a_long_control_period_holds_nothing_back() -> None:
    bench = SignedBench(None, BLANK)
    bench.sign(None)
    lib.host_be_busy(bench.robot, 9000)
    assert bench.answers(b"".join(bench.host.encode(Ping(1, number)) for number in range(3))) == [0, 1, 2]
    bench.run(1100, alive=False)
    assert bench.got(RobotStatus)


@pytest.mark.parametrize("position", range(1, 7))
def test_each_byte_of_a_signature_counts(position: int) -> None:
    bench = SignedBench()
    frame = bytearray(bench.host.encode(Ping(1, 1)))
    frame[-position] ^= 1
    assert bench.answers(bytes(frame)) == []
    bench.run(40, alive=False)
    assert bench.refused()[1] == 1


@pytest.mark.parametrize(("behind", "believed"), [(92, True), (93, False)])
def test_a_stream_begins_a_minute_behind_at_most(behind: int, believed: bool) -> None:  # noqa: FBT001
    bench = SignedBench()
    now = NOW >> 16 << 16
    assert bench.answers(signed_codec(now=now).encode(Ping(1, 1))) == [1]
    late = signed_codec(system=7, now=now - (behind << 16))
    assert bench.answers(late.encode(Ping(1, 2))) == ([2] if believed else [])


@pytest.mark.parametrize("bits", [0, 0xFFFF, 0x1_0000_0000])
def test_a_key_comes_with_a_time_before_which_nothing_is_believed(bits: int) -> None:
    bench = SignedBench(None)
    bench.sign(None)
    now = NOW ^ bits
    bench.tick(setup_signing(1, KEY, now))
    assert bench.answers(signed_codec(now=now - 1000).encode(Ping(1, 1))) == []
    assert bench.answers(signed_codec(now=now + 5000).encode(Ping(1, 2))) == [2]
