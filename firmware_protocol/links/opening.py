"""Opens the link that an address names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.address import parse_address, unknown_scheme
from firmware_protocol.links.serial import SerialLink
from firmware_protocol.links.tcp import TcpLink
from firmware_protocol.links.udp import UdpLink

if TYPE_CHECKING:
    from firmware_protocol.link import Link


def open_link(url: str) -> Link:
    """Open a link that leads out of this process.

    The options `system` and `node`, which select a robot, are allowed and mean nothing here.

    Args:
        url: `serial://PORT:BAUD` (or the bare port), `tcp://HOST:PORT`, `udpin://HOST:PORT` (waits for the robot to speak
            first), `udpout://HOST:PORT` or `can://INTERFACE/CHANNEL?bitrate=RATE`. `sim://` and `replay://` are the business of
            `hil.connect`.

    Returns:
        The open link; close it after use (it is a context manager).

    Raises:
        LinkOpenError: It could not be opened; the text says what to do.
        AddressError: The URL is not one of these.
    """
    address = parse_address(url)
    if address.scheme == "can":
        from firmware_protocol.links.can import open_can  # noqa: PLC0415 - python-can takes a moment to load

        return open_can(address)
    address.only("system", "node")
    match address.scheme:
        case "serial":
            return SerialLink(address.url, *address.port_baud())
        case "tcp":
            return TcpLink(url, *address.host_port())
        case "udpin":
            return UdpLink(url, *address.host_port(), listen=True)
        case "udpout":
            return UdpLink(url, *address.host_port(), listen=False)
        case _:
            raise unknown_scheme(address)
