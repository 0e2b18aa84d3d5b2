"""`sim://swarm?...`: an address's options, as what an emulated swarm begins with."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from firmware_protocol.address import REPEATED
from firmware_protocol.errors import AddressError
from firmware_protocol.wire.codec import SPLITTERS
from firmware_protocol.wire.fields import MAVLINK
from hil.connecting.network_address import network_of, number_option
from hil.files.profile_file import ProfileFileError, read_profile

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.address import Address
    from firmware_protocol.faults.spec import FaultSpec
    from simdevice.swarm.rooms import Room
    from simdevice.swarm.settings import SwarmSettings

SWARM: Final = "swarm"
"""Target of the address of an emulated swarm."""
SWARM_OPTIONS: Final = (
    "rangers", "wilds", "wall", "seed", "networks", "wire", "noise", "dropout", "occlusion", "ring", "period", "size", "room",
    "faults", "network", "system", "node",
)  # fmt: skip
_LARGEST: Final = 65.535
"""Side of a table, in m, as TABLE_RESET can tell it."""


def is_swarm(address: Address) -> bool:
    """Whether an address is that of an emulated swarm."""
    return address.scheme == "sim" and address.target == SWARM


def swarm_settings(address: Address, faults: FaultSpec | None = None) -> SwarmSettings:
    """What the swarm of an address begins with.

    Args:
        address: `sim://swarm?...`.
        faults: What goes wrong, as its options say.

    Raises:
        AddressError: Something in its options is wrong.
    """
    from simdevice.swarm.settings import SwarmSettings  # noqa: PLC0415 - pymunk is only needed here

    address.only(*SWARM_OPTIONS)
    given = address.options
    if (wire := given.get("wire", MAVLINK)) not in SPLITTERS:
        raise AddressError(address.url, f"wire is {' or '.join(SPLITTERS)}")
    period = given.get("period", "5")
    if period not in {"5", "10"}:
        raise AddressError(address.url, f"period is 5 or 10 (ms), not {period[:40]!r}")
    names = [name for name in given.get("room", "").split(REPEATED) if name]
    try:
        profile = read_profile(given.get("noise", "default"))
        if "dropout" in given:
            profile = replace(profile, dropout=_share(given["dropout"]))
        return SwarmSettings(
            rangers=_number(address, "rangers", SwarmSettings.rangers),
            wilds=_number(address, "wilds", SwarmSettings.wilds),
            wall=_switch(address, "wall", default=False),
            seed=_number(address, "seed", SwarmSettings.seed),
            networks=_number(address, "networks", 1),
            wire=wire,
            profile=profile,
            occlusion=_switch(address, "occlusion", default=False),
            ring=_switch(address, "ring", default=True),
            period=int(period) / 1000,
            size=size_of(given["size"]) if "size" in given else None,
            rooms=rooms_of(names),
            faults=faults,
        )
    except AddressError:  # which is a ValueError, and names the address already
        raise
    except (ValueError, ProfileFileError) as error:
        raise AddressError(address.url, str(error)) from error


def robots_of(address: Address) -> int:
    """How many robots there are at the address of a swarm, or of one of its networks.

    Raises:
        AddressError: Something in its options is wrong.
    """
    settings = swarm_settings(address)
    number = network_of(address)
    return settings.count if not number else min(settings.per, settings.count - (number - 1) * settings.per)


def rooms_of(names: Sequence[str]) -> tuple[Room, ...]:
    """The rooms that a user names.

    Args:
        names: Names of those that come with the program, or paths of images.

    Raises:
        ValueError: There is none of this name, or an image can't be read.
    """
    from simdevice.swarm.rooms import NAMES, built_in, from_image  # noqa: PLC0415 - as above

    return tuple(from_image(Path(name)) if name not in NAMES and Path(name).suffix else built_in(name) for name in names)


def size_of(text: str) -> tuple[float, float]:
    """The size of a table as a user writes it.

    Args:
        text: A side of a square one, or its width and height with a comma between them, in m.

    Raises:
        ValueError: It is no size.
    """
    try:
        sides = [float(side) for side in text.split(",")]
    except ValueError:
        sides = []
    if not 1 <= len(sides) <= 2 or not all(0 < side <= _LARGEST for side in sides):
        raise ValueError(f"size is a side or W,H in m, more than 0 and at most {_LARGEST}, not {text[:40]!r}")
    return sides[0], sides[-1]


def _share(text: str) -> float:
    try:
        share = float(text)
    except ValueError:
        share = math.nan
    if not 0 <= share <= 1:
        raise ValueError(f"dropout is a probability within a second, 0 to 1, not {text[:40]!r}")
    return share


def _switch(address: Address, name: str, *, default: bool) -> bool:
    text = address.options.get(name, "1" if default else "0")
    if text not in {"0", "1"}:
        raise AddressError(address.url, f"{name} is 0 or 1, not {text[:40]!r}")
    return text == "1"


def _number(address: Address, name: str, default: int) -> int:
    number = number_option(address, name)
    return default if number is None else number
