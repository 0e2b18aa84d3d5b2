"""A link of every kind, with its other end in the test's hands."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import threading
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, Protocol

import pytest
from serving import MULTICAST

from firmware_protocol.errors import LinkOpenError
from firmware_protocol.links import MemoryLink, UdpLink
from firmware_protocol.links.opening import open_link
from firmware_protocol.messages import Ping
from firmware_protocol.wire.can.frame import CanFrame
from firmware_protocol.wire.fields import CAN, MAVLINK
from firmware_protocol.wire.mavlink import MavlinkCodec
from hil.bridge.clock import MonotonicClock
from simdevice.serving.can_endpoints import SlcanEndpoint

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.clock import Clock
    from firmware_protocol.link import Link

PATIENCE: Final = 2.0
"""How long anything may take before a test fails, in s."""


class FarEnd(Protocol):
    """The other end of a link. One call of `send` carries whole frames; `receive` gives what has come, once so much has."""

    def send(self, data: bytes) -> None: ...
    def receive(self, count: int) -> bytes: ...
    def close(self) -> None: ...


@dataclass
class MemoryEnd:
    """A device in the same process, and a clock: its own."""

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
        end = self.now() + PATIENCE
        while len(self.came) < count and self.now() < end:
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


class BusEnd:
    """Another node of a bus."""

    def __init__(self, url: str) -> None:
        self.link = open_link(url)

    def send(self, data: bytes) -> None:
        self.link.write(data)

    def receive(self, count: int) -> bytes:
        return read_all(self.link, count)

    def close(self) -> None:
        self.link.close()


class AdapterEnd:
    """The bus behind a serial adapter, served by a thread as the emulator does."""

    def __init__(self) -> None:
        self.endpoint = SlcanEndpoint()
        self._clock = MonotonicClock()
        self._came = b""
        self._more = threading.Condition()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._stop.wait(0.0005):
            with self._more:
                self._came += self.endpoint.receive(self._clock.now())
                self.endpoint.send(b"", self._clock.now())
                self._more.notify()

    def wait_open(self) -> None:
        """Wait until the client has opened the channel."""
        with self._more:
            assert self._more.wait_for(lambda: self.endpoint.is_open, PATIENCE)

    def send(self, data: bytes) -> None:
        with self._more:
            self.endpoint.send(data, self._clock.now())

    def receive(self, count: int) -> bytes:
        with self._more:
            self._more.wait_for(lambda: len(self._came) >= count, PATIENCE)
            came, self._came = self._came, b""
        return came

    def close(self) -> None:
        if not self._stop.is_set():
            self._stop.set()
            self._thread.join()
            self.endpoint.close()


@dataclass
class Setup:
    """A link and its far end.

    Attributes:
        link: The link, perhaps made faulty.
        far: Its far end.
        clock: The time by which the link waits.
    """

    link: Link
    far: FarEnd
    clock: Clock = field(default_factory=MonotonicClock)


def _memory(wire: str = MAVLINK) -> Setup:
    end = MemoryEnd()
    return Setup(MemoryLink(end, wire=wire), end, end)


def _pty() -> Setup:
    master, slave = os.openpty()
    link = open_link(f"serial://{os.ttyname(slave)}:115200")
    os.close(slave)
    return Setup(link, FileEnd(master))


def _tcp() -> Setup:
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = open_link(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        return Setup(link, SocketEnd(server.accept()[0]))


def _udpin() -> Setup:
    link = open_link("udpin://127.0.0.1:0")
    assert isinstance(link, UdpLink)
    end = SocketEnd(socket.socket(socket.AF_INET, socket.SOCK_DGRAM), ("127.0.0.1", link.local_port))
    end.send(b"hello")  # it answers whoever spoke last
    assert link.read(PATIENCE) == b"hello"
    return Setup(link, end)


def _udpout() -> Setup:
    far = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    far.bind(("127.0.0.1", 0))
    link = open_link(f"udpout://127.0.0.1:{far.getsockname()[1]}")
    assert isinstance(link, UdpLink)
    return Setup(link, SocketEnd(far, ("127.0.0.1", link.local_port)))


def _bus(url: str) -> Setup:
    return Setup(open_link(url), BusEnd(url))


def _slcan() -> Setup:
    far = AdapterEnd()
    try:
        link = open_link(f"{far.endpoint.url}&bitrate=500000")
        far.wait_open()
    except BaseException:
        far.close()
        raise
    return Setup(link, far)


def socketcan_url() -> str:
    """The address of a kernel bus; skips the test, and says why, on a machine that has none."""
    url = "can://socketcan/vcan0"
    try:
        open_link(url).close()
    except LinkOpenError as error:
        pytest.skip(f"this machine has no kernel CAN with an interface vcan0 ({error.reason})")
    return url


KINDS: Final[dict[str, Callable[[], Setup]]] = {
    "memory": _memory,
    "pty": _pty,
    "tcp": _tcp,
    "udpin": _udpin,
    "udpout": _udpout,
    "memory_can": lambda: _memory(CAN),
    "virtual": lambda: _bus("can://virtual/contract"),
    "udp_multicast": lambda: _bus(MULTICAST),
    "slcan": _slcan,
    "socketcan": lambda: _bus(socketcan_url()),
}
"""Makes a link of a kind; only `socketcan` may skip the test."""


def read_all(link: Link, count: int) -> bytes:
    """Read until so many bytes have come, or nothing more does."""
    came = b""
    while len(came) < count and (data := link.read(PATIENCE)):
        came += data
    return came


def frames(wire: str, count: int) -> list[bytes]:
    """Different whole frames, as a wire carries them."""
    if wire == CAN:
        plain = [CanFrame(0x100 + k, bytes(range(k, k + k % 9))) for k in range(count - 1)]
        return [frame.pack() for frame in (*plain, CanFrame(0x1ABCDEF0, b"\1\2", extended=True))]
    codec = MavlinkCodec(system=255, component=190)
    return [codec.encode(Ping(time_usec=k * 0x01010101_01010101 % 2**64, seq=k)) for k in range(count)]


def closed(setup: Setup) -> None:
    """Give everything back."""
    with contextlib.ExitStack() as stack:
        stack.callback(setup.far.close)
        stack.callback(setup.link.close)
