"""`sim://junior?...`: an address's options, as what an emulated Junior on the sumo ring begins with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import AddressError
from firmware_protocol.near import nearest
from firmware_protocol.wire.codec import SPLITTERS
from firmware_protocol.wire.fields import MAVLINK
from hil.connecting.network_address import number_option
from hil.connecting.swarm_address import SWARM
from hil.signing.key_file import no_signatures

if TYPE_CHECKING:
    from firmware_protocol.address import Address
    from firmware_protocol.faults.spec import FaultSpec
    from firmware_protocol.wire.signing import SigningKey
    from simdevice.boards import BoardMaker
    from simdevice.sumo.settings import WorldSettings

JUNIOR: Final = "junior"
"""Target of the address of an emulated Junior, and name of the opponent that is one."""
JUNIOR_OPTIONS: Final = (
    "opponent", "seed", "faults", "referee", "wire", "board", "count", "networks", "network", "system", "node", "vary",
    "mass", "friction", "speed", "force", "left", "right", "eyes", "battery", "opponent_mass", "opponent_friction", "delay",
)  # fmt: skip
BOARDS: Final = ("host", "avr")
"""What an emulated robot's firmware runs on: this process, or an ATmega328P emulated by simavr."""


def junior_settings(address: Address, faults: FaultSpec | None = None, key: SigningKey | None = None) -> WorldSettings:
    """What the Junior of an address begins with, or each of several.

    Args:
        address: `sim://junior?...`; with `networks=2` the opponent is a second Junior, which has a host of its own.
        faults: What goes wrong, as its options say.
        key: Signing key that it comes up with.

    Raises:
        AddressError: It is of something else, or something in its options is wrong.
    """
    from simdevice.sumo.conditions import CONDITIONS, Conditions  # noqa: PLC0415 - pymunk is only needed here
    from simdevice.sumo.settings import WorldSettings  # noqa: PLC0415 - as above

    if address.target != JUNIOR:
        meant = nearest(address.target, (JUNIOR, SWARM))
        remedy = f"Did you mean sim://{meant}?" if meant else "Write sim://junior or sim://swarm"
        raise AddressError(address.url, f"there is no emulated {address.target!r}", remedy)
    address.only(*JUNIOR_OPTIONS)
    given = address.options
    if (referee := given.get("referee", "1")) not in {"0", "1"}:
        raise AddressError(address.url, "referee is 0 or 1")
    if (wire := given.get("wire", MAVLINK)) not in SPLITTERS:
        raise AddressError(address.url, f"wire is {' or '.join(SPLITTERS)}")
    if (board := given.get("board", BOARDS[0])) not in BOARDS:
        raise AddressError(address.url, f"board is {' or '.join(BOARDS)}")
    if (networks := number_option(address, "networks")) not in {None, 1, 2}:
        raise AddressError(address.url, f"a ring has two robots, each on one network: networks is 1 or 2, not {networks}")
    seed, maker, hosted = number_option(address, "seed") or 0, board_maker(board, wire), networks == 2
    if hosted and "count" in given:
        raise AddressError(address.url, "several rings have one network", "Leave out count, or networks")
    if key is not None and wire != MAVLINK:
        raise no_signatures(address.url)
    if key is not None and maker is not None:
        raise AddressError(address.url, "the firmware of this board is built without signing", "Leave --signing-key out")
    if key is not None and hosted:
        raise AddressError(address.url, "a second Junior comes without a signing key", "Leave --signing-key out")
    try:
        return WorldSettings(
            opponent=given.get("opponent", JUNIOR if hosted else WorldSettings.opponent),
            seed=seed,
            referee=referee == "1",
            wire=wire,
            faults=faults,
            board=maker,
            signing_key=key,
            hosted=hosted,
            conditions=Conditions(**{name: _real(address, name) for name in CONDITIONS if name in given}),
            vary=_real(address, "vary") if "vary" in given else 0.0,
        )
    except AddressError:  # which is a ValueError, and names the address already
        raise
    except ValueError as error:
        raise AddressError(address.url, str(error)) from error


def _real(address: Address, name: str) -> float:
    """An option that is a number of any kind.

    Raises:
        AddressError: It is none.
    """
    try:
        return float(address.options[name])
    except ValueError as error:
        raise AddressError(address.url, f"{name} is a number, not {address.options[name][:40]!r}") from error


def board_maker(name: str, wire: str = MAVLINK) -> BoardMaker | None:
    """What puts a board into an emulated robot.

    Args:
        name: One of `BOARDS`.
        wire: What it is to speak.

    Returns:
        The maker; None where the world's own board will do.

    Raises:
        AddressError: That board does not speak it.
    """
    if name != "avr":
        return None
    if wire != MAVLINK:
        raise AddressError("board=avr", "the AVR board has a serial line and no CAN", "Choose another wire or another board")
    from simdevice.avr.board import AvrBoard  # noqa: PLC0415 - only where it is wanted

    return AvrBoard
