"""Serves what has several networks in real time: one clock, and an endpoint for each network."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simdevice.serving.server import RealTimeServer, wait_readable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.clock import Clock
    from firmware_protocol.links.memory import Networked
    from simdevice.serving.endpoints import Endpoint
    from simdevice.serving.server import Wait


class NetworksServer(RealTimeServer):
    """Steps a world with several networks in real time; see `RealTimeServer`.

    Args:
        world: What is served.
        endpoints: Where the clients come, by network.
        clock: The time to keep up with.
        wait: How to sleep.
        speed: Seconds of emulation per second of the clock.
        lived: Called whenever control periods have been lived.

    Raises:
        ValueError: The speed is not positive, or there is not one endpoint for each network.
    """

    def __init__(
        self,
        world: Networked,
        endpoints: Sequence[Endpoint],
        clock: Clock,
        *,
        wait: Wait = wait_readable,
        speed: float = 1.0,
        lived: Callable[[], None] = lambda: None,
    ) -> None:
        if len(endpoints) != world.networks:
            raise ValueError(f"{world.networks} networks are served at so many endpoints, not at {len(endpoints)}")
        super().__init__(world.period, endpoints, clock, wait=wait, speed=speed)
        self._networked = world
        self._lived = lived

    def _exchange(self, now: float, periods: int) -> int:
        """Let all networks live, with what has come on each."""
        world = self._networked
        since = world.now()
        said = world.run_networks([endpoint.receive(now) for endpoint in self._endpoints], periods)
        for endpoint, data in zip(self._endpoints, said or [b""] * len(self._endpoints), strict=True):
            endpoint.send(data, now)
        self._lived()
        return round((world.now() - since) / world.period)
