"""CAN without I/O: frames in, typed events out; messages in, frames out. `dialect/junior.dbc` is the database of it.

An emergency stop, JUNIOR_WHEELS, ROBOT_ALIVE, a plain SWARM_MOVE and three digests of JUNIOR_SENSORS are single frames; every
other message is a transfer (`can_layout` says how). Nothing that comes from the wire raises: each frame that comes in is in
the `raw` of exactly one event.

What a single frame does not carry is supplied here: JUNIOR_WHEELS has the session that was opened last with its robot,
SWARM_MOVE that and the sectors that SWARM_SENSE has told it since; of the robot's time, which wraps after 49 days in the
digests, the upper part is taken from ROBOT_STATUS. A digest is used together with the two others of its moment, or not at all.

A transfer of which a part is missing is discarded whole. What is not complete after `PART_TIMEOUT` of silence is given up.
CAN checks each frame itself; the CRC of a transfer is against parts that do not belong together.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from struct import Struct
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import EncodeError
from firmware_protocol.events import Received, Rejected, RejectReason
from firmware_protocol.messages import (
    BYTE_LINKS_ONLY,
    HOST_COMPONENT,
    HOST_SYSTEM,
    REFEREE_COMPONENT,
    ROBOT_COMPONENT,
    Command,
    CommandLong,
    JuniorSensors,
    JuniorWheels,
    RobotAlive,
    RobotSession,
    RobotStatus,
    SwarmMove,
    SwarmSense,
)
from firmware_protocol.wire.can import layout
from firmware_protocol.wire.can.frame import RECORD_LENGTH, CanFrame, pack_frames
from firmware_protocol.wire.can.move import frame_of_move, move_of_frame
from firmware_protocol.wire.can.transfer import LONG, Long, Partial
from firmware_protocol.wire.fields import Direction
from firmware_protocol.wire.mavlink_layout import offsets
from firmware_protocol.wire.payload import BadValueError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from firmware_protocol.wire.fields import Message

PART_TIMEOUT: Final = 0.050
"""A transfer, or a set of digests, is given up after this much silence, in s."""

_SWITCHES: Final = Struct("<IHH")
_REST: Final = Struct("<HH")
_TIME: Final = Struct("<Q")
_STOP: Final = b"\1"
_MS_MASK: Final = 0xFFFFFFFF
_LAST_MS: Final = 2**53 // 1000
"""Greatest time in ms that a message can carry: 285 years."""
_IDENTIFIER: Final = 4
"""Bytes of a frame in serial form that are its identifier and flags."""
_STANDARD: Final = 0x7FF
"""Greatest identifier of 11 bits."""
_AT: Final = offsets(JuniorSensors)
_WHEELS: Final = slice(offsets(JuniorWheels)["sequence"], offsets(JuniorWheels)["target_system"])
_ALIVE: Final = slice(offsets(RobotAlive)["target_system"])
_TRANSFERS: Final = {
    layout.TRANSFER_UP_FUNCTION: ROBOT_COMPONENT,
    layout.TRANSFER_DOWN_FUNCTION: ROBOT_COMPONENT,
    layout.REFEREE_UP_FUNCTION: REFEREE_COMPONENT,
    layout.REFEREE_DOWN_FUNCTION: REFEREE_COMPONENT,
}
_SENSOR_FUNCTIONS: Final = (layout.SWITCHES_FUNCTION, layout.EYES_FUNCTION, layout.TRAVEL_FUNCTION)
_SINGLES: Final = {frame.identifier >> layout.FUNCTION_SHIFT: frame for frame in layout.single_frames()}


@dataclass(slots=True)
class _Digests:
    """The digests of one moment that have come so far."""

    heard: float
    data: list[bytes] = field(default_factory=list)
    raw: list[bytes] = field(default_factory=list)


class CanCodec:
    """One node of a CAN bus.

    Args:
        system: Own system id: 1 to 127 is the robot of that node, anything greater the host.
        component: Own component id; the referee's makes a robot's node a referee.

    Attributes:
        good: Good messages received.
        signed: Always 0: nothing is signed on CAN.
        rejected: Rejections by reason.
    """

    def __init__(self, *, system: int, component: int) -> None:
        self.system = system
        self.component = component
        self.good = 0
        self.signed = 0
        self.rejected: dict[RejectReason, int] = dict.fromkeys(RejectReason, 0)
        self._is_node = 0 < system <= layout.LAST_NODE
        self.reset()

    def reset(self) -> None:
        """Begin anew on a bus that was opened again: nothing half received, transfers counted from 0. Counters go on."""
        self._transfers: dict[int, int] = {}
        self._partials: dict[int, Partial] = {}
        self._digests: dict[int, _Digests] = {}
        self._next: dict[int, int] = {}
        self._counts: dict[tuple[int, int], int] = {}
        self._sessions: dict[int, int] = {}
        self._sectors: dict[int, int] = {}
        self._times: dict[int, int] = {}
        self._events: list[Received | Rejected] = []
        self._now = 0.0

    # --- out ---------------------------------------------------------------------------------------------------------

    @property
    def pending(self) -> bytes:
        """What has come and is not judged yet: of no interest to anybody, since there are no keys on CAN."""
        return b""

    def encode(self, message: Message) -> bytes:
        """The frames of a message in serial form; see `encode_frames`."""
        return pack_frames(self.encode_frames(message))

    def encode_frames(self, message: Message) -> list[CanFrame]:
        """The frames of a message; a transfer takes the next number.

        Args:
            message: What to say.

        Returns:
            The frames, in the order in which they are to be sent.

        Raises:
            EncodeError: The wire can't carry it: a field does not fit, the system or component addressed has no place on
                the bus, or a robot's message is to be sent by the host, or the other way round. Nothing has changed then.
        """
        kind = type(message)
        found = LONG.get(kind.ID)
        if kind in BYTE_LINKS_ONLY:
            raise EncodeError(f"{kind.NAME} can't be sent over CAN: nothing is signed there")
        if found is None or found.message is not kind:
            raise EncodeError(f"{kind.__name__} is not a message of this protocol")
        full = found.payload.pack(message)
        if found.direction is Direction.UP or (found.direction is Direction.BOTH and self._is_node):
            if not self._is_node:
                raise EncodeError(f"{kind.NAME} can't be sent over CAN by the host, system {self.system}")
            if kind is JuniorSensors:
                return self._sensors(full)
            function = layout.REFEREE_UP_FUNCTION if self.component == REFEREE_COMPONENT else layout.TRANSFER_UP_FUNCTION
            return self._cut(found, full, function << layout.FUNCTION_SHIFT | self.system)
        if self._is_node:
            raise EncodeError(f"{kind.NAME} can't be sent over CAN by a robot, system {self.system}")
        return self._down(message, found, full)

    def _sensors(self, full: bytes) -> list[CanFrame]:
        """JUNIOR_SENSORS as its three digests."""
        (micros,) = _TIME.unpack_from(full, _AT["time"])
        flags, battery = (full[_AT[name] : _AT[name] + 2] for name in ("flags", "battery"))
        time = (micros // 1000 & _MS_MASK).to_bytes(4, "little")
        data = (time + flags + battery, full[_AT["eye"] : _AT["eye"] + 8], full[_AT["travel"] : _AT["travel"] + 8])
        return [
            CanFrame(function << layout.FUNCTION_SHIFT | self.system, piece)
            for function, piece in zip(_SENSOR_FUNCTIONS, data, strict=True)
        ]

    def _down(self, message: Message, found: Long, full: bytes) -> list[CanFrame]:
        """Frames from the host to a robot."""
        node = getattr(message, "target_system", getattr(message, "target", 0)) if found.cut else 0
        component = getattr(message, "target_component", 0) if found.cut else 0
        if node > layout.LAST_NODE:
            raise EncodeError(f"system {node} has no place on a CAN bus: its nodes are 1 to {layout.LAST_NODE}, and 0 for all")
        if component not in {0, ROBOT_COMPONENT, REFEREE_COMPONENT}:
            raise EncodeError(f"component {component} has no place on a CAN bus: there are the robot (1) and the referee (25)")
        referee = component == REFEREE_COMPONENT
        if not referee:
            self._remember(node, message)
            if isinstance(message, JuniorWheels):
                return [CanFrame(layout.WHEELS_FUNCTION << layout.FUNCTION_SHIFT | node, full[_WHEELS])]
            if isinstance(message, SwarmMove) and (plain := frame_of_move(full, self._sectors.get(node, 0))):
                return [CanFrame(layout.MOVE_FUNCTION << layout.FUNCTION_SHIFT | node, plain)]
            if isinstance(message, RobotAlive):
                return [CanFrame(layout.ALIVE_FUNCTION << layout.FUNCTION_SHIFT | node, full[_ALIVE])]
            if isinstance(message, CommandLong) and message.command == Command.FLIGHT_TERMINATION and message.param1 == 1.0:
                return [CanFrame(layout.ESTOP_FUNCTION << layout.FUNCTION_SHIFT | node, _STOP)]
        function = layout.REFEREE_DOWN_FUNCTION if referee else layout.TRANSFER_DOWN_FUNCTION
        return self._cut(found, full, function << layout.FUNCTION_SHIFT | node)

    def _remember(self, node: int, message: Message) -> None:
        """Note what later single frames to this robot leave out."""
        if isinstance(message, RobotSession):
            self._sessions[node] = message.session
            self._sectors.pop(node, None)
        elif isinstance(message, SwarmSense):
            self._sectors[node] = message.sectors

    def _cut(self, found: Long, full: bytes, identifier: int) -> list[CanFrame]:
        """A transfer with the next number."""
        number = self._transfers.get(identifier, 0)
        self._transfers[identifier] = (number + 1) % layout.TRANSFERS
        return found.cut_up(full, identifier, number)

    # --- in ----------------------------------------------------------------------------------------------------------

    def receive(self, data: bytes, now: float) -> list[Received | Rejected]:
        """Take a chunk from the wire.

        Args:
            data: Frames in serial form, 16 bytes each; may be empty.
            now: Stamp of the chunk in s, not before that of the last one.

        Returns:
            What it completed, in the order in which that happened.
        """
        events = self.flush(now)
        self._events = events
        for at in range(0, len(data), RECORD_LENGTH):
            self._take_record(data[at : at + RECORD_LENGTH])
        return events

    def receive_frames(self, frames: Iterable[CanFrame], now: float) -> list[Received | Rejected]:
        """Take frames from the wire; see `receive`."""
        return self.receive(pack_frames(frames), now)

    def flush(self, now: float, *, ended: bool = False) -> list[Received | Rejected]:
        """Give up what has been incomplete for too long. `receive` does it by itself; call this when nothing comes.

        Args:
            now: Time in s.
            ended: Nothing will come any more: give everything up at once.

        Returns:
            Usually nothing; else rejections.
        """
        events: list[Received | Rejected] = []
        self._events = events
        self._now = now
        patience = float("-inf") if ended else PART_TIMEOUT
        while self._partials:  # the first is the one that was heard longest ago
            identifier = next(iter(self._partials))
            if now - self._partials[identifier].heard <= patience:
                break
            self._give_up(identifier)
        while self._digests:
            node = next(iter(self._digests))
            if now - self._digests[node].heard <= patience:
                break
            self._lose_digests(node)
        return events

    def _take_record(self, record: bytes) -> None:
        """Judge one frame in serial form."""
        try:
            frame = CanFrame.unpack(record)
        except ValueError as cause:
            self._reject(RejectReason.BAD_HEADER, record, str(cause), frames=False)
        else:
            self._take(frame, record)

    def _take(self, frame: CanFrame, raw: bytes) -> None:
        """Judge one frame."""
        identifier, data = frame.identifier, frame.data
        function, node = identifier >> layout.FUNCTION_SHIFT, identifier & layout.NODE_MASK
        single = _SINGLES.get(function)
        if frame.extended or (single is None and function not in _TRANSFERS):
            self._reject(RejectReason.UNKNOWN_MESSAGE, raw, f"identifier {identifier:#x}")
        elif function & 1 and not node:
            self._reject(RejectReason.BAD_HEADER, raw, "node 0 sends nothing")
        elif single is None:
            self._part(identifier, data, raw)
        elif len(data) != single.length:
            self._reject(RejectReason.BAD_HEADER, raw, f"{single.name} with length {len(data)}")
        elif function in _SENSOR_FUNCTIONS:
            self._digest(function, node, data, raw)
        elif function == layout.WHEELS_FUNCTION:
            session = self._sessions.get(node, 0).to_bytes(2, "little")
            self._deliver(LONG[JuniorWheels.ID], session + data + bytes((node, ROBOT_COMPONENT)), identifier, 0, raw)
        elif function == layout.MOVE_FUNCTION:
            full = move_of_frame(data, self._sessions.get(node, 0), self._sectors.get(node, 0), node)
            self._deliver(LONG[SwarmMove.ID], full, identifier, 0, raw)
        elif function == layout.ALIVE_FUNCTION:
            self._deliver(LONG[RobotAlive.ID], data + bytes((node, ROBOT_COMPONENT)), identifier, 0, raw)
        elif data == _STOP:
            stop = CommandLong(node, ROBOT_COMPONENT, Command.FLIGHT_TERMINATION, param1=1.0)
            self._accept(stop, identifier, 0, raw)
        else:
            self._reject(RejectReason.BAD_VALUE, raw, f"{single.name} of {data[0]}")

    def _part(self, identifier: int, data: bytes, raw: bytes) -> None:
        """Take a part of a transfer."""
        partial = self._partials.get(identifier)
        if not data:
            self._reject(RejectReason.BAD_HEADER, raw, "a part without a head")
            return
        if partial is not None and raw == partial.raw[-1]:
            self._reject(RejectReason.NOISE, raw, "a part that comes twice")
            return
        if data[0] & layout.PART_MASK == 0:
            if partial is not None:
                self._give_up(identifier)
            partial = Partial.begin(identifier, data, self._now)
            if partial is None:
                self._reject(RejectReason.BAD_HEADER, raw, "a first part of an impossible length")
                return
            self._partials[identifier] = partial
        elif partial is None:
            self._reject(RejectReason.INCOMPLETE, raw, "a part whose first one has not come")
            return
        elif not partial.fits(data):
            partial.raw.append(raw)
            self._give_up(identifier)
            return
        partial.take(data, raw, self._now)
        del self._partials[identifier]
        if partial.complete:
            self._finish(identifier, partial)
        else:
            self._partials[identifier] = partial  # as the last one heard

    def _finish(self, identifier: int, partial: Partial) -> None:
        """All parts of a transfer are there."""
        raw = b"".join(partial.raw)
        known, transfer = partial.known, partial.transfer
        expected = self._next.get(identifier, transfer)
        if known is None or partial.refused is not None:
            if transfer == expected:  # not checked: believe the number when it is the very next one
                self._next[identifier] = (transfer + 1) % layout.TRANSFERS
            reason, detail = partial.refused or (RejectReason.UNKNOWN_MESSAGE, "")
            self._reject(reason, raw, detail)
            return
        full = known.restore(partial.data, self._targets(identifier))
        if full is None:
            self._reject(RejectReason.BAD_CHECKSUM, raw, known.message.NAME)
            return
        gap = (transfer - expected) % layout.TRANSFERS
        if gap == layout.TRANSFERS - 1:  # a bus keeps the order: what is not ahead is the last one again
            gap = -1
        else:
            self._next[identifier] = (transfer + 1) % layout.TRANSFERS
        self._deliver(known, full, identifier, gap, raw)

    def _targets(self, identifier: int) -> bytes:
        """Whom a message is for, as MAVLink would say it: system, component."""
        function = identifier >> layout.FUNCTION_SHIFT
        if not function & 1:
            return bytes((identifier & layout.NODE_MASK, _TRANSFERS[function]))
        return bytes((HOST_SYSTEM, HOST_COMPONENT)) if self._is_node else bytes((self.system, self.component))

    def _digest(self, function: int, node: int, data: bytes, raw: bytes) -> None:
        """Take a digest of the sensors; the third one completes JUNIOR_SENSORS."""
        place = _SENSOR_FUNCTIONS.index(function)
        digests = self._digests.get(node)
        if digests is not None and raw == digests.raw[-1]:
            self._reject(RejectReason.NOISE, raw, "a frame that comes twice")
            return
        if digests is not None and place != len(digests.raw):
            self._lose_digests(node)
            digests = None
        if digests is None:
            if place:
                self._reject(RejectReason.INCOMPLETE, raw, f"{_SINGLES[function].name} by itself")
                return
            digests = self._digests[node] = _Digests(self._now)
        digests.heard = self._now
        digests.data.append(data)
        digests.raw.append(raw)
        del self._digests[node]
        if place < len(_SENSOR_FUNCTIONS) - 1:
            self._digests[node] = digests  # as the last one heard
            return
        switches, eyes, travel = digests.data
        milliseconds, flags, battery = _SWITCHES.unpack(switches)
        full = _TIME.pack(self._time(node, milliseconds) * 1000) + travel + eyes + _REST.pack(battery, flags)
        self._deliver(LONG[JuniorSensors.ID], full, function << layout.FUNCTION_SHIFT | node, 0, b"".join(digests.raw))

    def _time(self, node: int, milliseconds: int) -> int:
        """A robot's time in ms, from its lower 32 bits: what is nearest to its last time, and a time that there can be."""
        last = self._times.get(node, 0)
        time = last & ~_MS_MASK | milliseconds
        if time < last - (_MS_MASK >> 1):
            time += _MS_MASK + 1
        if time > _MS_MASK and (time > last + (_MS_MASK >> 1) + 1 or time > _LAST_MS):
            time -= _MS_MASK + 1
        self._times[node] = time
        return time

    def _deliver(self, known: Long, full: bytes, identifier: int, gap: int, raw: bytes) -> None:
        """Read a payload."""
        try:
            message = known.payload.unpack(full)
        except BadValueError as cause:
            self._reject(RejectReason.BAD_VALUE, raw, str(cause))
            return
        node = identifier & layout.NODE_MASK
        if isinstance(message, RobotStatus):
            self._times[node] = round(message.time * 1000)
        elif isinstance(message, RobotSession | SwarmSense) and message.target_component != REFEREE_COMPONENT:
            self._remember(node, message)
        self._accept(message, identifier, gap, raw)

    def _accept(self, message: Message, identifier: int, gap: int, raw: bytes) -> None:
        """Report a good message, `gap` transfers after the expected one."""
        function, node = identifier >> layout.FUNCTION_SHIFT, identifier & layout.NODE_MASK
        sender = (node, _TRANSFERS.get(function, ROBOT_COMPONENT)) if function & 1 else (HOST_SYSTEM, HOST_COMPONENT)
        count = self._counts.get(sender, 0) + gap
        if gap >= 0:
            self._counts[sender] = count + 1
        self.good += 1
        self._events.append(Received(message, *sender, count & 0xFF, self._now, raw))

    def _give_up(self, identifier: int) -> None:
        """Discard an incomplete transfer."""
        partial = self._partials.pop(identifier)
        name = partial.known.message.NAME if partial.known else "an unknown message"
        self._reject(RejectReason.INCOMPLETE, b"".join(partial.raw), name)

    def _lose_digests(self, node: int) -> None:
        """Discard digests without the others of their moment; they count as a lost message."""
        digests = self._digests.pop(node)
        sender = (node, ROBOT_COMPONENT)
        self._counts[sender] = self._counts.get(sender, 0) + 1
        self._reject(RejectReason.INCOMPLETE, b"".join(digests.raw), JuniorSensors.NAME)

    def _reject(self, reason: RejectReason, raw: bytes, detail: str, *, frames: bool = True) -> None:
        """Report what was not accepted; where it is `frames`, CAN has checked each, and with it who sent it."""
        self.rejected[reason] += 1
        identifier = int.from_bytes(raw[:_IDENTIFIER], "little") if frames else 0
        up = identifier <= _STANDARD and identifier >> layout.FUNCTION_SHIFT & 1
        sender = identifier & layout.NODE_MASK if up else 0
        self._events.append(Rejected(reason, raw, self._now, detail, sender or None))
