"""CAN links alone: what an adapter may say, trouble on the bus, and what cannot be opened."""

from __future__ import annotations

import contextlib
import os
import tty
from typing import TYPE_CHECKING

import can
import pytest
from link_kinds import PATIENCE, read_all
from serving import MULTICAST

from firmware_protocol.address import parse_address
from firmware_protocol.clock import ManualClock
from firmware_protocol.errors import AddressError, LinkClosedError, LinkOpenError, LinkTimeoutError
from firmware_protocol.links.can import BUS_OFF, PASSIVE, WARNING, WELL, CanLink, open_can
from firmware_protocol.links.opening import open_link
from firmware_protocol.wire.can.frame import CanFrame

if TYPE_CHECKING:
    from collections.abc import Iterator

FRAME = CanFrame(0x123, b"\xab\xcd")
EXTENDED = CanFrame(0x1ABCDEF0, b"\1\2", extended=True)


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
            assert link.read(0.005) == b""
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
        self.refusals: list[Exception] = []
        self.sent: list[can.Message] = []
        self.told = can.BusState.ACTIVE

    @property
    def state(self) -> can.BusState:
        return self.told

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        self.told = new_state

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:  # noqa: ARG002
        if not self.incoming:
            return None, False
        item = self.incoming.pop(0)
        if isinstance(item, Exception):
            raise item
        return item, False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002
        if self.refusals:
            raise self.refusals.pop(0)
        if self.refuses:
            raise self.refuses
        self.sent.append(msg)


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
        ("can://udp_multicast/239.74.163.2?prot=43114", "no option 'prot'.*port"),
        ("can://udp_multicast/239.74.163.2?port=70000", "port is 0 to 65535, not 70000"),
        ("can://udp_multicast/239.74.163.2?hop_limit=-1", "hop_limit is 0 to 255, not -1"),
        ("can://virtual/x?node=128", "node is 1 to 127 on a CAN bus, not '128'"),
        ("can://virtual/x?system=0", "system is 1 to 127"),
    ],
)
def test_what_cannot_be_opened_comes_with_a_remedy(url: str, words: str) -> None:
    with pytest.raises(LinkOpenError, match=words), contextlib.closing(open_can(parse_address(url))):
        pass
    if "nothing" in url:
        with pytest.raises(AddressError):
            open_link(url)


def test_a_full_queue_is_waited_for(scripted: tuple[CanLink, ScriptedBus]) -> None:
    link, bus = scripted
    bus.refusals = [can.CanOperationError("No buffer space available", 105)] * 3
    link.write(EXTENDED.pack())
    assert bus.refusals == []
    assert len(bus.sent) == 1


def test_a_driver_that_tells_how_the_bus_is_tells_its_end_too(scripted: tuple[CanLink, ScriptedBus]) -> None:
    link, bus = scripted
    for state in (can.BusState.PASSIVE, can.BusState.ERROR, can.BusState.ERROR, can.BusState.ACTIVE, can.BusState.ACTIVE):
        bus.told = state
        assert link.read(0) == b""
    assert link.news() == [PASSIVE, BUS_OFF, WELL]


def test_a_driver_that_knows_nothing_does_not_end_the_trouble_that_frames_tell(scripted: tuple[CanLink, ScriptedBus]) -> None:
    link, bus = scripted
    bus.incoming = [error_frame(0x40)]
    for _ in range(3):
        assert link.read(0) == b""
    assert link.news() == [BUS_OFF]


def test_two_groups_are_two_buses_though_they_share_a_port() -> None:
    port = MULTICAST.rpartition("=")[2]
    with (
        open_link(f"can://udp_multicast/239.74.163.2?port={port}") as one,
        open_link(f"can://udp_multicast/239.74.163.3?port={port}") as other,
        open_link(f"can://udp_multicast/239.74.163.3?port={port}") as third,
    ):
        one.write(FRAME.pack())
        other.write(EXTENDED.pack())
        assert third.read(PATIENCE) == EXTENDED.pack()
        assert one.read(0.02) == b""
        assert third.read(0.02) == b""


def test_an_unplugged_adapter_s_port_is_given_back() -> None:
    master, slave = os.openpty()
    tty.setraw(slave)
    link = open_link(f"can://slcan/{os.ttyname(slave)}?sleep_after_open=0")
    assert isinstance(link, CanLink)
    file = link.fileno()
    os.close(slave)
    os.close(master)
    link.close()
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(file)
    assert link.fileno() == -1


def test_a_bus_off_that_lasts_ends_the_link_and_one_that_passes_does_not(
    scripted: tuple[CanLink, ScriptedBus], monkeypatch: pytest.MonkeyPatch
) -> None:
    link, bus = scripted
    clock = ManualClock()
    monkeypatch.setattr("firmware_protocol.links.can.monotonic", clock.now)

    def let_pass(times: int) -> None:
        for _ in range(times):
            assert link.read(0) == b""
            clock.advance(0.1)

    bus.incoming = [error_frame(0x40)]
    let_pass(15)
    bus.incoming = [error_frame(0x100)]
    let_pass(30)
    assert link.news() == [BUS_OFF, WELL]
    bus.incoming = [error_frame(0x40)]
    let_pass(19)
    with pytest.raises(LinkClosedError, match="bus-off for 2 s"):
        let_pass(5)
