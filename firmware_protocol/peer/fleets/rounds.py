"""What is asked of many robots of one network at once, and repeated until each has answered: arrays, no I/O, no clock.

Who has not answered is asked again when nothing has come in answer from the network for a while: on a line that still carries
answers nobody is asked twice.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import ROBOT_COMPONENT, AckResult, Command, CommandLong
from firmware_protocol.peer.exchanges.exchange import Retry
from firmware_protocol.peer.exchanges.performing import RESULT_MARGIN
from firmware_protocol.peer.timetable import NEVER, NOW
from firmware_protocol.wire.rows import ROWS, Rows, take_rows

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from firmware_protocol.peer.fleets.fleet import Fleet, Said, Which
    from firmware_protocol.wire.batch import Batch
    from firmware_protocol.wire.fields import Message

    Numbers = NDArray[np.int64]

_SYSTEMS: Final = 256
_FRAMING: Final = 12
"""Bytes of a frame that are not its payload."""


class NetworkRound(ABC):
    """One of them. Arrays have a row for each system id.

    Args:
        systems: Who is asked.
        retry: When to ask again.
        wait: What the line needs for one asking beyond that, in s.

    Attributes:
        open: Who has not answered yet.
        tries: How often who has not answered was asked.
        next_due: When `due` must be called next, in s.
        reports: What each has reported.
        reported_at: When, in s; NaN before.
    """

    def __init__(self, systems: Numbers, retry: Retry, wait: float) -> None:
        self.open = np.zeros(_SYSTEMS, bool)
        self.open[systems] = True
        self.tries = np.zeros(_SYSTEMS, np.int64)
        self.next_due = NOW
        self.reported_at = np.full(_SYSTEMS, np.nan)
        self._retry = retry
        self._wait = wait
        self._interval = retry.first

    @property
    def answered(self) -> Which:
        """Who has answered, or reported, shape (256,)."""
        answered: Which = ~np.isnan(self.reported_at)
        return answered

    @abstractmethod
    def due(self, now: float) -> list[Said]:
        """What must be sent now; it counts as sent.

        Args:
            now: Time in s.
        """

    @abstractmethod
    def acknowledged(self, batch: Batch, mine: Which) -> None:
        """Acknowledgements (ROBOT_ACK) have come.

        Args:
            batch: The acknowledgements.
            mine: Which are addressed to us.
        """

    @abstractmethod
    def reported(self, batch: Batch, ends: Which, mine: Which) -> None:
        """Reports have come.

        Args:
            batch: The reports.
            ends: Which say how something ended; the others were asked for.
            mine: Which name the session that is open with the sender.
        """

    def drop(self, which: Which) -> None:
        """Wait for these no longer.

        Args:
            which: Who, shape (256,).
        """
        self.open &= ~which

    def _again(self, waiting: Which, now: float) -> Which:
        """Who of those that are waited for is asked again, and when the next of them is."""
        self._interval = (
            self._retry.first
            if not self.tries[waiting].any()
            else min(self._interval * self._retry.factor, self._retry.longest)
        )
        self.drop(waiting & (self.tries >= self._retry.tries))
        again = waiting & self.open
        self.tries[again] += 1
        self.next_due = now + self._interval + self._wait if again.any() else NEVER
        return again

    def _progress(self, time: float) -> None:
        """Somebody has answered: the others are given time."""
        self.next_due = max(self.next_due, time + self._interval)


class AskingRound(NetworkRound):
    """A message that is asked of robots: of all at once by one request, then of those singly that have not answered.

    Args:
        kind: What is asked for.
        systems: Of whom.
        count: Count of the asking, 1..65535, which the answers name as their sequence.
        host: Number of the host whose session is open with them; 0: somebody who watches.
        retry: When to ask again.
        wait: What the line needs for all answers, in s: of a line whose rate is known.
    """

    def __init__(
        self,
        kind: type[Message],
        systems: Numbers,
        *,
        count: int,
        host: int,
        retry: Retry = Retry(),  # noqa: B008 - frozen
        wait: float = 0.0,
    ) -> None:
        super().__init__(systems, retry, wait)
        self.kind = self.report = kind
        self.count = count
        self.reports = np.zeros(_SYSTEMS, ROWS[kind])
        self._host = host
        self._asked = len(systems) == 1

    def due(self, now: float) -> list[Said]:
        """See `NetworkRound.due`."""
        again = self._again(self.open, now)
        if not self._asked:
            self._asked = True
            return [self._request(0)]
        return [self._request(int(system)) for system in np.flatnonzero(again)]

    def reported(self, batch: Batch, ends: Which, mine: Which) -> None:
        """See `NetworkRound.reported`."""
        if batch.message is not self.kind:
            return
        system, rows, time = batch.system, batch.rows, batch.time
        good = self.open[system] & (rows["sequence"] == self.count) & ~ends
        if self._host:
            good &= mine
        if good.any():
            these = system[good]
            self.reports[these] = rows[good]
            self.reported_at[these] = time[good]
            self.open[these] = False
            self._progress(float(time[good].max()))
            if not self.open.any():
                self.next_due = NEVER

    def acknowledged(self, batch: Batch, mine: Which) -> None:
        """Nothing numbered was asked."""

    def _request(self, system: int) -> CommandLong:
        return CommandLong(
            system,
            ROBOT_COMPONENT,
            Command.REQUEST_MESSAGE,
            param1=float(self.kind.ID),
            param2=float(self.count),
            param3=float(self._host),
        )


class NumberedRound(NetworkRound):
    """A numbered message to each of many robots: acknowledged by each, and where it takes time reported by each at the end.

    The same bytes go again until they are answered; a robot performs them once.

    Args:
        fleet: The robots; gives sessions and sequences.
        kind: Class of the message.
        systems: Whom it goes to.
        rows: What each is told, in the order of `systems`; session and sequence are filled in here.
        result: How each reports in the end; None: the acknowledgement is all.
        longest: How long it may take on each, in s, in that order.
        retry: When to ask again.

    Attributes:
        accepted: Who has accepted it.
        reason: Why who has refused it did (`Reason`); 0: no reason was given, or it has not refused.
        refused: Who has refused it.
    """

    def __init__(
        self,
        fleet: Fleet,
        kind: type[Message],
        systems: Numbers,
        rows: Rows,
        *,
        result: type[Message] | None = None,
        longest: NDArray[np.float64] | None = None,
        retry: Retry = Retry(),  # noqa: B008 - frozen
    ) -> None:
        length = (ROWS[kind].itemsize + _FRAMING) * len(systems)
        super().__init__(systems, retry, length / fleet.capacity if fleet.capacity else 0.0)
        fleet.sequence[systems] = fleet.sequence[systems] + 1 & 0xFFFF
        self.kind = kind
        self.accepted, self.refused = (np.zeros(_SYSTEMS, bool) for _ in range(2))
        self.reason = np.zeros(_SYSTEMS, np.int64)
        self._rows = np.zeros(_SYSTEMS, ROWS[kind])
        rows["session"], rows["sequence"] = fleet.session[systems], fleet.sequence[systems]
        self._rows[systems] = rows
        self.report = result
        self.reports = np.zeros(_SYSTEMS, ROWS[result or kind])
        self._longest = np.zeros(_SYSTEMS)
        if longest is not None:
            self._longest[systems] = longest
        self._expected = np.full(_SYSTEMS, NEVER)
        self._ack_due = NOW

    def due(self, now: float) -> list[Said]:
        """See `NetworkRound.due`."""
        again = np.zeros(_SYSTEMS, bool)
        if now >= self._ack_due:
            again |= self._again(self.open & ~self.accepted, now)
            self._ack_due = self.next_due
        late = self.open & self.accepted & (self._expected <= now)
        if late.any():
            self.drop(late & (self.tries >= self._retry.tries))
            late &= self.open
            self.tries[late] += 1
            self._expected[late] = now + self._retry.longest
            again |= late
        self._plan()
        these = np.flatnonzero(again)
        return [(self.kind, take_rows(self._rows, these))] if these.size else []

    def acknowledged(self, batch: Batch, mine: Which) -> None:
        """See `NetworkRound.acknowledged`."""
        system, rows, time = batch.system, batch.rows, batch.time
        own = self._rows[system]
        good = mine & self.open[system] & (rows["message"] == self.kind.ID)
        good &= (rows["session"] == own["session"]) & (rows["sequence"] == own["sequence"])
        if not good.any():
            return
        these, when = system[good], time[good]
        taken = rows["result"][good] == AckResult.ACCEPTED
        fresh = taken & ~self.accepted[these]
        self.accepted[these[taken]] = True
        self._expected[these[fresh]] = when[fresh] + self._longest[these[fresh]] + RESULT_MARGIN
        self.tries[these[fresh]] = 0
        no = these[~taken]
        self.refused[no] = True
        self.reason[no] = rows["reason"][good][~taken]
        self.open[no] = False
        if self.report is None:
            self.open[these] = False
            self.reported_at[these[taken]] = when[taken]
        self._heard_answer(float(when.max()))

    def reported(self, batch: Batch, ends: Which, mine: Which) -> None:
        """See `NetworkRound.reported`."""
        if batch.message is not self.report:
            return
        system, rows, time = batch.system, batch.rows, batch.time
        good = self.open[system] & (rows["sequence"] == self._rows["sequence"][system]) & ends & mine
        if good.any():
            these = system[good]
            self.reports[these] = rows[good]
            self.reported_at[these] = time[good]
            self.accepted[these] = True
            self.open[these] = False
            self._heard_answer(float(time[good].max()))

    def _heard_answer(self, time: float) -> None:
        self._ack_due = max(self._ack_due, time + self._interval) if (self.open & ~self.accepted).any() else NEVER
        self._plan()

    def _plan(self) -> None:
        expected = self._expected[self.open & self.accepted]
        self.next_due = min(self._ack_due, float(expected.min()) if expected.size else NEVER)
