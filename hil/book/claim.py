"""A claim of the book, and the verdict on it, which is computed from the figure and its interval."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import inf
from typing import TYPE_CHECKING, Final

from hil.book.results import ResultMissingError

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil.book.measurement import Measurement
    from hil.book.results import StoredResults


class ClaimVerdict(StrEnum):
    """What becomes of a claim."""

    HOLDS = "holds"
    """What was measured is as claimed, and so is all of its interval."""
    OPEN = "open"
    """The interval reaches to both sides of the limit."""
    DOES_NOT = "does not"
    """It is not as claimed, nor is any of its interval."""
    DIFFERS = "differs"
    """There is something of the kind, and it is another."""
    REPORTED = "reported"
    """Nothing is claimed that a figure could decide."""
    UNKNOWN = "not measured"
    """The runs have not been made, or what they leave does not tell."""


@dataclass(frozen=True)
class Limit:
    """Where a figure must lie for a claim to hold.

    Attributes:
        low: It is no less.
        high: It is no more.
        otherwise: The verdict where it lies outside.
        alone: The figure alone decides, and not its interval: what is claimed is of these very runs.
    """

    low: float = -inf
    high: float = inf
    otherwise: ClaimVerdict = ClaimVerdict.DOES_NOT
    alone: bool = False

    def judge(self, measurement: Measurement) -> ClaimVerdict:
        """The verdict.

        Args:
            measurement: What was measured.
        """
        least, greatest = (measurement.value, measurement.value) if self.alone else (measurement.low, measurement.high)
        if self.low <= least and greatest <= self.high:
            return ClaimVerdict.HOLDS
        return self.otherwise if greatest < self.low or least > self.high else ClaimVerdict.OPEN


MORE_THAN_0: Final = 1e-9
"""Least figure that is not nothing."""


@dataclass(frozen=True)
class Claim:
    """A claim.

    Attributes:
        name: Its name, of which there is one.
        place: Where the book makes it.
        says: What the book says.
        measured: What is measured here.
        needs: Names of the experiments that it is measured by, the first the most.
        measure: Measures it.
        limit: Where the figure must lie; None where it is reported only.
        asked: The limit, in words.
        why: Why it is as it is, told where it does not hold.
    """

    name: str
    place: str
    says: str
    measured: str
    needs: tuple[str, ...]
    measure: Callable[[StoredResults], Measurement]
    limit: Limit | None = None
    asked: str = ""
    why: str = ""

    def judge(self, results: StoredResults) -> Judgement:
        """Measure it, and judge.

        Args:
            results: What the experiments have left.
        """
        try:
            measurement = self.measure(results)
        except ResultMissingError:
            return Judgement(self, None, ClaimVerdict.UNKNOWN)
        return Judgement(self, measurement, ClaimVerdict.REPORTED if self.limit is None else self.limit.judge(measurement))


@dataclass(frozen=True)
class Judgement:
    """What was found of a claim.

    Attributes:
        claim: The claim.
        measurement: The figure; None where it was not measured.
        verdict: The verdict.
    """

    claim: Claim
    measurement: Measurement | None
    verdict: ClaimVerdict
