"""The CAN interfaces of this machine: those of the Linux kernel, and those that python-can's drivers find."""

from __future__ import annotations

import json
import logging
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable

NET: Final = Path("/sys/class/net")
_ARPHRD_CAN: Final = "280"
"""Type of a network interface that is a CAN bus (linux/if_arp.h)."""
_FLAG_UP: Final = 1
_PATIENCE: Final = 2.0
"""Longest wait for the program `ip`, in s."""
_HARDWARE: Final = (
    "pcan", "kvaser", "vector", "ixxat", "gs_usb", "cantact", "systec", "usb2can", "neovi", "nican", "nixnet", "canalystii",
)  # fmt: skip
"""Drivers of python-can that can tell which adapters are plugged in. Buses without hardware are always there: no news."""


@dataclass(frozen=True)
class CanInterface:
    """A CAN interface of the Linux kernel.

    Attributes:
        name: As `can0`.
        is_up: It has been brought up.
        virtual: It leads to programs of this machine only, and has no bit rate.
        bitrate: In bit/s; None where it is not known or not set.
        state: State of the controller in words (`error-active`, `bus-off`); empty where it is not known.
    """

    name: str
    is_up: bool
    virtual: bool = False
    bitrate: int | None = None
    state: str = ""


@dataclass(frozen=True)
class CanAdapter:
    """A CAN adapter that a driver of python-can has found.

    Attributes:
        interface: Its kind, as python-can calls it.
        channel: Which one.
    """

    interface: str
    channel: str


def ip_details() -> list[dict[str, Any]]:
    """What the program `ip` says of all network interfaces; empty where there is no such program."""
    program = shutil.which("ip")
    if program is None:
        return []
    try:
        done = subprocess.run(  # noqa: S603 - a program of the system, with fixed arguments
            [program, "-json", "-details", "link", "show"], capture_output=True, timeout=_PATIENCE, check=True
        )
        found = json.loads(done.stdout)
    except (OSError, subprocess.SubprocessError, ValueError):
        return []
    return [row for row in found if isinstance(row, dict)] if isinstance(found, list) else []


def list_can_interfaces(*, net: Path = NET, details: Callable[[], list[dict[str, Any]]] = ip_details) -> list[CanInterface]:
    """The CAN interfaces of the Linux kernel, by name; none on other systems.

    Args:
        net: Where the kernel lists its network interfaces.
        details: Says more of them, as `ip -json -details link show` does.
    """
    try:
        buses = [path for path in sorted(net.iterdir()) if _read(path / "type") == _ARPHRD_CAN]
    except OSError:
        return []
    found = [(path.name, bool(_number(_read(path / "flags")) & _FLAG_UP)) for path in buses]
    if not found:
        return []
    known = {str(row.get("ifname")): row for row in details()}
    return [_interface(name, up, known.get(name, {})) for name, up in found]


def _interface(name: str, is_up: bool, row: dict[str, Any]) -> CanInterface:  # noqa: FBT001
    information = row.get("linkinfo")
    information = information if isinstance(information, dict) else {}
    data = information.get("info_data")
    data = data if isinstance(data, dict) else {}
    timing = data.get("bittiming")
    bitrate = timing.get("bitrate") if isinstance(timing, dict) else None
    kind = str(information.get("info_kind", ""))
    return CanInterface(
        name=name,
        is_up=is_up,
        virtual=kind in {"vcan", "vxcan"} or (not kind and name.startswith(("vcan", "vxcan"))),
        bitrate=bitrate if isinstance(bitrate, int) and bitrate > 0 else None,
        state=str(data.get("state", "")).lower(),
    )


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii", errors="replace").strip()
    except OSError:
        return ""


def _number(text: str) -> int:
    try:
        return int(text, 0)
    except ValueError:
        return 0


def list_can_adapters() -> list[CanAdapter]:
    """The CAN adapters that python-can's drivers find without the kernel."""
    import can  # noqa: PLC0415 - it loads much that nobody needs who asks for no adapters

    logger = logging.getLogger("can")
    before = logger.level
    logger.setLevel(logging.CRITICAL + 1)  # every driver that is not installed would say so
    try:
        found = can.detect_available_configs(_HARDWARE)
    finally:
        logger.setLevel(before)
    return [CanAdapter(str(row["interface"]), str(row["channel"])) for row in found]


def up_command(interface: CanInterface) -> str:
    """The command that brings an interface up.

    Args:
        interface: One that is down.
    """
    if interface.virtual:
        return f"sudo ip link set {interface.name} up"
    return f"sudo ip link set {interface.name} up type can bitrate {interface.bitrate or 500_000} restart-ms 100"
