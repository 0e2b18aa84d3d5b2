"""What the machine has: ports with their USB identity, CAN interfaces with their state, and who may and does use them."""

from __future__ import annotations

import logging
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import can
import pytest
import serial.tools.list_ports

from firmware_protocol.links import can_interfaces
from firmware_protocol.links.access import access_remedy, busy_remedy, group_remedy, holders
from firmware_protocol.links.can_interfaces import CanAdapter, CanInterface, list_can_adapters, list_can_interfaces, up_command
from firmware_protocol.links.serial import SerialPort, list_ports
from hil.connecting.places import can_places, present, serial_places

ARDUINO = SerialPort("/dev/ttyACM0", "Arduino Leonardo", "9573535", 0x2341, 0x8036, "Arduino LLC", "Arduino Leonardo")
ONBOARD = SerialPort("/dev/ttyS0", "ttyS0", "")


# --- Serial ports ----------------------------------------------------------------------------------------------------


def test_ports_are_listed_with_their_usb_identity(monkeypatch: pytest.MonkeyPatch) -> None:
    found = [
        SimpleNamespace(
            device="/dev/ttyS0", description="n/a", serial_number=None, vid=None, pid=None, manufacturer=None, product=None
        ),
        SimpleNamespace(
            device="/dev/ttyACM0", description="Arduino Leonardo", serial_number="9573535", vid=0x2341, pid=0x8036,
            manufacturer="Arduino LLC", product="Arduino Leonardo",
        ),
    ]  # fmt: skip
    monkeypatch.setattr(serial.tools.list_ports, "comports", lambda: found)
    assert list_ports() == [ARDUINO, SerialPort("/dev/ttyS0", "", "")]


def test_serial_places() -> None:
    arduino, onboard = serial_places([ARDUINO, ONBOARD], baud=57600, having=lambda _: [])
    assert (arduino.kind, arduino.url, arduino.obstacle) == ("serial", "serial:///dev/ttyACM0:57600", "")
    assert arduino.description == "Arduino LLC Arduino Leonardo"
    assert (arduino.details["vendor_id"], arduino.details["product_id"]) == ("2341", "8036")
    assert (onboard.description, onboard.details["vendor_id"]) == ("ttyS0", None)


def test_a_port_that_another_program_has_is_left_alone() -> None:
    (place,) = serial_places([ARDUINO], having=lambda device: [f"screen (process 7) on {device}"])
    assert place.obstacle == "in use by screen (process 7) on /dev/ttyACM0"
    assert place.remedy.startswith("Close screen")


def test_everything_is_listed() -> None:
    places = present(
        list_ports=lambda: [ARDUINO],
        list_interfaces=lambda: [CanInterface("can0", is_up=False)],
        list_adapters=lambda: [CanAdapter("pcan", "PCAN_USBBUS1")],
    )
    assert [place.device for place in places] == ["/dev/ttyACM0", "can0", "pcan PCAN_USBBUS1"]
    assert present(list_ports=list, list_interfaces=list, list_adapters=list) == []


# --- Who has a port, and who may have it -----------------------------------------------------------------------------


def process(proc: Path, number: int, name: str, *files: str) -> None:
    (proc / str(number) / "fd").mkdir(parents=True)
    (proc / str(number) / "comm").write_text(f"{name}\n", encoding="ascii")
    for index, file in enumerate(files):
        (proc / str(number) / "fd" / str(index)).symlink_to(file)


def test_who_has_a_port_is_read_from_proc(tmp_path: Path) -> None:
    (tmp_path / "sys").mkdir()
    process(tmp_path, 12, "bash", "/dev/null")
    process(tmp_path, 300, "picocom", "/dev/null", "/dev/not-there")
    process(tmp_path, 99, "screen", "/dev/not-there")
    process(tmp_path, os.getpid(), "ourselves", "/dev/not-there")
    assert holders("/dev/not-there", proc=tmp_path) == ["screen (process 99)", "picocom (process 300)"]
    assert holders("/dev/other", proc=tmp_path) == []
    assert holders("/dev/other", proc=tmp_path / "nothing") == []


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="no /proc here")
def test_a_program_that_has_a_port_is_named() -> None:
    master, slave = os.openpty()
    try:
        code = f"import sys; port = open({os.ttyname(slave)!r}, 'rb', 0); print('open', flush=True); sys.stdin.read()"
        with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:  # noqa: S603
            assert other.stdout is not None
            assert other.stdout.readline() == b"open\n"
            (name,) = holders(os.ttyname(slave))
            other.communicate(timeout=10)
        assert name.endswith(f"(process {other.pid})")
        assert name.startswith("python")
        assert holders(os.ttyname(slave)) == []
    finally:
        os.close(master)
        os.close(slave)


def test_what_to_do_about_a_busy_port() -> None:
    closed = busy_remedy("/dev/ttyACM0", ["screen (process 9)"])
    assert closed.startswith("Close screen (process 9). Or, to look on:")
    assert "--share tcp://127.0.0.1:5770" in closed
    assert "--share tcp://127.0.0.1:5770" in busy_remedy("/dev/ttyACM0", [])
    assert "ModemManager" in busy_remedy("/dev/ttyACM0", ["ModemManager (process 700)"])
    assert "systemctl disable" in busy_remedy("/dev/ttyACM0", ["ModemManager (process 700)"])
    assert "sudo fuser -v /dev/ttyACM0" in busy_remedy("/dev/ttyACM0", [])


@pytest.mark.parametrize(
    ("group", "shared", "member", "listed", "said"),
    [
        ("dialout", True, False, False, "`sudo usermod -aG dialout $USER`, then log out"),
        ("uucp", True, False, False, "`sudo usermod -aG uucp $USER`"),
        ("dialout", True, False, True, "newgrp dialout"),
        ("root", True, False, False, "Only root may"),
        ("dialout", False, False, False, "Only root may"),
        ("dialout", True, True, True, "chmod a+rw /dev/ttyX"),
    ],
)
def test_what_to_do_without_permission(group: str, shared: bool, member: bool, listed: bool, said: str) -> None:  # noqa: FBT001
    assert said in group_remedy("/dev/ttyX", group, shared=shared, member=member, listed=listed)


def test_the_group_is_that_which_owns_the_port(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    grp = pytest.importorskip("grp")
    port = tmp_path / "port"
    port.write_bytes(b"")
    port.chmod(0o660)
    monkeypatch.setattr(grp, "getgrgid", lambda _: SimpleNamespace(gr_name="tty", gr_mem=[]))
    monkeypatch.setattr(os, "getgroups", list)
    assert "usermod -aG tty $USER" in access_remedy(str(port))
    port.chmod(0o600)
    assert "Only root may" in access_remedy(str(port))
    assert "usermod -aG dialout $USER" in access_remedy(str(tmp_path / "gone"))


# --- CAN -------------------------------------------------------------------------------------------------------------

IP: list[dict[str, Any]] = [
    {"ifname": "lo"},
    {
        "ifname": "can0",
        "linkinfo": {"info_kind": "can", "info_data": {"state": "ERROR-ACTIVE", "bittiming": {"bitrate": 250000}}},
    },
    {"ifname": "can1", "linkinfo": {"info_kind": "can", "info_data": {"state": "STOPPED"}}},
    {"ifname": "vcan0", "linkinfo": {"info_kind": "vcan"}},
]


@pytest.fixture
def net(tmp_path: Path) -> Path:
    for name, kind, flags in (("lo", 772, 0x9), ("can0", 280, 0x40C1), ("can1", 280, 0x4080), ("vcan0", 280, 0xC1)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "type").write_text(f"{kind}\n", encoding="ascii")
        (tmp_path / name / "flags").write_text(f"{flags:#x}\n", encoding="ascii")
    return tmp_path


def test_can_interfaces_are_listed_with_state_and_bit_rate(net: Path) -> None:
    assert list_can_interfaces(net=net, details=lambda: IP) == [
        CanInterface("can0", is_up=True, bitrate=250000, state="error-active"),
        CanInterface("can1", is_up=False, state="stopped"),
        CanInterface("vcan0", is_up=True, virtual=True),
    ]


def test_can_interfaces_are_listed_without_the_program_ip(net: Path) -> None:
    assert [(found.name, found.is_up, found.virtual) for found in list_can_interfaces(net=net, details=list)] == [
        ("can0", True, False),
        ("can1", False, False),
        ("vcan0", True, True),
    ]
    assert list_can_interfaces(net=net / "nothing", details=list) == []


@pytest.mark.parametrize("said", ["[]", "no json", '{"a": 1}', '[1, {"ifname": "can0", "linkinfo": 3}]'])
def test_whatever_ip_says_is_survived(monkeypatch: pytest.MonkeyPatch, net: Path, said: str) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: "/sbin/ip")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: SimpleNamespace(stdout=said.encode()))
    assert [found.name for found in list_can_interfaces(net=net)] == ["can0", "can1", "vcan0"]


def test_the_program_ip_may_be_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    assert can_interfaces.ip_details() == []


def test_what_to_do_about_can_interfaces() -> None:
    up, down, off, virtual = can_places(
        [
            CanInterface("can0", is_up=True, bitrate=250000, state="error-active"),
            CanInterface("can1", is_up=False, bitrate=125000),
            CanInterface("can2", is_up=True, bitrate=500000, state="bus-off"),
            CanInterface("vcan0", is_up=False, virtual=True),
        ],
        [],
    )
    assert (up.obstacle, up.url) == ("", "can://socketcan/can0")
    assert up.description == "CAN interface, up at 250000 bit/s, error-active"
    assert down.obstacle == "the interface is down"
    assert down.remedy == "sudo ip link set can1 up type can bitrate 125000 restart-ms 100"
    assert "bus-off" in off.obstacle
    assert off.remedy.startswith("sudo ip link set can2 down")
    assert virtual.remedy == "sudo ip link set vcan0 up"
    assert up_command(CanInterface("can3", is_up=False)) == "sudo ip link set can3 up type can bitrate 500000 restart-ms 100"


def test_adapters_are_not_opened_at_a_guessed_bit_rate() -> None:
    (place,) = can_places([], [CanAdapter("pcan", "PCAN_USBBUS1")])
    assert place.url == "can://pcan/PCAN_USBBUS1?bitrate=500000"
    assert "disturb" in place.obstacle


def test_the_drivers_of_python_can_are_asked_in_silence(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    asked = []

    def detect(interfaces: object) -> list[dict[str, object]]:
        asked.append(interfaces)
        logging.getLogger("can.pcan").error("no driver")
        return [{"interface": "pcan", "channel": "PCAN_USBBUS1"}]

    monkeypatch.setattr(can, "detect_available_configs", detect)
    assert list_can_adapters() == [CanAdapter("pcan", "PCAN_USBBUS1")]
    assert "virtual" not in str(asked)
    assert capfd.readouterr().err == ""
