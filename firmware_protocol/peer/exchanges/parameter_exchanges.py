"""Questions about parameters: read one, set one, list all. No I/O, no clock."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import ParamRequestList, ParamRequestRead, ParamSet, ParamValue, Reason
from firmware_protocol.peer.exchanges.commands import reason_in_words
from firmware_protocol.peer.exchanges.exchange import Exchange

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.events import Received
    from firmware_protocol.wire.fields import Message

LIST_PAUSE: Final = 0.2
"""The robot has stopped listing its parameters when none has come for this long, in s."""
NO_PARAMETER: Final = 0xFFFF
"""Index in PARAM_VALUE that says there is none of this name."""
_MISSING_AT_ONCE: Final = 8
_READ_TOO: Final = 4
_REFUSALS: Final = 3


class ParameterReadExchange(Exchange[float]):
    """PARAM_REQUEST_READ by name.

    Args:
        system: Robot asked.
        component: Its component.
        parameter: Name.
    """

    def __init__(self, system: int, component: int, parameter: str) -> None:
        question = ParamRequestRead(system, component, parameter)
        super().__init__(f"reading parameter {parameter}", ("parameter", component), component, question)
        self._parameter = parameter

    def answer(self, received: Received) -> bool:
        """Take the value."""
        message = received.message
        if type(message) is not ParamValue or message.param_id != self._parameter:
            return False
        if message.param_index == NO_PARAMETER:
            self.refuse(*reason_in_words(Reason.NOT_FOUND))
        else:
            self.finish(message.param_value)
        return True


class ParameterSetExchange(Exchange[float]):
    """PARAM_SET, answered by the value now in force.

    PARAM_VALUE does not say whom it answers: another value than the one asked for may be the late answer to an earlier
    question, or to another's. It counts as a refusal only where it has come after each of several tries, of which one that
    was obeyed would have been answered by the value asked for. A robot that knows no such parameter does not answer (as
    MAVLink has it): after a few tries it is also asked to read it, which it does answer.

    Args:
        system: Robot asked.
        component: Its component.
        parameter: Name.
        value: New value.
    """

    def __init__(self, system: int, component: int, parameter: str, value: float) -> None:
        self._set = ParamSet(system, component, parameter, value)
        super().__init__(f"setting parameter {parameter} to {value:g}", ("parameter", component), component, self._set)
        self._tries_refused: set[int] = set()

    def messages(self) -> Sequence[Message]:
        """The request, and later a second question."""
        if self.tries < _READ_TOO:
            return [self._set]
        return [self._set, ParamRequestRead(self._set.target_system, self.component, self._set.param_id)]

    def answer(self, received: Received) -> bool:
        """Compare the value in force with the one asked for."""
        message = received.message
        if type(message) is not ParamValue or message.param_id != self._set.param_id:
            return False
        if message.param_index == NO_PARAMETER:
            self.refuse(*reason_in_words(Reason.NOT_FOUND))
            return True
        asked = self._set.param_value
        if abs(message.param_value - asked) <= 1e-6 * max(1.0, abs(asked)):
            self.finish(message.param_value)
            return True
        self._tries_refused.add(self.tries)
        if len(self._tries_refused) >= _REFUSALS:
            self.refuse(f"it keeps {message.param_value:g}")
        return True


class ParameterListExchange(Exchange[dict[str, float]]):
    """PARAM_REQUEST_LIST; what is then missing is asked for one by one.

    Args:
        system: Robot asked.
        component: Its component.
    """

    def __init__(self, system: int, component: int) -> None:
        question = ParamRequestList(system, component)
        super().__init__("listing the parameters", ("parameter", component), component, question)
        self._system = system
        self._found: dict[int, tuple[str, float]] = {}
        self._count: int | None = None

    def messages(self) -> Sequence[Message]:
        """The request for all, or for some that are missing."""
        if self._count is None:
            return [self.question]
        missing = [index for index in range(self._count) if index not in self._found]
        return [ParamRequestRead(self._system, self.component, param_index=index) for index in missing[:_MISSING_AT_ONCE]]

    def answer(self, received: Received) -> bool:
        """Take one parameter."""
        message = received.message
        if type(message) is not ParamValue or not message.param_index < message.param_count:
            return False
        if self._count is None:
            self._count = message.param_count
        if message.param_index < self._count and message.param_index not in self._found:
            self._found[message.param_index] = (message.param_id, message.param_value)
            self.rest(received.time + LIST_PAUSE)
        if len(self._found) == self._count:
            self.finish(dict(self._found[index] for index in range(self._count)))
        return True
