"""An emulated robot served in real time, in a thread of the test's own process."""

from __future__ import annotations

import os
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from hil.clock import MonotonicClock
from simdevice.endpoints import open_endpoint
from simdevice.server import Server
from simdevice.world import junior_world

if TYPE_CHECKING:
    from collections.abc import Iterator

    from simdevice.world import World

PATIENCE: Final = 60.0
"""How long the thread may take to end, in s."""
MULTICAST: Final = f"can://udp_multicast/239.74.163.2?port={20000 + os.getpid() % 20000}"
"""A bus of this process alone: another one that runs these tests has another port."""


@contextmanager
def served(link: str, world: World | None = None) -> Iterator[str]:
    """Serve a robot.

    Args:
        link: Where, as `hil emulate --link` takes it.
        world: What; None is a new robot that speaks what the link carries.

    Yields:
        The address at which it answers.
    """
    endpoint, stop = open_endpoint(link), threading.Event()
    server = Server(world or junior_world(wire=endpoint.wire), endpoint, MonotonicClock())
    thread = threading.Thread(target=server.run, args=(stop.is_set,), daemon=True)
    thread.start()
    try:
        yield endpoint.url
    finally:
        stop.set()
        thread.join(PATIENCE)
        assert not thread.is_alive()
        endpoint.close()
