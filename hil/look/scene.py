"""A scene: all that a page shows of a run, as plain values; it knows no log, no page and no wire.

Arrays are in SI units; times are log times in s. The same scene can be told in parts, one after the other (see `document`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Points = tuple[tuple[float, float], ...]


class Ground(StrEnum):
    """What robots stand on, as far as it is known."""

    RING = "ring"
    TABLE = "table"
    NONE = "none"
    """Nobody measures where the robot is: it is drawn in its own frame."""


@dataclass(frozen=True)
class Terrain:
    """The arena, about its origin.

    Attributes:
        ground: What it is.
        width: Along x, in m.
        height: Along y, in m.
        wall: A wall runs round it.
        obstacles: Closed outlines of what stands on it, in m.
    """

    ground: Ground
    width: float
    height: float
    wall: bool = False
    obstacles: tuple[Points, ...] = ()


@dataclass(frozen=True)
class Beam:
    """A sensor that looks along an axis, in the robot's frame: x forward, y left.

    Attributes:
        x: Where it sits, in m.
        y: Likewise.
        angle: Of its axis, in rad.
        half_cone: Half of its field of view, in rad.
        reach: How far it is drawn, in m.
        bit: Of the column `flags`: it sees something.
    """

    x: float
    y: float
    angle: float
    half_cone: float
    reach: float
    bit: int


@dataclass(frozen=True)
class Spot:
    """A switch or a spot on the body, lit while a bit of the column `flags` is set.

    Attributes:
        name: What it means that it is lit.
        points: A line on the body, or one point, in m.
        bit: The bit.
    """

    name: str
    points: Points
    bit: int


@dataclass(frozen=True)
class BodyShape:
    """What a body looks like, in its own frame.

    Attributes:
        outline: Corners, in m; empty: nobody knows, and a disc is drawn.
        radius: Of the body, in m.
        beams: Its sensors that look somewhere.
        spots: Its switches.
        sectors: How many sectors its surroundings are divided into; 0: into none.
    """

    outline: Points = ()
    radius: float = 0.02
    beams: tuple[Beam, ...] = ()
    spots: tuple[Spot, ...] = ()
    sectors: int = 0


@dataclass(frozen=True)
class Track:
    """A body and what is known of it over time.

    Attributes:
        key: Names it in this scene, as `junior` or `2.17`.
        label: For people.
        kind: `junior`, `opponent`, `ranger`, `wild`, `robot`.
        shape: What it looks like.
        poses: Columns `t`, `x`, `y`, `heading`; and, where there are any, `gap` (1: what came before belongs to another bout),
            `flags`, `near0`, `near1` (sectors with a robot of each class), `radius`.
        senses: Columns `t`, `flags`, of what it senses oftener or seldomer than where it is.
        rays: Column `t`, and `r0`, `r1`, ... in m, NaN where nothing is hit, all round from the nose counter-clockwise;
            `hits` says in its bits which of them are robots.
    """

    key: str
    label: str
    kind: str
    shape: BodyShape
    poses: dict[str, Array] = field(default_factory=dict)
    senses: dict[str, Array] = field(default_factory=dict)
    rays: dict[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class TimeCurves:
    """Curves over time, of one unit.

    Attributes:
        name: What they show.
        unit: Of the values; empty: a plain number.
        labels: Of each curve.
        times: BodyShape (n,).
        values: Of each curve, shape (n,).
        stepped: A value holds until the next.
        level: A line drawn across, as a threshold; None: none.
        level_name: What it is.
    """

    name: str
    unit: str
    labels: tuple[str, ...]
    times: Array
    values: tuple[Array, ...]
    stepped: bool = False
    level: float | None = None
    level_name: str = ""


@dataclass(frozen=True)
class Lane:
    """Something that is one of several things at a time: a band over the time axis.

    Attributes:
        name: What.
        begin: When each stretch begins, shape (n,).
        end: When it ends.
        code: Which word, shape (n,).
        words: What it is in a word.
        meanings: The same at length; empty where the word says it all.
        tones: How it is shown, by word: `quiet`, `good`, `bad`, `busy`, `even`.
    """

    name: str
    begin: Array
    end: Array
    code: Array
    words: tuple[str, ...]
    meanings: tuple[str, ...]
    tones: tuple[str, ...]


DECISION: Final = "decision"
"""Kind of the marks of what a learner asked for: there is one for every maneuver."""


@dataclass(frozen=True)
class Mark:
    """Something happened.

    Attributes:
        time: When.
        kind: `link`, `safety`, `bout`, `key`, ...
        text: In words.
    """

    time: float
    kind: str
    text: str


@dataclass(frozen=True)
class Chapter:
    """A stretch of the run with a beginning and an end: a bout, or a mission's run.

    Attributes:
        name: As `bout 3`.
        series: What it belongs to; empty: nothing.
        begin: When.
        end: When.
        outcome: `won`, `lost`, `drawn`, `broken off`; empty where it has none.
        against: The opponent; empty where there is none.
        story: How it ended, in words.
    """

    name: str
    series: str
    begin: float
    end: float
    outcome: str = ""
    against: str = ""
    story: str = ""


@dataclass(frozen=True)
class LearningCurves:
    """Curves over something else than time: how learning went.

    Attributes:
        name: What they show.
        unit: Of the values.
        along: What the x axis counts.
        labels: Of each curve.
        x: Of each curve, shape (n,), ascending.
        y: Likewise.
    """

    name: str
    unit: str
    along: str
    labels: tuple[str, ...]
    x: tuple[Array, ...]
    y: tuple[Array, ...]


@dataclass(frozen=True)
class LearntStep:
    """An action of a maneuver: how the wheels turn, as shares of full speed.

    Attributes:
        name: As `FF`.
        meaning: As `fast forward`.
        left: Left wheel, -1..1.
        right: Right wheel.
    """

    name: str
    meaning: str
    left: float
    right: float


@dataclass(frozen=True)
class LearntManeuver:
    """What was learnt for a situation.

    Attributes:
        when: The situation in words.
        steps: The maneuver; none: it is no sequence of actions.
        does: What is done, in words.
        worth: What that is worth, and how well that is known, in words.
        why: Why it is this maneuver, a paragraph an item; empty where that is not known.
    """

    when: str
    steps: tuple[LearntStep, ...]
    does: str
    worth: str
    why: tuple[str, ...] = ()


@dataclass
class Scene:
    """All that a page shows.

    Attributes:
        title: Headline.
        source: The log's name.
        said: What happened, a paragraph an item.
        facts: Figures that matter most: (value, what it is).
        notes: What is wrong with the log, and what was left out.
        about: Of the run: (name, value).
        begin: First log time.
        end: Last log time.
        terrain: The arena; None where there is nothing to draw.
        tracks: The bodies.
        traces: Curves over time.
        lanes: Bands over time.
        marks: What happened, in order.
        chapters: The bouts, in order.
        curves: How learning went.
        lessons: What was learnt.
    """

    title: str = ""
    source: str = ""
    said: list[str] = field(default_factory=list)
    facts: list[tuple[str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    about: list[tuple[str, str]] = field(default_factory=list)
    begin: float = 0.0
    end: float = 0.0
    terrain: Terrain | None = None
    tracks: list[Track] = field(default_factory=list)
    traces: list[TimeCurves] = field(default_factory=list)
    lanes: list[Lane] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)
    chapters: list[Chapter] = field(default_factory=list)
    curves: list[LearningCurves] = field(default_factory=list)
    lessons: list[LearntManeuver] = field(default_factory=list)
