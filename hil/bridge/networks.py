"""Several links served as one: whoever waits for one robot serves all. A robot's address is its network and its id there."""

from __future__ import annotations

import queue
from contextlib import suppress
from math import floor
from typing import TYPE_CHECKING, Final, NamedTuple

from firmware_protocol.errors import LinkError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from firmware_protocol.events import Event
    from hil.bridge.bridge import Bridge


GRID: Final = 0.02
"""In lock-step no network is read beyond the next multiple of this before the others have been, in s."""
_ROUNDING: Final = 1e-6
"""Slack for quotients of sums of control periods."""


class RobotAddress(NamedTuple):
    """Where a robot is: system ids (node ids on CAN) are given anew on every network.

    Attributes:
        network: Name of the network: the address of its link.
        system: System id of the robot there.
    """

    network: str
    system: int

    def __str__(self) -> str:
        return f"robot {self.system} on {self.network}"


class Networks:
    """Links with robots on them, behind one `step`.

    In real time a step ends as soon as anything comes on any of them. In lock-step every network has a clock of its own, and
    the one that is furthest behind is stepped, so that they stay together.

    Attributes:
        bridges: By name of the network.
        failures: Why networks are gone, by name; the others go on.
    """

    def __init__(self) -> None:
        self.bridges: dict[str, Bridge] = {}
        self.failures: dict[str, LinkError] = {}
        self._bell: queue.SimpleQueue[None] = queue.SimpleQueue()
        self._untold: list[tuple[str, Event]] = []

    def wake(self) -> None:
        """Something has come on one of the networks, or is asked for; for pumps, which are other threads, and for signals."""
        if self._bell.empty():
            self._bell.put(None)

    def add(self, name: str, bridge: Bridge) -> None:
        """Add a network.

        Args:
            name: Its name.
            bridge: Speaks with its robots; its `arrived` is our `wake`.

        Raises:
            ValueError: There is one of this name, or some would run in lock-step and others in real time.
        """
        if name in self.bridges:
            raise ValueError(f"{name} is given twice")
        if any(other.link.lockstep != bridge.link.lockstep for other in self.bridges.values()):
            raise ValueError("networks run all in lock-step or all in real time: else the emulated ones would run away")
        self.bridges[name] = bridge

    @property
    def alive(self) -> Mapping[str, Bridge]:
        """Networks that are there."""
        if not self.failures:
            return self.bridges
        return {name: bridge for name, bridge in self.bridges.items() if name not in self.failures}

    def now(self) -> float:
        """Time of the last step, in s; in lock-step that of the network furthest behind."""
        if len(self.bridges) == 1:
            return next(iter(self.bridges.values())).now
        bridges = (self.alive or self.bridges).values()
        if next(iter(bridges)).link.lockstep:
            return min(bridge.now for bridge in bridges)
        return max(bridge.now for bridge in bridges)

    @property
    def together(self) -> bool:
        """All that are there have been read up to the same time; in real time they always are."""
        times = {bridge.now for bridge in self.alive.values() if bridge.link.lockstep}
        return len(times) <= 1

    def step(self, wait: float) -> list[tuple[str, Event]]:
        """Wait for something to come, and serve every network.

        Args:
            wait: Longest wait in s.

        Returns:
            What has happened, with the name of the network.

        Raises:
            LinkError: The last network is gone.
        """
        alive = self.alive
        if not alive:
            raise next(reversed(self.failures.values()))
        if len(alive) > 1:
            if next(iter(alive.values())).link.lockstep:
                behind = min(alive, key=lambda name: (alive[name].now, alive[name].next_due()))
                now = alive[behind].now
                due = min(bridge.next_due() for bridge in alive.values()) - now
                grid = (floor(now / GRID + _ROUNDING) + 1) * GRID - now
                wait = min([wait, grid, *([due] if due > 0 else [])])  # nobody gets ahead of what others have to say
                alive = {behind: alive[behind]}
            else:
                due = min(bridge.next_due() for bridge in alive.values())
                if not any(bridge.pending or bridge.operator.waiting for bridge in alive.values()):
                    with suppress(queue.Empty):
                        self._bell.get(timeout=max(0.0, min(wait, due - self.now())))
                wait = 0.0
                alive = dict(sorted(alive.items(), key=lambda item: not item[1].urgent))
        events, self._untold = self._untold, []
        for name, bridge in alive.items():
            try:
                events += [(name, event) for event in bridge.step(wait)]
            except LinkError as error:
                self.failures[name] = error
            except KeyboardInterrupt:
                self._untold = events
                raise
        if not self.alive:
            raise next(reversed(self.failures.values()))
        return events

    def close(self) -> None:
        """Close every link. Repeating it does nothing."""
        for bridge in self.bridges.values():
            bridge.close()
