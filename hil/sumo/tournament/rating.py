"""How strong each is: paired comparisons with draws (Davidson 1970), and with what the seat is worth.

An entrant's strength is a logarithm of odds, theta. In a bout of i in the home seat against j, x = theta_i - theta_j + seat and

    win : draw : loss  =  exp(x / 2) : exp(draw) : exp(-x / 2)

so that i wins a share of 1 / (1 + exp(-x)) of the bouts that are decided: Bradley & Terry's model. The most probable values
are found by Newton's method, and intervals from the curvature there. Each value has a normal prior about 0, so wide that it
matters only where somebody has won or lost everything, which has no other finite answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import BoutOutcome
from hil.statistics import Z95

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hil.sumo.tournament.schedule import TournamentBout

    Array = NDArray[np.float64]

ELO: Final = 400 / log(10)
"""Points of a chess rating (Elo 1978) in a logarithm of odds: 400 points more are odds of 10 to 1."""
STRENGTH_PRIOR: Final = 3.0
"""Standard deviation of strengths, as a logarithm of odds: 520 points."""
SEAT_PRIOR: Final = 1.0
DRAW_PRIOR: Final = 3.0
_ROUNDS: Final = 100
_CLOSE: Final = 1e-10
_SHARES: Final = np.array([[0.5, 0.0], [0.0, 1.0], [-0.5, 0.0]])
"""What win, draw and loss have of x and of the draws' parameter."""


@dataclass(frozen=True)
class Rating:
    """A value that is known as well as this.

    Attributes:
        value: The most probable one.
        error: Standard deviation.
    """

    value: float
    error: float

    @property
    def ci95(self) -> tuple[float, float]:
        """Bounds of the 95 % interval."""
        return self.value - Z95 * self.error, self.value + Z95 * self.error


@dataclass(frozen=True)
class Ratings:
    """What bouts tell of strengths.

    Attributes:
        strengths: Of each entrant, in points about their mean, 0.
        seat: What the home seat is worth, in points.
        draw: Logarithm of the draws' part among equals, against the square root of the product of the others.
    """

    strengths: tuple[Rating, ...]
    seat: Rating
    draw: Rating

    def expected(self, home: int, away: int, *, seated: bool = True) -> tuple[float, float, float]:
        """How probable each ending of a bout is.

        Args:
            home: Who has the home seat.
            away: Who has the other.
            seated: With what the seat is worth; else without.

        Returns:
            Probability that home wins, that it is drawn, that away wins.
        """
        x = self.strengths[home].value - self.strengths[away].value + (self.seat.value if seated else 0.0)
        shares = _probabilities(np.array([x / ELO]), self.draw.value)[0]
        return float(shares[0]), float(shares[1]), float(shares[2])


def rate(entrants: int, bouts: Sequence[TournamentBout]) -> Ratings:
    """Find out how strong each is.

    Args:
        entrants: How many there are.
        bouts: What was played.
    """
    counts: dict[tuple[int, int], list[int]] = {}
    place = {BoutOutcome.WIN: 0, BoutOutcome.DRAW: 1, BoutOutcome.LOSS: 2}
    for bout in bouts:
        counts.setdefault((bout.home, bout.away), [0, 0, 0])[place[bout.outcome]] += 1
    pairs = sorted(counts)
    found = np.array([counts[pair] for pair in pairs], dtype=np.float64).reshape(-1, 3)
    design = np.zeros((len(pairs), entrants + 1))
    rows = np.arange(len(pairs))
    if pairs:
        home, away = np.array(pairs).T
        design[rows, home], design[rows, away], design[:, entrants] = 1.0, -1.0, 1.0
    values, covariance = _most_probable(design, found)
    middle = np.eye(entrants + 2)
    middle[:entrants, :entrants] -= 1.0 / entrants
    values, covariance = middle @ values, middle @ covariance @ middle.T
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = [Rating(float(value), float(error)) for value, error in zip(values, errors, strict=True)]
    points = [Rating(one.value * ELO, one.error * ELO) for one in known[: entrants + 1]]
    return Ratings(tuple(points[:entrants]), points[entrants], known[-1])


def _probabilities(x: Array, draw: float) -> Array:
    """Probabilities of win, draw and loss, shape (n, 3), for advantages of shape (n,)."""
    logits = np.stack([x / 2, np.full_like(x, draw), -x / 2], axis=1)
    shares = np.exp(logits - logits.max(axis=1, keepdims=True))
    normal: Array = shares / shares.sum(axis=1, keepdims=True)
    return normal


def _most_probable(design: Array, found: Array) -> tuple[Array, Array]:
    """Newton's method on the logarithm of the posterior, which has one summit.

    Args:
        design: Of each pair of seats, what its advantage is made of: strengths, then the seat; shape (pairs, entrants + 1).
        found: Of each, how many were won, drawn, lost; shape (pairs, 3).

    Returns:
        The values: strengths, seat, draws' parameter; and their covariance.
    """
    entrants = design.shape[1] - 1
    precision = np.array([STRENGTH_PRIOR] * entrants + [SEAT_PRIOR, DRAW_PRIOR]) ** -2.0
    trials = found.sum(axis=1)
    values = np.zeros(entrants + 2)

    def height(at: Array) -> float:
        shares = _probabilities(design @ at[:-1], at[-1])
        return float((found * np.log(shares)).sum() - (precision * at**2).sum() / 2)

    def curvature(at: Array) -> tuple[Array, Array]:
        shares = _probabilities(design @ at[:-1], at[-1])
        mean = shares @ _SHARES  # of each pair, what is expected of x and of draws
        off = found @ _SHARES - trials[:, None] * mean
        slope = np.append(design.T @ off[:, 0], off[:, 1].sum()) - precision * at
        spread = np.einsum("pk,ka,kb->pab", shares, _SHARES, _SHARES) - mean[:, :, None] * mean[:, None, :]
        spread *= trials[:, None, None]
        bent = np.zeros((entrants + 2, entrants + 2))
        bent[:-1, :-1] = design.T @ (spread[:, 0, 0, None] * design)
        bent[:-1, -1] = bent[-1, :-1] = design.T @ spread[:, 0, 1]
        bent[-1, -1] = spread[:, 1, 1].sum()
        return slope, bent + np.diag(precision)

    for _ in range(_ROUNDS):
        slope, bent = curvature(values)
        step = np.linalg.solve(bent, slope)
        while height(values + step) < height(values) and np.abs(step).max() > _CLOSE:
            step /= 2
        values = values + step
        if np.abs(step).max() < _CLOSE:
            break
    covariance: Array = np.linalg.inv(curvature(values)[1]).astype(np.float64)
    return values, covariance
