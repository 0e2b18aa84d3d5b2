"""Questions that are repeated until they are answered, and the queue that keeps them in order. No I/O, no clock."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Generic, TypeVar, cast

from firmware_protocol.errors import HilError, PeerError, RefusedError
from firmware_protocol.messages import Reason
from firmware_protocol.peer.timetable import NEVER, NOW
from firmware_protocol.wire.payload import PAYLOADS

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Sequence

    from firmware_protocol.events import Received
    from firmware_protocol.peer.quality import Counters
    from firmware_protocol.wire.fields import Message

T = TypeVar("T")

HOLD: Final = 0.15
"""Longest time a late answer to a repeated command may still be under way, in s."""


@dataclass(frozen=True)
class Retry:
    """When to ask again.

    The defaults suit a line with 20 ms of jitter each way that loses one frame in twenty: nothing is repeated before its
    answer could be there, and ten tries (3 s) are all lost once in 10^10 questions.

    Attributes:
        first: Time to the first repetition, in s.
        factor: Every further wait is this much longer.
        longest: But never longer than this, in s.
        tries: Give up after asking so often.
        hold: Longest time a late answer to a repeated command may still be under way, in s.
    """

    first: float = 0.08
    factor: float = 1.5
    longest: float = 0.4
    tries: int = 10
    hold: float = HOLD


class Ticket(Generic[T]):
    """What has become of something asked of a robot.

    Attributes:
        name: What was asked, in words.
        done: It has ended, well or badly.
        result: The answer; None while there is none.
        error: Why there will be none.
        reason: The robot's reason for refusing.
        asked_at: When it was first said to the robot, in s; None before.
        answered_at: When the answer came, by the stamp of the bytes that brought it, in s; None before, and where none did.
    """

    __slots__ = ("answered_at", "asked_at", "done", "error", "name", "reason", "result")

    def __init__(self, name: str) -> None:
        self.name = name
        self.done = False
        self.result: T | None = None
        self.error: HilError | None = None
        self.reason = Reason.NONE
        self.asked_at: float | None = None
        self.answered_at: float | None = None

    def value(self) -> T:
        """The answer.

        Raises:
            HilError: It was refused, or no answer came, or the robot or its link was lost.
            PeerError: It has not ended yet.
        """
        if self.error is not None:
            raise self.error
        if not self.done or self.result is None:
            raise PeerError(f"there is no answer to {self.name} yet")
        return self.result

    def __repr__(self) -> str:
        state = f"failed: {self.error}" if self.error else f"answered: {self.result}" if self.done else "open"
        return f"<Ticket {self.name}, {state}>"


class Exchange(ABC, Generic[T]):
    """One question, repeated until it is answered.

    Args:
        name: What is asked, in words.
        lane: Exchanges of the same lane go one after the other.
        component: Who answers.
        question: The message to send, as far as it is known now.

    Attributes:
        question: The message to send.
        ticket: What the asker holds.
        blocking: The next of its lane has to wait.
        urgent: It goes before what is due at the same time and is not.
        holds: The answers to two questions could not be told apart: where it was repeated, the next of its lane has to wait
            for `Retry.hold` after the last question, even after the answer.
        beside: What the line needs for what others are asked at the same time, in s: it is repeated so much later.
        due: When to ask (again), in s.
        tries: How often it was asked since the last progress.
        repeated: It was asked more than once.
        sent_first: When it was first asked, in s.
        sent_last: When it was last asked, in s.
    """

    urgent: bool = False
    holds: bool = False
    beside: float = 0.0

    def __init__(self, name: str, lane: Hashable, component: int, question: Message) -> None:
        self.ticket: Ticket[T] = Ticket(name)
        self.question = question
        self.lane = lane
        self.component = component
        self.blocking = True
        self.due = NOW
        self.tries = 0
        self.repeated = False
        self._asked = False
        self.sent_first = 0.0
        self.sent_last = 0.0
        self._interval = 0.0

    @property
    def name(self) -> str:
        """What is asked, in words."""
        return self.ticket.name

    @property
    def waits_for(self) -> str:
        """What has not come when it is given up, in words."""
        return f"did not answer {self.name}"

    def messages(self) -> Sequence[Message]:
        """What to send now."""
        return [self.question]

    @abstractmethod
    def answer(self, received: Received) -> bool:
        """Look at a message from the component asked.

        Returns:
            True when it was meant for this exchange, and so for no other.
        """

    def ask(self, now: float, retry: Retry) -> Sequence[Message]:
        """What to send now, and set the time for the next try.

        Args:
            now: Time in s.
            retry: When to ask again.
        """
        self._interval = retry.first if self.tries == 0 else min(self._interval * retry.factor, retry.longest)
        if self._asked:
            self.repeated = True
        else:
            self._asked = True
            self.sent_first = self.ticket.asked_at = now
        self.tries += 1
        self.sent_last = now
        self.due = now + self._interval + self.beside
        return self.messages()

    def over(self, now: float, retry: Retry) -> bool:  # noqa: ARG002 - `now` is for those that have a deadline
        """It has been asked for long enough, and is given up.

        Args:
            now: Time in s.
            retry: When to ask again.
        """
        return self.tries >= retry.tries

    def rest(self, until: float) -> None:
        """There was progress: ask again only if nothing more comes by then.

        Args:
            until: Time in s.
        """
        self.tries = 0
        self.due = until

    def finish(self, result: T) -> None:
        """It is answered."""
        self.ticket.result = result
        self.ticket.done = True

    def refuse(self, words: str, reason: Reason = Reason.NONE) -> None:
        """The robot refused.

        Args:
            words: Why, in words.
            reason: The robot's own reason.
        """
        self.ticket.reason = reason
        self.fail(RefusedError(self.name, words))

    def fail(self, error: HilError) -> None:
        """There will be no answer."""
        self.ticket.error = error
        self.ticket.done = True


class Exchanges:
    """All open exchanges with one robot.

    Args:
        label: Who is asked, in words.
        counters: Where repetitions and latencies are counted.
        retry: When to ask again.
        planned: Called whenever `next_due` may have changed.

    Attributes:
        next_due: When `due` must be called next, in s.
        shut: Why nothing can be asked now, and every question fails at once; None when it can.
        urgent: Something urgent has not been sent yet.
    """

    def __init__(self, label: str, counters: Counters, retry: Retry, planned: Callable[[], None] = lambda: None) -> None:
        self._label = label
        self._planned = planned
        self._counters = counters
        self._retry = retry
        self._active: list[Exchange[object]] = []
        self._busy: set[Hashable] = set()
        self._waiting: dict[Hashable, deque[Exchange[object]]] = {}
        self._free_from: dict[Hashable, float] = {}
        self.next_due = NEVER
        self.shut: HilError | None = None
        self.urgent = False

    @property
    def active(self) -> bool:
        """Something has been asked and not ended."""
        return bool(self._active)

    def add(self, exchange: Exchange[T]) -> Ticket[T]:
        """Put a question into its lane.

        Args:
            exchange: The question.

        Returns:
            Its ticket.

        Raises:
            EncodeError: The wire cannot carry it: found here, where it is asked, and not when its turn comes.
        """
        PAYLOADS[exchange.question.ID].pack(exchange.question)
        if self.shut is not None:
            exchange.fail(self.shut)
            return exchange.ticket
        lane, asked = exchange.lane, cast("Exchange[object]", exchange)
        if lane in self._busy or lane in self._waiting or lane in self._free_from:
            self._waiting.setdefault(lane, deque()).append(asked)
            self._sweep()
        else:
            self._active.append(asked)
            self._busy.add(lane)
            self.next_due = NOW
            if asked.urgent:
                self._put_first()
            self._planned()
        return exchange.ticket

    def _put_first(self) -> None:
        """Have urgent questions come before the others."""
        self._active.sort(key=lambda exchange: not exchange.urgent)
        self.urgent = True

    def drop(self, kind: type[Exchange[T]], component: int, error: HilError) -> None:
        """End every exchange of this kind with this component.

        Args:
            kind: Class of the exchanges.
            component: Who was asked.
            error: Why.
        """
        for exchange in self._all():
            if isinstance(exchange, kind) and exchange.component == component:
                exchange.fail(error)
        self._sweep()

    def due(self, now: float) -> list[Message]:
        """What must be sent now.

        Args:
            now: Time in s.

        Returns:
            Messages in order.
        """
        out: list[Message] = []
        if now < self.next_due:
            return out
        if self._waiting or self._free_from:
            self._promote(now)
        soonest, ended = NEVER, bool(self._waiting)
        for exchange in self._active:
            if exchange.due <= now:
                if exchange.over(now, self._retry):
                    waited = now - exchange.sent_first
                    exchange.fail(PeerError(f"{self._label} {exchange.waits_for} ({exchange.tries} tries, {waited:.1f} s)"))
                    ended = True
                    continue
                out += exchange.ask(now, self._retry)
                self._counters.retries += exchange.repeated
            soonest = min(soonest, exchange.due)
        self.next_due = soonest
        self.urgent = False
        if ended:
            self._sweep()
        return out

    def answer(self, received: Received) -> bool:
        """Show a message to those who may be waiting for it.

        Args:
            received: A good message from the robot.

        Returns:
            True when one was.
        """
        component = received.component
        for exchange in self._active:
            if exchange.component == component:
                blocking = exchange.blocking
                if exchange.answer(received):
                    ended = exchange.ticket.done or not exchange.blocking
                    if exchange.ticket.done:
                        exchange.ticket.answered_at = received.time
                    if blocking and ended and not exchange.repeated:
                        self._counters.answered(received.time - exchange.sent_first)
                    if ended:
                        self._sweep()
                    elif exchange.due < self.next_due:
                        self._hasten(exchange.due)
                    return True
                if exchange.ticket.done:  # by what it leaves to others, too
                    exchange.ticket.answered_at = received.time
                    self._sweep()
                elif exchange.due < self.next_due:  # it may have learnt something all the same
                    self._hasten(exchange.due)
        return False

    def _hasten(self, due: float) -> None:
        """Something is due sooner than all else."""
        self.next_due = due
        self._planned()

    def fail_all(self, error: HilError) -> None:
        """End everything: the robot is gone, or has forgotten.

        Args:
            error: Why.
        """
        for exchange in self._all():
            exchange.fail(error)
        self._sweep()

    def _all(self) -> list[Exchange[object]]:
        """Everything open."""
        return [*self._active, *(exchange for queue in self._waiting.values() for exchange in queue)]

    def _sweep(self) -> None:
        """Forget what has ended, and look when something is due next."""
        for exchange in self._active:
            if exchange.holds and exchange.ticket.done and exchange.repeated:
                self._free_from[exchange.lane] = exchange.sent_last + self._retry.hold
        self._active = [exchange for exchange in self._active if not exchange.ticket.done]
        self._busy = {exchange.lane for exchange in self._active if exchange.blocking}
        self.urgent = self.urgent and any(exchange.urgent and exchange.due == NOW for exchange in self._active)
        soonest = min((exchange.due for exchange in self._active), default=NEVER)
        for lane, queue in list(self._waiting.items()):
            while queue and queue[0].ticket.done:
                queue.popleft()
            if not queue:
                del self._waiting[lane]
            elif lane not in self._busy:
                soonest = min(soonest, self._free_from.get(lane, NOW))
        self.next_due = soonest
        self._planned()

    def _promote(self, now: float) -> None:
        """Let the first of every free lane begin."""
        self._free_from = {lane: time for lane, time in self._free_from.items() if time > now}
        for lane, queue in self._waiting.items():
            if queue and lane not in self._busy and lane not in self._free_from:
                self._active.append(queue.popleft())
                self._busy.add(lane)
                if self._active[-1].urgent:
                    self._put_first()
