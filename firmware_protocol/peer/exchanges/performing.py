"""A numbered message that is accepted first, then performed, and whose result is said when it is over."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar, cast

from firmware_protocol.messages import RobotStatus, State
from firmware_protocol.peer.exchanges.commands import NumberedExchange

if TYPE_CHECKING:
    from firmware_protocol.events import Received
    from firmware_protocol.messages import RobotAck
    from firmware_protocol.peer.exchanges.commands import Numbering
    from firmware_protocol.wire.fields import Message

M = TypeVar("M", bound="Message")

MOST_REPETITIONS: Final = 10
"""What was acknowledged again so often, and still no result came, is given up after the usual tries."""
RESULT_MARGIN: Final = 0.3
"""How much later than expected a result may come before it is asked for again, in s."""


class PerformExchange(NumberedExchange[M], Generic[M]):
    """Something that takes time on the robot.

    Once it is accepted the next of its lane may go. If the result does not come in time, the same message is sent again: the
    robot repeats its answer, not the motion.

    Args:
        name: What is asked, in words.
        message: The message.
        numbering: Gives session and sequence.
        result: Class of the result.
        duration: How long it may take, in s.
    """

    def __init__(self, name: str, message: Message, numbering: Numbering, result: type[M], duration: float) -> None:
        super().__init__(name, message, numbering)
        self._result = result
        self._duration = duration
        self._repetitions = 0

    @property
    def waits_for(self) -> str:
        """What has not come."""
        return f"did not answer {self.name}" if self.blocking else f"never sent the result of {self.name}"

    def accepted(self, ack: RobotAck, time: float) -> None:  # noqa: ARG002
        """It has begun: the result comes when it is over."""
        if self.blocking:
            self.blocking = False
            self.rest(time + self._duration + RESULT_MARGIN)
        elif self.tries and self._repetitions < MOST_REPETITIONS:
            # The answer to a repetition: the robot is there, and the result, if there is one, is repeated too.
            self._repetitions += 1
            self.tries = 1

    def ended(self, result: M) -> bool:
        """Look at a message of the result's class with our number.

        Returns:
            True: it was the result.
        """
        self.finish(result)
        return True

    def answer(self, received: Received) -> bool:
        """Take ROBOT_ACK, the result, or a status that says it is over."""
        message = received.message
        if type(message) is self._result:
            result = cast("Any", message)
            return (result.session, result.sequence) == (self.session, self.sequence) and self.ended(result)
        if type(message) is RobotStatus:
            over = message.session == self.session and message.sequence == self.sequence and message.state != State.PERFORMING
            if over and not self.blocking and self.tries == 0:
                self.due = received.time
            return False  # others may want the status, too
        return super().answer(received)
