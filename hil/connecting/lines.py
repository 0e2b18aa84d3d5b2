"""What the line of an address carries, and whether that is enough.

A serial line carries what its baud rate says, and a line that is made slow on purpose (`?faults=rate:1920`) what that says.
Nobody can know it of another: it is taken to be fast enough, and if it is not, `diagnosis` sees it by what comes.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

from firmware_protocol.errors import LinkOpenError
from firmware_protocol.peer.pacing import BITS_PER_BYTE, Pace, baud_of, full_capacity, least_capacity, pace_for
from firmware_protocol.roles.known import ROLES

if TYPE_CHECKING:
    from firmware_protocol.address import Address
    from firmware_protocol.faults.spec import FaultSpec


def capacity_of(address: Address, faults: FaultSpec | None = None) -> float | None:
    """What a line carries each way, in bytes/s; None where nobody knows.

    Args:
        address: Its address, taken apart.
        faults: What befalls the line, as the address asks for.
    """
    baud = address.port_baud()[1] / BITS_PER_BYTE if address.scheme == "serial" else inf
    capacity = min(baud, faults.rate if faults is not None else inf)
    return capacity if capacity < inf else None


def pace_of(address: Address, faults: FaultSpec | None = None, *, signed: bool) -> Pace | None:
    """What to ask of the robots on a line, so that half of it stays free; None where they need not be spared.

    Args:
        address: Its address, taken apart.
        faults: What befalls the line, as the address asks for.
        signed: Frames are signed.

    Raises:
        LinkOpenError: No robot can be driven over so slow a line.
    """
    capacity = capacity_of(address, faults)
    if capacity is None:
        return None
    if capacity < (least := least_capacity(ROLES[0], signed=signed)):
        raise LinkOpenError(address.url, *too_slow(address, capacity, least, "driving a robot"))
    return pace_for(ROLES[0], capacity, signed=signed)


def need_full_rate(address: Address, faults: FaultSpec | None = None, *, signed: bool) -> None:
    """See that a line carries all that a robot says by itself, and as much again.

    Args:
        address: Its address, taken apart.
        faults: What befalls the line, as the address asks for.
        signed: Frames are signed.

    Raises:
        LinkOpenError: It does not.
    """
    capacity, least = capacity_of(address, faults), full_capacity(ROLES[0], signed=signed)
    if capacity is not None and capacity < least:
        raise LinkOpenError(address.url, *too_slow(address, capacity, least, "checking all that a robot says"))


def too_slow(address: Address, capacity: float, least: float, purpose: str) -> tuple[str, str]:
    """What is said of a line that is too slow: what is so, and what to do.

    Args:
        address: Its address, taken apart.
        capacity: What it carries, in bytes/s.
        least: What it must carry, in bytes/s.
        purpose: What for.
    """
    if address.scheme != "serial":
        return f"a line of {capacity:,.0f} bytes a second is too slow: {purpose} takes {least:,.0f}", ""
    baud = address.port_baud()[1]
    reason = f"a line of {baud:,} baud is too slow: {purpose} takes {baud_of(least):,} baud"
    return reason, "Set both ends to a higher rate, 115200 if they can"
