"""Pacing and the real-time loop, with a clock that only moves when told to."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from firmware_protocol.clock import ManualClock
from firmware_protocol.errors import AddressError, LinkOpenError
from simdevice.serving.endpoints import Endpoint, Line, TcpEndpoint
from simdevice.serving.opening import open_endpoint
from simdevice.serving.server import MAX_CATCH_UP, Server


def test_a_line_passes_a_byte_per_ten_bit_times() -> None:
    line = Line(115200)
    line.push(bytes(range(100)), 1.0)
    assert line.pop(1.0) == b""
    assert line.pop(1.0 + 10 / 115200) == b"\x00"
    assert line.due() == pytest.approx(1.0 + 1000 / 115200)
    assert len(line.pop(1.0 + 505 / 115200)) == 49
    assert len(line) == 50
    line.push(b"later", 1.001)
    assert line.pop(2.0)[-5:] == b"later"
    assert line.due() == math.inf
    line.push(b"x", 3.0)
    assert line.pop(3.0) == b""


class Recorder:
    """A world that notes when it was stepped and what it was given."""

    period = 0.005

    def __init__(self, clock: ManualClock) -> None:
        self.clock = clock
        self.times: list[float] = []
        self.inbound = b""

    def step(self, inbound: bytes) -> bytes:
        self.times.append(self.clock.now())
        self.inbound += inbound
        return b"ab"


class Wire(Endpoint):
    """An endpoint made of lists."""

    url = "test:"

    def __init__(self) -> None:
        self.waiting = b""
        self.arrived = b""
        self.sent: list[tuple[float, bytes]] = []
        self.open = True

    def files(self) -> list[int]:
        return []

    def poll(self, now: float) -> None:
        del now
        self.arrived += self.waiting
        self.waiting = b""

    def receive(self, now: float) -> bytes:
        self.poll(now)
        data, self.arrived = self.arrived, b""
        return data

    def send(self, data: bytes, now: float) -> None:
        if data:
            self.sent.append((now, data))

    def close(self) -> None:
        self.open = False


def test_the_world_is_stepped_every_5_ms_of_the_clock() -> None:
    clock = ManualClock(100.0)
    world, wire = Recorder(clock), Wire()
    server = Server(world, wire, clock, wait=lambda _files, timeout: clock.advance(timeout))
    wire.waiting = b"hello"
    server.run(lambda: clock.now() >= 101.0)
    assert server.steps == pytest.approx(200, abs=1)
    assert all(b - a == pytest.approx(0.005) for a, b in pairwise(world.times))
    assert world.inbound == b"hello"
    assert len(wire.sent) == server.steps
    assert server.overruns == 0


def test_a_late_loop_catches_up_a_little_and_counts_the_rest() -> None:
    clock = ManualClock()
    world = Recorder(clock)
    pauses = iter([0.005, 0.012, 0.5, 0.005])
    server = Server(world, Wire(), clock, wait=lambda _files, _timeout: clock.advance(next(pauses)))
    steps = []
    for _ in range(4):
        before = server.steps
        server.turn()
        steps.append(server.steps - before)
    assert steps == [1, 2, MAX_CATCH_UP + 1, 1]
    assert server.overruns == 1
    assert server.late == pytest.approx(100 - MAX_CATCH_UP, abs=1)


def test_emulated_time_can_run_faster() -> None:
    clock = ManualClock()
    server = Server(Recorder(clock), Wire(), clock, wait=lambda _files, timeout: clock.advance(timeout), speed=4.0)
    server.run(lambda: clock.now() >= 1.0)
    assert server.steps == pytest.approx(800, abs=2)
    with pytest.raises(ValueError, match="positive"):
        Server(Recorder(clock), Wire(), clock, speed=0.0)


@pytest.mark.parametrize(
    "text", ["pty:fast", "pty:0", "serial:///dev/null", "tcp://127.0.0.1", "nonsense", "tcp://127.0.0.1:1?a=b"]
)
def test_what_cannot_be_served_is_explained(text: str) -> None:
    with pytest.raises(AddressError, match=text.partition("?")[0].replace("/", "[/]")):
        open_endpoint(text)


@pytest.mark.parametrize("text", ["tcp://0.0.0.0:0", "udp://[::]:0", "tcp://example.org:5760"])
def test_other_machines_are_kept_out_unless_allowed(text: str) -> None:
    with pytest.raises(AddressError, match="other machines"):
        open_endpoint(text)


def test_a_port_that_is_taken_is_explained() -> None:
    first = TcpEndpoint(port=0)
    with pytest.raises(LinkOpenError, match="in use"):
        TcpEndpoint(port=int(first.url.rpartition(":")[2]))
    first.close()
