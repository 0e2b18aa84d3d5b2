"""What a maneuver is worth, foretold from its parts: Bayesian ridge regression, mixed with its own performances.

A maneuver is described by features that are 1 or 0: a constant; the motion at each place; the pair of families at each
joint of two actions. With four actions these are 1 + 4 x 12 + 3 x 25 = 124. x being the features of a performance and y its
fitness,

    A = sum x x^T + diag(prior)    b = sum x y    w = A^-1 b    p = w . x    h = s2 x^T A^-1 x

where s2 is the pooled variance within maneuvers, p the fitness foretold of a maneuver and h its uncertainty. The prior is
small for the constant, greater for motions and greatest for joints: what is particular needs more evidence.

A maneuver with n performances of mean m is worth both: pv = s2 / 2 + h being the variance of what the features can't tell,
and e = s2 / n that of the mean, its value is (pv m + e p) / (pv + e), and the variance of it pv e / (pv + e).

All sums are made element by element in a fixed order, never by a BLAS: the same performances give the same bits anywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np

from firmware_protocol.vocabulary import Action, Family
from pal_advisor.fields import HUGE, MOST, Fields
from pal_advisor.maneuvers.evidence import SAME_MOTION, UNKNOWN, OwnMean, path_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from pal_advisor.fields import FieldError

Floats: TypeAlias = "NDArray[np.float64]"

PRIOR_CONSTANT: Final = 0.01
PRIOR_MOTION: Final = 4.0
PRIOR_JOINT: Final = 8.0
"""Performances that no effect of a feature is worth."""
RENEW_EVERY: Final = 12
"""Performances after which the inverse is made anew."""
OWN: Final = 2.0
"""What the features can't tell of a maneuver has the variance of a performance over this."""
ENOUGH: Final = 5
"""Repetitions needed to tell the spread of repetitions from that of all performances."""
LEAST_VARIANCE: Final = 1e-12
SUM: Final = HUGE * MOST
SQUARES: Final = HUGE * HUGE * MOST
"""No sum of fitness, and none of squares, is greater."""

_MOTIONS: Final = {code: number for number, code in enumerate(sorted(set(SAME_MOTION) - {int(Action.S)}))}
"""Numbers of the motions; to stop is none."""
_FAMILIES: Final = tuple(int(action.family) for action in Action)


@dataclass(frozen=True)
class Estimates:
    """What is known of some maneuvers.

    Attributes:
        value: Expected fitness of each, shape (maneuvers,).
        error: Standard errors of these, same shape.
        evidence: Performances that this knowledge is worth, same shape.
    """

    value: Floats
    error: Floats
    evidence: Floats


class Model:
    """The maneuvers of one situation, what their performances gave, and what that tells of others.

    Maneuvers that turn the wheels alike are one row; rows come in the order of `enter`.

    Args:
        actions: Actions a maneuver has.

    Attributes:
        count: Performances taken in.
    """

    def __init__(self, actions: int) -> None:
        self.count = 0
        self._size = 1 + len(_MOTIONS) * actions + len(Family) ** 2 * (actions - 1)
        self._prior = np.full(self._size, PRIOR_JOINT)
        self._prior[: 1 + len(_MOTIONS) * actions] = PRIOR_MOTION
        self._prior[0] = PRIOR_CONSTANT
        self._rows: dict[tuple[int, ...], int] = {}
        self._places = 2 * actions
        self._first, self._second = np.triu_indices(self._places)
        self._twice = np.where(self._first == self._second, 1.0, 2.0)
        self._features = np.empty((0, self._places), dtype=np.intp)
        self._count = np.zeros(0)
        self._total = np.zeros(0)
        self._squares = np.zeros(0)
        self._renewed = np.zeros(0)
        self._renewed_at = 0
        self._inverse = self._inverse_of(self._renewed)
        self._doubt = np.zeros(0)

    def enter(self, genome: Sequence[int]) -> int:
        """The row of a maneuver, a new one where it has none.

        Args:
            genome: Codes of its actions.
        """
        path = path_of(genome)
        row = self._rows.get(path)
        if row is None:
            row = self._rows[path] = len(self._rows)
            if row == len(self._count):
                self._grow()
            self._features[row] = self._features_of(path)
        return row

    def _grow(self) -> None:
        more = max(64, len(self._count))
        self._features = np.concatenate((self._features, np.full((more, self._places), self._size, dtype=np.intp)))
        self._count, self._total, self._squares, self._renewed = (
            np.concatenate((array, np.zeros(more))) for array in (self._count, self._total, self._squares, self._renewed)
        )

    def _features_of(self, genome: Sequence[int]) -> list[int]:
        """Numbers of the features that are 1; `_size`, which is none, where an action stops."""
        motions = [
            1 + len(_MOTIONS) * place + _MOTIONS[code] if code in _MOTIONS else self._size
            for place, code in enumerate(map(SAME_MOTION.__getitem__, genome))
        ]
        joints, families = 1 + len(_MOTIONS) * len(genome), [_FAMILIES[code] for code in genome]
        number = len(Family)
        return [0, *motions, *(joints + number * (number * joint + a) + b for joint, (a, b) in enumerate(pairwise(families)))]

    def add(self, genome: Sequence[int], fitness: float) -> None:
        """Take in a performance.

        Args:
            genome: The maneuver, as codes of its actions, however many of them were begun.
            fitness: How well it did.
        """
        row = self.enter(genome)
        self.count += 1
        self._count[row] += 1.0
        self._total[row] += fitness
        self._squares[row] += fitness * fitness
        if self.count - self._renewed_at >= RENEW_EVERY:
            self.renew()

    def of(self, genome: Sequence[int]) -> float:
        """Performances of what turns the wheels like a maneuver; `UNKNOWN` for none.

        Args:
            genome: Codes of its actions.
        """
        row = self._rows.get(path_of(genome))
        return UNKNOWN if row is None else float(self._count[row]) or UNKNOWN

    def own_mean(self, genome: Sequence[int]) -> OwnMean | None:
        """What came of what turned the wheels like a maneuver; None where nothing did.

        Args:
            genome: Codes of its actions.
        """
        row = self._rows.get(path_of(genome))
        if row is None or not self._count[row]:
            return None
        count = float(self._count[row])
        return OwnMean(int(count), float(self._total[row]) / count, math.sqrt(self.variance() / count))

    def renew(self) -> None:
        """Make the inverse of all performances so far."""
        if self._renewed_at != self.count:
            self._renewed_at = self.count
            self._renewed = self._count.copy()
            self._inverse = self._inverse_of(self._renewed)
            self._doubt = np.zeros(0)

    def _inverse_of(self, counts: Floats) -> Floats:
        """A^-1, with a last row and column of zeros for what is no feature; shape (features + 1, features + 1)."""
        size = self._size
        performed = np.flatnonzero(counts)
        features = self._features[performed]
        codes = features[:, :, None] * (size + 1) + features[:, None, :]
        sums = np.bincount(codes.ravel(), np.repeat(counts[performed], self._places**2), (size + 1) ** 2).astype(np.float64)
        matrix = sums.reshape(size + 1, size + 1)[:size, :size] + np.diag(self._prior)
        inverse = np.zeros((size + 1, size + 1))
        np.fill_diagonal(inverse[:size, :size], 1.0 / self._prior)
        seen = np.flatnonzero(matrix.diagonal() > self._prior)
        inverse[np.ix_(seen, seen)] = _inverted(matrix[np.ix_(seen, seen)])
        return inverse

    def variance(self) -> float:
        """s2: the pooled variance within maneuvers; of all performances, where too few were repeated."""
        repeated = self._count > 1.0
        count, total, squares = self._count[repeated], self._total[repeated], self._squares[repeated]
        freedom = float((count - 1.0).sum())
        if freedom >= ENOUGH:
            return max(float((squares - total * total / count).sum()) / freedom, LEAST_VARIANCE)
        if not self.count:
            return 1.0
        return max(float(self._squares.sum()) / self.count - (float(self._total.sum()) / self.count) ** 2, LEAST_VARIANCE)

    def weights(self) -> Floats:
        """W = A^-1 b, with a 0 for what is no feature; shape (features + 1,)."""
        rows = len(self._rows)
        sums = np.bincount(self._features[:rows].ravel(), np.repeat(self._total[:rows], self._places), self._size + 1)
        weights: Floats = (self._inverse * sums[:, None]).sum(axis=0)
        return weights

    def foretell(self, genomes: Sequence[Sequence[int]]) -> tuple[Floats, Floats]:
        """What is foretold of maneuvers that need not have been entered.

        Args:
            genomes: Codes of their actions.

        Returns:
            p and h of each, both of shape (maneuvers,).
        """
        features = np.array([self._features_of(genome) for genome in genomes], dtype=np.intp)
        return self._foretold(features, self.weights()), self.variance() * self._doubts(features)

    def by_parts(self, genome: Sequence[int]) -> tuple[float, float]:
        """What the features tell of a maneuver, its own mean left aside.

        Args:
            genome: Codes of its actions.

        Returns:
            The fitness foretold, p, and its standard error, sqrt(pv).
        """
        foretold, doubt = self.foretell([genome])
        return float(foretold[0]), math.sqrt(self.variance() / OWN + float(doubt[0]))

    @staticmethod
    def _foretold(features: NDArray[np.intp], weights: Floats) -> Floats:
        foretold: Floats = weights[features.T].sum(axis=0)
        return foretold

    def _doubts(self, features: NDArray[np.intp]) -> Floats:
        """x^T A^-1 x of each, shape (maneuvers,)."""
        codes = features[:, self._first].T * (self._size + 1) + features[:, self._second].T
        doubts: Floats = (self._inverse.take(codes) * self._twice[:, None]).sum(axis=0)
        return doubts

    def estimates(self) -> Estimates:
        """What is known of every row."""
        rows = len(self._rows)
        if rows > len(self._doubt):
            self._doubt = np.concatenate((self._doubt, self._doubts(self._features[len(self._doubt) : rows])))
        variance = self.variance()
        foretold = self._foretold(self._features[:rows], self.weights())
        count, total = self._count[:rows], self._total[:rows]
        untold = variance * (1.0 / OWN + self._doubt)
        performed = np.maximum(count, 1.0)
        spread = variance / performed
        value = np.where(count > 0.0, (untold * (total / performed) + spread * foretold) / (untold + spread), foretold)
        doubt = np.where(count > 0.0, untold * spread / (untold + spread), untold)
        return Estimates(value, np.sqrt(doubt), np.where(count > 0.0, count, UNKNOWN))

    def to_list(self) -> list[Any]:
        """State as plain values: for every row performances, those at the last renewal, sum of fitness, sum of squares."""
        rows = slice(len(self._rows))
        counts = (self._count[rows].astype(int).tolist(), self._renewed[rows].astype(int).tolist())
        sums = (self._total[rows].tolist(), self._squares[rows].tolist())
        return [list(row) for row in zip(*counts, *sums, strict=True)]

    def restore(self, data: object, path: str, error: type[FieldError]) -> None:
        """Go on with what `to_list` gave; all maneuvers have been entered, in the order in which they were.

        Args:
            data: Plain values.
            path: What they are within the whole.
            error: The error of a field.

        Raises:
            FieldError: A field is missing or wrong; of the kind given.
        """
        if not isinstance(data, list) or len(data) != len(self._rows):
            raise error(path, f"expected a list of {len(self._rows)}, one for each motion of the archive")
        for row, item in enumerate(data):
            fields = Fields.row(item, ("performed", "renewed", "total", "squares"), f"{path}[{row}]", error)
            self._count[row] = performed = fields.integer("performed")
            self._renewed[row] = fields.integer("renewed", 0, performed)
            self._total[row] = fields.number("total", -SUM, SUM)
            self._squares[row] = fields.number("squares", 0.0, SQUARES)
        self.count = int(self._count.sum())
        self._renewed_at = int(self._renewed.sum())
        self._inverse = self._inverse_of(self._renewed)


def _inverted(matrix: Floats) -> Floats:
    """The inverse of a symmetric positive definite matrix, by Gauss and Jordan, element by element in a fixed order."""
    inverse = matrix.copy()
    for pivot in range(len(inverse)):
        column = inverse[:, pivot].copy()
        row = inverse[pivot] / column[pivot]
        inverse -= column[:, None] * row
        inverse[pivot] = row
        inverse[:, pivot] = -column / column[pivot]
        inverse[pivot, pivot] = 1.0 / column[pivot]
    return inverse
