"""Round trip over every link: a PING through the whole stack, our link alone, and the bare transport.

Three contenders on each kind of link, with as many bytes or frames each way: the bare transport (pyserial, a socket,
python-can) and an echo; our link and the same echo; and the whole stack (link, pump, codec, bridge, peer) with the robot's
firmware at the other end, its sensor stream off. The other end is a process of its own, except for `memory` (a call) and
`virtual` (a thread: that bus ends with the process). Rounds of all three alternate, so that a busy machine is busy for all.

Run: `python benchmarks/links.py`, on an idle machine; the load that it found is printed.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import socket
import sys
from dataclasses import dataclass, field
from itertools import cycle
from statistics import median
from time import perf_counter_ns
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import parse_qsl

import can
import serial
from link_ends import UP, Answer, echo, echo_frames, far_end, firmware

from firmware_protocol.links import MemoryLink
from firmware_protocol.links.can_multicast import MulticastBus
from firmware_protocol.links.opening import open_link
from firmware_protocol.messages import JuniorSensors, Ping
from firmware_protocol.wire.can.frame import CanFrame, split_records
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN, MAVLINK
from hil.bridge.bridge import Bridge
from hil.bridge.clock import MonotonicClock

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.clock import Clock
    from firmware_protocol.link import Link

    Trip = Callable[[], None]
    """Makes one round trip."""

ROUNDS: Final = 20
BYTES: Final = ("pty", "tcp", "udp")
BUSES: Final = ("udp_multicast", "slcan", "virtual")
"""The last one has a thread: after the others have forked."""


class Called:
    """The other end as a call: what `MemoryLink` steps. Its time is the machine's."""

    def __init__(self, answer: Answer) -> None:
        self._answer = answer
        self.now = MonotonicClock().now

    def step(self, inbound: bytes) -> bytes:
        """Answer."""
        return self._answer(inbound)


# --- our end ---------------------------------------------------------------------------------------------------------


def bare_serial(url: str, data: bytes) -> tuple[Trip, Trip]:
    """Pyserial alone. Returns the trip, and what closes it."""
    port = serial.Serial(url.removeprefix("serial://").rpartition(":")[0], 115200, timeout=1)

    def trip() -> None:
        port.write(data)
        if len(port.read(len(data))) != len(data):
            raise TimeoutError("no echo within 1 s")

    return trip, port.close


def bare_socket(url: str, data: bytes) -> tuple[Trip, Trip]:
    """A socket alone. Returns the trip, and what closes it."""
    host, _, port = url.partition("://")[2].rpartition(":")
    stream = url.startswith("tcp")
    ours = socket.socket(socket.AF_INET, socket.SOCK_STREAM if stream else socket.SOCK_DGRAM)
    ours.settimeout(1)
    ours.connect((host, int(port)))
    if stream:
        ours.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def trip() -> None:
        ours.sendall(data)
        got = 0
        while got < len(data):
            got += len(ours.recv(4096))

    return trip, ours.close


def bare_bus(url: str, data: bytes) -> tuple[Trip, Trip]:
    """python-can alone, as many frames out and in. Returns the trip, and what closes it."""
    interface, _, rest = url.removeprefix("can://").partition("/")
    channel, _, asked = rest.partition("?")
    options: dict[str, Any] = {name: int(value) for name, value in parse_qsl(asked)}
    bus: can.BusABC
    if interface == "udp_multicast":  # python-can's own would not stay on this machine
        bus = MulticastBus(channel, **options)
    else:
        bus = can.Bus(interface=interface, channel=channel, ignore_config=True, **options)
    identifiers = [CanFrame.unpack(record).identifier for record in split_records(data)]
    numbers = cycle(range(1, 256))

    def ask(wait: float) -> bool:
        number = next(numbers)
        for part, identifier in enumerate(identifiers):
            bus.send(can.Message(arbitration_id=identifier, data=[number, part, 0, 0, 0, 0, 0, 0], is_extended_id=False))
        while came := bus.recv(wait):
            if came.arbitration_id & UP and came.data[:2] == bytes((number, len(identifiers) - 1)):
                return True  # a multicast bus brings back our own as well
        return False

    while not ask(0.05):  # the other end may not be there yet
        pass

    def trip() -> None:
        if not ask(1.0):
            raise TimeoutError("no answer within 1 s")

    return trip, bus.shutdown


def link_trip(link: Link, data: bytes) -> Trip:
    """Our link alone: as many bytes out and in."""

    def ask(wait: float) -> bool:
        link.write(data)
        got = 0
        while got < len(data):
            came = link.read(wait)
            if not came:
                return False
            got += len(came)
        return True

    while not ask(0.05):  # the other end may not be there yet
        pass
    while link.read(0.05):  # nor may what it answered late
        pass

    def trip() -> None:
        if not ask(1.0):
            raise TimeoutError("no echo within 1 s")

    return trip


def stack_trip(link: Link, clock: Clock) -> tuple[Trip, Trip]:
    """A PING through link, pump, codec, bridge and peer. Returns the trip, and what closes it."""
    bridge = Bridge(link, clock)
    while not (1 in bridge.peers and bridge.peers[1].ready and bridge.peers[1].status):
        bridge.step(0.05)
    quiet = bridge.peers[1].message_interval(JuniorSensors, -1)
    while not quiet.done:
        bridge.step(0.05)

    def trip() -> None:
        ticket = bridge.peers[1].ping()
        while not ticket.done:
            bridge.step(0.05)
        ticket.value()

    return trip, bridge.close


def _drop(_: bytes) -> None:
    """Do nothing with an answer."""


# --- measuring -------------------------------------------------------------------------------------------------------


@dataclass
class Contender:
    """One way to make a round trip.

    Attributes:
        name: What it is called in the table.
        trip: Makes one.
        rounds: Durations in us, a list for each round.
    """

    name: str
    trip: Trip
    rounds: list[list[float]] = field(default_factory=list)

    def run(self, count: int) -> None:
        """Make so many round trips."""
        trip, times = self.trip, []
        for _ in range(count):
            began = perf_counter_ns()
            trip()
            times.append((perf_counter_ns() - began) / 1000)
        self.rounds.append(times)

    def quantile(self, share: float) -> float:
        """Duration that this share of all trips kept within, in us."""
        times = sorted(time for times in self.rounds for time in times)
        return times[min(len(times) - 1, int(share * len(times)))]

    def ratio(self, base: Contender) -> float:
        """Median over the rounds of this one's median to the other's in the same round."""
        return median(median(own) / median(other) for own, other in zip(self.rounds, base.rounds, strict=True))


def contenders(kind: str, resources: contextlib.ExitStack) -> list[Contender]:
    """The three contenders on one kind of link, ready to run."""
    wire = CAN if kind in BUSES else MAVLINK
    data = open_codec(wire, system=255, component=190).encode(Ping(123456789, 77))
    back = echo_frames if wire == CAN else echo
    if kind == "memory":
        answer, alone = firmware(wire), MemoryLink(Called(echo))
        called = Called(firmware(wire))
        stack, close = stack_trip(MemoryLink(called), called)
        resources.callback(close)
        return [
            Contender("memory, the firmware called", lambda: _drop(answer(data))),
            Contender("memory, our link, echo", link_trip(alone, data)),
            Contender("memory, whole stack", stack),
        ]
    urls = [
        resources.enter_context(far_end(kind, number, answer)) for number, answer in enumerate((back, back, firmware(wire)))
    ]
    make, what = {"pty": (bare_serial, "pyserial"), "tcp": (bare_socket, "a socket"), "udp": (bare_socket, "a socket")}.get(
        kind, (bare_bus, "python-can")
    )
    bare, close_bare = make(urls[0], data)
    resources.callback(close_bare)
    link = resources.enter_context(open_link(urls[1]))
    alone_trip = link_trip(link, data)
    stack, close = stack_trip(open_link(urls[2]), MonotonicClock())
    resources.callback(close)
    return [
        Contender(f"{kind}, {what} alone, echo", bare),
        Contender(f"{kind}, our link, echo", alone_trip),
        Contender(f"{kind}, whole stack", stack),
    ]


def measure(kind: str, count: int) -> None:
    """Measure one kind of link, and print."""
    with contextlib.ExitStack() as resources:
        found = contenders(kind, resources)
        for contender in found:
            contender.run(50)
            contender.rounds.clear()
        for _ in range(ROUNDS):
            for contender in found:
                contender.run(count // ROUNDS)
    base = found[0]
    for contender in found:
        middle, worst = contender.quantile(0.5), contender.quantile(0.99)
        print(f"{contender.name:42}{middle:10.1f}{worst:10.1f}{contender.ratio(base):8.2f}{worst / base.quantile(0.99):7.2f}")


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=2000, help="round trips of each contender")
    parser.add_argument("--kind", choices=("memory", *BYTES, *BUSES), help="this kind of link alone")
    options = parser.parse_args()
    where = f"{os.cpu_count()} cores with a load of {os.getloadavg()[0]:.1f}, Python {sys.version.split()[0]}"
    print(f"{options.count} round trips of each, {where}")
    print(f"{'':42}{'median us':>10}{'p99 us':>10}{'ratio':>8}{'p99':>7}")
    for kind in [options.kind] if options.kind else ("memory", *BYTES, *BUSES):
        measure(kind, options.count)
    print(f"load at the end: {os.getloadavg()[0]:.1f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
