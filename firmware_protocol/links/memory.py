"""A link to a device in the same process, in lock-step: time passes only while the host reads."""

from __future__ import annotations

from typing import Final, Protocol

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.link import Link
from firmware_protocol.wire.fields import MAVLINK

_EPSILON: Final = 1e-9
"""Slack for sums of control periods, in s."""


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


class MemoryLink(Link):
    """Steps a device while its host waits.

    Args:
        device: What is at the other end.
        url: Name of the link in messages and logs.
        wire: What the device's bytes are.
    """

    lockstep = True

    def __init__(self, device: Steppable, url: str = "memory:", *, wire: str = MAVLINK) -> None:
        self.url = url
        self.wire = wire
        self._device = device
        self._outbound: list[bytes] = []
        self._closed = False

    def write(self, data: bytes) -> None:
        """Queue bytes; the device gets them at its next control period."""
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        self._outbound.append(data)

    def read(self, timeout: float) -> bytes:
        """Step the device until it sends something or the time is over.

        Args:
            timeout: Longest wait in the device's time, in s, rounded up to whole control periods; 0 does not step.
        """
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        if timeout <= 0:
            return b""
        step, now = self._device.step, self._device.now
        deadline = now() + timeout - _EPSILON
        inbound = b"".join(self._outbound)
        self._outbound.clear()
        while not (data := step(inbound)) and now() < deadline:
            inbound = b""
        return data

    def close(self) -> None:
        """Let go of the device."""
        self._closed = True
