"""On a CAN bus: messages of several frames, whole and otherwise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import ROBOT_COMPONENT, Ping, RobotAck, State, Timesync
from firmware_protocol.wire.can import layout
from firmware_protocol.wire.can.frame import MAX_DATA, CanFrame
from firmware_protocol.wire.fields import CAN
from firmware_protocol.wire.mavlink_layout import crc_extra
from hil.conformance.can_frames import STOP, UNKNOWN_ID, body, cut, identifier, payload, resized, sealed, without
from hil.conformance.probe import PATIENCE
from hil.conformance.registry import Group, require

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.conformance.subject import Subject

GROUP: Final = Group("CAN transfers", CAN)
_GIVEN_UP: Final = 0.08
"""An incomplete transfer has been given up after this, in s; the rule says 0.05."""
_LAST: Final = 99
"""Number of the question that must be answered after whatever came before it."""


def question(robot: Subject, number: int) -> list[CanFrame]:
    """A transfer of three full parts, to this robot alone, that is answered once: TIMESYNC. Not sent.

    Args:
        robot: Whom to ask.
        number: Told in the answer.
    """
    return robot.frames(Timesync(0, number, robot.system, ROBOT_COMPONENT))


def _answered(robot: Subject) -> list[int]:
    """Numbers of the questions that were answered, once the last one has been."""
    robot.put(*question(robot, _LAST))
    robot.wait(Timesync, lambda m: m.ts1 == _LAST, timeout=PATIENCE, start=0)
    return [answer.ts1 for answer in robot.got(Timesync)]


def _see(robot: Subject, wanted: Sequence[int], what: str) -> None:
    """See that of what was sent these questions are answered, in this order, and the next one too.

    Args:
        robot: Who was asked.
        wanted: Numbers of the questions.
        what: What was sent, in words.
    """
    found = _answered(robot)
    require(found == [*wanted, _LAST], f"{what}: of questions {[*wanted, _LAST]}, {found} were answered")
    robot.forget()


@GROUP.check("transfer-in-pieces", rule="an incomplete transfer is given up")
def in_pieces(robot: Subject) -> str:
    """The parts of a transfer may be apart, up to 50 ms."""
    with robot.silence():
        for frame in question(robot, 1):
            robot.put(frame)
            robot.spend(0.01)
        _see(robot, [1], "three parts, 10 ms apart")
    return "3 parts, 10 ms apart"


@GROUP.check("partial-transfer-given-up", rule="an incomplete transfer is given up")
def given_up(robot: Subject) -> str:
    """An incomplete transfer is given up after 50 ms without a part."""
    with robot.silence():
        frames = question(robot, 1)
        robot.put(*frames[:2])
        robot.spend(_GIVEN_UP)
        robot.put(frames[2])
        _see(robot, [], f"the last of three parts came after {_GIVEN_UP * 1e3:.0f} ms")
    return f"after {_GIVEN_UP * 1e3:.0f} ms its rest is not taken"


@GROUP.check("missing-part-discards", rule="A missing part discards the whole")
def missing(robot: Subject) -> str:
    """A missing part discards the whole transfer, and nothing else."""
    with robot.silence():
        for part in range(2):
            robot.put(*without(question(robot, 1), part))
            _see(robot, [], f"part {part} was missing")
    return "the first, the second"


@GROUP.check("parts-out-of-order-discarded", rule="A missing part discards the whole")
def out_of_order(robot: Subject) -> str:
    """Parts that come in another order are no transfer, nor are parts of two transfers."""
    with robot.silence():
        orders = (0, 2, 1), (1, 0, 2)  # at the end of these nothing is under way
        for order in orders:
            frames = question(robot, 1)
            robot.put(*(frames[part] for part in order))
            _see(robot, [], f"parts {order}")
        first, second = question(robot, 1), question(robot, 2)
        robot.put(first[0], second[1], first[2])
        _see(robot, [], "a part of another transfer between two")
    return "two of three exchanged, and a foreign part"


@GROUP.check("abandoned-transfer-replaced", rule="when another begins")
def abandoned(robot: Subject) -> str:
    """A transfer that is broken off makes room at once for the one that follows."""
    with robot.silence():
        for parts in (1, 2):
            robot.put(*question(robot, 1)[:parts], *question(robot, 2))
            _see(robot, [2], f"behind {parts} of three parts")
    return "after one part, after two"


@GROUP.check("repeated-part-taken-once", rule="a part that comes twice in a row is taken once")
def repeated(robot: Subject) -> str:
    """A part that comes twice in a row is taken once."""
    with robot.silence():
        robot.put(*(frame for frame in question(robot, 1) for _ in range(2)))
        _see(robot, [1], "each part twice")
    return "each of 3 parts"


@GROUP.check("transfers-interleaved", rule="for each identifier")
def interleaved(robot: Subject) -> str:
    """Transfers under different identifiers may be interleaved."""
    with robot.silence():
        own, to_all = question(robot, 1), robot.frames(Timesync(0, 2))
        robot.put(*(frame for parts in zip(own, to_all, strict=True) for frame in parts))
        _see(robot, [1, 2], "two transfers, part by part")
    return "what is for it, and what is for all"


@GROUP.check("stop-between-parts", rule="JUNIOR_ESTOP", needs=("stop-frame-stops",))
def stop_between(robot: Subject) -> str:
    """An emergency stop between the parts of a transfer acts, and the transfer is none the worse."""
    stop = CanFrame(identifier(layout.ESTOP_FUNCTION, robot.system), STOP)
    robot.arm()
    with robot.silence():
        frames = question(robot, 1)
        robot.put(frames[0], stop, *frames[1:])
        _see(robot, [1], "an emergency stop between two parts")
    robot.expect_state(State.STOPPED, "after an emergency stop between the parts of a transfer")
    return "stopped, and the transfer taken"


@GROUP.check("transfer-checksum-checked", rule="The CRC is over")
def checksum(robot: Subject) -> str:
    """A transfer with a wrong checksum is not acted on, and is counted."""
    for at in range(layout.TRANSFER_HEAD, len(body(question(robot, 1)))):

        def send(at: int = at) -> None:
            frames = question(robot, 1)
            data = bytearray(body(frames))
            data[at] ^= 0x20
            robot.put(*cut(frames, bytes(data)))

        before, after = robot.counted(send)
        require(not robot.got(Timesync), f"with byte {at} damaged it was taken")
        count = after.bad_checksum - before.bad_checksum
        require(count == 1, f"ROBOT_STATUS.bad_checksum rose by {count} after one such transfer")
    return f"bytes {layout.TRANSFER_HEAD} to {at} damaged in turn"


@GROUP.check("part-length-checked", rule="the last part fewer")
def part_length(robot: Subject) -> str:
    """A part with another length than it must have discards the transfer."""
    with robot.silence():
        for part, lengths in ((0, range(MAX_DATA)), (1, range(1, MAX_DATA))):
            for length in lengths:
                frames = question(robot, 1)
                frames[part] = resized(frames[part], length)
                robot.put(*frames)
                _see(robot, [], f"part {part} of {length} bytes")
        frames = robot.frames(Ping(1, 1))
        robot.put(*frames[:-1], resized(frames[-1], frames[-1].length + 1))
        _see(robot, [], "a byte behind the checksum")
        require(not robot.got(Ping), "a PING with a byte behind its checksum was answered")
    return "first, middle and last"


@GROUP.check("transfer-length-checked", rule="What is not understood")
def too_long(robot: Subject) -> str:
    """A transfer that is longer than its message can be is refused, and counted once."""

    def send() -> None:
        frames = question(robot, 1)
        robot.put(*sealed(frames, Timesync.ID, payload(frames) + b"\0", crc_extra(Timesync)))

    before, after = robot.counted(send)
    require(not robot.got(Timesync), "it was taken")
    count = after.unknown - before.unknown
    require(count == 1, f"ROBOT_STATUS.unknown rose by {count} after one such transfer")
    return "one byte too long"


@GROUP.check("shorter-transfer-taken", rule="A payload may end early")
def shorter(robot: Subject) -> str:
    """A transfer without the bytes at the end of its message is taken: they are 0."""
    with robot.silence():
        frames = question(robot, 1)
        full = payload(frames)
        robot.put(*sealed(frames, Timesync.ID, full.rstrip(b"\0"), crc_extra(Timesync)))
        _see(robot, [1], f"{len(full.rstrip(bytes(1)))} of {len(full)} bytes")
    return f"{len(full.rstrip(bytes(1)))} of {len(full)} bytes"


@GROUP.check("unknown-transfer-counted", rule="What is not understood")
def unknown(robot: Subject) -> str:
    """A transfer of an unknown message is counted once and left alone."""

    def send() -> None:
        frames = question(robot, 1)
        robot.put(*sealed(frames, UNKNOWN_ID, payload(frames), 0), *question(robot, 2))

    before, after = robot.counted(send)
    found = [answer.ts1 for answer in robot.got(Timesync)]
    require(found == [2], f"of an unknown message and question 2 behind it, {found} were answered")
    count = after.unknown - before.unknown
    require(count == 1, f"ROBOT_STATUS.unknown rose by {count} after one such transfer")
    return "counted once, and the transfer behind it taken"


@GROUP.check("upward-message-refused", rule="What is not understood")
def upward(robot: Subject) -> str:
    """A message that only robots send is not taken from the host, and is counted."""

    def send() -> None:
        robot.put(*sealed(question(robot, 1), RobotAck.ID, bytes(8), crc_extra(RobotAck)))

    before, after = robot.counted(send)
    require(not robot.got(RobotAck), "it was answered")
    count = after.unknown - before.unknown
    require(count == 1, f"ROBOT_STATUS.unknown rose by {count} after one such transfer")
    return "ROBOT_ACK"


@GROUP.check("good-transfers-counted", rule="ROBOT_STATUS")
def good_transfers(robot: Subject) -> str:
    """Good transfers and good single frames are counted."""
    robot.arm()

    def send() -> None:
        for number in range(5):
            robot.put(*question(robot, number), *robot.frames(robot.single(0.0)))

    before, after = robot.counted(send)
    count = after.good - before.good - 1
    require(count == 10, f"ROBOT_STATUS.good rose by {count} after 5 good transfers and 5 good single frames")
    return "10 of 10"


@GROUP.check("lost-transfers-counted", rule="Gaps in the transfer numbers")
def lost(robot: Subject) -> str:
    """Gaps in the numbers of the transfers are counted, repetitions are not."""

    def send() -> None:
        frames = question(robot, 1)
        robot.put(*frames, *frames)
        for _ in range(gap):
            question(robot, 2)  # numbered, and never sent

    for gap in (3, 1, 2, 3, 4, 5, 6):  # the numbers wrap within more than one of these
        before, after = robot.counted(send)
        count = after.lost - before.lost
        require(count == gap, f"ROBOT_STATUS.lost rose by {count} after a gap of {gap}")
    return "gaps of 1 to 6"
