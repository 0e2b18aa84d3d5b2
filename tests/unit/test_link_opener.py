"""A port that is plugged in again, perhaps under another name: found by its hardware. Real pseudo-terminals, a made-up list."""

from __future__ import annotations

import os
import socket
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import pytest

from firmware_protocol.errors import AddressError, LinkOpenError
from firmware_protocol.links import LinkOpener, SerialPort

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@dataclass
class Bench:
    """Serial ports of a machine that there is not."""

    ports: list[SerialPort] = field(default_factory=list)
    handles: list[int] = field(default_factory=list)

    def plug_in(self, serial_number: str = "SN1", vendor: int | None = 0x2341, product: int = 0x0043) -> str:
        """A device is plugged in: returns its name."""
        master, slave = os.openpty()
        self.handles += [master, slave]
        self.ports.append(SerialPort(os.ttyname(slave), "Board", serial_number, vendor, product))
        return self.ports[-1].device

    def unplug(self, name: str) -> None:
        self.ports = [port for port in self.ports if port.device != name]

    def list(self) -> list[SerialPort]:
        return self.ports


@pytest.fixture
def bench() -> Iterator[Bench]:
    bench = Bench()
    yield bench
    for handle in bench.handles:
        os.close(handle)


def opened(opener: LinkOpener) -> str:
    """Opens, and closes again: where it was."""
    with opener.open() as link:
        return link.url


def test_the_same_hardware_is_found_under_another_name(bench: Bench) -> None:
    first = bench.plug_in()
    opener = LinkOpener(f"serial://{first}:57600", bench.list)
    assert opened(opener) == f"serial://{first}:57600"
    bench.unplug(first)
    bench.plug_in("SN2")
    with pytest.raises(LinkOpenError, match="the USB device 2341:0043 with serial number SN1 is not plugged in"):
        opener.open()
    second = bench.plug_in()
    assert opened(opener) == f"serial://{second}:57600"


def test_the_old_name_is_not_opened_if_other_hardware_has_it(bench: Bench) -> None:
    name = bench.plug_in()
    opener = LinkOpener(f"serial://{name}:57600", bench.list)
    opened(opener)
    bench.ports = [SerialPort(name, "Another board", "SN9", 0x2341, 0x0043)]
    with pytest.raises(LinkOpenError, match="not plugged in"):
        opener.open()


def test_without_a_serial_number_all_of_the_same_make_are_tried_in_turn(bench: Bench) -> None:
    first, other = bench.plug_in("", 0x1A86, 0x7523), bench.plug_in("", 0x1A86, 0x7523)
    bench.plug_in("", 0x1A86, 0x5523)
    opener = LinkOpener(f"serial://{other}:57600", bench.list)
    opened(opener)
    assert [opened(opener) for _ in range(3)] == [f"serial://{name}:57600" for name in (other, first, other)]


def test_the_number_of_a_pseudo_terminal_is_not_opened_again(bench: Bench) -> None:
    name = bench.plug_in("", None)
    opener = LinkOpener(f"serial://{name}:57600", bench.list)
    assert opened(opener) == f"serial://{name}:57600"
    with pytest.raises(LinkOpenError, match="may be another program's by now"):
        opener.open()


def test_nor_is_it_through_a_link_that_still_leads_there(bench: Bench, tmp_path: Path) -> None:
    link = tmp_path / "robot"
    link.symlink_to(bench.plug_in("", None))
    opener = LinkOpener(f"serial://{link}:57600", bench.list)
    opened(opener)
    with pytest.raises(LinkOpenError, match="may be another program's by now"):
        opener.open()


def test_a_port_without_usb_is_opened_by_its_name(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("firmware_protocol.links.reopen._PSEUDO", "/dev/none/")  # a pty stands for a port on the board
    name = bench.plug_in("", None)
    opener = LinkOpener(f"serial://{name}:57600", bench.list)
    assert [opened(opener), opened(opener)] == [f"serial://{name}:57600"] * 2


def test_a_link_to_the_name_is_followed_to_where_it_leads_now(bench: Bench, tmp_path: Path) -> None:
    first = bench.plug_in()
    link = tmp_path / "by-id-board"
    link.symlink_to(first)
    opener = LinkOpener(f"serial://{link}:57600", bench.list)
    assert opened(opener) == f"serial://{link}:57600"
    bench.unplug(first)
    link.unlink()
    with pytest.raises(LinkOpenError, match="not plugged in"):
        opener.open()
    link.symlink_to(bench.plug_in())
    assert opened(opener) == f"serial://{link}:57600"


def test_a_link_alone_is_followed_where_there_is_no_usb(tmp_path: Path) -> None:
    link = tmp_path / "robot"
    opener = LinkOpener(f"serial://{link}:57600", list)
    for _ in range(2):
        master, slave = os.openpty()
        link.symlink_to(os.ttyname(slave))
        assert opened(opener) == f"serial://{link}:57600"
        link.unlink()
        os.close(slave)
        os.close(master)
    with pytest.raises(LinkOpenError, match="there is no port"):
        opener.open()


def test_an_adapter_for_can_is_found_again_too(bench: Bench) -> None:
    first = bench.plug_in()
    opener = LinkOpener(f"can://slcan/{first}?sleep_after_open=0", bench.list)
    opened(opener)
    bench.unplug(first)
    second = bench.plug_in()
    assert opened(opener) == f"can://slcan/{second}?sleep_after_open=0"


def test_what_is_no_serial_port_is_just_opened_again() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        url = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        opener = LinkOpener(url, list)
        assert [opened(opener), opened(opener)] == [url, url]
    with pytest.raises(LinkOpenError, match="nothing listens"):
        opener.open()
    with pytest.raises(AddressError):
        LinkOpener("robot")
