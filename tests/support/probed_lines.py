"""Lines to be probed, in lock-step: devices and drivers on one line, and lines whose rate matters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from firmware_protocol.clock import ManualClock
from firmware_protocol.link import Link
from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM
from firmware_protocol.wire.codec import open_codec

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.wire.fields import Message
    from simdevice.sumo.world import World


class Device(Protocol):
    """Lives one control period at a time."""

    def now(self) -> float:
        """Its time in s."""
        ...

    def step(self, inbound: bytes) -> bytes:
        """Live for one control period."""
        ...


class Driven:
    """A world whose robot another host drives, on the line that is to be probed too.

    Args:
        world: The world.
        driver: What that host says in a control period, given the time in s; its words are heard by everybody on a bus.
        overheard: The listener hears that host as well, as on a CAN bus.
    """

    def __init__(self, world: World, driver: Callable[[float], Sequence[Message]], *, overheard: bool = False) -> None:
        self.world = world
        self.inbound = b""
        self._driver = driver
        self._overheard = overheard
        self._codec = open_codec(world.wire, system=HOST_SYSTEM, component=HOST_COMPONENT)

    def now(self) -> float:
        """Time in s."""
        return self.world.now()

    def step(self, inbound: bytes) -> bytes:
        """Live for one control period."""
        self.inbound += inbound
        said = b"".join(map(self._codec.encode, self._driver(self.now())))
        out = self.world.step(said + inbound)
        return said + out if self._overheard else out


class Shared:
    """Several devices on one byte line.

    Args:
        *devices: The devices.
    """

    def __init__(self, *devices: Device) -> None:
        self._devices = devices

    def now(self) -> float:
        """Time in s."""
        return self._devices[0].now()

    def step(self, inbound: bytes) -> bytes:
        """Live for one control period."""
        return b"".join([device.step(inbound) for device in self._devices])


class Rated(Link):
    """A serial line in lock-step: what comes depends on the rate.

    Args:
        says: What comes in a control period, given time in s and rate in bit/s.
        answers: What comes at once when something is written.
        baud: The rate it is opened with.

    Attributes:
        rates: All the rates it has had.
        written: What was sent.
        closed: It has been closed.
    """

    lockstep = True

    def __init__(
        self, says: Callable[[float, int], bytes], answers: Callable[[bytes], bytes] = lambda _: b"", baud: int = 115200
    ) -> None:
        self.url = f"serial:///dev/test:{baud}"
        self.clock = ManualClock()
        self.rates = [baud]
        self.written = b""
        self.closed = False
        self._says = says
        self._answers = answers
        self._answer = b""

    def set_baud(self, baud: int) -> None:
        """Change the rate."""
        self.rates.append(baud)

    def write(self, data: bytes) -> None:
        """Send."""
        self.written += data
        self._answer += self._answers(data)

    def read(self, timeout: float) -> bytes:
        """Let time pass until something comes."""
        data, self._answer = self._answer, b""
        end = self.clock.now() + timeout
        while not data and self.clock.now() < end:
            self.clock.advance(0.005)
            data = self._says(self.clock.now(), self.rates[-1])
        return data

    def close(self) -> None:
        """Close."""
        self.closed = True
