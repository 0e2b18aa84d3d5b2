"""Ten robots: what the loss and return of one means to the other nine, on one TCP link and on ten.

The robots are emulated in a process of their own, at the pace of real time. All ten are armed and drive. One is unplugged (on
one link: taken off the line; on ten: its connection is cut and its port closed) and plugged in again, or it loses its power
and gets it back. A round trip is a request and its answer (ROBOT_STATUS) through the whole stack; the other nine take
turns, one question at a time. An emulated robot answers at its next control period: 2.5 ms of a round trip on average, and
5 ms at most, are that.

Run: `python benchmarks/fleet.py`.
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import os
import select
import sys
from dataclasses import dataclass, field
from statistics import median
from time import monotonic
from typing import TYPE_CHECKING

import hil
from firmware_protocol.events import PeerBack, PeerLost
from firmware_protocol.messages import RobotStatus
from firmware_protocol.roles.junior import drive
from hil.bridge.clock import MonotonicClock
from hil.statistics import quantile
from simdevice.serving.endpoints import Endpoint, TcpEndpoint
from simdevice.serving.server import Server
from simdevice.sumo.crowd import Crowd
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from firmware_protocol.events import Event
    from hil import RobotAddress
    from hil.sumo.junior import Junior
    from hil.sumo.robots import Robots

COUNT = 10
LOST = 4
EFFORT = 0.15
"""Of both wheels, one forward, one back: the robots turn on the spot."""
AGAIN = 1.0
"""Time between drive commands to a robot, in s; each lasts five times as long, so that it is the watchdog that stops it."""
BEFORE, DURING, AFTER = 3.0, 5.0, 3.0
"""How long round trips are measured, in s."""
CASES = (("unplug", "plug"), ("switch_off", "switch_on"))


class Nobody(Endpoint):
    """A port that nobody can open."""

    url = ""

    def files(self) -> list[int]:
        """None."""
        return []

    def poll(self, now: float) -> None:
        """Nothing comes."""

    def receive(self, now: float) -> bytes:  # noqa: ARG002 - nothing ever comes
        """Nothing."""
        return b""

    def send(self, data: bytes, now: float) -> None:
        """Nobody hears it."""

    def close(self) -> None:
        """There is nothing to give back."""


class Emulation:
    """Ten robots on one port, or each on its own, told what to do through a pipe; reports when the lost one's wheels change."""

    def __init__(self, pipe: Connection, links: int) -> None:
        self._pipe = pipe
        self._links = links
        self._crowds = [Crowd(COUNT)] if links == 1 else [Crowd(1, WorldSettings(seed=number + 1)) for number in range(links)]
        self._servers: list[Server] = []
        self._endpoints: list[Endpoint] = []
        for crowd in self._crowds:
            self._endpoints.append(TcpEndpoint(port=0))
            self._servers.append(self._server(crowd, self._endpoints[-1]))
        self._ports = [int(endpoint.url.rpartition(":")[2]) for endpoint in self._endpoints]
        self._which, self._id = (0, LOST) if links == 1 else (LOST - 1, 1)

    def _server(self, crowd: Crowd, endpoint: Endpoint) -> Server:
        return Server(crowd, endpoint, MonotonicClock(), wait=lambda _files, _time: None)

    def serve(self) -> None:
        """Serve until the other end of the pipe is gone."""
        self._pipe.send([endpoint.url for endpoint in self._endpoints])
        device = self._crowds[self._which].members[self._id].world.device
        turned = False
        with contextlib.suppress(EOFError):
            while True:
                files = [file for endpoint in self._endpoints for file in endpoint.files()]
                ready, _, _ = select.select([*files, self._pipe.fileno()], [], [], 0.001)
                for server in self._servers:
                    server.turn()
                turns = device.wheels != (0.0, 0.0)
                if turns != turned:
                    self._pipe.send(("turns" if turns else "neutral", monotonic()))
                turned = turns
                if self._pipe.fileno() in ready:
                    self._do(self._pipe.recv())

    def _do(self, what: str) -> None:
        crowd, which = self._crowds[self._which], self._which
        if self._links == 1 or what.startswith("switch"):
            getattr(crowd, what)(self._id)
        else:
            self._endpoints[which].close()
            self._endpoints[which] = Nobody() if what == "unplug" else TcpEndpoint(port=self._ports[which])
            self._servers[which] = self._server(crowd, self._endpoints[which])
        self._pipe.send((what, monotonic()))


def emulate(pipe: Connection, links: int) -> None:
    """What the other process does."""
    Emulation(pipe, links).serve()


@dataclass
class Figures:
    """What was measured of one case, times in s."""

    trips: dict[str, list[float]] = field(default_factory=lambda: {"before": [], "during": [], "after": []})
    neutral: list[float] = field(default_factory=list)
    told: list[float] = field(default_factory=list)
    back: list[float] = field(default_factory=list)
    working: list[float] = field(default_factory=list)


class Bench:
    """The host's side of one set of links."""

    def __init__(self, robots: Robots, pipe: Connection, lost: RobotAddress) -> None:
        self._robots = robots
        self._pipe = pipe
        members = [junior for _, junior in sorted(robots.members.items())]
        self._lost: Junior = robots[lost]
        self._nine = [junior for junior in members if junior is not self._lost]
        self._drive_at = dict.fromkeys((junior.address for junior in members), 0.0)
        self._events: list[tuple[float, Event]] = []
        self._stamps: dict[str, float] = {}
        robots.listen(self._hear)

    def _hear(self, network: str, event: Event) -> None:
        if isinstance(event, PeerLost | PeerBack) and (network, event.system) == self._lost.address:
            self._events.append((monotonic(), event))

    def _keep_driving(self) -> None:
        now = monotonic()
        for junior in self._robots:
            if junior.armed and now >= self._drive_at[junior.address]:
                self._drive_at[junior.address] = now + AGAIN
                drive(junior.peer, EFFORT, -EFFORT, 5 * AGAIN)

    def _step(self) -> None:
        self._keep_driving()
        self._robots.step(0.05)
        while self._pipe.poll():
            kind, when = self._pipe.recv()
            self._stamps[kind] = when

    def measure(self, trips: list[float], seconds: float) -> None:
        """Ask the nine in turn for so long."""
        end, turn = monotonic() + seconds, 0
        while monotonic() < end:
            junior = self._nine[turn % len(self._nine)]
            turn += 1
            began = monotonic()
            ticket = junior.peer.request(RobotStatus)
            while not ticket.done:
                self._step()
            ticket.value()
            trips.append(monotonic() - began)

    def _until(self, kind: str, after: float) -> float:
        end = monotonic() + 20
        while self._stamps.get(kind, 0.0) < after:
            if monotonic() > end:
                raise TimeoutError(f"{kind} did not come within 20 s")
            self._step()
        return self._stamps[kind]

    def _event(self, kind: type[PeerLost | PeerBack], trips: list[float]) -> float:
        """When such an event of the lost robot came; the nine are asked meanwhile."""
        end = monotonic() + 20
        while not (times := [time for time, event in self._events if isinstance(event, kind)]):
            if monotonic() > end:
                raise TimeoutError(f"{kind.__name__} did not come within 20 s")
            self.measure(trips, 0.0001)
        return times[0]

    def round(self, off: str, on: str, figures: Figures) -> None:
        """Lose one robot and have it back."""
        self.measure(figures.trips["before"], BEFORE)
        self._events.clear()
        self._pipe.send(off)
        gone = self._until(off, monotonic() - 1)
        figures.neutral.append(self._until("neutral", gone) - gone)
        figures.told.append(self._event(PeerLost, figures.trips["during"]) - gone)
        self.measure(figures.trips["during"], DURING)
        self._events.clear()
        self._pipe.send(on)
        there = self._until(on, gone)
        figures.back.append(self._event(PeerBack, figures.trips["after"]) - there)
        self._lost.arm()
        self._drive_at[self._lost.address] = 0.0
        figures.working.append(self._until("turns", there) - there)
        self.measure(figures.trips["after"], AFTER)


def run(links: int, rounds: int) -> None:
    """Measure one set of links, and print."""
    ours, theirs = multiprocessing.Pipe()
    process = multiprocessing.Process(target=emulate, args=(theirs, links), daemon=True)
    process.start()
    theirs.close()
    try:
        urls = ours.recv()
        limits = hil.Limits(duration=5 * AGAIN)
        with hil.connect_all(*urls, expect=COUNT, timeout=20.0, limits=limits, reconnect=60.0) as robots:
            if errors := robots.arm().errors:
                raise RuntimeError(str(errors))
            lost = hil.RobotAddress(urls[0], LOST) if links == 1 else hil.RobotAddress(urls[LOST - 1], 1)
            bench = Bench(robots, ours, lost)
            for off, on in CASES:
                figures = Figures()
                for _ in range(rounds):
                    bench.round(off, on, figures)
                report(links, off, figures)
    finally:
        process.terminate()
        process.join()


def report(links: int, off: str, figures: Figures) -> None:
    """Print what was measured."""
    name = f"{links} link{'s' if links > 1 else ''}, {off.replace('_', ' ')}"
    for phase, trips in figures.trips.items():
        middle, worst = (quantile(trips, share) * 1e3 for share in (0.5, 0.99))
        print(f"{name:24}{phase:10}{len(trips):8}{middle:12.2f}{worst:10.2f}{max(trips) * 1e3:10.2f}")
    times = {"neutral": figures.neutral, "host told": figures.told, "back": figures.back, "drives again": figures.working}
    print(f"{name:24}" + ", ".join(f"{what} after {median(values):.3f} s" for what, values in times.items()), flush=True)


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--rounds", type=int, default=3, help="losses of each kind")
    rounds = parser.parse_args().rounds
    print(f"{COUNT} robots, one lost {rounds} times in each way, {os.cpu_count()} cores, Python {sys.version.split()[0]}")
    print(f"{'':24}{'the nine':10}{'trips':>8}{'median ms':>12}{'p99 ms':>10}{'max ms':>10}")
    for links in (1, COUNT):
        run(links, rounds)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
