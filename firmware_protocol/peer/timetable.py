"""When which of the peers of one network has something to send next, so that nobody asks all of them. No I/O, no clock."""

from __future__ import annotations

from heapq import heapify, heappop, heappush
from typing import Final

NOW: Final = float("-inf")
"""Due at once."""
NEVER: Final = float("inf")
"""Not due at all."""
_STALE: Final = 64
"""So many entries more than there are peers may wait in the heap that are not true any more."""


class Timetable:
    """What the peers of one network have told: when they are due, and which of them are to be kept moving.

    A peer tells whenever that changes. Of one that has not been entered, or has left, nothing is taken down.

    Attributes:
        soonest: When the first of them is due, in s.
        kept: System ids of those that are armed, and ours to keep moving.
    """

    def __init__(self) -> None:
        self.soonest = NEVER
        self.kept: set[int] = set()
        self._due: dict[int, float] = {}
        self._ranks: dict[int, int] = {}
        self._entered = 0
        self._heap: list[tuple[float, int]] = []

    def enter(self, system: int) -> None:
        """Have a peer take part.

        Args:
            system: System id of its robot.
        """
        self._due[system] = NEVER
        self._ranks[system] = self._entered
        self._entered += 1

    def leave(self, system: int) -> None:
        """Have one take part no more.

        Args:
            system: System id of its robot.
        """
        self.kept.discard(system)
        self._ranks.pop(system, None)
        if self._due.pop(system, NEVER) == self.soonest:
            self._look()

    def plan(self, system: int, due: float) -> None:
        """Note when a peer is due.

        Args:
            system: System id of its robot.
            due: When, in s.
        """
        before = self._due.get(system)
        if before is None or before == due:
            return
        self._due[system] = due
        if due != NEVER:
            heappush(self._heap, (due, system))
            if due < self.soonest:
                self.soonest = due
                return
        if before == self.soonest:
            self._look()

    def keep(self, system: int, *, moving: bool) -> None:
        """Note whether a robot is to be kept moving.

        Args:
            system: Its system id.
            moving: It is.
        """
        if moving and system in self._due:
            self.kept.add(system)
        else:
            self.kept.discard(system)

    def take(self, now: float) -> list[int]:
        """Those that are due, in the order in which they were entered; each of them has to say anew when it is due next.

        Args:
            now: Time in s.
        """
        taken: list[int] = []
        heap, planned = self._heap, self._due
        while heap and heap[0][0] <= now:
            due, system = heappop(heap)
            if planned.get(system) == due:
                planned[system] = NEVER
                taken.append(system)
        self._look()
        if len(taken) > 1:
            taken.sort(key=self._ranks.__getitem__)
        return taken

    def _look(self) -> None:
        """See who is the first now; entries that are not true any more are dropped."""
        heap, planned = self._heap, self._due
        if len(heap) > 2 * len(planned) + _STALE:
            heap[:] = {(due, system) for due, system in heap if planned.get(system) == due}
            heapify(heap)
        while heap and planned.get(heap[0][1]) != heap[0][0]:
            heappop(heap)
        self.soonest = heap[0][0] if heap else NEVER
