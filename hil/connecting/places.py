"""Places where a robot may be: the serial ports and CAN interfaces of this machine, and addresses that a person names.

Listers are arguments, so that all of it can be tried on a machine without hardware.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from firmware_protocol.address import DEFAULT_BAUD, parse_address
from firmware_protocol.links import can_interfaces, serial
from firmware_protocol.links.access import busy_remedy, holders

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from firmware_protocol.links.can_interfaces import CanAdapter, CanInterface
    from firmware_protocol.links.serial import SerialPort


@dataclass(frozen=True)
class Place:
    """Where a robot may be.

    Attributes:
        kind: `serial`, `can` or `address`.
        device: Its name, as `/dev/ttyACM0` or `can0`.
        url: What to connect to.
        description: The hardware in words.
        serial_number: Of the USB device; empty for none.
        details: What else is known: USB ids, state and bit rate of a CAN interface.
        obstacle: Why it is not worth opening; empty where it is.
        remedy: What to do about that.
    """

    kind: str
    device: str
    url: str
    description: str = ""
    serial_number: str = ""
    details: dict[str, object] = field(default_factory=dict)
    obstacle: str = ""
    remedy: str = ""


def serial_places(
    ports: Iterable[SerialPort], *, baud: int = DEFAULT_BAUD, having: Callable[[str], Sequence[str]] = holders
) -> list[Place]:
    """Places at serial ports.

    A port that another program has open is not opened too, even where the system would allow it: that would take bytes
    away from that program, and restart many a board.

    Args:
        ports: From `list_ports`.
        baud: Rate to begin with, in bit/s.
        having: Tells who has a port open.
    """
    places = []
    for port in ports:
        who = having(port.device)
        words = port.model or port.description
        if port.maker and port.maker.lower() not in words.lower():
            words = f"{port.maker} {words}".strip()
        places.append(
            Place(
                kind="serial",
                device=port.device,
                url=f"serial://{port.device}:{baud}",
                description=words,
                serial_number=port.serial_number,
                details={
                    "vendor_id": None if port.vendor is None else f"{port.vendor:04x}",
                    "product_id": None if port.product is None else f"{port.product:04x}",
                    "manufacturer": port.maker,
                    "product": port.model,
                },
                obstacle=f"in use by {' and '.join(who)}" if who else "",
                remedy=busy_remedy(port.device, who) if who else "",
            )
        )
    return places


def can_places(interfaces: Iterable[CanInterface], adapters: Iterable[CanAdapter]) -> list[Place]:
    """Places on CAN buses.

    Args:
        interfaces: Those of the kernel.
        adapters: Those that python-can's drivers have found. They are not opened: that takes a bit rate, and a wrong one
            disturbs the bus.
    """
    places = []
    for interface in interfaces:
        rate = "" if interface.bitrate is None else f" at {interface.bitrate} bit/s"
        words = f"{'virtual ' if interface.virtual else ''}CAN interface, {'up' if interface.is_up else 'down'}{rate}"
        if interface.state and interface.is_up:
            words += f", {interface.state}"
        obstacle = remedy = ""
        if not interface.is_up:
            obstacle, remedy = "the interface is down", can_interfaces.up_command(interface)
        elif interface.state == "bus-off":
            obstacle = "the controller is bus-off: check wiring, terminating resistors and bit rate"
            remedy = f"sudo ip link set {interface.name} down, then {can_interfaces.up_command(interface)}"
        places.append(
            Place(
                kind="can",
                device=interface.name,
                url=f"can://socketcan/{interface.name}",
                description=words,
                details={
                    "up": interface.is_up,
                    "virtual": interface.virtual,
                    "bitrate": interface.bitrate,
                    "state": interface.state,
                },
                obstacle=obstacle,
                remedy=remedy,
            )
        )
    for adapter in adapters:
        url = f"can://{adapter.interface}/{adapter.channel}?bitrate=500000"
        places.append(
            Place(
                kind="can",
                device=f"{adapter.interface} {adapter.channel}",
                url=url,
                description=f"CAN adapter of python-can's driver {adapter.interface}",
                obstacle="not opened: at a wrong bit rate it would disturb the bus",
                remedy=f"hil ports '{url}' looks, with your bus's bit rate",
            )
        )
    return places


def present(
    *,
    baud: int = DEFAULT_BAUD,
    list_ports: Callable[[], list[SerialPort]] = serial.list_ports,
    list_interfaces: Callable[[], list[CanInterface]] = can_interfaces.list_can_interfaces,
    list_adapters: Callable[[], list[CanAdapter]] = can_interfaces.list_can_adapters,
) -> list[Place]:
    """Everything of this machine that may lead to a robot: serial ports, then CAN.

    Args:
        baud: Rate at which serial ports are listened to first, in bit/s.
        list_ports: Lists serial ports.
        list_interfaces: Lists the kernel's CAN interfaces.
        list_adapters: Lists CAN adapters that python-can's drivers find.
    """
    return serial_places(list_ports(), baud=baud) + can_places(list_interfaces(), list_adapters())


def named(urls: Iterable[str]) -> list[Place]:
    """Places that a person has named by their addresses.

    Args:
        urls: Addresses of links.

    Raises:
        AddressError: One of them is no address.
    """
    parsed = [parse_address(url).url for url in urls]
    return [Place(kind="address", device=url, url=url) for url in parsed]
