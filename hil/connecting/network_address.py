"""Addresses of emulated places with several networks: each network has an address of its own."""

from __future__ import annotations

from firmware_protocol.address import Address, parse_address, whole_number
from firmware_protocol.errors import AddressError

MOST_NUMBER = 2**32 - 1
_NETWORK = "&network="


def networks_of(address: Address) -> list[Address]:
    """The networks behind an address, each with an address of its own.

    Args:
        address: `sim://swarm?networks=3` has three, `sim://junior?networks=2` two; every other address is one.

    Raises:
        AddressError: It is no number of networks.
    """
    count = (number_option(address, "networks") or 1) if address.scheme == "sim" else 1
    if count <= 1 or "network" in address.options:
        return [address]
    return [parse_address(f"{address.url}{_NETWORK}{number}") for number in range(1, count + 1)]


def whole_of(address: Address) -> str:
    """The address of all networks of an emulated place.

    Args:
        address: That of one of them, as `networks_of` makes it, or of all.
    """
    return address.url.rpartition(_NETWORK)[0] or address.url


def network_of(address: Address) -> int:
    """Which network of an emulated place an address is, from 1; 0: it is all of them.

    Args:
        address: `sim://...`.

    Raises:
        AddressError: There is no such network.
    """
    if address.scheme != "sim" or "network" not in address.options:
        return 0
    number, count = number_option(address, "network"), number_option(address, "networks") or 1
    if number is None or not 1 <= number <= count:
        raise AddressError(address.url, f"network is 1 to {count}, not {number}")
    return number


def number_option(address: Address, name: str) -> int | None:
    """A whole number among the options of an address.

    Args:
        address: The address, taken apart.
        name: Which option.

    Returns:
        Its value; None where it is not given.

    Raises:
        AddressError: It is no whole number.
    """
    text = address.options.get(name)
    if text is None:
        return None
    number = whole_number(text, MOST_NUMBER)
    if number is None:
        raise AddressError(address.url, f"{name} is a whole number, 0 to {MOST_NUMBER}, not {text[:40]!r}")
    return number
