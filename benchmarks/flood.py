"""An emergency stop while the link is flooded: when it is on the wire, when it is acknowledged, and what the flood costs.

An emulated robot is served over TCP, at the pace of real time, by a process of its own, which floods the same connection
between the robot's frames: with noise, or with heartbeats of 254 other systems. The host connects and arms before the flood
begins. Then it is either busy with the user's own code for ten seconds, so that nobody takes what comes, or it steps. Then
the emergency stop is called. *On the wire* is when the robot's process has its frame in hand; both processes read one
monotonic clock. What the connection does not take of a flood is not sent: the last column says what came through.

Every case has a host of its own, so that its peak of memory is its own; a case that makes no progress is ended after a minute.
The flood ends by itself after so many seconds or bytes.

Run: `python benchmarks/flood.py`.
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import os
import random
import resource
import select
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from time import monotonic
from typing import TYPE_CHECKING, Final

import hil
from firmware_protocol.events import Received
from firmware_protocol.messages import Command, CommandLong, Heartbeat, RobotStatus
from firmware_protocol.wire.mavlink import MavlinkCodec
from hil.bridge.clock import MonotonicClock
from hil.recording.recorder import Recorder
from simdevice.serving.endpoints import TcpEndpoint
from simdevice.serving.server import Server
from simdevice.sumo.junior_world import junior_world

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection

    from hil.sumo.junior import Junior

ROBOT: Final = 1
BUSY: Final = 10.0
"""Of the user's own code, or of stepping under the flood, before each stop, in s."""
MOST_SECONDS, MOST_BYTES = 90.0, 2_000_000_000
"""A flood ends after so long, or so much."""
PATIENCE: Final = 60.0
"""A case that has not come to its next stop by then makes no progress, in s."""
ON_THE_WIRE: Final = 0.050
"""The latest that an emergency stop may be on the wire after the call, in s."""
MEMORY: Final = 32.0
"""The most that a flood may cost, in MiB."""
_PIECE: Final = 32 * 1024
"""The flood is held back while more than this waits to be taken by the connection, in bytes: the robot's frames come next."""


@dataclass(frozen=True)
class Case:
    """What is measured.

    Attributes:
        name: In words.
        rate: Of the flood, in bytes/s; 0 for none.
        valid: It is of heartbeats, else of noise.
        busy: The user's code takes all the time before the stop.
    """

    name: str
    rate: float
    valid: bool = False
    busy: bool = False


CASES: Final = (
    Case("quiet", 0),
    Case("noise 5 MB/s, busy user code", 5e6, busy=True),
    Case("heartbeats of 254 systems, 1 MB/s", 1e6, valid=True),
    Case("noise 20 MB/s", 20e6),
)


@dataclass
class Figures:
    """What was measured of one case: times in s, memory in bytes."""

    wire: list[float] = field(default_factory=list)
    acknowledged: list[float] = field(default_factory=list)
    trips: list[float] = field(default_factory=list)
    steps: int = 0
    stepped: float = 0.0
    longest: float = 0.0
    dropped: int = 0
    peak: int = 0
    poured: float = 0.0


# --- the robot, and the flood ----------------------------------------------------------------------------------------


def noise() -> list[bytes]:
    """A mebibyte of noise, in pieces."""
    source = random.Random(1)  # noqa: S311 - repeatable, not secret
    return [source.randbytes(1024) for _ in range(1024)]


def strangers() -> list[bytes]:
    """Heartbeats of every system but the robot's own, which say that here is a robot: twenty of each."""
    codecs = [MavlinkCodec(system=system, component=1) for system in range(1, 256) if system != ROBOT]
    said = [Heartbeat(10, 0, 0, 0, 4)] * 20
    return [codec.encode(message) for message in said for codec in codecs]


class FloodedEndpoint(TcpEndpoint):
    """A TCP port on which more is sent than the robot says.

    Args:
        case: What is sent besides.
        stopped: Called when an emergency stop has come.

    Attributes:
        rate: Of the flood now, in bytes/s.
        poured: Bytes of it that were handed to the connection.
    """

    def __init__(self, case: Case, stopped: Callable[[], None]) -> None:
        super().__init__(port=0)
        self.rate = 0.0
        self.poured = 0
        self._stopped = stopped
        self._ear = MavlinkCodec(system=ROBOT, component=1)
        self._frames = strangers() if case.valid else noise()
        self._at = 0
        self._owed = self._began = self._last = 0.0

    def poll(self, now: float) -> None:
        """Take what the host has sent, and look for an emergency stop in it."""
        known = len(self._in)
        super().poll(now)
        for event in self._ear.receive(bytes(self._in[known:]), now):
            message = event.message if isinstance(event, Received) else None
            if isinstance(message, CommandLong) and message.command == Command.FLIGHT_TERMINATION:
                self._stopped()

    def begin(self, rate: float) -> None:
        """Flood from now on."""
        self._began = self._last = monotonic()
        self.rate, self.poured, self._owed = rate, 0, 0.0

    def pour(self) -> None:
        """Send as much of the flood as is due, unless the connection is behind."""
        now = monotonic()
        if not self.rate or now - self._began > MOST_SECONDS or self.poured > MOST_BYTES:
            return
        self._owed = min(self._owed + self.rate * (now - self._last), _PIECE)
        self._last = now
        while self._owed > 0 and len(self._out) < _PIECE:
            frame = self._frames[self._at]
            self._at = (self._at + 1) % len(self._frames)
            self._out += frame
            self._owed -= len(frame)
            self.poured += len(frame)
        self.send(b"", now)

    @property
    def mean(self) -> float:
        """What came through, in bytes/s."""
        return self.poured / max(monotonic() - self._began, 1e-9) if self.rate else 0.0


def emulate(pipe: Connection, case: Case) -> None:
    """What the robot's process does: serve, flood, and say when an emergency stop has come, until the pipe ends."""
    endpoint = FloodedEndpoint(case, lambda: pipe.send(monotonic()))
    server = Server(junior_world(), endpoint, MonotonicClock(), wait=lambda _files, _time: None)
    pipe.send(endpoint.url)
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            ready, _, _ = select.select([*endpoint.files(), pipe.fileno()], [], [], 0.0005)
            endpoint.pour()
            server.turn()
            if pipe.fileno() in ready:
                if pipe.recv() == "flood":
                    endpoint.begin(case.rate)
                else:
                    pipe.send(endpoint.mean)


# --- the host --------------------------------------------------------------------------------------------------------


class Bench:
    """The host's side of one case."""

    def __init__(self, junior: Junior, robot: Connection, case: Case) -> None:
        self._junior = junior
        self._robot = robot
        self._case = case
        self.figures = Figures()

    def stop(self) -> None:
        """Let the flood run, and call the emergency stop."""
        if self._case.busy:
            end, total = monotonic() + BUSY, 0
            while monotonic() < end:
                total += sum(range(1000))
        else:
            self.step(BUSY)
        called = monotonic()
        self._junior.emergency_stop()
        self.figures.acknowledged.append(monotonic() - called)
        self.figures.wire.append(self._robot.recv() - called)
        while self._robot.poll():  # repetitions
            self._robot.recv()
        self._trips()
        self._junior.disarm()
        self._junior.arm()

    def step(self, seconds: float) -> None:
        """Serve the link for so long."""
        figures, began = self.figures, monotonic()
        last = began
        while last - began < seconds:
            self._junior.step()
            now = monotonic()
            figures.longest = max(figures.longest, now - last)
            figures.steps += 1
            last = now
        figures.stepped += last - began

    def _trips(self) -> None:
        """Ask ten questions."""
        for _ in range(10):
            began = monotonic()
            self._junior.finish(self._junior.peer.request(RobotStatus))
            self.figures.trips.append(monotonic() - began)


def host(result: Connection, robot: Connection, case: Case, rounds: int) -> None:
    """What the host's process does."""
    url = robot.recv()
    with (
        tempfile.TemporaryDirectory() as folder,
        Recorder(Path(folder, "log.mcap"), run={}, config={}, link=url, lockstep=False) as recorder,
        hil.connect(url, taps=[recorder]) as junior,
    ):
        bench = Bench(junior, robot, case)
        junior.arm()
        robot.send("flood")
        for _ in range(rounds):
            bench.stop()
            result.send(None)
        bench.step(2.0)
        figures = bench.figures
        robot.send("mean")
        figures.poured = robot.recv()
        figures.dropped = junior.bridge.overrun
    figures.peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    result.send(figures)


def run(case: Case, rounds: int) -> Figures | None:
    """Measure one case; None where the host makes no progress."""
    context = multiprocessing.get_context("spawn")  # a process of its own memory
    at_host, at_robot = context.Pipe()
    ours, theirs = context.Pipe()
    processes = [
        context.Process(target=emulate, args=(at_robot, case), daemon=True),
        context.Process(target=host, args=(theirs, at_host, case, rounds), daemon=True),
    ]
    for process in processes:
        process.start()
    for pipe in (at_host, at_robot, theirs):
        pipe.close()
    try:
        for _ in range(rounds):
            if not ours.poll(PATIENCE):
                return None
            ours.recv()
        return ours.recv() if ours.poll(PATIENCE) else None
    except EOFError:
        return None
    finally:
        for process in processes:
            process.terminate()
            process.join()


def report(case: Case, figures: Figures | None, quiet: int) -> bool:
    """Print what was measured of one case.

    Returns:
        It is as it must be.
    """
    if figures is None:
        print(f"{case.name:36}no progress within {PATIENCE:g} s", flush=True)
        return False
    wire, acknowledged, trips = (
        f"{median(times) * 1e3:.1f} ({max(times) * 1e3:.1f})" for times in (figures.wire, figures.acknowledged, figures.trips)
    )
    rate = f"{figures.steps / figures.stepped:.0f}"
    memory = (figures.peak - quiet) / 2**20
    print(
        f"{case.name:36}{wire:>16}{acknowledged:>18}{trips:>16}{rate:>8}{figures.longest * 1e3:>9.1f}"
        f"{memory:>9.1f}{figures.dropped / 1e6:>9.1f}{figures.poured / 1e6:>8.2f}",
        flush=True,
    )
    return max(figures.wire) <= ON_THE_WIRE and memory <= MEMORY


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--rounds", type=int, default=5, help="emergency stops in each case")
    rounds = parser.parse_args().rounds
    print(f"{rounds} stops a case, median (greatest), {os.cpu_count()} cores, Python {sys.version.split()[0]}")
    print(
        f"{'':36}{'on the wire ms':>16}{'acknowledged ms':>18}{'question ms':>16}{'steps/s':>8}{'max ms':>9}"
        f"{'+MiB':>9}{'lost MB':>9}{'MB/s':>8}"
    )
    quiet, good = 0, True
    for case in CASES:
        figures = run(case, rounds)
        if figures is not None and not case.rate:
            quiet = figures.peak
        good = report(case, figures, quiet) and good
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
