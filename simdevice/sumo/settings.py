"""What an emulated bout begins with: the one list of what can be chosen of a world."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from firmware_protocol.wire.fields import MAVLINK
from simdevice.arena import CONTROL_PERIOD
from simdevice.junior.profile import JuniorProfile
from simdevice.sumo.conditions import MOST_VARY, NOMINAL, Conditions
from simdevice.sumo.opponents import JUNIOR_OPPONENT

if TYPE_CHECKING:
    from firmware_protocol.faults.spec import FaultSpec
    from firmware_protocol.wire.signing import SigningKey
    from simdevice.boards import BoardMaker, Host


@dataclass(frozen=True)
class WorldSettings:
    """A Junior on the sumo ring, or each of several.

    Attributes:
        opponent: Its name, as on the command line: `flat-light`, or another of `OpponentCode`, in lower case.
        seed: Seed of everything random.
        referee: There is a referee on the wire; without one it is as with a physical robot.
        profile: The device's numbers.
        nvm: Image of Junior's EEPROM, as `device.nvm` gave it; None is a new robot. Of several: one image after the other.
        host: Build of the firmware that Junior runs; None is the one that comes with the package.
        wire: What goes in and out: MAVLink, or CAN frames in serial form.
        faults: What goes wrong with Junior, by the world's time; faults of a line are `DisturbedWorld`'s business.
        board: Makes Junior's board, as `AvrBoard` does; None is one in this process. A second Junior always has the latter.
        signing_key: Key that Junior and the referee sign with; None: Junior has the one in `nvm`, if any.
        start_held: Junior is switched on with its start input held: it forgets the time of its signatures that is in `nvm`.
        period: One control period, in s. The firmware is made for 5 ms.
        hosted: The opponent, a second Junior, has a host of its own on a second network, and no keeper.
        conditions: How it differs from the nominal.
        vary: Each bout has conditions of its own, drawn from its seed: every quantity is off by up to this share of what
            it is nominally. 0 draws nothing.

    Raises:
        ValueError: The period takes no time, an opponent that is no robot is to have a host, or that is no share.
    """

    opponent: str = "flat-light"
    seed: int = 1
    referee: bool = True
    profile: JuniorProfile = field(default_factory=JuniorProfile)
    nvm: bytes | None = None
    host: Host | None = None
    wire: str = MAVLINK
    faults: FaultSpec | None = None
    board: BoardMaker | None = None
    signing_key: SigningKey | None = None
    start_held: bool = False
    period: float = CONTROL_PERIOD
    hosted: bool = False
    conditions: Conditions = NOMINAL
    vary: float = 0.0

    def __post_init__(self) -> None:
        if not self.period > 0.0:
            raise ValueError(f"a control period is longer than 0 s, not {self.period:g} s")
        if not 0 <= self.vary <= MOST_VARY:
            raise ValueError(f"vary is a share, 0 to {MOST_VARY:g}, not {self.vary:g}")
        if self.hosted and self.opponent != JUNIOR_OPPONENT:
            raise ValueError(f"only a second Junior has a host of its own, and the opponent is {self.opponent}")
