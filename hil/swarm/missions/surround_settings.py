"""What is asked of a surround mission, as plain values; lengths are in the book's units."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from enum import StrEnum
from math import inf
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.messages.swarm import LONG_RANGE
from firmware_protocol.parameters import SWARM_PARAMETERS
from firmware_protocol.vocabulary import MICRO_ROBOT_RADIUS, RobotClass
from pal_advisor.fields import Fields, SettingsError, shown
from pal_advisor.ring import SensorRing
from pal_advisor.surround import Case, Sensing, case_settings, letters
from pal_advisor.surround.places import AREA
from pal_advisor.surround.settings import MOST_GAIN, MOST_ROUNDS
from pal_advisor.surround.stimuli import MOST_SECTORS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pal_advisor.surround import GroupSettings

MOST_STEPS: Final = 1_000_000
"""No mission has more steps."""
LEAST: Final = 1e-3
MOST_LENGTH: Final = 1000.0
"""Lengths, and shares of lengths, that make sense."""
CONTACT_GAP: Final = next(one.default for one in SWARM_PARAMETERS if one.name == "CONTACT_GAP")
"""What is nearer to a robot's edge is in contact, in m."""
FARTHEST: Final = 60.0
"""No move is longer on the wire, in m."""


class Order(StrEnum):
    """Which robots move at once."""

    GROUP = "group"
    """All RANGERs, then all WILDs."""
    ALL = "all"
    """Everybody."""
    SEQUENTIAL = "sequential"
    """One after the other."""


@dataclass(frozen=True)
class SurroundSettings:
    """How a surround mission goes.

    Attributes:
        case: Name of the case; R and W that are left out are who is there.
        steps: How many steps.
        order: Which robots move at once.
        sensing: What makes the stimulus.
        sectors: N, of rings and behaviours.
        feasible: Which behaviours the robots can perform, B1 first, as N digits 1 or 0; empty for all.
        conditional: Behaviours given for stimuli, by class.
        mutate_after: A RANGER whose weights did not change for so many rounds performs a random behaviour (7.8); 0 for never.
        learning: Weights are updated.
        r0: Radius of the rings, R0.
        eta: Step of a RANGER as a share of R0 (Eq. 6.11).
        dr: Increment of the radius, dR.
        gain: c of the increment C1.
        wild_step: Step of a WILD as a share of a RANGER's.
        unit: Length of the book's unit, in m.
        area: Sides of the area.

    Raises:
        SettingsError: A value makes no sense.
        CaseError: The case is none.
    """

    case: str = ""
    steps: int = 100
    order: Order = Order.GROUP
    sensing: Sensing = Sensing.HYBRID
    sectors: int = 8
    feasible: str = ""
    conditional: Mapping[RobotClass, Mapping[int, int]] = field(default_factory=dict)
    mutate_after: int = 0
    learning: bool = True
    r0: float = 1.0
    eta: float = 0.4
    dr: float = 0.25
    gain: float = 0.5
    wild_step: float = 0.5
    unit: float = 0.2
    area: tuple[float, float] = AREA

    def __post_init__(self) -> None:
        for name in ("r0", "unit", "eta", "wild_step", "dr", "gain"):
            value = getattr(self, name)
            low, high = (0.0, MOST_GAIN) if name == "gain" else (0.0 if name in {"dr", "wild_step"} else LEAST, MOST_LENGTH)
            if not low <= value <= high:
                raise SettingsError(name, f"expected a number, {low:g} to {high:g}, not {shown(value)}")
        if not 0 <= self.steps <= MOST_STEPS:
            raise SettingsError("steps", f"expected 0 to {MOST_STEPS} steps, not {shown(self.steps)}")
        if not self.long_range and self.r0 * self.unit >= LONG_RANGE:
            raise SettingsError(
                "r0", f"a radius of {self.r0 * self.unit:g} m can't be sent: a ring takes less than {LONG_RANGE} m"
            )
        if self.step_of(RobotClass.RANGER) > FARTHEST or self.step_of(RobotClass.WILD) > FARTHEST:
            raise SettingsError("eta", f"a step of more than {FARTHEST:g} m can't be sent")
        self.groups(Case.parse(self.case))

    @property
    def long_range(self) -> bool:
        """Sensors see all robots, however far."""
        return Case.parse(self.case).long_range

    @property
    def robots(self) -> dict[RobotClass, int]:
        """How many robots of a class the case's name asks for; a class that it leaves out is not there."""
        named = letters(self.case)
        return {kind: named[kind.name[0]] for kind in RobotClass if kind.name[0] in named}

    def case_of(self, rangers: int, wilds: int) -> Case:
        """The case that is played.

        Args:
            rangers: How many RANGERs play.
            wilds: How many WILDs.
        """
        rest = "".join(f"{letter}{number}" for letter, number in letters(self.case).items() if letter not in "RW")
        return Case.parse(f"{rest}R{rangers}W{wilds}")

    def groups(self, case: Case) -> tuple[GroupSettings, GroupSettings]:
        """How the RANGERs and the WILDs of a case sense, move and learn.

        Args:
            case: The case.

        Raises:
            SettingsError: A value makes no sense.
        """
        return case_settings(
            case,
            sectors=self.sectors,
            sensing=self.sensing,
            gain=self.gain,
            learning=self.learning,
            feasible=self.feasible,
            conditional=self.conditional,
            mutate_after=self.mutate_after,
        )

    def step_of(self, kind: RobotClass) -> float:
        """How far a robot of a class moves, in m (Eq. 6.11).

        Args:
            kind: The class.
        """
        return self.eta * self.r0 * self.unit * (1.0 if kind == RobotClass.RANGER else self.wild_step)

    @property
    def sensed(self) -> dict[str, Any]:
        """How rings are read, as `Swarm.sense` takes it, in m."""
        if self.long_range:
            return {"radius": LONG_RANGE, "increment": 0.0, "sectors": self.sectors}
        return {"radius": self.r0 * self.unit, "increment": self._increment * self.unit, "sectors": self.sectors}

    @property
    def ring(self) -> SensorRing:
        """How rings are reckoned, in m."""
        if self.long_range:
            return SensorRing(self.sectors, inf, 0.0)
        return SensorRing(self.sectors, self.r0 * self.unit, self._increment * self.unit)

    @property
    def _increment(self) -> float:
        return 0.0 if self.sensing == Sensing.FIXED else self.dr

    @property
    def size(self) -> tuple[float, float]:
        """Sides of the area, in m."""
        return self.area[0] * self.unit, self.area[1] * self.unit

    @property
    def body(self) -> float:
        """Radius of a robot, in the book's units."""
        return MICRO_ROBOT_RADIUS / self.unit

    @property
    def contact(self) -> float:
        """Distance of two robots' positions up to which they touch, in the book's units."""
        return (2.0 * MICRO_ROBOT_RADIUS + CONTACT_GAP) / self.unit

    def to_dict(self) -> dict[str, Any]:
        """Settings as plain values."""
        return {
            **asdict(self),
            "order": self.order.value,
            "sensing": self.sensing.value,
            "area": list(self.area),
            "conditional": {
                kind.name.lower(): {f"STIMULUS{stimulus}": behaviour for stimulus, behaviour in table.items()}
                for kind, table in self.conditional.items()
            },
        }

    @classmethod
    def from_fields(cls, fields: Fields) -> SurroundSettings:
        """The inverse of `to_dict`.

        Args:
            fields: What it gave.

        Raises:
            FieldError: A field is missing, unknown or wrong; of the kind that the fields raise.
        """
        sides = fields.elements("area")
        if len(sides.names) != 2:
            raise fields.wrong("area", "expected two sides")
        values: dict[str, Any] = {
            "case": fields.text("case"),
            "steps": fields.integer("steps", 0, MOST_STEPS),
            "order": fields.one_of("order", Order),
            "sensing": fields.one_of("sensing", Sensing),
            "sectors": fields.integer("sectors", 1, MOST_SECTORS),
            "feasible": fields.text("feasible"),
            "conditional": _conditional(fields.table("conditional")),
            "mutate_after": fields.integer("mutate_after", 0, MOST_ROUNDS),
            "learning": fields.flag("learning"),
            **{name: fields.number(name, 0.0) for name in ("r0", "eta", "dr", "gain", "wild_step", "unit")},
            "area": tuple(sides.number(path, LEAST, MOST_LENGTH) for path in sides.names),
        }
        fields.done()
        try:
            return cls(**values)
        except SettingsError as error:
            raise fields.wrong(error.path, str(error).partition(": ")[2]) from error
        except ValueError as error:
            raise fields.wrong("case", str(error)) from error


def _conditional(fields: Fields) -> dict[RobotClass, dict[int, int]]:
    found: dict[RobotClass, dict[int, int]] = {}
    for kind in RobotClass:
        if fields.has(kind.name.lower()):
            table = fields.table(kind.name.lower())
            names = [name for name in table.names if name.startswith("STIMULUS") and name[8:].isdecimal()]
            found[kind] = {int(name[8:]): table.integer(name, 1, MOST_SECTORS) for name in names}
            table.done()
    fields.done()
    return found
