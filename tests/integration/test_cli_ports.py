"""`hil ports` on real ptys, sockets and buses, and what it prints."""

from __future__ import annotations

import functools
import json
import os
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest
from signed_pair import KEY

from firmware_protocol.links.opening import open_link
from firmware_protocol.links.serial import SerialPort
from hil.bridge.clock import MonotonicClock
from hil.cli.app import run
from hil.connecting.places import present
from simdevice.serving.endpoints import Endpoint, PtyEndpoint
from simdevice.serving.opening import open_endpoint
from simdevice.serving.server import serve
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from firmware_protocol.wire.signing import SigningKey
    from hil.pytest_plugin import ServedJunior

NEEDS_PTY = pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")


@pytest.fixture(autouse=True)
def _bare_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine with no ports but those that a test adds."""
    here(monkeypatch)


def here(monkeypatch: pytest.MonkeyPatch, *ports: SerialPort) -> None:
    """Make these the machine's ports."""
    listed = functools.partial(present, list_ports=lambda: list(ports), list_interfaces=list, list_adapters=list)
    monkeypatch.setattr("hil.cli.ports.present", listed)
    monkeypatch.setattr("firmware_protocol.links.serial.list_ports", lambda: list(ports))


@contextmanager
def served(endpoint: Endpoint, key: SigningKey | None = None) -> Iterator[str]:
    """An emulated robot in real time."""
    stop = threading.Event()
    world = junior_world(WorldSettings(wire=endpoint.wire, signing_key=key))
    thread = threading.Thread(target=serve, args=(world, endpoint, MonotonicClock(), stop.is_set))
    thread.start()
    try:
        yield endpoint.url
    finally:
        stop.set()
        thread.join(10)


class OtherRate(PtyEndpoint):
    """A serial port whose robot talks at 57600 baud: at any other rate its bytes are garbage."""

    def send(self, data: bytes, now: float) -> None:
        import termios  # noqa: PLC0415 - POSIX only

        right = termios.tcgetattr(self._slave)[5] == termios.B57600
        super().send(data if right else bytes(byte ^ 0x5A for byte in data), now)


def test_a_machine_without_ports(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["ports"]) == 3
    assert "hil emulate junior --link pty" in capsys.readouterr().out
    assert run(["ports", "--json"]) == 3
    assert json.loads(capsys.readouterr().out) == []
    assert run(["ports", "--no-probe"]) == 0


@pytest.mark.slow
@NEEDS_PTY
def test_robot_busy_port_and_none(
    junior_pty: ServedJunior, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    master, slave = os.openpty()
    other, busy = os.openpty()
    robot = SerialPort(junior_pty.path, "USB Serial", "A123", 0x1A86, 0x7523, "QinHeng", "USB Serial")
    here(monkeypatch, robot, SerialPort(os.ttyname(slave), "", ""), SerialPort(os.ttyname(busy), "", ""))
    try:
        with open_link(f"serial://{os.ttyname(busy)}:115200"):
            assert run(["ports", "--json", "--timeout", "2"]) == 0
    finally:
        for file in (master, slave, other, busy):
            os.close(file)
    first, second, third = json.loads(capsys.readouterr().out)
    assert (first["status"], first["url"]) == ("robot", junior_pty.url)
    assert (first["serial_number"], first["details"]["vendor_id"], first["details"]["product_id"]) == ("A123", "1a86", "7523")
    (found,) = first["robots"]
    assert (found["system"], found["state"], found["armed"], found["firmware"]) == (1, "disarmed", False, "0.1")
    assert (second["status"], second["reason"]) == ("silent", "nothing came at all")
    assert third["status"] == "unavailable"
    assert "in use by another program" in third["reason"]
    assert "fuser" in third["remedy"]


@pytest.mark.slow
@NEEDS_PTY
def test_a_robot_at_another_rate(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    endpoint = OtherRate(57600)
    here(monkeypatch, SerialPort(endpoint.path, "", ""))
    with served(endpoint) as url:
        assert run(["ports", "--timeout", "8"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == endpoint.path
    assert lines[1].startswith("    Junior, system 1, disarmed, firmware 0.1, battery 7.")
    assert lines[1].endswith(f": hil monitor {url}")


@pytest.mark.slow
@pytest.mark.parametrize("link", ["tcp://127.0.0.1:0", f"can://udp_multicast/239.74.163.2?port={20000 + os.getpid() % 20000}"])
def test_addresses_can_be_named(link: str, capsys: pytest.CaptureFixture[str]) -> None:
    with served(open_endpoint(link)) as url:
        assert run(["ports", url, "tcp://127.0.0.1:1"]) == 0
    text = capsys.readouterr().out
    assert "Junior, system 1, disarmed" in text
    assert f"hil monitor {url}" in text or f"hil monitor '{url}'" in text
    assert "nothing listens on port 1 of 127.0.0.1" in text


def test_an_address_that_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["ports", "ttyACM0"]) == 2
    assert "not an address of a link" in capsys.readouterr().err


def test_what_keeps_a_port_from_being_used_is_told_without_opening_any(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    here(monkeypatch, SerialPort("/dev/ttyACM0", "Arduino", "95", 0x2341, 0x8036))
    assert run(["ports", "--no-probe"]) == 0
    assert capsys.readouterr().out == "/dev/ttyACM0  Arduino  (2341:8036, serial number 95)\n"


@pytest.mark.slow
def test_robots_that_sign(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "our.key"
    path.touch(0o600)
    path.write_text(KEY.secret.hex())
    with served(open_endpoint("tcp://127.0.0.1:0"), KEY) as url:
        assert run(["ports", url]) == 3
        assert "signs; pass --signing-key" in capsys.readouterr().out
        assert run(["ports", url, "--signing-key", str(path)]) == 0
    text = capsys.readouterr().out
    assert f"signs with this key: hil monitor {url} --signing-key {path}" in text
    assert "firmware 0.1" in text
    arguments = ["ports", "sim://junior", "sim://junior?wire=can", "--json", "--signing-key", str(path)]
    assert run(arguments) == 0
    found = [finding["robots"][0]["signed"] for finding in json.loads(capsys.readouterr().out)]
    assert found == ["our key", "not"]
