"""Addresses of links: URLs, taken apart and checked, with nothing opened."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlsplit

from firmware_protocol.errors import AddressError

if TYPE_CHECKING:
    from collections.abc import Mapping

EXAMPLES = (
    "serial:///dev/ttyACM0:115200, tcp://127.0.0.1:5760, udpin://127.0.0.1:14550, udpout://127.0.0.1:14550, "
    "can://socketcan/can0 or sim://junior"
)
DEFAULT_BAUD = 115200
FASTEST_BAUD = 2**31 - 1
"""No rate is greater, in bit/s: a system call takes no more."""
MAY_REPEAT = frozenset({"room"})
"""Options that may be given several times."""
REPEATED = "\n"
"""Between the values of one that is."""


def whole_number(text: str, most: int) -> int | None:
    """A whole number as it stands in an address: digits and nothing else.

    Args:
        text: The text.
        most: The greatest that will do.

    Returns:
        The number; None where it is none, or greater.
    """
    if not text.isascii() or not text.isdigit() or len(text.lstrip("0")) > len(str(most)):
        return None
    number = int(text.lstrip("0") or "0")
    return number if number <= most else None


@dataclass(frozen=True)
class Address:
    """A link's URL, taken apart.

    Attributes:
        url: The URL as given.
        scheme: What comes before `://`, in lower case.
        target: What comes between that and the options: a device, `host:port`, a name or a path.
        options: The part after `?`; the values of one that is given several times, with `REPEATED` between them.
    """

    url: str
    scheme: str
    target: str
    options: Mapping[str, str]

    def host_port(self) -> tuple[str, int]:
        """The target as host and port.

        Returns:
            Host name or number (an IPv6 number without its brackets), and port.

        Raises:
            AddressError: The target is not `host:port`.
        """
        host, colon, port = self.target.rpartition(":")
        number = whole_number(port, 65535)
        if not colon or not host or number is None:
            raise AddressError(self.url, "the address is not host:port", f"Write it as {self.scheme}://127.0.0.1:5760")
        return host.strip("[]"), number

    def port_baud(self) -> tuple[str, int]:
        """The target as serial port and baud rate.

        Returns:
            Device name and rate in bit/s; without a rate, 115200.

        Raises:
            AddressError: No device is named, or the rate is not a positive number.
        """
        device, colon, baud = self.target.rpartition(":")
        if not colon or "/" in baud:
            device, baud = self.target, str(DEFAULT_BAUD)
        rate = whole_number(baud, FASTEST_BAUD)
        if not device or not rate:
            raise AddressError(self.url, "the address is not PORT:BAUD", "Write it as serial:///dev/ttyACM0:115200")
        return device, rate

    def only(self, *known: str) -> None:
        """Check that every option is one of these.

        Args:
            *known: Names of the options that have a meaning here.

        Raises:
            AddressError: There is another one.
        """
        for name in self.options:
            if name not in known:
                expected = f"Known are: {', '.join(known)}" if known else "It takes none"
                raise AddressError(self.url, f"unknown option {name!r}", expected)


def parse_address(url: str) -> Address:
    """Take a URL apart.

    Args:
        url: For instance `serial:///dev/ttyACM0:115200` or `sim://junior?opponent=flat-heavy&seed=1`.

    Returns:
        Its parts; whether the target suits the scheme is checked where it is used.

    Raises:
        AddressError: It has no scheme, no target, or an option without a value or given twice.
    """
    try:
        parts = urlsplit(url)
    except ValueError as error:
        raise AddressError(url, str(error)) from error
    if not parts.scheme or "://" not in url:
        raise AddressError(url, "not an address of a link", f"Write for instance {EXAMPLES}")
    if not parts.netloc + parts.path:
        raise AddressError(url, "nothing follows the scheme", f"Write for instance {EXAMPLES}")
    try:
        pairs = parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query))
    except ValueError as error:
        raise AddressError(url, f"options are not NAME=VALUE ({error})") from error
    options: dict[str, str] = {}
    for name, value in pairs:
        if name in options and name not in MAY_REPEAT:
            raise AddressError(url, "an option is given twice")
        options[name] = f"{options[name]}{REPEATED}{value}" if name in options else value
    return Address(url, parts.scheme.lower(), parts.netloc + parts.path, MappingProxyType(options))
