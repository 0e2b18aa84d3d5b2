"""The table on the wire: component 25 of a system of its own, with a face on every network.

It is set up anew when asked (TABLE_RESET), puts robots, box and goal where they are wanted (TABLE_PLACE), and says five times a
second what is to be seen of it (TABLE_STATE). Physical robots have no such component.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, Final, Protocol

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    TABLE_COMPONENT,
    AckResult,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    Reason,
    RobotAck,
    RobotSession,
    TablePlace,
    TableReset,
    TableState,
)
from firmware_protocol.roles.swarm_table import table_system
from firmware_protocol.wire.codec import open_codec

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.wire.fields import Message

STATE_INTERVAL: Final = 0.2
"""Between two TABLE_STATE, in s, unless others are asked for."""
HEARTBEAT_INTERVAL: Final = 1.0
"""Between two HEARTBEAT, in s."""
LONGEST: Final = 60.0
"""Greatest interval that can be asked for, in s."""
_ONBOARD_CONTROLLER: Final = 18
_NO_AUTOPILOT: Final = 8
_ACTIVE: Final = 4
"""MAV_TYPE, MAV_AUTOPILOT, MAV_STATE of its HEARTBEAT."""
_REMEMBERED: Final = 1024
"""Answers to numbered messages that are kept, to be given again."""
_HALF: Final = 0x8000
"""Sequence numbers this far ahead or more are taken to be behind (serial number arithmetic, RFC 1982)."""
_ALL: Final = -1
"""What TABLE_RESET sets up, among the things that TABLE_PLACE names."""


class TableControl(Protocol):
    """What is asked of the table from the wire."""

    def set_up(self, network: int, wanted: TableReset) -> Reason:
        """Set it up anew; nothing has changed where it is refused."""
        ...

    def place(self, network: int, wanted: TablePlace) -> Reason:
        """Pick something up and put it there; nothing has changed where it is refused."""
        ...

    def state(self) -> TableState:
        """What is to be seen of it."""
        ...


class TableComponent:
    """The table's face on one network.

    Args:
        control: The table.
        network: Which network it is, from 0.
        wire: What it speaks.
        period: Control period, in s.
    """

    def __init__(self, control: TableControl, network: int, *, wire: str, period: float) -> None:
        self._control = control
        self._network = network
        self._system = table_system(wire)
        self._codec = open_codec(wire, system=self._system, component=TABLE_COMPONENT)
        self._period = period
        self._interval = self._periods(STATE_INTERVAL)
        self._state_due = self._interval
        self._heartbeat_due = 0
        self._answers: OrderedDict[tuple[int, int], Reason] = OrderedDict()
        self._newest: dict[tuple[int, int], int] = {}

    def _periods(self, interval: float) -> int:
        return max(1, round(interval / self._period))

    @property
    def due(self) -> int:
        """The control period at whose end it says something of itself."""
        return min(self._state_due, self._heartbeat_due)

    def changed(self) -> None:
        """Something is to be told at once."""
        self._state_due = 0

    def say(self, ticks: int) -> bytes:
        """What it says of itself.

        Args:
            ticks: Control periods so far, this one among them.

        Returns:
            Bytes for the host; none where nothing is due.
        """
        said: list[Message] = []
        if ticks >= self._heartbeat_due:
            self._heartbeat_due = ticks + self._periods(HEARTBEAT_INTERVAL)
            said.append(Heartbeat(_ONBOARD_CONTROLLER, _NO_AUTOPILOT, 0, 0, _ACTIVE))
        if ticks >= self._state_due:
            self._state_due = ticks + self._interval
            said.append(self._control.state())
        return b"".join(map(self._codec.encode, said))

    def receive(self, data: bytes, now: float) -> bytes:
        """Take frames that are for it.

        Args:
            data: Whole frames.
            now: Time of the emulation, in s.

        Returns:
            Answers.
        """
        answers: list[Message] = []
        for event in self._codec.receive(data, now):
            message = event.message if isinstance(event, Received) else None
            if (
                isinstance(event, Received)
                and isinstance(message, CommandLong | TableReset | TablePlace | RobotSession)
                and message.target_system == self._system
                and message.target_component in {0, TABLE_COMPONENT}
            ):
                answers += self._answer(message, event)
        return b"".join(map(self._codec.encode, answers))

    def _answer(self, message: CommandLong | TableReset | TablePlace | RobotSession, event: Received) -> Sequence[Message]:
        if isinstance(message, CommandLong):
            return self._command(message, event)
        reason = Reason.NONE if isinstance(message, RobotSession) else self._numbered(message)
        result = AckResult.ACCEPTED if reason is Reason.NONE else AckResult.REFUSED
        return [RobotAck(message.ID, message.session, message.sequence, event.system, event.component, result, reason)]

    def _command(self, message: CommandLong, event: Received) -> Sequence[Message]:
        """Answer a standard command: only its own message can be asked for, once or at intervals."""
        result = CommandResult.UNSUPPORTED
        if message.command in {Command.REQUEST_MESSAGE, Command.SET_MESSAGE_INTERVAL}:
            result = CommandResult.ACCEPTED if message.param1 == TableState.ID else CommandResult.DENIED
        if message.command == Command.SET_MESSAGE_INTERVAL and result is CommandResult.ACCEPTED:
            result = self._set_interval(message.param2)
        ack = CommandAck(message.command, result, target_system=event.system, target_component=event.component)
        asked = message.command == Command.REQUEST_MESSAGE and result is CommandResult.ACCEPTED
        return [ack, self._control.state()] if asked else [ack]

    def _set_interval(self, interval: float) -> CommandResult:
        """Tell its state at another interval, in us; 0 is the usual one."""
        if not 0 <= interval <= LONGEST * 1e6:
            return CommandResult.DENIED
        before, self._interval = self._interval, self._periods(interval * 1e-6 if interval else STATE_INTERVAL)
        self._state_due += self._interval - before
        return CommandResult.ACCEPTED

    def _numbered(self, message: TableReset | TablePlace) -> Reason:
        """Do a numbered message, once for each (session, sequence).

        Messages may come in another order than they were sent in: one is too old where a later one of its session has set
        up the same thing, or the whole table.
        """
        identity = (message.session, message.sequence)
        if (known := self._answers.get(identity)) is not None:
            return known
        thing = message.system if isinstance(message, TablePlace) else _ALL
        for other in {_ALL, thing} if thing != _ALL else {_ALL, *(key[1] for key in self._newest)}:
            newest = self._newest.get((message.session, other))
            if newest is not None and (message.sequence - newest) % (2 * _HALF) >= _HALF:
                return Reason.OLD_SEQUENCE
        if isinstance(message, TablePlace):
            reason = self._control.place(self._network, message)
        else:
            reason = self._control.set_up(self._network, message)
        self._answers[identity] = reason
        while len(self._answers) > _REMEMBERED:
            self._answers.popitem(last=False)
        if reason is Reason.NONE:
            self._newest[message.session, thing] = message.sequence
        return reason
