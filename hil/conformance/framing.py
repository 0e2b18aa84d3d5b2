"""Frames, good and bad: what a receiver takes, what it drops, and what a dropped one costs."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import CommandLong, Ping, Timesync
from firmware_protocol.wire.fields import MAVLINK
from firmware_protocol.wire.mavlink_layout import payload_length
from hil.conformance.frames import checksum_at, damaged, foreign, header, untrimmed, version_1
from hil.conformance.probe import PATIENCE, QUIET
from hil.conformance.registry import ANY_WIRE, Group, require

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.conformance.subject import Subject

GROUP: Final = Group("framing", MAVLINK)
_GIVEN_UP: Final = 0.05
"""A partial frame has been given up after this, in s; the rule says 0.02."""
_FRAME_LIMIT: Final = 256


def _ping(robot: Subject, number: int) -> bytes:
    return robot.frame(Ping(time_usec=1, seq=number))


def _answers(robot: Subject, wanted: Sequence[int], wait: float = PATIENCE) -> list[int]:
    """Numbers of the pings that were answered, once the wanted ones have been or the wait is over."""
    robot.wait(Ping, lambda ping: ping.seq == wanted[-1], timeout=wait, start=0)
    return [ping.seq for ping in robot.got(Ping)]


@GROUP.check("frame-in-pieces", rule="Damage")
def in_pieces(robot: Subject) -> str:
    """A frame may arrive in pieces that are less than 20 ms apart."""
    with robot.silence():
        whole = _ping(robot, 7)
        for at in range(0, len(whole), 9):
            robot.raw(whole[at : at + 9])
            robot.spend(0.005)
        require(_answers(robot, [7]) == [7], "a PING sent in three pieces, 5 ms apart, was not answered")
    return "3 pieces, 5 ms apart"


@GROUP.check("untrimmed-payload", rule="Zeros at the end of the payload are left out")
def untrimmed_payload(robot: Subject) -> str:
    """A payload is taken with the zeros at its end as well as without them."""
    robot.raw(_ping(robot, 1))
    robot.raw(robot.sealed(untrimmed(_ping(robot, 2), Ping)))
    require(_answers(robot, [2]) == [1, 2], "a PING with the zeros at its end was not answered")
    return f"{payload_length(Ping)} bytes"


@GROUP.check("bad-checksum-dropped", rule="Damage")
def bad_checksum(robot: Subject) -> str:
    """A frame with a bad checksum is not acted on, and is counted."""
    robot.need_own_line()

    def send() -> None:
        frame = _ping(robot, 3)
        robot.raw(damaged(frame, checksum_at(frame)))

    before, after = robot.counted(send)
    require(not robot.got(Ping), "a PING with a bad checksum was answered")
    count = after.bad_checksum - before.bad_checksum
    require(count == 1, f"ROBOT_STATUS.bad_checksum rose by {count} after one such frame")
    return "counted once"


@GROUP.check("unknown-message-counted", rule="What is not understood")
def unknown_message(robot: Subject) -> str:
    """A frame with an unknown id is counted and left alone."""
    robot.need_own_line()

    def send() -> None:
        robot.raw(robot.sealed(foreign(_ping(robot, 3))) + _ping(robot, 4))

    before, after = robot.counted(send)
    require([ping.seq for ping in robot.got(Ping)] == [4], "the frame behind an unknown one was not taken")
    count = after.unknown - before.unknown
    require(count == 1, f"ROBOT_STATUS.unknown rose by {count} after one such frame")
    return "counted once, and the frame behind it taken"


@GROUP.check("impossible-length-refused", rule="Damage")
def impossible_length(robot: Subject) -> str:
    """A header whose length its message cannot have is refused at once."""
    robot.need_own_line()
    with robot.silence():
        first, second = (robot.frame(Timesync(0, stamp)) for stamp in (101, 102))
        robot.raw(header(_ping(robot, 0), length=payload_length(CommandLong)) + first)
        robot.spend(0.01)
        robot.raw(second)
        robot.wait(Timesync, lambda m: m.ts1 == 102, start=0)
    times = {answer.ts1: answer.tc1 for answer in robot.got(Timesync)}
    require(set(times) == {101, 102}, "a frame behind such a header was not taken")
    require(times[101] < times[102], "the frame behind such a header was held back until more had come")
    return "the frame behind it was taken at once"


@GROUP.check("partial-frame-dropped", rule="Damage")
def partial_frame(robot: Subject) -> str:
    """A partial frame is given up after 20 ms of silence."""
    with robot.silence():
        robot.raw(robot.frame(CommandLong(robot.system, 1, 0, param1=1.0, param7=1.0))[:12])
        robot.spend(_GIVEN_UP)
        robot.raw(_ping(robot, 5))
        require(_answers(robot, [5]) == [5], f"a frame {_GIVEN_UP * 1e3:.0f} ms behind a partial one was taken for its rest")
    return f"a frame {_GIVEN_UP * 1e3:.0f} ms behind it was taken"


@GROUP.check(
    "damage-costs-one-frame", rule="Damage", needs=("wrongly-signed-refused", "bad-checksum-dropped", "partial-frame-dropped")
)
def damage(robot: Subject) -> str:
    """Damage within one frame costs that frame and no other."""
    with robot.silence():
        length = len(_ping(robot, 1))
        for at in range(length):
            robot.forget()
            robot.raw(_ping(robot, 1) + damaged(_ping(robot, 2), at, 0x20) + _ping(robot, 3))
            robot.spend(_GIVEN_UP)
            found = _answers(robot, [3])
            require(found == [1, 3], f"with byte {at} of the second of three frames damaged, {found} were answered")
    return f"each of {length} bytes damaged in turn"


@GROUP.check("noise-skipped", rule="Damage")
def noise(robot: Subject) -> str:
    """Bytes outside any frame are skipped, start markers among them."""
    with robot.silence():
        robot.raw(bytes(range(256)) + b"\xfd\xfd\xfd" + _ping(robot, 6))
        robot.spend(_GIVEN_UP)
        require(_answers(robot, [6]) == [6], "a PING behind noise was not answered")
    return "259 bytes"


@GROUP.check("mavlink-1-ignored", rule="Signing")
def mavlink_1(robot: Subject) -> str:
    """A MAVLink 1 frame is not taken."""
    robot.raw(version_1(_ping(robot, 9), Ping))
    robot.spend(QUIET)
    require(not robot.got(Ping), "a PING in a MAVLink 1 frame was answered")
    return "no answer"


@GROUP.check("good-frames-counted", rule="ROBOT_STATUS")
def good_frames(robot: Subject) -> str:
    """Good frames are counted."""

    def send() -> None:
        robot.raw(b"".join(_ping(robot, number) for number in range(10)))

    before, after = robot.counted(send)
    count = after.good - before.good - 1
    require(count == 10, f"ROBOT_STATUS.good rose by {count} after 10 good frames")
    return "10 of 10"


@GROUP.check("lost-frames-counted", rule="ROBOT_STATUS")
def lost_frames(robot: Subject) -> str:
    """Gaps in the sender's frame numbers are counted, repetitions are not."""

    def send() -> None:
        last = _ping(robot, 0)
        robot.raw(last + last)
        for _ in range(3):
            _ping(robot, 1)  # numbered, and never sent

    before, after = robot.counted(send)
    count = after.lost - before.lost
    require(count == 3, f"ROBOT_STATUS.lost rose by {count} after a gap of 3")
    return "a gap of 3"


@GROUP.check("frames-numbered", rule="A frame", wire=ANY_WIRE)
def frames_numbered(robot: Subject) -> str:
    """Every frame carries the number that follows the sender's last."""
    robot.spend(1.0)
    numbers = [event.sequence for event in robot.heard]
    gaps = sum((after - before) % _FRAME_LIMIT != 1 for before, after in pairwise(numbers))
    require(len(numbers) > 1 and not gaps, f"{gaps} gaps in the numbers of {len(numbers)} frames")
    return f"{len(numbers)} frames without a gap"
