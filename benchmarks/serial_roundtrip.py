"""Round trip over a pseudo-terminal: a PING through the whole stack against a bare pyserial echo of as many bytes.

The other end is a process of its own: one that echoes bytes, or one that runs the robot's firmware on what comes (with
the sensor stream off). Rounds of all kinds alternate, so that a busy machine is busy for all.

Run: `python benchmarks/serial_roundtrip.py`.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import select
import sys
from dataclasses import dataclass, field
from statistics import median
from time import perf_counter_ns
from typing import TYPE_CHECKING, Any

import serial

from firmware_protocol.events import Received
from firmware_protocol.firmware._host import ffi, lib
from firmware_protocol.link import open_link
from firmware_protocol.links import SerialLink
from firmware_protocol.mavlink import MavlinkCodec
from firmware_protocol.messages import JuniorSensors, Ping
from hil.bridge import Bridge
from hil.clock import MonotonicClock

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

ROUNDS = 20


@contextlib.contextmanager
def far_end(answer: Callable[[bytes], bytes]) -> Iterator[str]:
    """A process that holds the controlling end of a pseudo-terminal.

    Args:
        answer: What it sends back for what it gets.

    Yields:
        Name of the terminal.
    """
    master, slave = os.openpty()
    name = os.ttyname(slave)
    child = os.fork()
    if child == 0:
        os.close(slave)
        with contextlib.suppress(OSError):
            while True:
                if select.select([master], [], [], None)[0] and (data := answer(os.read(master, 4096))):
                    os.write(master, data)
        os._exit(0)
    os.close(master)
    try:
        yield name
    finally:
        os.close(slave)
        os.waitpid(child, 0)


def firmware() -> Callable[[bytes], bytes]:
    """The robot's own program (C), run whenever something comes; it answers in the same call."""
    robot: Any = ffi.new("host_robot *")
    ffi.buffer(robot.io.nvm)[:] = b"\xff" * len(ffi.buffer(robot.io.nvm))
    lib.host_power_on(robot, 0)
    began, sent = perf_counter_ns(), ffi.buffer(robot.io.tx)

    def answer(data: bytes) -> bytes:
        count = lib.host_tick(robot, (perf_counter_ns() - began) // 1000, data, len(data))
        return bytes(sent[:count])

    return answer


@dataclass
class Contender:
    """One way to make a round trip.

    Attributes:
        name: What it is called in the table.
        trip: Makes one round trip.
        rounds: Times in ns, a list for each round.
    """

    name: str
    trip: Callable[[], None]
    rounds: list[list[int]] = field(default_factory=list)

    def run(self, count: int) -> None:
        """Make so many round trips."""
        trip, times = self.trip, []
        for _ in range(count):
            began = perf_counter_ns()
            trip()
            times.append(perf_counter_ns() - began)
        self.rounds.append(times)

    def quantile(self, share: float) -> float:
        """Time that this share of all trips kept within, in us."""
        times = sorted(time for times in self.rounds for time in times)
        return times[min(len(times) - 1, int(share * len(times)))] / 1000

    def ratio(self, base: Contender) -> float:
        """Median over the rounds of this one's median to the other's in the same round."""
        return median(median(own) / median(other) for own, other in zip(self.rounds, base.rounds, strict=True))


def bridge_trip(name: str, *, inline: bool) -> tuple[Bridge, Callable[[], None]]:
    """A PING through link, pump, codec, bridge and peer."""
    clock = MonotonicClock()
    link = open_link(f"serial://{name}:115200")
    if inline:
        link.lockstep = True  # the pump then reads in this thread
    bridge = Bridge(link, clock)
    while not (1 in bridge.peers and bridge.peers[1].ready and bridge.peers[1].status):
        bridge.step(0.05)
    ticket = bridge.peers[1].message_interval(JuniorSensors, -1)
    while not ticket.done:
        bridge.step(0.05)
    ping, step = bridge.peers[1].ping, bridge.step

    def trip() -> None:
        ticket = ping()
        while not ticket.done:
            step(0.05)
        ticket.value()

    return bridge, trip


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=4000, help="round trips of each kind")
    count = parser.parse_args().count
    frame = MavlinkCodec(system=255, component=190).encode(Ping(123456789, 77))
    length = len(frame)
    with contextlib.ExitStack() as stack:
        bare = serial.Serial(stack.enter_context(far_end(lambda data: data)), 115200, timeout=1)
        stack.callback(bare.close)
        link = SerialLink("echo", stack.enter_context(far_end(lambda data: data)), 115200)
        stack.callback(link.close)
        robot = SerialLink("robot", stack.enter_context(far_end(firmware())), 115200)
        stack.callback(robot.close)
        codec = MavlinkCodec(system=255, component=190)
        threaded, threaded_trip = bridge_trip(stack.enter_context(far_end(firmware())), inline=False)
        stack.callback(threaded.close)
        inline, inline_trip = bridge_trip(stack.enter_context(far_end(firmware())), inline=True)
        stack.callback(inline.close)

        def echo(port: serial.Serial, data: bytes, answer: int) -> Callable[[], None]:
            def trip() -> None:
                port.write(data)
                if len(port.read(answer)) != answer:
                    raise TimeoutError("no echo within 1 s")

            return trip

        def link_trip() -> None:
            link.write(frame)
            got = 0
            while got < length:
                got += len(link.read(1.0))

        def codec_trip() -> None:
            robot.write(codec.encode(Ping(123456789, 77)))
            while not any(isinstance(e, Received) and isinstance(e.message, Ping) for e in codec.receive(robot.read(1.0), 0.0)):
                pass

        contenders = [
            Contender("bare pyserial, echo", echo(bare, frame, length)),
            Contender("our serial link alone, echo", link_trip),
            Contender("our link and codec by hand, firmware", codec_trip),
            Contender("whole stack, read inline", inline_trip),
            Contender("whole stack", threaded_trip),
        ]
        for contender in contenders:
            contender.run(50)
            contender.rounds.clear()
        for _ in range(ROUNDS):
            for contender in contenders:
                contender.run(count // ROUNDS)
    base = contenders[0]
    print(f"{length} bytes each way, {count} round trips of each kind, {os.cpu_count()} cores, Python {sys.version.split()[0]}")
    print(f"{'':42}{'median us':>10}{'p99 us':>10}{'ratio':>8}{'p99':>7}")
    for contender in contenders:
        middle, worst = contender.quantile(0.5), contender.quantile(0.99)
        worst_ratio = worst / base.quantile(0.99)
        print(f"{contender.name:42}{middle:10.1f}{worst:10.1f}{contender.ratio(base):8.2f}{worst_ratio:7.2f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
