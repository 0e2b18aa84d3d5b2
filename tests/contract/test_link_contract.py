"""One suite for every link, with and without a faulty wrapper around it (that only delays)."""

from __future__ import annotations

import contextlib
import os
import select
import socket
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import pytest

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.link import Link, open_link
from firmware_protocol.links import FaultSpec, FaultyLink, MemoryLink, UdpLink
from hil.clock import MonotonicClock

if TYPE_CHECKING:
    from collections.abc import Iterator

PATIENCE = 2.0
"""How long anything may take before a test fails, in s."""


class FarEnd(Protocol):
    """The other end of a link, in the test's hands."""

    def send(self, data: bytes) -> None: ...
    def receive(self, count: int) -> bytes: ...
    def close(self) -> None: ...


@dataclass
class MemoryEnd:
    """A device in the same process."""

    link: Link | None = None
    outgoing: list[bytes] = field(default_factory=list)
    came: bytes = b""
    ticks: int = 0

    def now(self) -> float:
        return self.ticks * 0.005

    def step(self, inbound: bytes) -> bytes:
        self.ticks += 1
        self.came += inbound
        return self.outgoing.pop(0) if self.outgoing else b""

    def send(self, data: bytes) -> None:
        self.outgoing.append(data)

    def receive(self, count: int) -> bytes:
        assert self.link
        while len(self.came) < count and self.ticks < 2000:
            self.link.read(0.005)
        came, self.came = self.came, b""
        return came

    def close(self) -> None:
        pass


@dataclass
class FileEnd:
    """The controlling end of a pseudo-terminal."""

    handle: int

    def send(self, data: bytes) -> None:
        os.write(self.handle, data)

    def receive(self, count: int) -> bytes:
        came = b""
        while len(came) < count and select.select([self.handle], [], [], PATIENCE)[0]:
            came += os.read(self.handle, 65536)
        return came

    def close(self) -> None:
        if self.handle >= 0:
            os.close(self.handle)
        self.handle = -1


@dataclass
class SocketEnd:
    """A socket, connected or (UDP) with the other end's address."""

    socket: socket.socket
    to: tuple[str, int] | None = None

    def send(self, data: bytes) -> None:
        if self.to:
            self.socket.sendto(data, self.to)
        else:
            self.socket.sendall(data)

    def receive(self, count: int) -> bytes:
        came = b""
        while len(came) < count and select.select([self.socket], [], [], PATIENCE)[0]:
            data, sender = self.socket.recvfrom(65536)
            came += data
            self.to = self.to or sender
        return came

    def close(self) -> None:
        self.socket.close()


@dataclass
class Setup:
    """A link, its far end, and what is true of its kind."""

    link: Link
    far: FarEnd
    keeps: bool = False
    """Bytes under way survive the other end's closing."""
    listens: bool = False


def _memory() -> Setup:
    end = MemoryEnd()
    return Setup(MemoryLink(end), end)


def _pty() -> Setup:
    master, slave = os.openpty()
    link = open_link(f"serial://{os.ttyname(slave)}:115200")
    os.close(slave)
    return Setup(link, FileEnd(master))


def _tcp() -> Setup:
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = open_link(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        return Setup(link, SocketEnd(server.accept()[0]), keeps=True)


def _udpin() -> Setup:
    link = open_link("udpin://127.0.0.1:0")
    assert isinstance(link, UdpLink)
    end = SocketEnd(socket.socket(socket.AF_INET, socket.SOCK_DGRAM), ("127.0.0.1", link.local_port))
    return Setup(link, end, listens=True)


def _udpout() -> Setup:
    far = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    far.bind(("127.0.0.1", 0))
    link = open_link(f"udpout://127.0.0.1:{far.getsockname()[1]}")
    assert isinstance(link, UdpLink)
    return Setup(link, SocketEnd(far, ("127.0.0.1", link.local_port)))


KINDS = {"memory": _memory, "pty": _pty, "tcp": _tcp, "udpin": _udpin, "udpout": _udpout}


@pytest.fixture(params=[f"{kind}{how}" for kind in KINDS for how in ("", "-faulty")])
def setup(request: pytest.FixtureRequest) -> Iterator[Setup]:
    kind, _, faulty = str(request.param).partition("-")
    setup = KINDS[kind]()
    inner, far = setup.link, setup.far
    if faulty:
        clock = far if isinstance(far, MemoryEnd) else MonotonicClock()
        setup.link = FaultyLink(inner, FaultSpec(delay=0.002, jitter=0.003), seed=1, clock=clock)
    if isinstance(far, MemoryEnd):
        far.link = setup.link
    yield setup
    setup.link.close()
    far.close()


def read_all(link: Link, count: int) -> bytes:
    """Read until so many bytes have come, or nothing more does."""
    came = b""
    while len(came) < count:
        data = link.read(PATIENCE)
        if not data:
            break
        came += data
    return came


def pieces(count: int) -> list[bytes]:
    return [bytes((k + i) & 255 for i in range(1 + k % 60)) for k in range(count)]


def test_bytes_come_in_intact_and_in_order(setup: Setup) -> None:
    sent = pieces(40)
    for piece in sent:
        setup.far.send(piece)
    assert read_all(setup.link, len(b"".join(sent))) == b"".join(sent)


def test_bytes_go_out_intact_and_in_order(setup: Setup) -> None:
    if setup.listens:
        setup.far.send(b"hello")
        assert setup.link.read(PATIENCE) == b"hello"
    sent = pieces(40)
    for piece in sent:
        setup.link.write(piece)
    if isinstance(setup.link, FaultyLink):
        setup.link.read(0.02)  # a late frame leaves while somebody reads
    assert setup.far.receive(len(b"".join(sent))) == b"".join(sent)


def test_reading_with_no_wait_returns_at_once_with_nothing(setup: Setup) -> None:
    assert setup.link.read(0) == b""


def test_a_wait_ends_with_nothing_after_the_time_allowed(setup: Setup) -> None:
    clock = setup.far if isinstance(setup.far, MemoryEnd) else MonotonicClock()
    began = clock.now()
    assert setup.link.read(0.02) == b""
    assert clock.now() - began >= 0.0199


def test_a_wait_ends_as_soon_as_bytes_are_there(setup: Setup) -> None:
    setup.far.send(b"x")
    clock = setup.far if isinstance(setup.far, MemoryEnd) else MonotonicClock()
    began = clock.now()
    assert setup.link.read(PATIENCE) == b"x"
    assert clock.now() - began < PATIENCE / 2


def test_closing_twice_does_nothing_and_a_closed_link_says_so(setup: Setup) -> None:
    setup.link.close()
    setup.link.close()
    with pytest.raises(LinkClosedError, match="closed"):
        setup.link.read(0)
    with pytest.raises(LinkClosedError, match="closed"):
        setup.link.write(b"x")


def test_a_link_is_a_context_manager(setup: Setup) -> None:
    with setup.link as link:
        assert link is setup.link
    with pytest.raises(LinkClosedError):
        setup.link.read(0)


@pytest.mark.parametrize("setup", ["pty", "pty-faulty", "tcp", "tcp-faulty"], indirect=True)
def test_the_other_end_closing_is_told_after_what_it_had_sent(setup: Setup) -> None:
    if setup.keeps:
        setup.far.send(b"last words")
    setup.far.close()
    if setup.keeps:
        assert read_all(setup.link, 10) == b"last words"
    for _ in range(2):
        with pytest.raises(LinkClosedError) as caught:
            setup.link.read(PATIENCE)
        assert caught.value.url == setup.link.url
    with contextlib.suppress(LinkClosedError):  # a socket may take one more write before it notices
        setup.link.write(b"anyone?")
    with pytest.raises(LinkClosedError):
        setup.link.write(b"anyone?")


def test_lockstep_is_said_of_memory_alone(setup: Setup) -> None:
    assert setup.link.lockstep == isinstance(setup.far, MemoryEnd)


def test_a_robot_that_is_not_there_is_no_error_on_udp() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    with open_link(f"udpout://127.0.0.1:{port}") as link:
        for _ in range(5):
            link.write(b"anyone?")
            assert link.read(0.001) == b""


def test_before_anyone_has_spoken_udpin_sends_nowhere() -> None:
    with open_link("udpin://127.0.0.1:0") as link:
        link.write(b"anyone?")
        assert link.read(0) == b""
