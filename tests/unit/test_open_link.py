"""Addresses, and what is said when a link cannot be opened."""

from __future__ import annotations

import errno
import os
import socket
from typing import TYPE_CHECKING

import pytest
import serial

import firmware_protocol
from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError, LinkOpenError
from firmware_protocol.links import serial as serial_link
from firmware_protocol.links.opening import open_link
from firmware_protocol.links.serial import SerialPort

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize(
    ("url", "port", "baud"),
    [
        ("serial:///dev/ttyACM0:57600", "/dev/ttyACM0", 57600),
        ("serial:///dev/ttyACM0", "/dev/ttyACM0", 115200),
        ("serial://COM3:9600", "COM3", 9600),
        ("SERIAL://COM3", "COM3", 115200),
        ("/dev/ttyACM0", "/dev/ttyACM0", 115200),
        ("/dev/ttyUSB1:57600", "/dev/ttyUSB1", 57600),
        ("/dev/ttyUSB1:57600?system=2", "/dev/ttyUSB1", 57600),
        ("/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0", "/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0", 115200),
        ("COM3", "COM3", 115200),
        ("com12:9600", "com12", 9600),
        (r"\\.\COM10", r"\\.\COM10", 115200),
        ("serial:///dev/serial/by-id/usb-a:b/c", "/dev/serial/by-id/usb-a:b/c", 115200),
    ],
)
def test_serial_addresses(url: str, port: str, baud: int) -> None:
    assert parse_address(url).port_baud() == (port, baud)


@pytest.mark.parametrize(
    ("url", "host", "port"), [("tcp://robot.local:5760", "robot.local", 5760), ("udpin://[::1]:14550?system=3", "::1", 14550)]
)
def test_network_addresses(url: str, host: str, port: int) -> None:
    assert parse_address(url).host_port() == (host, port)


def test_options() -> None:
    address = parse_address("sim://junior?opponent=flat-heavy&faults=drop:0.05,corrupt:0.01")
    assert (address.scheme, address.target) == ("sim", "junior")
    assert address.options == {"opponent": "flat-heavy", "faults": "drop:0.05,corrupt:0.01"}


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("junior", "not an address"),
        ("tcp://", "nothing follows"),
        ("tcp://host", "not host:port"),
        ("tcp://host:99999", "not host:port"),
        ("tcp://host:5760?a", "NAME=VALUE"),
        ("tcp://host:5760?system=1&system=2", "twice"),
        ("tcp://host:5760?sytem=1", "unknown option 'sytem'"),
        ("serial:///dev/ttyACM0:fast", "not PORT:BAUD"),
        ("serial:///dev/ttyACM0:0", "not PORT:BAUD"),
        ("ftp://host:21", "no link is called 'ftp'"),
        ("sim://junior", "no link is called 'sim'"),
        ("tcp://[::1:5760", "IPv6"),
    ],
)
def test_wrong_addresses_are_refused_with_a_remedy(url: str, said: str) -> None:
    with pytest.raises(AddressError, match=said) as caught:
        open_link(url)
    assert isinstance(caught.value, LinkOpenError)
    assert isinstance(caught.value, ValueError)


def test_a_bare_port_is_the_url_of_it() -> None:
    address = parse_address("/dev/ttyACM0?system=2")
    assert (address.url, address.scheme) == ("serial:///dev/ttyACM0:115200?system=2", "serial")
    assert parse_address(address.url) == address


@pytest.mark.parametrize(
    ("url", "meant"),
    [
        ("ttyACM0", "/dev/ttyACM0"),
        ("can0", "can://socketcan/can0"),
        ("localhost:5760", "tcp://localhost:5760"),
        ("serial:/dev/ttyACM0", "serial:///dev/ttyACM0"),
        ("udpn:127.0.0.1:14550", "udpin://127.0.0.1:14550"),
        ("tpc://127.0.0.1:5760", "tcp://127.0.0.1:5760"),
        ("junoir?seed=3", "sim://junior?seed=3"),
        ("tcp://127.0.0.1:5760?sytem=1", "system"),
    ],
)
def test_what_is_nearly_an_address_is_asked_for(url: str, meant: str) -> None:
    with pytest.raises(AddressError) as caught:
        open_link(url)
    assert caught.value.remedy.endswith(f"Did you mean {meant}?")


@pytest.mark.parametrize("url", ["", "/home/robot", "x" * 100_000, "moon"])
def test_of_what_is_like_nothing_examples_are_given(url: str) -> None:
    with pytest.raises(AddressError) as caught:
        open_link(url)
    assert "Did you mean" not in caught.value.remedy


def test_a_missing_port_is_told_with_those_present(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serial_link, "list_ports", lambda: [SerialPort("/dev/ttyUSB7", "", "")])
    with pytest.raises(LinkOpenError, match="there is no port /dev/nosuch") as caught:
        open_link("serial:///dev/nosuch:115200")
    assert "/dev/ttyUSB7" in caught.value.remedy


def test_no_port_at_all_asks_whether_the_robot_is_plugged_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serial_link, "list_ports", list)
    with pytest.raises(LinkOpenError, match="plugged in"):
        open_link("serial:///dev/nosuch:115200")


def test_a_file_is_not_a_port(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(LinkOpenError, match="is not a serial port"):
        open_link(f"serial://{tmp_path}/file:115200")


def test_a_port_that_is_open_already_is_busy() -> None:
    master, slave = os.openpty()
    url = f"serial://{os.ttyname(slave)}:115200"
    try:
        with open_link(url), pytest.raises(LinkOpenError, match="in use by another program"):
            open_link(url)
        open_link(url).close()
    finally:
        os.close(master)
        os.close(slave)


@pytest.mark.parametrize(
    ("code", "said"),
    [
        (errno.EACCES, "usermod -aG dialout"),
        (errno.EBUSY, "in use"),
        (errno.ENOENT, "no port"),
        (errno.EIO, "could not be opened"),
    ],
)
def test_what_the_system_says_is_put_into_words(monkeypatch: pytest.MonkeyPatch, code: int, said: str) -> None:
    def fail(*_: object, **__: object) -> None:
        raise serial.SerialException(code, os.strerror(code))

    monkeypatch.setattr(serial, "Serial", fail)
    with pytest.raises(LinkOpenError, match=said):
        open_link("serial:///dev/nosuch:115200")


def test_nobody_listening_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(LinkOpenError, match=f"nothing listens on port {port}"):
        open_link(f"tcp://127.0.0.1:{port}")


def test_a_taken_udp_port_is_told() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        with pytest.raises(LinkOpenError, match="Another program may have it"):
            open_link(f"udpin://127.0.0.1:{taken.getsockname()[1]}")


def test_public_names_are_there() -> None:
    for name in firmware_protocol.__all__:
        assert getattr(firmware_protocol, name) is not None
    with pytest.raises(AttributeError, match="nothing_such"):
        _ = firmware_protocol.nothing_such
