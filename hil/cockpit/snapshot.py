"""What is shown of robots at one moment, as plain data: made where robots are watched, drawn where a terminal is."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Figure(Enum):
    """What stands on the ground, by the letter that it is drawn with."""

    JUNIOR = "J"
    OPPONENT = "O"
    RANGER = "R"
    WILD = "W"
    BOX = "B"
    GOAL = "G"
    ROBOT = "?"


class Tone(Enum):
    """How much something matters."""

    CALM = "calm"
    GOOD = "good"
    WARNING = "warning"
    ALARM = "alarm"


@dataclass(frozen=True)
class Body:
    """Something that stands on the ground.

    Attributes:
        figure: What it is.
        position: Of its centre: x and y, in m.
        heading: In rad; None where it has none.
        radius: Of its outline, in m.
        chosen: Keys act on it.
    """

    figure: Figure
    position: tuple[float, ...]
    heading: float | None
    radius: float
    chosen: bool = False


@dataclass(frozen=True)
class PlanView:
    """What robots stand on, seen from above: x to the right, y up, the origin in the middle of a ring.

    Attributes:
        bodies: What stands on it.
        ring: Radius of a ring round the origin, in m; 0: there is none.
        trail: Where the chosen robot has been, in m, oldest first.
        caption: What there is to say of it.
        area: Least x and y, greatest x and y that are to be seen in any case, in m; None: what stands there decides.
    """

    bodies: tuple[Body, ...]
    ring: float = 0.0
    trail: tuple[tuple[float, float], ...] = ()
    caption: str = ""
    area: tuple[float, float, float, float] | None = None

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Least x and y, greatest x and y of what is to be seen, in m."""
        around = [(body.position[0], body.position[1], body.radius) for body in self.bodies]
        if self.ring or not around:
            around.append((0.0, 0.0, self.ring))
        if self.area is not None:
            around += [(self.area[0], self.area[1], 0.0), (self.area[2], self.area[3], 0.0)]
        return (
            min(x - radius for x, _, radius in around),
            min(y - radius for _, y, radius in around),
            max(x + radius for x, _, radius in around),
            max(y + radius for _, y, radius in around),
        )


@dataclass(frozen=True)
class Senses:
    """What a Junior senses, seen from above with its nose up, where nobody says where it stands.

    Attributes:
        eyes: The left, right eye sees something.
        arms: The left, right arm touches something.
        off_ring: The left, right floor sensor sees the border, or beyond.
        caption: What there is to say of it.
    """

    eyes: tuple[bool, bool]
    arms: tuple[bool, bool]
    off_ring: tuple[bool, bool]
    caption: str = ""


@dataclass(frozen=True)
class Fact:
    """One line of what is known of the chosen robot.

    Attributes:
        name: What it is of.
        value: In words, with its unit.
        share: The same as a share of its range, 0..1; None: no bar is drawn.
        tone: How much it matters.
    """

    name: str
    value: str
    share: float | None = None
    tone: Tone = Tone.CALM


@dataclass(frozen=True)
class Row:
    """One robot in the table of all.

    Attributes:
        cells: As the heads of the table.
        tone: How much it matters.
    """

    cells: tuple[str, ...]
    tone: Tone = Tone.CALM


@dataclass(frozen=True)
class Snapshot:
    """What is shown.

    Attributes:
        title: Whom or what is looked at.
        now: Time of the step that it was made after, in s.
        state: What the chosen robot is doing, in capitals where it matters.
        tone: How much that matters.
        facts: What is known of the chosen robot.
        ground: Where everybody is, or what the robot senses; None: nobody says so.
        heads: What the columns of the table are called.
        rows: All robots; empty where there is only one.
        chosen: Index of the chosen one.
        keys: What keys do: the key and what it does, the most important first.
    """

    title: str
    now: float
    state: str
    tone: Tone
    facts: tuple[Fact, ...]
    ground: PlanView | Senses | None
    heads: tuple[str, ...] = ()
    rows: tuple[Row, ...] = ()
    chosen: int = 0
    keys: tuple[tuple[str, str], ...] = ()
