"""The referee of an emulated bout: component 25 of the robot's own system.

It puts everybody at a fresh start pose when asked (REFEREE_RESET), says twenty times a second what it sees
(REFEREE_STATE), and decides. After a bout is over the world goes on as a real one would: nobody is stopped, the host
resets when it likes. A physical robot has no such component.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    REFEREE_COMPONENT,
    AckResult,
    BoutOutcome,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    OpponentCode,
    Phase,
    Reason,
    RefereeReset,
    RefereeState,
    RobotAck,
    RobotSession,
)
from firmware_protocol.wire.can.frame import split_records
from firmware_protocol.wire.can.layout import FUNCTION_SHIFT, REFEREE_DOWN_FUNCTION
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN, MAVLINK
from firmware_protocol.wire.mavlink_layout import CHECKSUM_LENGTH, FLAG_SIGNED, HEADER_LENGTH, MARKER, SIGNATURE_LENGTH
from firmware_protocol.wire.payload import PAYLOADS
from simdevice.sumo.match import opponent_code

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.signing import Signing
    from simdevice.sumo.match import Match

REPORT_PERIODS: Final = 10
"""Control periods between two REFEREE_STATE, unless others are asked for: 20 Hz."""
LONGEST: Final = 60.0
"""Greatest interval that can be asked for, in s."""
_MINE: Final = frozenset((CommandLong.ID, RefereeReset.ID, RobotSession.ID))
"""Messages that a referee answers."""
IDENTIFIERS: Final = range(REFEREE_DOWN_FUNCTION << FUNCTION_SHIFT, (REFEREE_DOWN_FUNCTION + 1) << FUNCTION_SHIFT)
"""Under which a referee is spoken to on a CAN bus."""
_HALF: Final = 0x8000
"""Sequence numbers this far ahead or more are taken to be behind (serial number arithmetic, RFC 1982)."""


def _ack(message: RefereeReset | RobotSession, asked: Received, reason: Reason = Reason.NONE) -> RobotAck:
    """The answer to a numbered message, to who has sent it."""
    result = AckResult.ACCEPTED if reason is Reason.NONE else AckResult.REFUSED
    return RobotAck(message.ID, message.session, message.sequence, asked.system, asked.component, result, reason)


class Referee:
    """Resets, judges and reports.

    Args:
        match: What it watches.
        on_reset: Called after everybody has been placed.
        look: Called before the table is looked at: it may have to be told where everybody is.
        wire: What it speaks.
        signing: Signs what it says, and tells whom to believe; None: nothing is signed.

    Attributes:
        bout: Number of the bout, from 1; 0 before the first reset.
        phase: Of the bout.
        longest: Room that the line is to have for a state, in bytes.
    """

    def __init__(
        self,
        match: Match,
        on_reset: Callable[[], None] = lambda: None,
        *,
        look: Callable[[], None] = lambda: None,
        wire: str = MAVLINK,
        signing: Signing | None = None,
    ) -> None:
        self._match = match
        self._look = look
        self._on_reset = on_reset
        self._system = 1
        self._wire = wire
        self._signing = signing
        self.longest = HEADER_LENGTH + PAYLOADS[RefereeState.ID].length + CHECKSUM_LENGTH + SIGNATURE_LENGTH * bool(signing)
        self._codec = open_codec(wire, system=self._system, component=REFEREE_COMPONENT, signing=signing)
        self._last: tuple[int, int] | None = None
        self._reported = -1
        self._decided = BoutOutcome.UNDECIDED
        self._countdown = 0
        self._periods = REPORT_PERIODS
        self._whole = True
        self.bout = 0

    @property
    def phase(self) -> Phase:
        """Phase of the bout."""
        self._look()
        if self.bout == 0:
            return Phase.IDLE
        return Phase.RUNNING if self._match.outcome is BoutOutcome.UNDECIDED else Phase.OVER

    @property
    def outcome(self) -> BoutOutcome:
        """Of the bout; before the first reset nothing is decided."""
        self._look()
        return self._match.outcome if self.bout else BoutOutcome.UNDECIDED

    def follow(self, system: int) -> None:
        """Belong to this system from now on."""
        if system != self._system:
            self._system = system
            self._codec = open_codec(self._wire, system=system, component=REFEREE_COMPONENT, signing=self._signing)

    def receive(self, data: bytes, now: float) -> bytes:
        """Take bytes from the host; what is not for the referee is passed over.

        Args:
            data: Bytes.
            now: Time of the emulation in s.

        Returns:
            Answers.
        """
        if self._wire == CAN:
            data = _for_referee(data)
        elif self._whole and _for_others(data):
            return b""
        answers: list[Message] = []
        events = self._codec.receive(data, now)
        last = events[-1] if events else None
        self._whole = isinstance(last, Received) and data.endswith(last.raw)
        for event in events:
            if not isinstance(event, Received):
                continue
            message = event.message
            if isinstance(message, CommandLong | RefereeReset | RobotSession) and (
                message.target_system == self._system and message.target_component == REFEREE_COMPONENT
            ):
                answers += self._handle(message, event, now)
        return b"".join(map(self._codec.encode, answers))

    def _handle(self, message: CommandLong | RefereeReset | RobotSession, event: Received, now: float) -> list[Message]:
        """Answer a message that is for the referee."""
        if isinstance(message, CommandLong):
            return self._command(message, event, now)
        if isinstance(message, RobotSession):
            return [_ack(message, event)]
        return [self._reset(message, event)]

    def _command(self, message: CommandLong, event: Received, now: float) -> list[Message]:
        """Answer a standard command: only its own message can be asked for, once or at intervals."""
        result = CommandResult.UNSUPPORTED
        if message.command in {Command.REQUEST_MESSAGE, Command.SET_MESSAGE_INTERVAL}:
            result = CommandResult.ACCEPTED if message.param1 == RefereeState.ID else CommandResult.DENIED
        if message.command == Command.SET_MESSAGE_INTERVAL and result is CommandResult.ACCEPTED:
            result = self._set_interval(message.param2)
        ack = CommandAck(message.command, result, target_system=event.system, target_component=event.component)
        asked = message.command == Command.REQUEST_MESSAGE and result is CommandResult.ACCEPTED
        return [ack, self.state(now)] if asked else [ack]

    def _set_interval(self, interval: float) -> CommandResult:
        """Report at another interval, in us; 0 is the usual one. Never is not allowed: nobody would know how a bout ends."""
        if not 0 <= interval <= LONGEST * 1e6:
            return CommandResult.DENIED
        self._periods = max(1, round(interval * 1e-6 / self._match.period)) if interval else REPORT_PERIODS
        self._countdown = min(self._countdown, self._periods)
        return CommandResult.ACCEPTED

    def _reset(self, message: RefereeReset, event: Received) -> RobotAck:
        """Begin a bout, once for each (session, sequence)."""
        identity = (message.session, message.sequence)
        if identity == self._last:
            return _ack(message, event)
        last = self._last
        if last is not None and last[0] == identity[0] and (identity[1] - last[1]) % (2 * _HALF) >= _HALF:
            return _ack(message, event, Reason.OLD_SEQUENCE)
        opponent = OpponentCode(message.opponent)
        self._look()
        self._match.reset(message.seed, None if opponent is OpponentCode.KEEP else opponent.label)
        self.bout += 1
        self._on_reset()
        self._last = identity
        return _ack(message, event)

    def report(self, now: float, room: int | None = None) -> bytes:
        """What is to be sent after a period: the state when it is due, or when something was decided.

        Args:
            now: Time of the emulation in s.
            room: Bytes that the line takes; what finds no room is sent later. None: any number.

        Returns:
            Bytes for the host; empty most of the time.
        """
        self._countdown -= 1
        if self._countdown > 0 and self._match.outcome is self._decided and self.bout == self._reported:
            return b""
        return self._say(now, room)

    def _say(self, now: float, room: int | None) -> bytes:
        """Send the state, now that it is due."""
        if room is not None and room < self.longest:
            return b""
        if self._countdown <= 0:
            self._countdown = self._periods
        self._decided = self._match.outcome
        self._reported = self.bout
        return self._codec.encode(self.state(now))

    def state(self, now: float) -> RefereeState:
        """What the referee sees.

        Args:
            now: Time of the emulation in s.
        """
        self._look()
        match = self._match
        junior = match.robot.body
        opponent = match.opponent
        return RefereeState(
            time=now,
            bout=self.bout,
            elapsed=match.elapsed,
            junior=(junior.x, junior.y),
            junior_heading=math.remainder(junior.angle, math.tau),
            opponent=(opponent.x, opponent.y),
            opponent_heading=math.remainder(opponent.angle, math.tau),
            clearance=match.clearance,
            phase=self.phase,
            outcome=self.outcome,
            opponent_code=opponent_code(match.name),
        )


def _for_referee(data: bytes) -> bytes:
    """The CAN frames among these that are for a referee."""
    return b"".join([record for record in split_records(data) if int.from_bytes(record[:4], "little") in IDENTIFIERS])


def _for_others(data: bytes) -> bool:
    """Nothing but whole frames of messages that are no referee's business: most of what comes, and not worth decoding.

    Args:
        data: Bytes that begin where a frame may begin.
    """
    at, end = 0, len(data)
    while at < end:
        if end - at < HEADER_LENGTH or data[at] != MARKER or int.from_bytes(data[at + 7 : at + 10], "little") in _MINE:
            return False
        signature = SIGNATURE_LENGTH if data[at + 2] & FLAG_SIGNED else 0
        at += HEADER_LENGTH + data[at + 1] + CHECKSUM_LENGTH + signature
    return at == end
