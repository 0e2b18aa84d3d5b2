"""The firmware's signing: who is believed, what the key survives, and that a reboot opens no door."""

from __future__ import annotations

import pytest
from fastcrc.crc16 import mcrf4xx
from firmware_bench import BLANK, HOST
from signed_bench import AHEAD, SignedBench
from signed_pair import END, KEY, NOW, OTHER_KEY, signed_at, signed_codec

from firmware_protocol.messages import (
    Command,
    CommandAck,
    CommandLong,
    Heartbeat,
    Ping,
    Reason,
    RobotStatus,
    SetupSigning,
    State,
)
from firmware_protocol.vocabulary import Action
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.signing import OLDEST, TIME_LIMIT, SigningKey, setup_signing
from simdevice._host import ffi, lib

FAR = [END, TIME_LIMIT, TIME_LIMIT + (1 << 16), (END >> 16) - 458 << 16]
"""Times that are none: the last one, the first one, and what a reckoning in 32 bits may take for less."""


def armed() -> SignedBench:
    """A robot in session and armed."""
    bench = SignedBench()
    bench.armed()
    return bench


def test_a_signed_host_drives_it() -> None:
    bench = armed()
    assert bench.state() is State.READY
    assert bench.refused() == (0, 0, 0)


def test_what_it_says_is_believed_by_who_has_the_key() -> None:
    bench = SignedBench()
    bench._codec = signed_codec(system=255)  # the bench takes no rejection
    bench.tick(Ping(1, 1))
    bench.run(3000)
    assert len(bench.got(Heartbeat)) >= 3


def test_unsigned_wrongly_signed_and_replayed_frames_are_refused_and_counted() -> None:
    bench = SignedBench()
    assert bench.answers(MavlinkCodec(system=255, component=190).encode(Ping(1, 1))) == []
    assert bench.answers(signed_codec(OTHER_KEY).encode(Ping(1, 2))) == []
    good = bench.host.encode(Ping(1, 3))
    assert bench.answers(good) == [3]
    assert bench.answers(good + good) == []
    assert bench.refused() == (1, 1, 2)


def test_the_first_frame_of_a_stream_may_be_a_minute_behind() -> None:
    bench = SignedBench()
    assert bench.answers(bench.host.encode(Ping(1, 1))) == [1]
    assert bench.answers(signed_codec(system=7, now=NOW - OLDEST + 5000).encode(Ping(1, 2))) == [2]
    assert bench.answers(signed_codec(system=8, now=NOW - OLDEST - 200_000).encode(Ping(1, 3))) == []
    assert bench.answers(signed_codec(system=9, component=1, now=NOW).encode(Ping(1, 4))) == [4]


def test_five_senders_share_four_places_and_nothing_is_believed_twice() -> None:
    bench = SignedBench()
    bench.answers(bench.host.encode(Ping(1, 0)))
    senders = [signed_codec(system=10 + i, now=NOW + 100 * i) for i in range(6)]
    frames = [sender.encode(Ping(1, 1)) for sender in senders]
    for frame in frames:
        assert bench.answers(frame) == [1]
    for frame in frames:
        assert bench.answers(frame) == []
    assert bench.answers(signed_codec(system=10, now=NOW + 10_000).encode(Ping(1, 5))) == [5]


def test_refused_frames_do_not_feed_the_watchdog() -> None:
    bench = armed()
    bench.ask(bench.wheels_message(0.5, 0.5, 2.0))
    assert bench.wheels != (0, 0)
    unsigned = MavlinkCodec(system=255, component=190)
    for _ in range(60):
        bench.tick(raw=unsigned.encode(HOST) + signed_codec(OTHER_KEY).encode(HOST))
    assert bench.wheels == (0, 0)
    assert bench.state() is State.READY


def test_refused_frames_change_no_count_of_lost_ones() -> None:
    bench = SignedBench()
    codec = MavlinkCodec(system=255, component=190)
    for number in range(9):
        bench.tick(Ping(1, number))
        bench.tick(raw=codec.encode(Ping(1, 0)) + codec.encode(Ping(1, 0)) + codec.encode(Ping(1, 0)))
    bench.refused()
    assert bench.latest(RobotStatus).lost == 0


@pytest.mark.parametrize("codec", ["unsigned", "other key", "replayed"])
def test_an_emergency_stop_is_honoured_from_anybody(codec: str) -> None:
    bench = armed()
    bench.ask(bench.wheels_message(0.5, 0.5, 2.0))
    stop = CommandLong(0, 0, Command.FLIGHT_TERMINATION, param1=1.0)
    if codec == "replayed":
        frame = bench.host.encode(stop)
        bench.tick(raw=frame)
        bench.disarm()
        bench.arm()
    else:
        frame = (MavlinkCodec(system=3, component=1) if codec == "unsigned" else signed_codec(OTHER_KEY)).encode(stop)
    bench.tick(raw=frame)
    assert bench.state() is State.STOPPED
    assert bench.wheels == (0, 0)
    assert sum(bench.refused()) == 1
    assert any(ack.command == Command.FLIGHT_TERMINATION for ack in bench.got(CommandAck))
    bench.clear()
    bench.tick(raw=MavlinkCodec(system=255, component=190).encode(CommandLong(1, 1, Command.ARM_DISARM, param1=0.0)))
    assert not bench.got(CommandAck)


def test_a_frame_cut_within_its_signature_costs_no_other() -> None:
    bench = SignedBench()
    for missing in range(1, 16):
        frame = bench.host.encode(Ping(1, 1))[:-missing] + bench.host.encode(Ping(1, 100 + missing))
        found = bench.answers(frame)
        bench.run(40, alive=False)
        assert 100 + missing in found + [ping.seq for ping in bench.got(Ping)], missing


# --- the key --------------------------------------------------------------------------------------------------------


def test_a_key_is_given_over_the_line_and_survives_power_off() -> None:
    bench = SignedBench(None)
    bench.sign(None)
    assert not bench.signs()
    bench.give(KEY)
    assert bench.signs()
    assert bench.answers(bench.host.encode(Ping(1, 1))) == []
    bench.power_on()
    assert bench.signs()
    bench.sign(KEY, NOW + 2 * AHEAD)
    assert bench.answers(bench.host.encode(Ping(1, 2))) == [2]


def test_a_key_is_changed_and_taken_away_only_with_the_present_one() -> None:
    bench = SignedBench()
    bench.sign(None)
    bench.give(OTHER_KEY)
    bench.give(None)
    bench.sign(OTHER_KEY)
    bench.give(OTHER_KEY)
    assert bench.signs()
    bench.sign(KEY)
    assert bench.answers(bench.host.encode(Ping(1, 1))) == [1]
    bench.give(OTHER_KEY)
    assert bench.answers(signed_codec(KEY, now=NOW + AHEAD).encode(Ping(1, 1))) == []
    bench.sign(OTHER_KEY, NOW + AHEAD)
    assert bench.answers(bench.host.encode(Ping(1, 2))) == [2]
    bench.give(None)
    assert not bench.signs()
    assert OTHER_KEY.secret not in bench.nvm
    assert KEY.secret not in bench.nvm
    bench.sign(None)
    assert bench.answers(bench.host.encode(Ping(1, 3))) == [3]


@pytest.mark.parametrize("system", [0, 2])
def test_a_key_for_all_or_for_another_is_not_taken(system: int) -> None:
    bench = SignedBench(None)
    bench.sign(None)
    bench.give(KEY, system=system)
    assert not bench.signs()


def test_no_key_is_taken_while_armed() -> None:
    bench = SignedBench(None)
    bench.sign(None)
    bench.armed()
    bench.give(KEY)
    assert not bench.signs()


def test_what_was_signed_before_a_key_was_given_again_stays_refused() -> None:
    bench = SignedBench()
    old = bench.host.encode(Ping(1, 1))
    assert bench.answers(old) == [1]
    bench.give(None)
    bench.sign(None)
    bench.give(KEY)
    assert bench.answers(old) == []


def test_a_cut_while_a_key_is_written_leaves_the_old_or_the_new_one() -> None:
    bench = SignedBench()
    bench.tick(Ping(1, 0))
    before = bench.nvm
    outcomes = []
    for cut in range(80):
        bench = SignedBench(None, before)
        bench.sign(KEY, NOW + AHEAD)
        bench.tick(Ping(1, 0))
        lib.host_cut_power(bench.robot, cut)
        bench.give(OTHER_KEY)
        bench.power_on()
        old = bench.answers(signed_codec(KEY, now=NOW + 9 * AHEAD).encode(Ping(1, 1))) == [1]
        new = bench.answers(signed_codec(OTHER_KEY, now=NOW + 9 * AHEAD).encode(Ping(1, 2))) == [2]
        assert old != new, cut
        outcomes.append(new)
        assert [KEY.secret in bench.nvm, OTHER_KEY.secret in bench.nvm] == [old, new], cut
    assert outcomes == sorted(outcomes)
    assert {True, False} == set(outcomes)


def test_a_cut_while_a_first_key_is_written_leaves_none_or_it() -> None:
    for cut in range(80):
        bench = SignedBench(None)
        bench.sign(None)
        lib.host_cut_power(bench.robot, cut)
        bench.give(KEY)
        bench.power_on()
        assert bench.signs() == (cut >= 35), cut  # 32 bytes, a checksum and a mark that was blank before


def test_a_slow_eeprom_stalls_nothing() -> None:
    bench = SignedBench(None)
    bench.sign(None)
    lib.host_slow_down(bench.robot, 1, 0, 0)
    bench.tick(setup_signing(1, KEY, NOW))
    for number in range(20):
        bench.tick(Ping(1, number))
    assert [ping.seq for ping in bench.got(Ping)] == list(range(20))
    bench.run(1000, alive=False)
    assert bench.signs()
    bench.sign(KEY, NOW + 2 * AHEAD)
    bench.tick(Ping(1, 90))  # beyond what is stored: the robot stores first
    bench.run(100, alive=False)
    bench.tick(Ping(1, 91))
    assert 90 not in [ping.seq for ping in bench.got(Ping)]
    assert 91 in [ping.seq for ping in bench.got(Ping)]


# --- power off ------------------------------------------------------------------------------------------------------


def test_nothing_believed_before_a_reboot_is_believed_after() -> None:
    bench = SignedBench()
    frames = [bench.host.encode(Ping(1, number)) for number in range(20)]
    frames += [signed_codec(system=9, now=NOW + 3000).encode(Ping(1, 50))]
    assert bench.answers(b"".join(frames)) == [*range(20), 50]
    for _ in range(3):
        bench.power_on()
        assert bench.answers(b"".join(frames)) == []
    assert bench.refused()[2] == len(frames)


def test_nor_after_a_cut_at_any_byte() -> None:
    bench = SignedBench()
    bench.tick(Ping(1, 0))
    before = bench.nvm
    for cut in range(30):
        bench = SignedBench(None, before)
        lib.host_cut_power(bench.robot, cut)
        frames = [signed_codec(now=NOW + (k + 1) * AHEAD).encode(Ping(1, k)) for k in range(4)]
        believed = [frame for k, frame in enumerate(frames) if bench.answers(frame) == [k]]
        stored = bench.nvm
        bench.power_on(stored)
        for frame in believed if cut >= 28 else []:
            assert bench.answers(frame) == []


def test_its_own_time_never_goes_back() -> None:
    bench = SignedBench()
    host = signed_codec()
    bench._codec = host
    bench.tick(Ping(1, 1))
    for _ in range(4):
        bench.run(1000, alive=False)
        bench.power_on()
        bench._codec = host  # who heard it before still believes it
    bench.run(1000, alive=False)
    assert bench.got(Heartbeat)


def test_a_host_behind_a_rebooted_robot_catches_up_by_hearing_it() -> None:
    bench = SignedBench()
    bench.tick(Ping(1, 1))
    bench.power_on()
    host = signed_codec(now=NOW + 100)
    bench._codec = host
    assert bench.answers(host.encode(Ping(1, 2))) == []
    bench.run(1000, alive=False)  # a heartbeat comes
    assert bench.answers(host.encode(Ping(1, 3))) == [3]


@pytest.mark.slow
def test_storing_its_time_wears_little() -> None:
    bench = SignedBench()
    bench.tick(Ping(1, 1))
    begun = lib.host_nvm_writes(bench.robot)
    bench.run(20 * 60 * 1000, alive=False)
    writes = lib.host_nvm_writes(bench.robot) - begun
    assert 3 * 7 <= writes <= 6 * 7  # every 4.5 minutes, 7 bytes, in two places by turns


def test_without_a_key_nothing_is_ever_stored() -> None:
    bench = SignedBench(None)
    bench.sign(None)
    begun = lib.host_nvm_writes(bench.robot)
    bench.run(10_000)
    assert lib.host_nvm_writes(bench.robot) == begun


# --- the end of time ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("time", FAR)
@pytest.mark.parametrize("heard", [False, True])
def test_a_time_of_2100_or_later_is_none(time: int, heard: bool) -> None:  # noqa: FBT001
    bench = SignedBench()
    if heard:
        assert bench.answers(bench.host.encode(Ping(1, 1))) == [1]
    assert bench.answers(signed_at(time, Ping(1, 2))) == []
    assert bench.answers(signed_at(time, Ping(1, 2), system=7)) == []
    bench.run(400, alive=False)
    assert bench.answers(bench.host.encode(Ping(1, 3))) == [3]
    bench.power_on()
    bench.sign(KEY, NOW + 2 * AHEAD)
    assert bench.answers(bench.host.encode(Ping(1, 4))) == [4]
    assert bench.refused() == (0, 0, 0)


def test_it_is_counted_with_what_is_refused_for_its_time() -> None:
    bench = SignedBench()
    assert bench.answers(signed_at(END, Ping(1, 2))) == []
    assert bench.refused() == (0, 0, 1)


def test_the_last_time_before_2100_is_one() -> None:
    bench = SignedBench()
    assert bench.answers(signed_at(TIME_LIMIT - 1, Ping(1, 1))) == [1]
    assert bench.answers(signed_at(TIME_LIMIT, Ping(1, 2))) == []


@pytest.mark.parametrize("time", [*FAR, 2**64 - 1, 2**48 + NOW + 2 * AHEAD])
@pytest.mark.parametrize("key", [KEY, OTHER_KEY])
def test_a_key_is_taken_but_not_a_time_that_is_none_with_it(time: int, key: SigningKey) -> None:
    bench = SignedBench()
    bench.tick(Ping(1, 0))
    bench.tick(SetupSigning(1, 1, tuple(key.secret), time))
    bench.run(400, alive=False)
    bench.sign(key, NOW + 2 * AHEAD)
    assert bench.answers(bench.host.encode(Ping(1, 1))) == [1]
    bench.power_on()
    bench.sign(key, NOW + 5 * AHEAD)
    assert bench.answers(bench.host.encode(Ping(1, 2))) == [2]


def near_the_end(nvm: bytes = BLANK) -> SignedBench:
    """A robot that has believed a frame from the last moment before 2100, and was switched off and on."""
    bench = SignedBench(nvm=nvm)
    assert bench.answers(signed_at(TIME_LIMIT - 1, Ping(1, 1))) == [1]
    bench.power_on()
    return bench


def own_time(bench: SignedBench) -> int:
    """The time that the robot signs at."""
    bench.now += 1000
    length = lib.host_tick(bench.robot, bench.now * 1000, b"", 0)
    return int.from_bytes(bytes(ffi.buffer(bench.io.tx, length))[-12:-6], "little")


def test_its_own_time_stops_where_times_are_none() -> None:
    bench = near_the_end()
    for _ in range(3):
        assert own_time(bench) >> 16 << 16 == TIME_LIMIT
        bench.run(20_000, alive=False)
    bench.power_on()
    assert own_time(bench) >> 16 << 16 == TIME_LIMIT
    assert bench.answers(signed_at(TIME_LIMIT - 1, Ping(1, 1))) == []


def test_a_stored_time_beyond_the_end_stops_there() -> None:
    bench = near_the_end()
    stored = TIME_LIMIT.to_bytes(6, "little")[2:]
    later = b"\xfe\xff\xff\xff"
    assert bench.nvm.count(stored) == 1
    at = bench.nvm.index(stored)
    turn = bench.nvm[at + 6]
    checksum = mcrf4xx(later + bytes([turn])).to_bytes(2, "little")
    bench.power_on(bench.nvm[:at] + later + checksum + bench.nvm[at + 6 :])
    for _ in range(2):
        assert own_time(bench) >> 16 << 16 == TIME_LIMIT
        bench.power_on()
    switch_on_held(bench)
    assert bench.answers(bench.host.encode(Ping(1, 2))) == [2]


# --- the start input held at power-on -------------------------------------------------------------------------------


def switch_on_held(bench: SignedBench) -> None:
    """Switch it off and on with the start input held, and let go."""
    bench.io.start = True
    bench.power_on()
    bench.io.start = False


def test_the_start_input_held_at_power_on_forgets_the_time_and_not_the_key() -> None:
    bench = near_the_end()
    assert bench.answers(bench.host.encode(Ping(1, 1))) == []
    switch_on_held(bench)
    assert own_time(bench) < AHEAD
    assert bench.answers(MavlinkCodec(system=255, component=190).encode(Ping(1, 2))) == []
    assert bench.answers(bench.host.encode(Ping(1, 3))) == [3]
    assert own_time(bench) > NOW
    bench.power_on()  # and so it stays
    bench.sign(KEY, NOW + 2 * AHEAD)
    assert bench.answers(bench.host.encode(Ping(1, 4))) == [4]


def test_what_it_forgot_stays_forgotten_when_nobody_was_heard() -> None:
    bench = near_the_end()
    switch_on_held(bench)
    for _ in range(3):
        bench.power_on()
    assert bench.answers(bench.host.encode(Ping(1, 3))) == [3]


def test_a_start_input_that_is_held_later_forgets_nothing() -> None:
    bench = SignedBench()
    frame = bench.host.encode(Ping(1, 1))
    assert bench.answers(frame) == [1]
    bench.power_on()
    for start in (True, False, True):
        bench.io.start = start
        bench.run(200, alive=False)
    assert bench.answers(frame) == []
    bench.io.start = False
    bench.power_on()
    assert bench.answers(frame) == []


def test_on_at_power_on_is_no_start_with_a_key_either() -> None:
    bench = SignedBench()
    bench.armed()
    assert bench.ask(bench.write_message((Action.F,), 0)) is Reason.NONE
    bench.run(400)
    bench.disarm()
    bench.io.start = True
    bench.power_on()
    bench.run(200, alive=False)
    assert bench.state() is State.DISARMED
    bench.io.start = False
    bench.run(200, alive=False)
    assert bench.state() is State.DISARMED
    bench.io.start = True
    bench.run(200, alive=False)
    assert bench.state() is State.COUNTDOWN


def test_forgetting_without_a_key_is_kept_for_when_there_is_one() -> None:
    bench = SignedBench()
    assert bench.answers(signed_at(TIME_LIMIT - 2, Ping(1, 1))) == [1]
    bench.tick(raw=signed_at(TIME_LIMIT - 1, setup_signing(1, None, 0)))
    bench.run(400, alive=False)
    assert not bench.signs()
    switch_on_held(bench)
    bench.power_on()
    bench.sign(None)
    bench.give(OTHER_KEY)
    bench.sign(OTHER_KEY, NOW + AHEAD)
    assert bench.answers(bench.host.encode(Ping(1, 2))) == [2]


def test_a_cut_while_it_forgets_leaves_the_time_or_none() -> None:
    """And the key in any case; who holds the input again has it forgotten."""
    before = near_the_end().nvm
    outcomes = []
    for cut in range(30):
        bench = SignedBench(None, before)
        bench.io.start = True
        lib.host_power_on_cut(bench.robot, 0, cut)
        bench.io.start = False
        bench.power_on()
        usable = bench.answers(bench.host.encode(Ping(1, 1))) == [1]
        assert usable or own_time(bench) >> 16 << 16 == TIME_LIMIT
        outcomes.append(usable)
        switch_on_held(bench)
        assert bench.signs()
        assert bench.answers(signed_codec(now=NOW + 2 * AHEAD).encode(Ping(1, 2))) == [2]
    assert outcomes == sorted(outcomes)
    assert {True, False} == set(outcomes)


def test_what_forgetting_costs_ends_with_the_next_power_on_after_a_host_was_heard() -> None:
    bench = SignedBench()
    recorded = [bench.host.encode(Ping(1, number)) for number in range(4)]
    assert bench.answers(b"".join(recorded)) == [0, 1, 2, 3]
    switch_on_held(bench)
    assert bench.answers(recorded[0]) == [0]
    assert bench.answers(recorded[0] + recorded[1]) == [1]  # once, and in order
    assert bench.answers(signed_codec(now=NOW + AHEAD).encode(Ping(1, 9))) == [9]
    bench.power_on()
    assert bench.answers(b"".join(recorded)) == []
