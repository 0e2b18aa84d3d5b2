"""Follows a run step by step, and keeps what the measures of its whole history need, and no more."""

from __future__ import annotations

from math import isnan, nan
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.fields import MOST
from pal_advisor.surround.measures.histories import PERIODS, SPAN, macro_stable, periodic, pushed
from pal_advisor.surround.stimuli import MOST_SECTORS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from pal_advisor.fields import Fields

    Positions = tuple[NDArray[np.float64], NDArray[np.float64]]

WINDOW: Final = 2 * PERIODS + 1
"""Positions of which `periodic` sees the periods that end now."""
FAR: Final = 1e9


class RunTracker:
    """What is kept of a run.

    Args:
        robots: How many RANGERs and WILDs play.

    Attributes:
        pushed: How often a WILD was pushed by RANGERs together: one for each such WILD and step (7.2.2.3).
        macro_stable: First steps of the spans in which the swarm was stable in the large and not in its members (8.7).
        weights: Least and greatest weight of the vectors that are others than uniform, as seen after any step, of RANGERs and
            of WILDs; None where all have always been uniform.
    """

    def __init__(self, robots: tuple[int, int]) -> None:
        self.pushed = 0
        self.macro_stable: list[int] = []
        self.weights: list[tuple[float, float] | None] = [None for _ in RobotClass]
        self._robots = robots
        self._steps = -1
        self._to_and_fro = np.zeros(sum(robots), dtype=np.bool_)
        self._positions: list[NDArray[np.float64]] = []
        self._distances: list[float] = []
        self._turned: list[bool] = []
        self._best: NDArray[np.int64] | None = None

    @property
    def periodic(self) -> tuple[float | None, float | None]:
        """Share of the RANGERs and of the WILDs that have moved to and fro (8.6); None where there is none."""
        rangers, wilds = np.split(self._to_and_fro, [self._robots[0]])
        return tuple(float(found.mean()) if len(found) else None for found in (rangers, wilds))  # type: ignore[return-value]

    def push(self, before: Positions, after: Positions, contact: float) -> None:
        """Count the WILDs that were pushed while RANGERs moved.

        Args:
            before: Where RANGERs and WILDs were, each of shape (robots, 2).
            after: Where they are.
            contact: Distance of positions up to which two robots touch.
        """
        (rangers, wilds), (ranger_ways, wild_ways) = after, (end - begin for begin, end in zip(before, after, strict=True))
        self.pushed += int(np.count_nonzero(pushed(rangers, ranger_ways, wilds, wild_ways, contact)))

    def replace(self, kind: RobotClass, place: int) -> None:
        """Another robot has taken somebody's place: it has no history.

        Args:
            kind: The class.
            place: Whose, among those of the class.
        """
        row = place + (self._robots[0] if kind == RobotClass.WILD else 0)
        for positions in self._positions:
            positions[row] = np.nan

    def take(
        self, positions: Positions, distance: float | None, weights: tuple[NDArray[np.float64], NDArray[np.float64]]
    ) -> None:
        """Take in the start, or the end of a step.

        Args:
            positions: Where RANGERs and WILDs are, each of shape (robots, 2); NaN where nobody knows.
            distance: D; None where it is unknown.
            weights: What RANGERs and WILDs know, each of shape (stimuli, N); -1 where a behaviour is not feasible.
        """
        self._steps += 1
        self._positions = [*self._positions[-(WINDOW - 1) :], np.concatenate(positions)]
        if len(self._positions) == WINDOW:
            self._to_and_fro |= periodic(np.stack(self._positions))
        self._distances = [*self._distances[-SPAN:], np.nan if distance is None else distance]
        wilds = weights[RobotClass.WILD]
        if self._best is not None:
            self._turned = [*self._turned[-(SPAN - 1) :], bool((wilds.argmax(axis=1) != self._best).any())]
        self._best = wilds.argmax(axis=1)
        if len(self._turned) == SPAN and len(macro_stable(np.array(self._distances), np.array(self._turned))):
            self.macro_stable.append(self._steps - SPAN)
        for kind in RobotClass:
            self.weights[kind] = _wider(self.weights[kind], weights[kind])

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "steps": self._steps + 1,
            "pushed": self.pushed,
            "macro_stable": self.macro_stable,
            "weights": [None if seen is None else list(seen) for seen in self.weights],
            "to_and_fro": np.flatnonzero(self._to_and_fro).tolist(),
            "positions": [_plain(positions.ravel().tolist()) for positions in self._positions],
            "distances": _plain(self._distances),
            "turned": self._turned,
            "best": [] if self._best is None else self._best.tolist(),
        }

    @classmethod
    def from_fields(cls, fields: Fields, robots: tuple[int, int]) -> RunTracker:
        """The inverse of `to_dict`.

        Args:
            fields: What it gave.
            robots: How many RANGERs and WILDs play.

        Raises:
            FieldError: A field is missing, unknown or wrong; of the kind that the fields raise.
        """
        tracker, count = cls(robots), sum(robots)
        tracker._steps = fields.integer("steps") - 1
        tracker.pushed = fields.integer("pushed")
        tracker.macro_stable = _integers(fields, "macro_stable", MOST)
        seen = fields.elements("weights")
        if len(seen.names) != len(tracker.weights):
            raise fields.wrong("weights", f"expected {len(tracker.weights)} pairs, not {len(seen.names)}")
        for kind, path in zip(RobotClass, seen.names, strict=True):
            tracker.weights[kind] = None if seen.peek(path) is None else _pair(seen, path)
        rows = _integers(fields, "to_and_fro", count - 1)
        tracker._to_and_fro[rows] = True
        positions = fields.elements("positions")
        for path in positions.names:
            row = _numbers(positions, path)
            if len(row) != 2 * count:
                raise fields.wrong("positions", f"expected {2 * count} numbers, not {len(row)}")
            tracker._positions.append(np.array(row).reshape(count, 2))
        tracker._distances = _numbers(fields, "distances")
        turned = fields.elements("turned")
        tracker._turned = [turned.flag(path) for path in turned.names]
        best = _integers(fields, "best", MOST_SECTORS)
        tracker._best = np.array(best, dtype=np.int64) if best else None
        fields.done()
        for name, kept, most in (
            ("positions", tracker._positions, WINDOW),
            ("distances", tracker._distances, SPAN + 1),
            ("turned", tracker._turned, SPAN),
        ):
            if len(kept) > most:
                raise fields.wrong(name, f"expected up to {most}, not {len(kept)}")
        return tracker


def _wider(seen: tuple[float, float] | None, weights: NDArray[np.float64]) -> tuple[float, float] | None:
    """Least and greatest weight of vectors that are not uniform, with those that were seen before."""
    mask = weights[0] >= 0.0
    feasible = weights[:, mask]
    learnt = feasible[(feasible != 1.0 / max(1, feasible.shape[1])).any(axis=1)]
    if not learnt.size:
        return seen
    low, high = float(learnt.min()), float(learnt.max())
    return (low, high) if seen is None else (min(low, seen[0]), max(high, seen[1]))


def _plain(values: Iterable[float]) -> list[float | None]:
    return [None if isnan(value) else value for value in values]


def _numbers(fields: Fields, name: str) -> list[float]:
    row = fields.elements(name)
    return [nan if row.peek(path) is None and row.take(path) is None else row.number(path, -FAR, FAR) for path in row.names]


def _integers(fields: Fields, name: str, most: int) -> list[int]:
    row = fields.elements(name)
    return [row.integer(path, 0, most) for path in row.names]


def _pair(fields: Fields, path: str) -> tuple[float, float]:
    pair = fields.elements(path)
    if len(pair.names) != 2:
        raise fields.wrong(path, "expected two weights")
    low, high = (pair.number(each, 0.0, 1.0) for each in pair.names)
    return low, high
