"""Serves an emulated robot in real time: one control period after the other by a clock, bytes through an endpoint.

Clock and waiting are arguments, so that the loop can be tested without any time passing.
"""

from __future__ import annotations

import select
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Final, Protocol

from firmware_protocol.links.memory import Runnable
from simdevice.emulation import Patient

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.clock import Clock
    from simdevice.serving.endpoints import Endpoint

    Wait = Callable[[list[int], float], object]
    """Sleeps until one of these file descriptors is readable, or for this many seconds."""

MAX_CATCH_UP: Final = 4
"""Periods that may be made up for at once; what is further behind is given up and counted as an overrun."""
_PACE: Final = 0.001
"""Shortest wait while bytes are on their way, in s."""


class Servable(Protocol):
    """What can be served.

    Attributes:
        period: One control period, in s.
    """

    period: float

    def step(self, inbound: bytes) -> bytes:
        """Advance by one control period."""
        ...


def wait_readable(files: list[int], timeout: float) -> None:
    """Sleep until one of the files is readable.

    Args:
        files: File descriptors.
        timeout: Longest wait in s.
    """
    select.select(files, [], [], timeout)


class RealTimeServer(ABC):
    """Keeps up with a clock: what is common to servers of one network and of several.

    Args:
        period: One control period of what is served, in s.
        endpoints: Where clients come.
        clock: The time to keep up with.
        wait: How to sleep.
        speed: Seconds of emulation per second of the clock.

    Attributes:
        steps: Control periods done.
        overruns: Times the machine was too slow, so that emulated time fell behind for good.
        late: Control periods given up that way.

    Raises:
        ValueError: The speed is not positive.
    """

    def __init__(
        self,
        period: float,
        endpoints: Sequence[Endpoint],
        clock: Clock,
        *,
        wait: Wait,
        speed: float,
    ) -> None:
        if speed <= 0:
            raise ValueError(f"the speed is a positive factor, not {speed:g}")
        self._endpoints = endpoints
        self._clock = clock
        self._wait = wait
        self._period = period / speed
        self._next = clock.now() + self._period
        self.steps = 0
        self.overruns = 0
        self.late = 0

    def turn(self) -> None:
        """Wait for the next thing to do, and do it: pass bytes on, or a control period or a few."""
        endpoints = self._endpoints
        now = self._clock.now()
        if now < self._next:
            due = min([endpoint.due() for endpoint in endpoints])
            pause = min(self._next - now, max(_PACE, due - now))
            self._wait([file for endpoint in endpoints for file in endpoint.files()], pause)
            now = self._clock.now()
            for endpoint in endpoints:
                endpoint.poll(now)
        if now < self._next:
            for endpoint in endpoints:
                endpoint.send(b"", now)
            return
        behind = int((now - self._next) / self._period)
        if behind > MAX_CATCH_UP:
            self.overruns += 1
            self.late += behind - MAX_CATCH_UP
            self._next += (behind - MAX_CATCH_UP) * self._period
        while self._next <= now:
            lived = self._exchange(now, int((now - self._next) / self._period) + 1)
            self._next += lived * self._period
            self.steps += lived

    def run(self, stopped: Callable[[], bool]) -> None:
        """Serve until told to stop.

        Args:
            stopped: Asked before every turn, at least once a control period; an Event's `is_set` will do.
        """
        while not stopped():
            self.turn()

    @abstractmethod
    def _exchange(self, now: float, periods: int) -> int:
        """Let the world live for at most so many control periods, with what has come, and send what it says.

        Returns:
            How many it were.
        """


class Server(RealTimeServer):
    """Steps a world in real time; see `RealTimeServer`.

    Args:
        world: What is served.
        endpoint: Where its client comes.
        clock: The time to keep up with.
        wait: How to sleep.
        speed: Seconds of emulation per second of the clock.
    """

    def __init__(
        self,
        world: Servable,
        endpoint: Endpoint,
        clock: Clock,
        *,
        wait: Wait = wait_readable,
        speed: float = 1.0,
    ) -> None:
        super().__init__(world.period, [endpoint], clock, wait=wait, speed=speed)
        self._world = world
        self._runnable = world if isinstance(world, Runnable) else None
        self._patient = world if isinstance(world, Patient) else None
        self._endpoint = endpoint

    def _exchange(self, now: float, periods: int) -> int:
        """Let the world live, with what has come."""
        endpoint = self._endpoint
        inbound = endpoint.receive(now)
        if self._patient is not None:
            self._patient.room = endpoint.room()
        sent, lived = self._live(inbound, periods)
        endpoint.send(sent, now)
        return lived

    def _live(self, inbound: bytes, periods: int) -> tuple[bytes, int]:
        """Let the world live for at most so many control periods, until it sends something.

        Returns:
            What it has sent, and how many it were.
        """
        world = self._runnable
        if world is None:
            return self._world.step(inbound), 1
        since = world.now()
        chunks = world.run(inbound, periods)
        return b"".join([data for _, data in chunks]), round((world.now() - since) / world.period)


def serve(world: Servable, endpoint: Endpoint, clock: Clock, stopped: Callable[[], bool]) -> Server:
    """Serve a world in real time until told to stop, then close the endpoint.

    Args:
        world: What is served.
        endpoint: Where its client comes, as from `open_endpoint`; its `url` is what the client opens.
        clock: The machine's monotonic clock.
        stopped: An Event's `is_set`, for instance.

    Returns:
        The server, for its counters.
    """
    server = Server(world, endpoint, clock)
    try:
        server.run(stopped)
    finally:
        endpoint.close()
    return server
