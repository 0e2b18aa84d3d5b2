"""An emulated robot served in real time, in a thread of the test's own process."""

from __future__ import annotations

import os
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from hil.bridge.clock import MonotonicClock
from simdevice.serving.opening import open_endpoint
from simdevice.serving.server import Server
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from simdevice.serving.endpoints import Endpoint
    from simdevice.serving.server import Servable
    from simdevice.sumo.world import World

PATIENCE: Final = 60.0
"""How long the thread may take to end, in s."""
MULTICAST: Final = f"can://udp_multicast/239.74.163.2?port={20000 + os.getpid() % 20000}"
"""A bus of this process alone: another one that runs these tests has another port."""


class Stepped:
    """A world that another thread serves, and that the test can wait for.

    Args:
        world: What is served.
    """

    def __init__(self, world: Servable) -> None:
        self._served = world
        self.period = world.period
        self._stepped = threading.Condition()

    def step(self, inbound: bytes) -> bytes:
        """One control period."""
        out = self._served.step(inbound)
        self.heard(out)
        with self._stepped:
            self._stepped.notify_all()
        return out

    def heard(self, out: bytes) -> None:
        """What the world has said in this period; who wants to look at it overrides this."""

    def until(self, done: Callable[[], bool]) -> None:
        """Wait for something to come true of the world."""
        with self._stepped:
            assert self._stepped.wait_for(done, timeout=PATIENCE)


@contextmanager
def in_thread(world: Servable, endpoint: Endpoint, *, speed: float = 1.0) -> Iterator[None]:
    """Serve a world in a thread, and close its endpoint at the end.

    Args:
        world: What is served.
        endpoint: Where.
        speed: Seconds of emulation per second.
    """
    stop = threading.Event()
    server = Server(world, endpoint, MonotonicClock(), speed=speed)
    thread = threading.Thread(target=server.run, args=(stop.is_set,), daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join(PATIENCE)
        assert not thread.is_alive()
        endpoint.close()


@contextmanager
def served(link: str, world: World | None = None) -> Iterator[str]:
    """Serve a robot.

    Args:
        link: Where, as `hil emulate --link` takes it.
        world: What; None is a new robot that speaks what the link carries.

    Yields:
        The address at which it answers.
    """
    endpoint = open_endpoint(link)
    with in_thread(world or junior_world(WorldSettings(wire=endpoint.wire)), endpoint):
        yield endpoint.url
