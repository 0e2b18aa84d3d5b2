"""A swarm of the kinematic world: what a mission holds, without wire, firmware or physics. Its unit is 0.2 m."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from surround_world import Conditions, KinematicWorld, ring_of

from firmware_protocol.messages import Reason, SwarmObservation
from firmware_protocol.vocabulary import RobotClass
from firmware_protocol.wire.rows import ROWS, rows_of
from hil.bridge.networks import RobotAddress
from hil.swarm.rounds import Round, SwarmMoves
from pal_advisor.ring import count_within, readings
from pal_advisor.surround import Case, start_places

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

UNIT = 0.2
NETWORK = "memory:1"


@dataclass
class KinematicSwarm:
    """As `hil.swarm.host.HeldSwarm`.

    Attributes:
        world: Where the robots are, RANGERs first; in the book's units.
        kinds: Class of each robot.
        there: Who takes part in the next round.
        case: The case.
        fenced: Says of a row and a sector whether the fence refuses that move.
        moved: Sectors of each round of moves; 0 where there was none.
        mute: Rows that answer no more, and are missing then.
        time: Time, in s.
    """

    world: KinematicWorld
    kinds: NDArray[np.int64]
    there: NDArray[np.bool_]
    case: Case
    fenced: Callable[[int, int], bool] = lambda _, __: False
    moved: list[NDArray[np.int64]] = field(default_factory=list)
    mute: set[int] = field(default_factory=set)
    time: float = 0.0

    def __post_init__(self) -> None:
        self.addresses = tuple(RobotAddress(NETWORK, row + 1) for row in range(len(self.kinds)))
        self._radius = np.zeros(len(self.kinds))

    @property
    def labels(self) -> tuple[str, ...]:
        """What each robot is called."""
        return tuple(str(address.system) for address in self.addresses)

    def now(self) -> float:
        """Time, a second for each round."""
        return self.time

    def observe(self, robots: NDArray[np.bool_]) -> Round:
        """They say what they observe."""
        asked = robots & self.there
        return self._round(asked, np.zeros(len(asked), np.int64), np.zeros(len(asked), bool))

    def move(self, moves: SwarmMoves, *, deadline: float | None = None) -> Round:
        """They move, one after the other within a class, as in the kinematic world."""
        del deadline
        asked = moves.moving & self.there
        sector = np.where(asked, moves.sector, 0)
        refused = np.array([bool(one) and self.fenced(row, one) for row, one in enumerate(sector.tolist())])
        self.moved.append(np.where(refused, 0, sector))
        outcome = np.zeros(len(asked), np.int64)
        for kind in RobotClass:
            rows = self.world.rows[kind]
            outcome[rows] = self.world.move(kind, np.where(refused, 0, sector)[rows], int(moves.sectors))
        return self._round(asked & ~refused, outcome, refused)

    def _round(self, asked: NDArray[np.bool_], outcome: NDArray[np.int64], refused: NDArray[np.bool_]) -> Round:
        self.time += 1.0
        answers = asked.copy()
        answers[list(self.mute)] = False
        read = readings(self.world.poses, self.kinds, ring_of(self.case, 60.0))
        before = count_within(self.world.poses, self.kinds, self._radius / UNIT)
        radius = np.minimum(read.radius * UNIT, 65.534)
        rows = rows_of(
            SwarmObservation,
            len(asked),
            {
                "position": self.world.poses[:, :2] * UNIT,
                "heading": np.mod(self.world.poses[:, 2] + np.pi, 2 * np.pi) - np.pi,
                "near": read.near,
                "seen": read.seen,
                "count": np.minimum(read.count, 255),
                "count_before": np.minimum(before, 255),
                "radius": radius,
                "radius_before": self._radius,
                "outcome": outcome,
            },
        )
        rows[~answers] = np.zeros(1, ROWS[SwarmObservation])
        self._radius = np.where(answers, np.round(radius, 3), self._radius)
        self.there = self.there & ~(asked & ~answers)
        reasons = np.where(refused, int(Reason.BAD_VALUE), 0)
        everybody = asked | refused
        return Round(self.addresses, everybody, answers, rows, reasons, refused, 1.0)


def kinematic_swarm(name: str, seed: int) -> KinematicSwarm:
    """A swarm of a case.

    Args:
        name: Name of the case.
        seed: Seed of the places, and of noise.
    """
    case = Case.parse(name)
    places = start_places(case, np.random.default_rng([seed, 0]))
    wall = (5.0, 5.0) if case.wall else None
    world = KinematicWorld(np.concatenate(places), case.rangers, Conditions(), wall, np.random.default_rng([seed, 2]))
    kinds = world.classes.astype(np.int64)
    return KinematicSwarm(world, kinds, np.ones(len(kinds), bool), case)
