"""One suite for every CAN link, with and without a faulty wrapper around it (that only delays)."""

from __future__ import annotations

import contextlib
import os
import threading
import tty
from typing import TYPE_CHECKING, Protocol

import can
import pytest

from firmware_protocol.address import parse_address
from firmware_protocol.can_frame import CanFrame, pack_frames, split_records
from firmware_protocol.errors import AddressError, LinkClosedError, LinkOpenError, LinkTimeoutError
from firmware_protocol.link import open_link
from firmware_protocol.links import FaultSpec, FaultyLink
from firmware_protocol.links.can import BUS_OFF, PASSIVE, WARNING, WELL, CanLink, open_can
from firmware_protocol.wire import CAN
from hil.clock import MonotonicClock
from simdevice.can_endpoints import SlcanEndpoint

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from firmware_protocol.link import Link

PATIENCE = 2.0
"""How long anything may take before a test fails, in s."""
PORT = 20000 + os.getpid() % 20000
"""Of the multicast bus: groups alone do not keep two buses apart."""
FRAMES = [CanFrame(0x100 + k, bytes(range(k, k + k % 9))) for k in range(40)]
EXTENDED = CanFrame(0x1ABCDEF0, b"\1\2", extended=True)


class FarEnd(Protocol):
    """Another node of the bus, in the test's hands."""

    def send(self, data: bytes) -> None: ...
    def receive(self, count: int) -> bytes: ...
    def close(self) -> None: ...


class BusEnd:
    """A node that opens the same bus."""

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

    def send(self, data: bytes) -> None:
        with self._more:
            self.endpoint.send(data, self._clock.now())

    def receive(self, count: int) -> bytes:
        with self._more:
            self._more.wait_for(lambda: len(self._came) >= count, PATIENCE)
            came, self._came = self._came, b""
        return came

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self.endpoint.close()


def _virtual() -> tuple[Link, FarEnd]:
    url = "can://virtual/contract"
    return open_link(url), BusEnd(url)


def _udp() -> tuple[Link, FarEnd]:
    url = f"can://udp_multicast/239.74.163.2?port={PORT}"
    return open_link(url), BusEnd(url)


def _slcan() -> tuple[Link, FarEnd]:
    far = AdapterEnd()
    try:
        link = open_link(f"{far.endpoint.url}&bitrate=500000")
    except BaseException:
        far.close()
        raise
    far.receive(0)
    with far._more:
        assert far._more.wait_for(lambda: far.endpoint._adapter.is_open, PATIENCE)
    return link, far


def _socketcan() -> tuple[Link, FarEnd]:
    try:
        return open_link("can://socketcan/vcan0"), BusEnd("can://socketcan/vcan0")
    except LinkOpenError as error:
        pytest.skip(f"this machine has no kernel CAN with an interface vcan0 ({error.reason})")


KINDS: dict[str, Callable[[], tuple[Link, FarEnd]]] = {
    "virtual": _virtual,
    "udp_multicast": _udp,
    "slcan": _slcan,
    "socketcan": _socketcan,
}


@pytest.fixture(params=[f"{kind}{how}" for kind in KINDS for how in ("", "-faulty")][:-1])
def ends(request: pytest.FixtureRequest) -> Iterator[tuple[Link, FarEnd]]:
    kind, _, faulty = str(request.param).partition("-")
    link, far = KINDS[kind]()
    if faulty:
        link = FaultyLink(link, FaultSpec(delay=0.002, jitter=0.003), seed=1, clock=MonotonicClock(), split=split_records)
    yield link, far
    link.close()
    far.close()


def read_all(link: Link, count: int) -> bytes:
    """Read until so many bytes have come, or nothing more does."""
    came = b""
    while len(came) < count and (data := link.read(PATIENCE)):
        came += data
    return came


def test_frames_come_in_whole_and_in_order(ends: tuple[Link, FarEnd]) -> None:
    link, far = ends
    sent = pack_frames([*FRAMES, EXTENDED])
    far.send(sent)
    assert read_all(link, len(sent)) == sent


def test_frames_go_out_whole_in_order_and_do_not_come_back(ends: tuple[Link, FarEnd]) -> None:
    link, far = ends
    sent = pack_frames([*FRAMES, EXTENDED])
    for start in range(0, len(sent), 64):
        link.write(sent[start : start + 64])
    if isinstance(link, FaultyLink):
        link.read(0.02)  # a late frame leaves while somebody reads
    assert far.receive(len(sent)) == sent
    assert link.read(0.01) == b""


def test_a_wait_ends_with_nothing_after_the_time_allowed(ends: tuple[Link, FarEnd]) -> None:
    link, clock = ends[0], MonotonicClock()
    assert link.read(0) == b""
    began = clock.now()
    assert link.read(0.02) == b""
    assert clock.now() - began >= 0.0199


def test_closing_twice_does_nothing_and_a_closed_link_says_so(ends: tuple[Link, FarEnd]) -> None:
    link = ends[0]
    assert (link.wire, link.lockstep, link.news()) == (CAN, False, [])
    link.close()
    link.close()
    with pytest.raises(LinkClosedError, match="closed"):
        link.read(0)
    with pytest.raises(LinkClosedError, match="closed"):
        link.write(EXTENDED.pack())


def test_an_adapter_that_is_unplugged_ends_the_link() -> None:
    master, slave = os.openpty()
    tty.setraw(slave)
    link = open_link(f"can://slcan/{os.ttyname(slave)}?sleep_after_open=0")
    os.close(slave)
    os.close(master)
    with pytest.raises(LinkClosedError, match="gone"):
        read_all(link, 1)
    link.close()


def test_garbage_from_an_adapter_is_counted_and_ends_nothing() -> None:
    master, slave = os.openpty()
    tty.setraw(slave)
    link = open_link(f"can://slcan/{os.ttyname(slave)}?sleep_after_open=0")
    assert isinstance(link, CanLink)
    for number, garbage in enumerate((b"tzzz1\r", b"t1\r", b"T\xff\xff\r", b"tFFF0\r")):
        os.write(master, garbage)
        while link.garbage == number:
            assert link.read(PATIENCE) == b""
    os.write(master, b"t1232ABCD\r")
    came = link.read(PATIENCE)
    link.close()
    os.close(slave)
    os.close(master)
    assert came == CanFrame(0x123, b"\xab\xcd").pack()


class ScriptedBus(can.BusABC):
    """A bus that says what a test wants it to."""

    def __init__(self) -> None:
        super().__init__("scripted")
        self.incoming: list[can.Message | Exception] = []
        self.refuses: Exception | None = None

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:  # noqa: ARG002
        if not self.incoming:
            return None, False
        item = self.incoming.pop(0)
        if isinstance(item, Exception):
            raise item
        return item, False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002
        if self.refuses:
            raise self.refuses


@pytest.fixture
def scripted() -> Iterator[tuple[CanLink, ScriptedBus]]:
    bus = ScriptedBus()
    link = CanLink("can://scripted/x", bus, "scripted")
    yield link, bus
    link.close()


def error_frame(kind: int, status: int = 0) -> can.Message:
    return can.Message(arbitration_id=kind, is_error_frame=True, data=[0, status, 0, 0, 0, 0, 0, 0])


def test_trouble_on_the_bus_is_told_once_and_so_is_its_end(scripted: tuple[CanLink, ScriptedBus]) -> None:
    link, bus = scripted
    bus.incoming = [error_frame(4, 8), error_frame(4, 0x20), error_frame(4, 0x10), error_frame(0x40), error_frame(0x100)]
    assert link.read(0) == b""
    assert link.news() == [WARNING, PASSIVE, BUS_OFF, WELL]
    assert link.news() == []


def test_remote_and_long_frames_are_not_ours(scripted: tuple[CanLink, ScriptedBus]) -> None:
    link, bus = scripted
    bus.incoming = [
        can.Message(arbitration_id=1, is_remote_frame=True),
        can.Message(arbitration_id=1, is_fd=True, data=bytes(12)),
    ]
    assert link.read(0) == b""


def test_a_full_bus_is_a_time_out_and_a_missing_one_the_end(scripted: tuple[CanLink, ScriptedBus]) -> None:
    link, bus = scripted
    bus.refuses = can.CanOperationError("No buffer space available", 105)
    with pytest.raises(LinkTimeoutError, match="takes no frames"):
        link.write(EXTENDED.pack())
    bus.refuses = can.CanOperationError("Network is down", 100)
    with pytest.raises(LinkClosedError, match="gone"):
        link.write(EXTENDED.pack())
    bus.incoming = [can.CanOperationError("No such device", 19)]
    with pytest.raises(LinkClosedError, match="gone"):
        link.read(0)


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("can://socketcan", "not can://INTERFACE/CHANNEL"),
        ("can://nothing/x", "python-can has no interface 'nothing'"),
        ("can://slcan//dev/not-there?sleep_after_open=0", "hil ports lists the ports"),
        ("can://udp_multicast/10.1.2.3", "multicast group"),
        ("can://socketcan/not-there", "ip link set not-there up type can bitrate"),
    ],
)
def test_what_cannot_be_opened_comes_with_a_remedy(url: str, words: str) -> None:
    with pytest.raises(LinkOpenError, match=words), contextlib.closing(open_can(parse_address(url))):
        pass
    if "nothing" in url:
        with pytest.raises(AddressError):
            open_link(url)
