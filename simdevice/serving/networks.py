"""Serves what has several networks in real time: one clock, and an endpoint for each network."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simdevice.serving.endpoints import Endpoint
from simdevice.serving.server import Server, wait_readable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.clock import Clock
    from firmware_protocol.links.memory import Networked
    from simdevice.serving.server import Wait


class NetworksServer(Server):
    """Steps a world with several networks in real time; see `Server`.

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
        super().__init__(_Stepped(world), _All(endpoints), clock, wait=wait, speed=speed)
        self._networked = world
        self._endpoints = endpoints
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


class _Stepped:
    """The part of a world that the server reads its period from."""

    def __init__(self, world: Networked) -> None:
        self.period = world.period

    def step(self, inbound: bytes) -> bytes:
        """Networks live together."""
        raise NotImplementedError


class _All(Endpoint):
    """All endpoints, as far as waiting for them goes."""

    url = ""

    def __init__(self, endpoints: Sequence[Endpoint]) -> None:
        self._endpoints = endpoints

    def files(self) -> list[int]:
        """Of all."""
        return [file for endpoint in self._endpoints for file in endpoint.files()]

    def poll(self, now: float) -> None:
        """Take in what has come at any."""
        for endpoint in self._endpoints:
            endpoint.poll(now)

    def receive(self, now: float) -> bytes:
        """Networks are received from one by one."""
        raise NotImplementedError

    def send(self, data: bytes, now: float) -> None:
        """Go on with what waits."""
        for endpoint in self._endpoints:
            endpoint.send(data, now)

    def due(self) -> float:
        """When any of them has something to go on with."""
        return min(endpoint.due() for endpoint in self._endpoints)

    def close(self) -> None:
        """Close all."""
        for endpoint in self._endpoints:
            endpoint.close()
