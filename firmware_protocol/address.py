"""Addresses of links: URLs, taken apart and checked, with nothing opened. A bare port, as `/dev/ttyACM0`, is one too."""

from __future__ import annotations

import re
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final
from urllib.parse import parse_qsl, urlsplit

from firmware_protocol.errors import AddressError
from firmware_protocol.near import did_you_mean, nearest

if TYPE_CHECKING:
    from collections.abc import Mapping

EXAMPLES = (
    "serial:///dev/ttyACM0:115200, tcp://127.0.0.1:5760, udpin://127.0.0.1:14550, udpout://127.0.0.1:14550, "
    "can://socketcan/can0 or sim://junior"
)
SCHEMES: Final = ("serial", "tcp", "udpin", "udpout", "can", "sim", "replay")
DEFAULT_BAUD = 115200
FASTEST_BAUD = 2**31 - 1
"""No rate is greater, in bit/s: a system call takes no more."""
MAY_REPEAT = frozenset({"room"})
"""Options that may be given several times."""
REPEATED = "\n"
"""Between the values of one that is."""
_BARE: Final = re.compile(r"(?P<port>/dev/[^?]+|(?:\\\\\.\\)?COM[0-9]+(?::[^?/]*)?)(?P<options>\?.*)?", re.IGNORECASE)
"""A serial port, and perhaps its rate, without a scheme."""
_RATE: Final = re.compile(r":\w+$")
"""A rate at the end of it, or what was meant as one: names of ports that have colons end otherwise."""
_MEANT: Final = (
    (re.compile(r"(?:tty|cu\.|rfcomm)[\w.-]*(?::[0-9]+)?"), "/dev/{}"),
    (re.compile(r"v?can[0-9]+"), "can://socketcan/{}"),
    (re.compile(r"(?:[A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)*|\[[0-9A-Fa-f:]+\]):[0-9]+"), "tcp://{}"),
)
"""What is written without a scheme, and how it is written with one."""


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
                raise AddressError(self.url, f"unknown option {name!r}", f"{expected}{did_you_mean(name, known)}")


def parse_address(url: str) -> Address:
    """Take a URL apart.

    Args:
        url: For instance `serial:///dev/ttyACM0:115200` or `sim://junior?opponent=flat-heavy&seed=1`. A bare serial port, with
            or without a rate, as `/dev/ttyACM0`, `COM3` or `COM3:57600`, is the URL of it.

    Returns:
        Its parts; whether the target suits the scheme is checked where it is used.

    Raises:
        AddressError: It has no scheme, no target, or an option without a value or given twice.
    """
    if bare := _BARE.fullmatch(url):
        rate = "" if _RATE.search(bare["port"]) else f":{DEFAULT_BAUD}"
        url = f"serial://{bare['port']}{rate}{bare['options'] or ''}"
    try:
        parts = urlsplit(url)
    except ValueError as error:
        raise AddressError(url, str(error)) from error
    if not parts.scheme or "://" not in url:
        raise AddressError(url, "not an address of a link", _meant(url) or f"Write for instance {EXAMPLES}")
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


def unknown_scheme(address: Address) -> AddressError:
    """What is said of a URL whose scheme nobody knows.

    Args:
        address: The URL, taken apart.
    """
    found = nearest(address.scheme, SCHEMES)
    rest = address.url.partition("://")[2]
    remedy = f"Did you mean {found}://{rest}?" if found and found != address.scheme else f"Write for instance {EXAMPLES}"
    return AddressError(address.url, f"no link is called {address.scheme!r}", remedy)


def _meant(text: str) -> str:
    """What was probably meant by a text that is no URL, as a question; empty where nobody knows."""
    for pattern, written in _MEANT:
        if pattern.fullmatch(text):
            return f"Did you mean {written.format(text)}?"
    word, colon, rest = text.partition(":")
    if colon and (scheme := nearest(word, SCHEMES)):
        rest = rest.lstrip("/")
        return f"Did you mean {scheme}://{'/' if rest.startswith('dev/') else ''}{rest}?" if rest else ""
    name, mark, options = text.partition("?")
    return f"Did you mean sim://{found}{mark}{options}?" if (found := nearest(name, ("junior", "swarm"))) else ""
