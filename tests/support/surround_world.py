"""A kinematic world of RANGERs and WILDs: points that move straight until they touch, with noise if wanted.

It is to the adviser of the surround task what a table is, without a wire, firmware or physics; lengths are in the book's
units. `run` plays a case in it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, inf, pi, sin, tau
from typing import TYPE_CHECKING, Literal

import numpy as np

from firmware_protocol.vocabulary import RobotClass, SwarmOutcome
from pal_advisor.ring import SensorRing, count_within, readings
from pal_advisor.surround import Case, Results, Sights, Surround, case_settings, start_places
from pal_advisor.surround.measures import mean_distance, ranger_distance, share_outside, share_surrounded
from pal_advisor.surround.places import APART, AREA

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pal_advisor.surround import GroupSettings, Moves, Sensing, Tables

BODY = 0.1
"""Half of the distance at which two robots touch: that of a robot from a wall."""


@dataclass(frozen=True)
class Conditions:
    """How a run goes that is not said by the case.

    Attributes:
        order: Which robots move at once.
        eta: Step of a RANGER as a share of R0 (Eq. 6.11).
        wild_step: Step of a WILD as a share of a RANGER's.
        distance_noise: Standard deviation of a step, as a share of it.
        heading_noise: Standard deviation of a way, in rad.
        loss: Probability that the observation after a move is lost.
        rigid: Robots keep the heading that they begin with; else their nose turns to where they go.
        limit: Greatest radius of the ring.
    """

    order: Literal["group", "all", "sequential"] = "group"
    eta: float = 0.4
    wild_step: float = 0.5
    distance_noise: float = 0.0
    heading_noise: float = 0.0
    loss: float = 0.0
    rigid: bool = False
    limit: float = inf


@dataclass
class History:
    """What happened in a run of T steps.

    Attributes:
        distance: D, shape (T + 1,).
        ranger_distance: Mean distance between RANGERs, shape (T + 1,).
        surrounded: Share of WILDs that are surrounded, shape (T + 1,).
        outside: Share of RANGERs outside the area, shape (T + 1,).
        positions: Of all robots, RANGERs first, shape (T + 1, robots, 2).
        stimuli: Stimuli that RANGERs met, shape (T, rangers).
        behaviours: Behaviours that RANGERs performed, shape (T, rangers).
        weights: Weights of both classes, shape (T + 1, 2, stimuli, N).
        tables: What was learnt at the end.
    """

    distance: NDArray[np.float64]
    ranger_distance: NDArray[np.float64]
    surrounded: NDArray[np.float64]
    outside: NDArray[np.float64]
    positions: NDArray[np.float64]
    stimuli: NDArray[np.int64]
    behaviours: NDArray[np.int64]
    weights: NDArray[np.float64]
    tables: Tables


class KinematicWorld:
    """Robots that stand where they are, and move when told.

    Args:
        poses: x, y, heading of all, RANGERs first, shape (robots, 3).
        rangers: How many are RANGERs.
        conditions: Noise and steps.
        wall: Half sides of the area within a wall; None for no wall.
        rng: Source of noise.
    """

    def __init__(
        self,
        poses: NDArray[np.float64],
        rangers: int,
        conditions: Conditions,
        wall: tuple[float, float] | None,
        rng: np.random.Generator,
    ) -> None:
        self.poses = poses.copy()
        self.classes = (np.arange(len(poses)) >= rangers).astype(np.int64)
        self.conditions = conditions
        self.rows = (slice(0, rangers), slice(rangers, len(poses)))
        self._wall = wall
        self._rng = rng

    def sights(self, kind: RobotClass, ring: SensorRing, there: NDArray[np.bool_]) -> Sights:
        """What the robots of a class see of the other."""
        seen, rows, other = readings(self.poses, self.classes, ring), self.rows[kind], kind.other
        return Sights(there, seen.near[rows, other], seen.seen[rows, other], seen.count[rows, other], seen.radius[rows])

    def counts(self, kind: RobotClass, radius: NDArray[np.float64]) -> NDArray[np.int64]:
        """How many of the other class are within a radius of the robots of a class."""
        all_radii = np.zeros(len(self.poses))
        all_radii[self.rows[kind]] = radius
        return count_within(self.poses, self.classes, all_radii)[self.rows[kind], kind.other]

    def lost(self, robots: int) -> NDArray[np.bool_]:
        """Whose observation after a move is lost."""
        if not self.conditions.loss:
            return np.zeros(robots, dtype=np.bool_)
        return self._rng.random(robots) < self.conditions.loss

    def move(self, kind: RobotClass, sector: NDArray[np.int64], sectors: int) -> NDArray[np.int64]:
        """Move robots of a class along the bisectors of sectors, as far as they get (Eq. 6.10); 0 stays.

        Returns:
            How each move ended.
        """
        step = self.conditions.eta * (1.0 if kind == RobotClass.RANGER else self.conditions.wild_step)
        first = self.rows[kind].start
        outcome = np.full(len(sector), int(SwarmOutcome.NONE))
        for row in np.flatnonzero(sector).tolist():
            turn = (sector[row] - 0.5) * tau / sectors
            outcome[row] = self._drive(first + row, turn, step)
        return outcome

    def _drive(self, robot: int, turn: float, step: float) -> SwarmOutcome:
        conditions = self.conditions
        way = float(self.poses[robot, 2]) + turn
        if not conditions.rigid:
            self.poses[robot, 2] = (way + pi) % tau - pi
        if conditions.heading_noise:
            way += conditions.heading_noise * float(self._rng.standard_normal())
        if conditions.distance_noise:
            step *= max(0.0, 1.0 + conditions.distance_noise * float(self._rng.standard_normal()))
        free = self._free(robot, cos(way), sin(way))
        self.poses[robot, :2] += min(step, free) * np.array((cos(way), sin(way)))
        return SwarmOutcome.BLOCKED if free < step else SwarmOutcome.ARRIVED

    def _free(self, robot: int, x: float, y: float) -> float:
        """How far a robot can go along a way until it touches another or the wall."""
        across, up = (self.poses[:, axis] - self.poses[robot, axis] for axis in (0, 1))
        ahead = across * x + up * y
        gap = ahead * ahead - (across * across + up * up - APART * APART)
        hit = (ahead > 0.0) & (gap > 0.0)
        free = float(np.min(ahead[hit] - np.sqrt(gap[hit]), initial=inf))
        if self._wall is not None:
            for half, place, part in zip(self._wall, self.poses[robot, :2].tolist(), (x, y), strict=True):
                if part:
                    free = min(free, ((half - BODY) * (1 if part > 0 else -1) - place) / part)
        return max(0.0, free)


def half_round(
    adviser: Surround, world: KinematicWorld, kinds: list[RobotClass], ring: SensorRing, only: int | None = None
) -> dict[RobotClass, Moves]:
    """Let classes observe, choose, move at once and learn; of one class one robot alone where one is given."""
    asked: dict[RobotClass, tuple[Sights, Moves]] = {}
    for kind in kinds:
        there = np.full(adviser.groups[kind].settings.robots, fill_value=only is None)
        if only is not None:
            there[only] = True
        sights = world.sights(kind, ring, there)
        asked[kind] = (sights, adviser.ask(kind, sights))
    outcomes = {kind: world.move(kind, moves.sector, ring.sectors) for kind, (_, moves) in asked.items()}
    for kind, (sights, _) in asked.items():
        outcomes[kind][world.lost(len(outcomes[kind]))] = int(SwarmOutcome.NONE)
        adviser.tell(kind, Results(outcomes[kind], world.counts(kind, sights.radius), sights.radius))
    return {kind: moves for kind, (_, moves) in asked.items()}


def play_step(adviser: Surround, world: KinematicWorld, ring: SensorRing) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """One step of both classes, in the order that the conditions say.

    Returns:
        Stimuli that the RANGERs met, and behaviours that they performed.
    """
    alone = world.conditions.order == "sequential"
    together = world.conditions.order == "all"
    rounds = []
    for kinds in [list(RobotClass)] if together else [[kind] for kind in RobotClass]:
        robots = adviser.groups[kinds[0]].settings.robots
        rounds += [half_round(adviser, world, kinds, ring, row) for row in (range(robots) if alone else (None,))]
    moves = [moved[RobotClass.RANGER] for moved in rounds if RobotClass.RANGER in moved]
    return np.sum([move.stimulus for move in moves], axis=0), np.sum([move.behaviour for move in moves], axis=0)


def ring_of(case: Case, limit: float = inf) -> SensorRing:
    """How robots of a case sense."""
    return SensorRing(radius=inf, increment=0.0) if case.long_range else SensorRing(limit=limit)


def run(
    name: str,
    seed: int,
    steps: int,
    conditions: Conditions | None = None,
    *,
    settings: tuple[GroupSettings, GroupSettings] | None = None,
    learning: bool = True,
    sensing: Sensing | None = None,
) -> History:
    """Play a case.

    Args:
        name: Of the case.
        seed: Of places, decisions and noise.
        steps: How many steps.
        conditions: How it goes; by default without noise.
        settings: Of the adviser, in place of the case's.
        learning: Whether the case's robots learn.
        sensing: What makes the stimulus, in place of the default.
    """
    case, conditions = Case.parse(name), conditions or Conditions()
    of_places, of_adviser, of_world = (np.random.default_rng([seed, stream]) for stream in range(3))
    places = start_places(case, of_places)
    both = settings or case_settings(case, learning=learning)
    if sensing is not None:
        both = (replace(both[0], sensing=sensing), replace(both[1], sensing=sensing))
    adviser = Surround(*both, of_adviser)
    wall = (AREA[0] / 2.0, AREA[1] / 2.0) if case.wall else None
    world = KinematicWorld(np.concatenate(places), case.rangers, conditions, wall, of_world)
    ring = ring_of(case, conditions.limit)
    positions, weights = [world.poses[:, :2].copy()], [_weights(adviser)]
    stimuli, behaviours = [], []
    for _ in range(steps):
        met, performed = play_step(adviser, world, ring)
        positions.append(world.poses[:, :2].copy())
        weights.append(_weights(adviser))
        stimuli.append(met)
        behaviours.append(performed)
    pairs = [(there[: case.rangers], there[case.rangers :]) for there in positions]
    return History(
        distance=np.array([mean_distance(*pair) for pair in pairs], dtype=np.float64),
        ranger_distance=np.array([ranger_distance(rangers) for rangers, _ in pairs], dtype=np.float64),
        surrounded=np.array([share_surrounded(*pair, 1.0) for pair in pairs], dtype=np.float64),
        outside=np.array([share_outside(rangers, AREA) for rangers, _ in pairs], dtype=np.float64),
        positions=np.array(positions),
        stimuli=np.array(stimuli),
        behaviours=np.array(behaviours),
        weights=np.array(weights),
        tables=adviser.tables(name),
    )


def _weights(adviser: Surround) -> NDArray[np.float64]:
    return np.stack([group.experience.weights for group in adviser.groups])
