"""Who is believed, and why not."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest
from signed_pair import END, KEY, NOW, OTHER_KEY, signed_at, signed_codec

from firmware_protocol.errors import EncodeError
from firmware_protocol.events import Received, Rejected, RejectReason
from firmware_protocol.messages import Heartbeat, Ping, SetupSigning
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN, MAVLINK
from firmware_protocol.wire.mavlink import MavlinkCodec, SignedMavlinkCodec
from firmware_protocol.wire.mavlink_layout import SIGNATURE_LENGTH
from firmware_protocol.wire.signing import (
    EPOCH,
    OLDEST,
    STREAMS,
    TIME_LIMIT,
    Signing,
    SigningKey,
    redacted,
    setup_signing,
    signing_time,
    time_text,
    trouble,
)

PING = Ping(1, 2)


def reasons(codec: MavlinkCodec, *frames: bytes) -> list[RejectReason | None]:
    """What becomes of frames: None for one that is believed."""
    events = codec.receive(b"".join(frames), 0.0)
    assert b"".join(event.raw for event in events) == b"".join(frames)
    return [event.reason if isinstance(event, Rejected) else None for event in events]


def test_a_signed_frame_is_believed_once() -> None:
    robot, host = signed_codec(), signed_codec()
    frame = robot.encode(PING)
    assert reasons(host, frame, frame) == [None, RejectReason.REPLAYED]
    assert (host.good, host.signed) == (1, 1)
    assert host.rejected[RejectReason.REPLAYED] == 1


def test_what_came_before_is_not_believed_after() -> None:
    robot, host = signed_codec(), signed_codec()
    first, second, third = (robot.encode(PING) for _ in range(3))
    assert reasons(host, first, third, second) == [None, None, RejectReason.REPLAYED]


def test_unsigned_frames_are_refused_whole() -> None:
    host = signed_codec()
    plain = MavlinkCodec(system=1, component=1).encode(PING)
    signed = signed_codec(system=1, component=1).encode(PING)
    assert reasons(host, plain, signed, plain) == [RejectReason.NOT_SIGNED, None, RejectReason.NOT_SIGNED]
    assert host.good == 1
    event = host.receive(plain, 0.0)[0]
    assert isinstance(event, Rejected)
    assert event.detail == "PING of system 1, component 1"


def test_another_key_is_refused() -> None:
    assert reasons(signed_codec(), signed_codec(OTHER_KEY).encode(PING)) == [RejectReason.BAD_SIGNATURE]


def test_a_wrong_signature_does_not_move_the_stream() -> None:
    robot, host = signed_codec(), signed_codec()
    frame = bytearray(robot.encode(PING))
    later = frame[:]
    later[-8] = 0xFF  # a time far ahead, for which the signature does not hold
    assert reasons(host, bytes(later), bytes(frame)) == [RejectReason.BAD_SIGNATURE, None]


def test_streams_are_told_apart() -> None:
    host = signed_codec()
    frames = [
        signed_codec(system=system, component=component, link=link).encode(PING)
        for system, component, link in ((1, 1, 0), (2, 1, 0), (1, 2, 0), (1, 1, 1))
    ]
    assert reasons(host, *frames) == [None] * 4
    assert reasons(host, *frames) == [RejectReason.REPLAYED] * 4


@pytest.mark.parametrize(("behind", "reason"), [(OLDEST, None), (OLDEST + 1, RejectReason.TOO_OLD)])
def test_a_new_stream_may_be_a_minute_behind(behind: int, reason: RejectReason | None) -> None:
    assert reasons(signed_codec(), signed_codec(now=NOW - behind).encode(PING)) == [reason]


def test_a_known_stream_may_fall_further_behind() -> None:
    times = iter([NOW, NOW + 2 * OLDEST, NOW + 2 * OLDEST])
    robot = signed_codec()
    host = SignedMavlinkCodec(system=255, component=190, signing=Signing(KEY, lambda: next(times)))
    assert reasons(host, robot.encode(PING), robot.encode(PING)) == [None, None]


def test_time_is_put_forward_and_runs_on() -> None:
    clock = [NOW]
    host = Signing(KEY, lambda: clock[0])
    assert host.check(signed_codec(now=NOW + 5_000).encode(PING)) is None
    assert host.now() == NOW + 5_000
    clock[0] += 70
    assert host.now() == NOW + 5_070


def test_time_is_put_forward_all_the_way_where_the_clock_has_gone_back() -> None:
    clock = [NOW]
    host = Signing(KEY, lambda: clock[0])
    host.sign(b"")
    clock[0] -= 60 * OLDEST
    assert host.check(signed_codec(now=NOW + 5_000).encode(PING)) is None
    assert host.now() == NOW + 5_000


def test_time_never_goes_back() -> None:
    clock = [NOW]
    signing = Signing(KEY, lambda: clock[0])
    stamps = []
    for step in (0, 0, -50_000, 10**6, -(10**12)):
        clock[0] += step
        stamps.append(int.from_bytes(signing.sign(b"")[1:7], "little"))
    assert stamps == sorted(set(stamps))


def test_a_time_is_none_from_2100_on() -> None:
    begin_of_2100 = signing_time(datetime(2100, 1, 1, tzinfo=UTC).timestamp())
    assert 0 <= begin_of_2100 - TIME_LIMIT < 1 << 16
    assert TIME_LIMIT % (1 << 16) == 0


@pytest.mark.parametrize("time", [END, TIME_LIMIT, TIME_LIMIT + 1])
@pytest.mark.parametrize("known", [False, True])
def test_what_is_signed_in_2100_or_later_is_refused_and_moves_nothing(time: int, known: bool) -> None:  # noqa: FBT001
    host = Signing(KEY, lambda: NOW)
    if known:
        assert host.check(signed_at(NOW, PING)) is None
    assert host.check(signed_at(time, PING)) is RejectReason.NO_TIME
    assert host.check(signed_at(time, PING, system=7)) is RejectReason.NO_TIME
    assert host.now() == NOW
    assert host.check(signed_at(NOW + 1, PING)) is None
    assert host.check(signed_at(NOW + 1, PING, system=7)) is None


def test_who_does_not_have_the_key_is_not_said_to_have_the_wrong_time() -> None:
    assert Signing(KEY, lambda: NOW).check(signed_at(END, PING, key=OTHER_KEY)) is RejectReason.BAD_SIGNATURE


def test_our_own_time_does_not_move_beyond_2100() -> None:
    clock = [NOW]
    host = Signing(KEY, lambda: clock[0])
    assert host.check(signed_at(TIME_LIMIT - 1, PING)) is None
    clock[0] += OLDEST
    for _ in range(3):
        assert int.from_bytes(host.sign(b"")[1:7], "little") == TIME_LIMIT
    assert host.now() == TIME_LIMIT
    assert Signing(KEY, lambda: END + 5).now() == TIME_LIMIT


def test_a_robot_is_given_no_time_that_is_none() -> None:
    assert setup_signing(1, KEY, TIME_LIMIT - 1).initial_timestamp == TIME_LIMIT - 1
    assert setup_signing(1, KEY, TIME_LIMIT).initial_timestamp == 0


def test_a_value_out_of_range_is_refused_as_such() -> None:
    frame = bytearray(signed_codec().encode(Heartbeat(6, 8, 0, 0, 4)))
    frame[-1] ^= 1
    assert reasons(signed_codec(), bytes(frame)) == [RejectReason.BAD_SIGNATURE]


def test_a_codec_without_a_key_takes_signed_frames_and_counts_them() -> None:
    plain = MavlinkCodec(system=1, component=1)
    assert reasons(plain, signed_codec().encode(PING)) == [None]
    assert (plain.good, plain.signed) == (1, 1)


def test_frames_are_what_they_were_but_for_flag_and_signature() -> None:
    plain = MavlinkCodec(system=255, component=190).encode(PING)
    signed = signed_codec().encode(PING)
    assert len(signed) == len(plain) + SIGNATURE_LENGTH
    assert (signed[2], plain[2]) == (1, 0)
    assert signed[3:-15] == plain[3:-2]


def test_open_codec() -> None:
    signing = Signing(KEY, lambda: NOW)
    assert isinstance(open_codec(MAVLINK, system=1, component=1, signing=signing), SignedMavlinkCodec)
    with pytest.raises(ValueError, match="nothing is signed on the wire 'can'"):
        open_codec(CAN, system=1, component=1, signing=signing)
    with pytest.raises(EncodeError, match="nothing is signed there"):
        open_codec(CAN, system=255, component=190).encode(setup_signing(1, KEY, 0))


@pytest.mark.parametrize("secret", [bytes(32), b"short", bytes(33)])
def test_what_is_no_key(secret: bytes) -> None:
    with pytest.raises(ValueError, match="a signing key"):
        SigningKey(secret)


def test_a_key_is_never_shown() -> None:
    message = setup_signing(1, KEY, NOW)
    texts = [repr(KEY), str(KEY), repr(message), str([KEY, message])]
    with pytest.raises(EncodeError) as caught:
        MavlinkCodec(system=1, component=1).encode(SetupSigning(1, 1, (*KEY.secret[:31], 256), 0))
    texts += [str(caught.value), repr(caught.value)]
    for text in texts:
        assert "2, 3, 4" not in text
        assert KEY.secret.hex()[4:12] not in text.replace("\\x", "")


def test_redacted() -> None:
    for codec in (MavlinkCodec(system=255, component=190), signed_codec()):
        frame = codec.encode(setup_signing(1, KEY, NOW))
        kept = redacted(frame)
        assert kept == frame[:10] + bytes(len(frame) - 10)
        assert redacted(frame[:20]) == kept[:20]
        assert redacted(frame[:4]) == frame[:4]


def test_signing_time() -> None:
    assert signing_time(EPOCH) == 0
    assert signing_time(EPOCH + 1.5) == 150_000


def test_trouble_names_what_is_wrong() -> None:
    none = dict.fromkeys(RejectReason, 0)
    ours = Signing(KEY, lambda: NOW)
    assert not trouble(none, 0, None)
    assert not trouble(none, 5, ours)
    assert "pass its key file" in trouble(none, 5, None)
    assert "another key" in trouble({**none, RejectReason.BAD_SIGNATURE: 1}, 0, ours)
    assert "does not sign" in trouble({**none, RejectReason.NOT_SIGNED: 1}, 0, ours)


def moment(text: str) -> int:
    """A time in signatures."""
    return signing_time(datetime.fromisoformat(text).replace(tzinfo=UTC).timestamp())


@pytest.mark.parametrize(
    ("robot", "ours", "words"),
    [
        (moment("2015-01-01 00:05:01"), moment("2026-07-01 12:00:30"), ("2015-01-01 00:05:01 GMT", "2026-07-01 12:00:30 GMT")),
        (END, moment("2026-07-01 12:00:30"), ("2100 or later", "2026-07-01 12:00:30 GMT")),
        (moment("2026-07-01 12:00:30"), moment("2101-01-01 00:00"), ("2026-07-01 12:00:30 GMT", "2100 or later")),
    ],
)
def test_trouble_with_time_names_both_and_blames_neither(robot: int, ours: int, words: tuple[str, str]) -> None:
    signing = Signing(KEY, lambda: ours)
    assert signing.check(signed_at(robot, PING)) is not None
    text = trouble(dict.fromkeys(RejectReason, 0), 0, signing)
    assert f"the robot's is {words[0]}, this computer's {words[1]}." in text
    assert "put forward" not in text
    assert "right?" not in text


def test_trouble_with_time_says_how_far_we_were_put_forward() -> None:
    ours, first = moment("2026-07-01 12:00"), moment("2090-01-01 00:00")
    signing = Signing(KEY, lambda: ours)
    assert signing.check(signed_at(first, PING, system=7)) is None
    assert signing.check(signed_at(ours, PING)) is RejectReason.TOO_OLD
    text = trouble(dict.fromkeys(RejectReason, 0), 0, signing)
    assert "the robot's is 2026-07-01 12:00:00 GMT, this computer's 2026-07-01 12:00:00 GMT (put forward to 2090-01-01 " in text


def test_time_text() -> None:
    assert time_text(0) == "2015-01-01 00:00:00 GMT"
    assert time_text(TIME_LIMIT - 1) == "2099-12-31 23:59:59 GMT"
    assert time_text(TIME_LIMIT) == "2100 or later"


def test_a_frame_cut_short_costs_no_other() -> None:
    host, robot = signed_codec(), signed_codec(system=1, component=1)
    for missing in range(1, len(robot.encode(PING))):
        events = host.receive(b"\xfd" * 40 + robot.encode(PING)[:-missing], 0.0)
        good = robot.encode(PING)
        events += host.receive(good, 0.005)
        events += host.flush(1.0)
        assert [event.raw for event in events if isinstance(event, Received)] == [good], missing


def test_so_many_streams_are_remembered_and_what_is_forgotten_cannot_be_replayed() -> None:
    host = signed_codec()
    streams = host._signing._streams
    robot = signed_codec(system=1, component=1)
    first, other = robot.encode(PING), signed_codec(system=2, component=1, now=NOW - 1).encode(PING)
    assert reasons(host, first) == [None]
    later = [signed_codec(system=100 + k // 250, component=k % 250, now=NOW + 1 + k).encode(PING) for k in range(STREAMS)]
    assert reasons(host, *later) == [None] * STREAMS
    assert len(streams) == STREAMS
    assert reasons(host, first, other) == [RejectReason.TOO_OLD] * 2
    assert reasons(host, signed_codec(system=1, component=1, now=NOW + 5000).encode(PING)) == [None]
    assert len(streams) == STREAMS
