"""A link to a device in the same process, in lock-step: time passes only while the host reads."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, Final, Protocol, runtime_checkable

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.link import Link
from firmware_protocol.wire.fields import MAVLINK

if TYPE_CHECKING:
    from collections.abc import Sequence

Stamped = tuple[float, bytes]
"""What a device has sent, and when, in s of its time."""
_EPSILON: Final = 1e-9
"""Slack for sums of control periods, in s."""
_ROUNDING: Final = 1e-6
"""Slack for quotients of them."""
_MOST: Final = 1e6
"""Control periods asked for at a time."""


class Steppable(Protocol):
    """A device, or a world of them, that lives one control period at a time."""

    def now(self) -> float:
        """Its time in s."""
        ...

    def step(self, inbound: bytes) -> bytes:
        """Live for one control period.

        Args:
            inbound: What the host has sent since the last one.

        Returns:
            What is sent to the host.
        """
        ...


@runtime_checkable
class Runnable(Steppable, Protocol):
    """One that can live for many control periods at a time.

    Attributes:
        period: One control period, in s.
    """

    period: float

    def run(self, inbound: bytes, periods: int) -> list[Stamped]:
        """Live for at most so many control periods, and return early when something is sent or is to be looked at.

        Args:
            inbound: What the host has sent since the last one; received in the first of them.
            periods: How many, 1 or more.

        Returns:
            What is sent to the host, and when.
        """
        ...


class Networked(Protocol):
    """What lives on one clock with several networks.

    Attributes:
        period: One control period, in s.
        networks: How many networks it has.
    """

    period: float
    networks: int

    def now(self) -> float:
        """Its time in s."""
        ...

    def run_networks(self, inbound: Sequence[bytes], periods: int) -> list[bytes]:
        """Live for at most so many control periods, and return early when something is sent or is to be looked at.

        Args:
            inbound: What the host has sent since the last one, by network; received in the first of them.
            periods: How many, 1 or more.

        Returns:
            What has been sent in the last of them, by network; nothing where nobody has sent anything.
        """
        ...


class NetworkClock:
    """The time up to which one of several links to an emulation has been read; it is a `Clock`.

    Args:
        period: One control period, in s.

    Attributes:
        ticks: Likewise, in control periods.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self.ticks = 0

    def now(self) -> float:
        """Time in s."""
        return self.ticks * self._period


class SharedTime:
    """The time that several links to one emulation share: it passes while the host reads that one which is furthest behind.

    Args:
        device: What is at the other ends; its time is 0.
        prompt: A read is over as soon as something has come on any network, and a network that is behind comes up to the
            others before time passes again, so that nobody's answer is late because another network is being read. Without, a
            host that reads many networks takes fewer steps.

    Attributes:
        clocks: How far each network has been read.
    """

    def __init__(self, device: Networked, *, prompt: bool = False) -> None:
        self._device = device
        self._prompt = prompt
        self.clocks = [NetworkClock(device.period) for _ in range(device.networks)]
        self._ticks = 0
        self._outbound: list[list[bytes]] = [[] for _ in range(device.networks)]
        self._inbound: list[deque[tuple[int, bytes]]] = [deque() for _ in range(device.networks)]

    def send(self, network: int, data: bytes) -> None:
        """Queue bytes: they arrive in the next control period."""
        self._outbound[network].append(data)

    def read(self, network: int, timeout: float) -> bytes:
        """What has come on a network first, up to a time; time passes only where nobody has let it pass yet.

        Args:
            network: Which network, from 0.
            timeout: Longest wait by the network's clock, in s, rounded up to whole control periods.
        """
        clock, queue = self.clocks[network], self._inbound[network]
        until = clock.ticks + max(1, math.ceil(min((timeout - _EPSILON) / self._device.period, _MOST) - _ROUNDING))
        while not queue and self._ticks < until:
            if self._prompt and clock.ticks < self._ticks:
                until = self._ticks
            else:
                self._run(until - self._ticks)
        if queue and queue[0][0] <= until:
            clock.ticks, data = queue.popleft()
            return data
        clock.ticks = until
        return b""

    def _run(self, periods: int) -> None:
        """Live for at most so many control periods, until somebody sends something."""
        device = self._device
        outbound = [b"".join(chunks) for chunks in self._outbound]
        self._outbound = [[] for _ in outbound]
        said = device.run_networks(outbound, periods)
        self._ticks = round(device.now() / device.period)
        for queue, data in zip(self._inbound, said, strict=False):
            if data:
                queue.append((self._ticks, data))


class SharedLink(Link):
    """A link to one network of several that live on one clock.

    Each link is read by its own clock (`SharedTime.clocks`). Whoever reads several lets none get ahead by more than what may
    pass before the others are heard: `hil.bridge.networks.Networks` does.

    Args:
        time: The time that it shares with the others.
        network: Which network, from 0.
        url: Name of the link in messages and logs.
        wire: What the bytes are.
    """

    lockstep = True

    def __init__(self, time: SharedTime, network: int, url: str, *, wire: str = MAVLINK) -> None:
        self.url = url
        self.wire = wire
        self._time = time
        self._network = network
        self._closed = False

    def write(self, data: bytes) -> None:
        """Queue bytes; they arrive in the next control period."""
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        self._time.send(self._network, data)

    def read(self, timeout: float) -> bytes:
        """Let time pass until something has come, or the time is over.

        Args:
            timeout: Longest wait in s, rounded up to whole control periods; 0 does not step.
        """
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        return self._time.read(self._network, timeout) if timeout > 0 else b""

    def close(self) -> None:
        """Let go of the device."""
        self._closed = True


class MemoryLink(Link):
    """Steps a device while its host waits.

    Args:
        device: What is at the other end; where it is `Runnable`, it lives for as many control periods at a time as nobody
            has to look at.
        url: Name of the link in messages and logs.
        wire: What the device's bytes are.
    """

    lockstep = True

    def __init__(self, device: Steppable, url: str = "memory:", *, wire: str = MAVLINK) -> None:
        self.url = url
        self.wire = wire
        self._device = device
        self._runnable = device if isinstance(device, Runnable) else None
        self._outbound: list[bytes] = []
        self._closed = False

    def write(self, data: bytes) -> None:
        """Queue bytes; the device gets them at its next control period."""
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        self._outbound.append(data)

    def read(self, timeout: float) -> bytes:
        """Let the device live until it sends something or the time is over.

        Args:
            timeout: Longest wait in the device's time, in s, rounded up to whole control periods; 0 does not step.
        """
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        if timeout <= 0:
            return b""
        device, now = self._runnable, self._device.now
        timeout -= _EPSILON
        deadline = now() + timeout
        inbound = b"".join(self._outbound)
        self._outbound.clear()
        if device is None:
            while not (data := self._device.step(inbound)) and now() < deadline:
                inbound = b""
            return data
        while True:
            chunks = device.run(inbound, max(1, math.ceil(min(timeout / device.period, _MOST) - _ROUNDING)))
            if chunks:
                return chunks[0][1] if len(chunks) == 1 else b"".join([data for _, data in chunks])
            timeout = deadline - now()
            if timeout <= 0:
                return b""
            inbound = b""

    def close(self) -> None:
        """Let go of the device."""
        self._closed = True
