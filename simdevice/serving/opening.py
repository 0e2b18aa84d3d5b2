"""Opens the endpoint that a person asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.address import FASTEST_BAUD, Address, parse_address, whole_number
from firmware_protocol.errors import AddressError
from simdevice.serving.endpoints import DEFAULT_BAUD, PtyEndpoint, TcpEndpoint, UdpEndpoint

if TYPE_CHECKING:
    from firmware_protocol.wire.signing import Signing
    from simdevice.serving.endpoints import Endpoint

_LOOPBACK: Final = ("127.0.0.1", "localhost", "::1")


def open_endpoint(text: str, *, public: bool = False, signing: Signing | None = None) -> Endpoint:
    """Open what a person asked for.

    Args:
        text: `pty`, `pty:57600`, `tcp://127.0.0.1:5760`, `udp://127.0.0.1:14550` (`udpin://` is the same), `slcan`, or
            `can://INTERFACE/CHANNEL`.
        public: Addresses that other machines can reach are allowed.
        signing: Signs what the server itself says for a robot that signs; None signs nothing.

    Returns:
        An endpoint that waits for its client.

    Raises:
        AddressError: It cannot be understood, or it would be reachable from other machines.
        LinkOpenError: It cannot be had.
    """
    name, _, baud = text.partition(":")
    if name in {"pty", "slcan"} and not baud.startswith("//"):
        rate = whole_number(baud, FASTEST_BAUD) if baud else 0
        if baud and not rate:
            raise AddressError(text, "the rate is not a positive number", f"Write it as {name}:115200")
        if name == "slcan":
            from simdevice.serving.can_endpoints import SLCAN_BAUD, SlcanEndpoint  # noqa: PLC0415 - python-can takes its time

            return SlcanEndpoint(rate or SLCAN_BAUD)
        return PtyEndpoint(rate or DEFAULT_BAUD)
    address: Address = parse_address(text)
    if address.scheme == "can":
        from simdevice.serving.can_endpoints import CanEndpoint  # noqa: PLC0415 - likewise

        return CanEndpoint(address, public=public)
    if address.scheme not in {"tcp", "udp", "udpin"}:
        raise AddressError(
            text, f"nothing can be served on {address.scheme!r}", "Known are: pty, tcp://, udp://, slcan, can://"
        )
    address.only()
    host, port = address.host_port()
    if not public and host not in _LOOPBACK:
        raise AddressError(text, "other machines could reach this address", "Use 127.0.0.1, or allow it expressly")
    return TcpEndpoint(host, port, signing) if address.scheme == "tcp" else UdpEndpoint(host, port)
