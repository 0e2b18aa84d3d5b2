"""How long things take when a robot is unplugged and plugged in again, for every kind of link.

The emulated robot is served in real time by a thread and drives; then what it is reached by is closed (a pty, a TCP port) or
falls silent (UDP, CAN), and a while later it is there again, a pty under another name. Measured are, on one clock:

- from the unplugging until the wheels are off, as the device itself has them;
- from the unplugging until the host has been told (`PeerLost`);
- from the plugging in until the first command is answered (`PeerBack`, and a question answered after it).

Run: `python benchmarks/reconnect.py`.
"""

from __future__ import annotations

import argparse
import os
import queue
import random
import sys
import threading
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import inf
from statistics import median
from typing import TYPE_CHECKING, Final

from firmware_protocol.events import PeerLost
from firmware_protocol.links import SerialPort
from hil.bridge.clock import MonotonicClock
from hil.sumo.connecting import connect
from simdevice.serving.endpoints import Endpoint
from simdevice.serving.opening import open_endpoint
from simdevice.serving.server import Server
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from firmware_protocol.events import Event
    from hil.sumo.junior import Junior

KINDS: Final = {
    "pty": "pty",
    "tcp": "tcp://127.0.0.1:0",
    "slcan": "slcan",
    "udp": "udp://127.0.0.1:0",
    "can udp_multicast": f"can://udp_multicast/239.74.163.11?port={20000 + os.getpid() % 20000}",
}
AWAY: Final = (0.5, 1.5)
"""The plug is out for a time between these after the host was told, so that the tries are met at any phase, in s."""


class Socket(Endpoint):
    """What a robot is reached by, which can be closed and opened again while the robot is served: by the serving thread.

    Args:
        text: As for `hil emulate --link`.
        clock: Tells when.

    Attributes:
        changed: When it was closed or opened last, in s.
        ports: The serial ports that there are: this one, or none.
    """

    def __init__(self, text: str, clock: MonotonicClock) -> None:
        self._clock = clock
        self._orders: queue.SimpleQueue[bool] = queue.SimpleQueue()
        self._done = threading.Event()
        self._text = text
        self.changed = clock.now()
        self.ports: list[SerialPort] = []
        self._inner: Endpoint | None = None
        inner = self._open()
        self.wire, self.url = inner.wire, inner.url
        if "://" in text:  # a port taken by chance is kept
            self._text = self.url.replace("udpout", "udp")

    def plug(self, *, in_: bool) -> float:
        """Have it closed or opened, and say when that was done, in s."""
        self._done.clear()
        self._orders.put(in_)
        if not self._done.wait(10.0):
            raise TimeoutError("the emulator does not answer")
        return self.changed

    def _open(self) -> Endpoint:
        self._inner = inner = open_endpoint(self._text)
        path = getattr(inner, "path", "")
        self.ports = [SerialPort(path, "Board", "SN1", 0x2341, 0x0043)] if path else []
        self.changed = self._clock.now()
        return inner

    def _obey(self) -> None:
        """Do what was ordered."""
        while not self._orders.empty():
            if self._orders.get():
                self._open()
            elif self._inner is not None:
                self.changed = self._clock.now()
                self._inner.close()
                self._inner, self.ports = None, []
            self._done.set()

    def files(self) -> list[int]:
        """What can be waited for; nothing while it is closed."""
        return self._inner.files() if self._inner else []

    def poll(self, now: float) -> None:
        """Take in what has come."""
        self._obey()
        if self._inner:
            self._inner.poll(now)

    def receive(self, now: float) -> bytes:
        """Hand over what has come; nothing while it is closed."""
        self._obey()
        return self._inner.receive(now) if self._inner else b""

    def send(self, data: bytes, now: float) -> None:
        """Send; to nobody while it is closed."""
        if self._inner:
            self._inner.send(data, now)

    def due(self) -> float:
        """When something under way is due."""
        return self._inner.due() if self._inner else inf

    def close(self) -> None:
        """Close it for good."""
        if self._inner:
            self._inner.close()


class Driven:
    """A world that notes when its robot's wheels were seen off, after they had been on.

    Attributes:
        off: When, in s; None while they are on.
    """

    def __init__(self, wire: str, clock: MonotonicClock) -> None:
        self._world = junior_world(WorldSettings(referee=False, wire=wire))
        self.period = self._world.period
        self._clock = clock
        self.off: float | None = None

    def stood_still_since(self) -> float:
        """When its wheels were seen off, in s.

        Raises:
            RuntimeError: They are on.
        """
        if self.off is None:
            raise RuntimeError("the wheels are on")
        return self.off

    def step(self, inbound: bytes) -> bytes:
        """One control period."""
        out = self._world.step(inbound)
        if self._world.device.wheels != (0.0, 0.0):
            self.off = None
        elif self.off is None:
            self.off = self._clock.now()
        return out


@dataclass
class Times:
    """What was measured on one kind of link, in s, a figure for each round.

    Attributes:
        neutral: From unplugging to wheels off.
        told: From unplugging to the host being told.
        working: From plugging in to the first answer.
    """

    neutral: list[float] = field(default_factory=list)
    told: list[float] = field(default_factory=list)
    working: list[float] = field(default_factory=list)


@contextmanager
def serving(text: str, clock: MonotonicClock) -> Iterator[tuple[Socket, Driven]]:
    """A robot served in real time by a thread."""
    plug = Socket(text, clock)
    world, stop = Driven(plug.wire, clock), threading.Event()
    server = Server(world, plug, clock)
    thread = threading.Thread(target=server.run, args=(stop.is_set,), daemon=True)
    thread.start()
    try:
        yield plug, world
    finally:
        stop.set()
        thread.join()
        plug.close()


def measure(text: str, rounds: int, seed: int) -> Times:
    """Unplug and plug in, again and again.

    Args:
        text: What the robot is reached by.
        rounds: How often.
        seed: Decides for how long the plug is out.
    """
    clock, chance, times = MonotonicClock(), random.Random(seed), Times()  # noqa: S311 - repeatable, not secret
    with serving(text, clock) as (plug, world), connect(plug.url, reconnect=60.0, ports=lambda: plug.ports) as junior:
        for _ in range(rounds):
            drive(junior, clock)
            pulled = plug.plug(in_=False)
            events: list[Event] = []
            while not any(isinstance(event, PeerLost) for event in events):
                events += junior.step(0.01)
            times.told.append(clock.now() - pulled)
            junior.wait(chance.uniform(*AWAY))
            times.neutral.append(world.stood_still_since() - pulled)
            plugged = plug.plug(in_=True)
            junior.wait_until_back()
            junior.read_sensors()
            times.working.append(clock.now() - plugged)
    if min(times.neutral) <= 0:
        raise RuntimeError("the robot did not drive when it was unplugged")
    return times


def drive(junior: Junior, clock: MonotonicClock) -> None:
    """Turn the wheels for a while; they would go on for half a second."""
    junior.arm()
    end = clock.now() + 0.5
    while clock.now() < end:
        junior.drive(0.3, -0.3, 0.5)
        junior.wait(0.02)


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--rounds", type=int, default=10, help="times each is unplugged")
    parser.add_argument("--seed", type=int, default=1, help="decides for how long the plug is out")
    options = parser.parse_args()
    print(f"{options.rounds} rounds each, {os.cpu_count()} cores, Python {sys.version.split()[0]}; median (greatest), in ms")
    print(f"{'':20}{'wheels off':>18}{'host told':>18}{'working again':>18}")
    for kind, text in KINDS.items():
        times = measure(text, options.rounds, options.seed)
        cells = (
            f"{median(values) * 1e3:.0f} ({max(values) * 1e3:.0f})" for values in (times.neutral, times.told, times.working)
        )
        print(f"{kind:20}" + "".join(f"{cell:>18}" for cell in cells), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
