"""A world behind a bad line: what it is sent and what it sends is lost, damaged or late, in its own time."""

from __future__ import annotations

import contextlib
from math import inf
from typing import TYPE_CHECKING

from firmware_protocol.errors import LinkClosedError, LinkOpenError
from firmware_protocol.links.faulty import FaultyLink
from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.wire.codec import SPLITTERS
from simdevice.emulation import Patient, run_single_periods

if TYPE_CHECKING:
    from firmware_protocol.faults.spec import FaultSpec
    from firmware_protocol.links.faulty import FaultCounts
    from firmware_protocol.links.memory import Stamped
    from simdevice.emulation import Emulation


class DisturbedWorld:
    """Steps a world behind a line with faults, each way.

    Args:
        world: The world.
        spec: What befalls the frames.
        seed: The same seed does the same to the same frames.

    Attributes:
        period: One control period, in s.
        wire: What goes in and out.
    """

    def __init__(self, world: Emulation, spec: FaultSpec, seed: int) -> None:
        self._world = world
        self.period = world.period
        self._slack = self.period / 2  # less than a control period by far more than rounding
        self._patient = world if isinstance(world, Patient) else None
        self.wire = world.wire
        self._dead_from = world.now() + min((cut.at for cut in spec.unplugs if cut.ends == inf), default=inf)
        self._link = FaultyLink(MemoryLink(world, wire=self.wire), spec, seed=seed, clock=world, split=SPLITTERS[self.wire])

    @property
    def room(self) -> int | None:
        """Bytes that the line takes in the next control period; None: any number."""
        return self._patient.room if self._patient is not None else None

    @room.setter
    def room(self, room: int | None) -> None:
        if self._patient is not None:
            self._patient.room = room

    @property
    def down(self) -> FaultCounts:
        """What was done on the way to the robot."""
        return self._link.down

    def now(self) -> float:
        """Time of the world, in s."""
        return self._world.now()

    def run(self, inbound: bytes, periods: int) -> list[Stamped]:
        """Live for at most so many control periods, until something leaves the line; see `Emulation.run`.

        Raises:
            LinkClosedError: As `step`.
        """
        return run_single_periods(self, inbound, periods)

    def step(self, inbound: bytes) -> bytes:
        """One control period.

        Args:
            inbound: Bytes from the host.

        Returns:
            Bytes for the host, as they leave the bad line; none while it is dead and will come back.

        Raises:
            LinkClosedError: The line is dead for good, as the specification asked for.
        """
        end = self._world.now() + self.period
        out = b""
        try:
            if inbound:
                self._link.write(inbound)
            while self._world.now() < end - self._slack:
                out += self._link.read(self._slack)  # the link steps whole periods
        except LinkClosedError:
            if self._world.now() >= self._dead_from:
                raise
            if self._world.now() < end - self._slack:
                self._world.step(b"")
            with contextlib.suppress(LinkOpenError):
                self._link.open_again(lambda: MemoryLink(self._world, wire=self.wire))
        return out
