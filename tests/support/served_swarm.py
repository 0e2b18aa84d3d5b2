"""Emulated micro-robots served in real time, in a thread of the test's own process, which looks at them as they live."""

from __future__ import annotations

import threading
from collections import Counter
from contextlib import ExitStack, closing, contextmanager
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    ARMED_FLAG,
    HOST_COMPONENT,
    HOST_SYSTEM,
    AckResult,
    Heartbeat,
    RobotAck,
    RobotStatus,
    SwarmMove,
)
from firmware_protocol.wire.codec import open_codec
from hil.bridge.clock import MonotonicClock
from simdevice.serving.networks import NetworksServer
from simdevice.serving.opening import open_endpoint
from simdevice.swarm.disturbed import DisturbedSwarm
from simdevice.swarm.world import SwarmWorld

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from firmware_protocol.faults.spec import FaultSpec
    from firmware_protocol.wire.codec import Codec
    from simdevice.swarm.settings import SwarmSettings

    Numbered = tuple[int, int, int, int]
    """Network, system, session and sequence of a numbered message."""

PATIENCE: Final = 60.0
"""How long the thread may take to end, in s."""


class ServedSwarm(SwarmWorld):
    """Robots that another thread lets live.

    Args:
        settings: What they are.

    Attributes:
        urls: Where each network is served.
        heard: Time of the last bytes from any host, in s of the robots' time.
        rolled: The last time at which a wheel was commanded to turn, likewise.
        told: Moves that have reached a robot, and how often.
        accepted: Moves that robots have accepted.
        begun: How many moves each has begun by its own count, as it said last, by network and system.
        armed: Robots that are armed by what they said last, likewise.
        lived: Called in that thread whenever control periods have been lived.
    """

    def __init__(self, settings: SwarmSettings) -> None:
        super().__init__(settings)
        self.urls: list[str] = []
        self.heard = self.rolled = 0.0
        self.lived: Callable[[], None] = lambda: None
        self.told: Counter[Numbered] = Counter()
        self.accepted: set[Numbered] = set()
        self.begun: dict[tuple[int, int], int] = {}
        self.armed: set[tuple[int, int]] = set()
        self._in = [open_codec(self.wire, system=1, component=1) for _ in range(self.networks)]
        self._out = [open_codec(self.wire, system=HOST_SYSTEM, component=HOST_COMPONENT) for _ in range(self.networks)]
        self._turned = threading.Condition()

    def run_networks(self, inbound: Sequence[bytes], periods: int) -> list[bytes]:
        """Live for one control period; see `SwarmWorld.run_networks`."""
        del periods
        self._note(inbound, self._in)
        said = super().run_networks(inbound, 1)
        self._note(said, self._out)
        if any(inbound):
            self.heard = self.now()
        if np.any(self.table.arrays.command):
            self.rolled = self.now()
        self.lived()
        with self._turned:
            self._turned.notify_all()
        return said

    def _note(self, chunks: Sequence[bytes], codecs: Sequence[Codec]) -> None:
        """Take down what is said of moves."""
        for network, (data, codec) in enumerate(zip(chunks, codecs, strict=False), 1):
            for event in codec.receive(data, self.now()) if data else ():
                if not isinstance(event, Received):
                    continue
                match event.message:
                    case SwarmMove() as move:
                        self.told[network, move.target_system, move.session, move.sequence] += 1
                    case RobotAck(message=SwarmMove.ID, result=AckResult.ACCEPTED) as ack:
                        self.accepted.add((network, event.system, ack.session, ack.sequence))
                    case RobotStatus() as status:
                        self.begun[network, event.system] = status.maneuvers
                    case Heartbeat(base_mode=mode) if mode & ARMED_FLAG:
                        self.armed.add((network, event.system))
                    case Heartbeat():
                        self.armed.discard((network, event.system))

    def until(self, done: Callable[[], bool]) -> None:
        """Wait for something to come true of the robots."""
        with self._turned:
            assert self._turned.wait_for(done, timeout=PATIENCE)


@contextmanager
def served_swarm(
    settings: SwarmSettings, *links: str, speed: float = 1.0, faults: FaultSpec | None = None
) -> Iterator[ServedSwarm]:
    """Serve robots.

    Args:
        settings: What they are.
        *links: Where each network is served, as `hil emulate swarm --link` takes it.
        speed: Seconds of emulation per second.
        faults: What befalls the frames of every line.
    """
    swarm = ServedSwarm(settings)
    with ExitStack() as opened:
        endpoints = [opened.enter_context(closing(open_endpoint(link))) for link in links]
        swarm.urls = [endpoint.url for endpoint in endpoints]
        world = swarm if faults is None else DisturbedSwarm(swarm, faults, settings.seed)
        server = NetworksServer(world, endpoints, MonotonicClock(), speed=speed)
        stop = threading.Event()
        thread = threading.Thread(target=server.run, args=(stop.is_set,), daemon=True)
        thread.start()
        try:
            yield swarm
        finally:
            stop.set()
            thread.join(PATIENCE)
            assert not thread.is_alive()
