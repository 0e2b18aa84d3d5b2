"""A swarm behind bad lines: what each network is sent and sends is lost, damaged or late, in its own time."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from firmware_protocol.errors import LinkClosedError, LinkOpenError
from firmware_protocol.link import Link
from firmware_protocol.links.faulty import FaultyLink
from firmware_protocol.wire.codec import SPLITTERS
from simdevice.emulation import check_periods

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.faults.spec import FaultSpec
    from simdevice.swarm.world import SwarmWorld


class DisturbedSwarm:
    """Steps a swarm whose networks have lines with faults, each way.

    Args:
        world: The swarm.
        spec: What befalls the frames of every line; each line has a chance of its own.
        seed: The same seed does the same to the same frames.

    Attributes:
        period: One control period, in s.
        wire: What goes in and out.
        networks: Number of networks.
    """

    def __init__(self, world: SwarmWorld, spec: FaultSpec, seed: int) -> None:
        self._world = world
        self.period, self.wire, self.networks = world.period, world.wire, world.networks
        self._ends = [_End(world.wire) for _ in range(world.networks)]
        split = SPLITTERS[world.wire]
        self._lines = [
            FaultyLink(end, spec, seed=seed + number, clock=world, split=split) for number, end in enumerate(self._ends)
        ]

    def now(self) -> float:
        """Time of the world, in s."""
        return self._world.now()

    def run_networks(self, inbound: Sequence[bytes], periods: int) -> list[bytes]:
        """Live for at most so many control periods, until something leaves a line; see `SwarmWorld.run_networks`.

        A line that is cut for good is silent from then on.
        """
        check_periods(periods)
        for _ in range(periods):
            for line, data in zip(self._lines, inbound, strict=True):
                _push(line, data)
            said = self._world.run_networks([end.take() for end in self._ends], 1)
            for end, data in zip(self._ends, said, strict=False):
                end.said = data
            out = [self._pull(number) for number in range(self.networks)]
            if any(out):
                return out
            inbound = [b""] * self.networks
        return []

    def _pull(self, number: int) -> bytes:
        """What leaves a line towards its host."""
        line, end, parts = self._lines[number], self._ends[number], []
        try:
            while data := line.read(0.0):
                parts.append(data)
        except LinkClosedError:
            end.said = b""
            with contextlib.suppress(LinkOpenError):
                line.open_again(lambda: end)
        return b"".join(parts)


def _push(line: FaultyLink, data: bytes) -> None:
    """Let bytes enter a line from its host, and what is due leave it towards the robots."""
    with contextlib.suppress(LinkClosedError):
        line.write(data)


class _End(Link):
    """The robots' end of a line.

    Args:
        wire: What the bytes are.

    Attributes:
        said: What the robots have said, until the line takes it.
    """

    lockstep = True
    url = "the line"

    def __init__(self, wire: str) -> None:
        self.wire = wire
        self.said = b""
        self._heard: list[bytes] = []

    def write(self, data: bytes) -> None:
        """Take what has come through the line."""
        self._heard.append(data)

    def take(self) -> bytes:
        """What has come through the line for the robots."""
        data = b"".join(self._heard)
        self._heard.clear()
        return data

    def read(self, timeout: float) -> bytes:  # noqa: ARG002 - nothing is waited for
        """Hand over what the robots have said."""
        data, self.said = self.said, b""
        return data

    def close(self) -> None:
        """Nothing is to be given back."""
