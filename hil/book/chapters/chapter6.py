"""Chapter 6, the method: what its tables and figures say, and which reading of its sensors learns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from hil.book.chapters.measuring import left_at_50
from hil.book.claim import Claim, ClaimVerdict, Limit
from hil.book.measurement import Measurement, difference_of, mean_of
from pal_advisor.surround.experience import bounds
from pal_advisor.surround.stimuli import stimuli_of

if TYPE_CHECKING:
    from hil.book.results import StoredResults

_TABLE_6_1: Final = {1: 2, 2: 3, 3: 4, 4: 6, 5: 8, 6: 14, 7: 18, 8: 29, 9: 42}
"""Stimuli by number of sectors, as the book prints them."""


def _stimuli(_: StoredResults) -> Measurement:
    found = {sectors: len(stimuli_of(sectors)) for sectors in _TABLE_6_1}
    equal = sum(found[sectors] == printed for sectors, printed in _TABLE_6_1.items())
    others = ", ".join(f"{found[n]} for N = {n}" for n, printed in _TABLE_6_1.items() if found[n] != printed)
    return Measurement(equal, equal, equal, 0, f"{equal} of {len(_TABLE_6_1)} entries are the same; there are {others}")


def _stimulus_25(_: StoredResults) -> Measurement:
    number = next(n for n in range(1, len(stimuli_of(8)) + 1) if stimuli_of(8).text(n) == "01010111")
    return Measurement(number, number, number, 0, f"number {number}, canonical 01010111")


def _smallest_weight(_: StoredResults) -> Measurement:
    least, greatest = bounds(8)
    return Measurement(least, least, greatest, 0, f"{least:.5f} to {greatest:.5f} for eight behaviours")


def _sensing(name: str) -> Claim:
    return Claim(
        name=f"sensing-{name}",
        place="6.1.4, Fig. 6.6",
        says={
            "hybrid": "Sensors of short range, fixed for the stimulus and adjustable for the direction, serve to surround.",
            "adjustable": "Sensors of short range whose radius grows until something is seen serve as well.",
            "fixed": "Sensors of short range whose radius is fixed serve as well.",
        }[name],
        measured="left of the distance D after 50 steps, B2D3",
        needs=("b2d3" if name == "hybrid" else f"b2d3-{name}",),
        measure=lambda results: mean_of(left_at_50(results, "b2d3" if name == "hybrid" else f"b2d3-{name}")),
        limit=Limit(high=0.3),
        asked="at most 0.30",
        why={
            "hybrid": "",
            "adjustable": (
                "A radius that grows until something is seen always sees something, so that STIMULUS1 does not occur, and what "
                "is learnt far off and what is learnt near by share one table."
            ),
            "fixed": (
                "Who sees nobody within R0 has no direction that means anything to others, and increments there are nearly "
                "always 0: nobody who is far from all WILDs learns to come nearer."
            ),
        }[name],
    )


def _between_orders(results: StoredResults) -> Measurement:
    return difference_of(mean_of(left_at_50(results, "b2d3-sequential")), mean_of(left_at_50(results, "b2d3")))


CLAIMS: Final = (
    Claim(
        name="stimuli-of-n-sectors",
        place="Table 6.1",
        says="There are 2, 3, 4, 6, 8, 14, 18, 29 and 42 stimuli for 1 to 9 sectors.",
        measured="entries of the table that are the numbers of classes under rotation and reflection",
        needs=(),
        measure=_stimuli,
        limit=Limit(low=9, otherwise=ClaimVerdict.DIFFERS),
        asked="all nine",
        why=("There are as many stimuli as bracelets of N beads of two colours, whose known numbers are the ones here."),
    ),
    Claim(
        name="stimulus-25",
        place="Table 6.1, Eq. 7.16",
        says="01110101 is STIMULUS25.",
        measured="its number in the order of ones, then of value",
        needs=(),
        measure=_stimulus_25,
        limit=Limit(25, 25, otherwise=ClaimVerdict.DIFFERS),
        asked="25",
        why="The book does not say in which order it counts.",
    ),
    Claim(
        name="bound-of-function2",
        place="Eq. 6.15, Fig. 6.15",
        says="Smoothed weights come near to 0 and 1 and never reach them.",
        measured="least and greatest weight that one increment and smoothing can leave, from the equations",
        needs=(),
        measure=_smallest_weight,
        limit=Limit(1e-9, 1 - 1e-9),
        asked="within 0 and 1",
    ),
    *(_sensing(name) for name in ("hybrid", "adjustable", "fixed")),
    Claim(
        name="order-of-moves",
        place="6.2, ch. 14",
        says="Robots move one after the other (the toolbox of chapter 14 loops so).",
        measured="left of D after 50 steps, B2D3: one after the other, less all of a class at once",
        needs=("b2d3-sequential", "b2d3"),
        measure=_between_orders,
        limit=Limit(-0.05, 0.05),
        asked="the same within 0.05",
    ),
)
"""In the order of the book."""
