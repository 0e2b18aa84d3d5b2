"""CAN: a PING through the whole stack against python-can alone on the same kind of bus, and the codec's speed.

A PING is three frames each way. The other end answers in a process of its own (of the virtual bus, in a thread, for that
bus ends with the process): frames sent back, or the robot's firmware run on what comes. Rounds of both alternate.

Run: `python benchmarks/can_roundtrip.py`.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import select
import signal
import sys
import threading
from itertools import cycle
from statistics import median
from time import perf_counter_ns
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl

import can
from cantools.database import load_file
from cantools.database.can import Database

from firmware_protocol.can_frame import CanFrame, pack_frames, split_records
from firmware_protocol.dbc import CanCodec
from firmware_protocol.firmware._host import ffi, lib
from firmware_protocol.generate.outputs import ROOT
from firmware_protocol.link import open_link
from firmware_protocol.messages import JuniorSensors, JuniorWheels, Ping
from hil.bridge import Bridge
from hil.clock import MonotonicClock
from simdevice.can_endpoints import SlcanEndpoint

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

ROUNDS = 10
FAST = 100_000_000
"""Rate of the adapter's line in bit/s: what is measured is software, not a line."""


def echo(data: bytes) -> bytes:
    """The same frames as if from the robot."""
    frames = [CanFrame.unpack(record) for record in split_records(data)]
    return pack_frames(CanFrame(frame.identifier ^ 0x80, frame.data) for frame in frames)


def firmware() -> Callable[[bytes], bytes]:
    """The robot's own program (C) on CAN, run whenever something comes; it answers in the same call."""
    robot: Any = ffi.new("host_robot *")
    ffi.buffer(robot.io.nvm)[:] = b"\xff" * len(ffi.buffer(robot.io.nvm))
    robot.io.can = 1
    lib.host_power_on(robot, 0)
    began, sent = perf_counter_ns(), ffi.buffer(robot.io.tx)

    def answer(data: bytes) -> bytes:
        return bytes(sent[: lib.host_tick(robot, (perf_counter_ns() - began) // 1000, data, len(data))])

    return answer


def answer_on_bus(url: str, answer: Callable[[bytes], bytes], stopped: Callable[[], bool]) -> None:
    """Be a node."""
    with open_link(url) as link:
        while not stopped():
            if (data := link.read(0.05)) and (out := answer(data)):
                link.write(out)


def answer_behind_adapter(endpoint: SlcanEndpoint, answer: Callable[[bytes], bytes]) -> None:
    """Be the node behind a serial adapter."""
    clock = MonotonicClock()
    while True:
        select.select(endpoint.files(), [], [], 0.0002)
        endpoint.poll(clock.now())
        data = endpoint.receive(clock.now() + 1e-4)  # what is on the line has passed: it is no line that is measured
        endpoint.send(answer(data) if data else b"", clock.now())
        endpoint.send(b"", clock.now() + 1e-4)


@contextlib.contextmanager
def far_end(kind: str, number: int, answer: Callable[[bytes], bytes]) -> Iterator[str]:
    """A node that answers, on a bus of its own. Yields the address of the bus."""
    if kind == "virtual":
        url, stop = f"can://virtual/bench{number}", threading.Event()
        thread = threading.Thread(target=answer_on_bus, args=(url, answer, stop.is_set))
        thread.start()
        try:
            yield url
        finally:
            stop.set()
            thread.join()
        return
    endpoint = SlcanEndpoint(FAST) if kind == "slcan" else None
    url = endpoint.url if endpoint else f"can://udp_multicast/239.74.163.2?port={43200 + number}"
    child = os.fork()
    if child == 0:
        if endpoint:
            answer_behind_adapter(endpoint, answer)
        else:
            answer_on_bus(url, answer, lambda: False)
    try:
        yield url
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        if endpoint:
            endpoint.close()


def bare(url: str) -> tuple[Callable[[], None], Callable[[], None]]:
    """python-can alone: three frames out, three in. Returns the trip, and what closes it."""
    interface, _, rest = url.removeprefix("can://").partition("/")
    channel, _, asked = rest.partition("?")
    options: dict[str, Any] = {name: int(value) for name, value in parse_qsl(asked)}
    if interface == "udp_multicast":
        options["hop_limit"] = 0
    bus = can.Bus(interface=interface, channel=channel, ignore_config=True, **options)
    identifiers = [frame.identifier for frame in CanCodec(system=255, component=190).encode_frames(Ping(123456789, 77))]
    numbers = cycle(range(1, 256))

    def ask(wait: float) -> bool:
        number = next(numbers)
        for part, identifier in enumerate(identifiers):
            bus.send(can.Message(arbitration_id=identifier, data=[number, part, 0, 0, 0, 0, 0, 0], is_extended_id=False))
        while came := bus.recv(wait):
            if came.arbitration_id & 0x80 and came.data[:2] == bytes((number, len(identifiers) - 1)):
                return True  # a multicast bus brings back our own as well
        return False

    while not ask(0.05):  # the other end may not be there yet
        pass

    def trip() -> None:
        if not ask(1.0):
            raise TimeoutError("no answer within 1 s")

    return trip, bus.shutdown


def stack(url: str) -> tuple[Callable[[], None], Callable[[], None]]:
    """A PING through link, pump, codec, bridge and peer. Returns the trip, and what closes it."""
    bridge = Bridge(open_link(url), MonotonicClock())
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


def times(trip: Callable[[], None], count: int) -> list[float]:
    """Durations of so many trips, in us."""
    found = []
    for _ in range(count):
        began = perf_counter_ns()
        trip()
        found.append((perf_counter_ns() - began) / 1000)
    return found


def round_trips(kind: str, count: int) -> None:
    """Measure one kind of bus, and print."""
    with contextlib.ExitStack() as resources:
        pairs: list[tuple[Callable[[], None], list[float]]] = []
        for number, (make, answer) in enumerate(((bare, echo), (stack, firmware()))):
            trip, close = make(resources.enter_context(far_end(kind, number, answer)))
            resources.callback(close)
            times(trip, 20)
            pairs.append((trip, []))
        for _ in range(ROUNDS):
            for trip, durations in pairs:
                durations.extend(times(trip, count // ROUNDS))
    base = median(pairs[0][1])
    for name, (_, durations) in zip(("python-can alone, echo", "whole stack, firmware"), pairs, strict=True):
        durations.sort()
        worst = durations[int(0.99 * len(durations))]
        print(f"{f'{kind}, {name}':42}{median(durations):10.1f}{worst:10.1f}{median(durations) / base:8.2f}")


def codec() -> None:
    """Measure the codec, and print."""
    host, robot = CanCodec(system=255, component=190), CanCodec(system=1, component=1)
    sensors = JuniorSensors(time=12.345, travel=(0.5, -0.25), eye=(1, 2), floor=(3, 4), battery=7.4, flags=771)
    wheels = JuniorWheels(4711, 12, (0.5, -0.35), 0.25, 1, 1)
    database = load_file(str(ROOT / "firmware_protocol/dialect/junior.dbc"))
    assert isinstance(database, Database)
    oracle = database.get_message_by_name("JUNIOR_WHEELS_FRAME")
    signals: dict[str, Any] = {"sequence": 12, "speed_left": 0.5, "speed_right": -0.35, "duration": 0.25}
    data = robot.encode(sensors)
    question = host.encode(Ping(1, 2))
    jobs: dict[str, Callable[[], object]] = {
        "JUNIOR_WHEELS encoded, one frame": lambda: host.encode(wheels),
        "the same by cantools, strict": lambda: oracle.encode(signals),
        "JUNIOR_SENSORS encoded, three frames": lambda: robot.encode(sensors),
        "JUNIOR_SENSORS decoded": lambda: host.receive(data, 0.0),
        "PING encoded, three frames": lambda: host.encode(Ping(1, 2)),
        "PING decoded": lambda: robot.receive(question, 0.0),
    }
    print(f"\n{'':42}{'thousand a second':>18}")
    for name, job in jobs.items():
        began = perf_counter_ns()
        for _ in range(20_000):
            job()
        print(f"{name:42}{20_000e6 / (perf_counter_ns() - began):18.0f}")


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=2000, help="round trips of each kind")
    count = parser.parse_args().count
    print(f"{count} round trips of each kind, {os.cpu_count()} cores, Python {sys.version.split()[0]}")
    print(f"{'':42}{'median us':>10}{'p99 us':>10}{'ratio':>8}")
    for kind in ("udp_multicast", "slcan", "virtual"):  # the virtual one has a thread: after the others have forked
        round_trips(kind, count)
    codec()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
