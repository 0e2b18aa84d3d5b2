"""Robots are driven to places: who goes to which, so that the longest way is shortest, and past each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.vocabulary import MoveOption, SwarmOutcome
from hil.swarm.rounds import SwarmMoves

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hil.swarm.host import SwarmHost

THERE: Final = 0.01
"""Who is nearer to its place, in m, has arrived."""
NEAR_ENOUGH: Final = 0.02
"""Who is farther from it when time is over, in m, is told of."""
LEG: Final = 0.3
"""Longest way of a round, in m: then all are dealt places anew."""
DETOUR: Final = 0.06
"""Way aside of who was blocked, in m."""
ASIDE: Final = (np.pi / 3, 2 * np.pi / 3)
"""It goes aside by an angle between these, to either side, in rad."""
LONGEST: Final = 60.0
"""How long robots are driven, in s."""


def deal(at: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.int64]:
    """Deal places to robots so that the longest way is shortest (a bottleneck assignment).

    Args:
        at: Where the robots are, shape (n, 2); NaN where nobody knows.
        places: The places, shape (n, 2).

    Returns:
        Which place each gets, shape (n,).
    """
    ways = np.nan_to_num(np.linalg.norm(at[:, None, :] - places[None, :, :], axis=2))
    lengths = np.unique(ways)
    low, high = 0, len(lengths) - 1
    best = np.arange(len(at))
    while low <= high:
        middle = (low + high) // 2
        found = _matching(ways <= lengths[middle])
        if found is None:
            low = middle + 1
        else:
            best, high = found, middle - 1
    return best


def _matching(allowed: NDArray[np.bool_]) -> NDArray[np.int64] | None:
    """A place for each, among those that are allowed; None where there is none for all (Kuhn's algorithm)."""
    choices = [np.flatnonzero(row).tolist() for row in allowed]
    holder: dict[int, int] = {}

    def seat(robot: int, tried: set[int]) -> bool:
        for place in choices[robot]:
            if place not in tried:
                tried.add(place)
                if place not in holder or seat(holder[place], tried):
                    holder[place] = robot
                    return True
        return False

    if not all(seat(robot, set()) for robot in range(len(choices))):
        return None
    found = np.zeros(len(choices), dtype=np.int64)
    for place, robot in holder.items():
        found[robot] = place
    return found


def drive_to(
    host: SwarmHost,
    groups: Sequence[tuple[NDArray[np.int64], NDArray[np.float64]]],
    rng: np.random.Generator,
    *,
    longest: float = LONGEST,
) -> list[int]:
    """Drive robots to places, and turn them as they are to stand.

    Args:
        host: Holds the rounds.
        groups: Rows of robots among which places may be dealt as one likes, and their poses: x, y in m and heading in rad,
            shape (robots, 3).
        rng: Source of chance, for who goes aside.
        longest: How long, in s.

    Returns:
        Rows of those that are not near their places.

    Raises:
        QuorumError: Too few robots are there.
        LinkError: The last link is gone.
    """
    host.observe(host.everybody_there)
    end = host.swarm.now() + longest
    wanted = np.full((len(host.poses), 3), np.nan)
    blocked = np.zeros(len(host.poses), dtype=np.bool_)
    while True:
        for rows, poses in groups:
            wanted[rows] = poses[deal(host.poses[rows, :2], poses[:, :2])]
        ways = wanted[:, :2] - host.poses[:, :2]
        far = np.linalg.norm(ways, axis=1)
        moving = host.everybody_there & (far > THERE)
        if not moving.any() or host.swarm.now() >= end:
            break
        heading, distance = np.arctan2(ways[:, 1], ways[:, 0]), np.minimum(far, LEG)
        aside = moving & blocked
        turn = rng.uniform(*ASIDE, len(far)) * np.where(rng.random(len(far)) < 0.5, 1.0, -1.0)
        heading = np.where(aside, heading + turn, heading)
        distance = np.where(aside, DETOUR, distance)
        found = host.move(_moves(moving, distance, heading))
        blocked = moving & (found.outcome == SwarmOutcome.BLOCKED) & ~aside
    turning = host.everybody_there & ~np.isnan(wanted[:, 2])
    if turning.any():
        host.move(_moves(turning, np.zeros(len(wanted)), wanted[:, 2]))
    late = np.linalg.norm(wanted[:, :2] - host.poses[:, :2], axis=1)
    return np.flatnonzero(host.playing & ~(late <= NEAR_ENOUGH)).tolist()


def _moves(moving: NDArray[np.bool_], distance: NDArray[np.float64], heading: NDArray[np.float64]) -> SwarmMoves:
    turned = np.mod(np.where(moving, heading, 0.0) + np.pi, 2.0 * np.pi) - np.pi
    return SwarmMoves(
        moving,
        distance=np.where(moving, distance, 0.0),
        heading=turned,
        options=int(MoveOption.STOP_ON_CONTACT),
    )
