"""Chapter 8, what matters: range of the sensors, where WILDs begin, smoothing, selection, how WILDs move."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from hil.book.chapters.measuring import left_of_distance, mean_column
from hil.book.claim import MORE_THAN_0, Claim, ClaimVerdict, Limit
from hil.book.measurement import Measurement, difference_of, mean_of, ratio_of, share_of
from pal_advisor.surround.measures import settle_step

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.book.results import StoredResults

_CHANCE: Final = 0.25
"""What two of eight uniform weights hold."""


def _learns_nothing(results: StoredResults, names: Sequence[str]) -> Measurement:
    return share_of(np.concatenate([results.runs(name).column("uniform") for name in names]) > 0)


def _occurs(results: StoredResults, name: str, column: str) -> Measurement:
    """The share of runs in which something occurs, and how often it does."""
    found = results.runs(name).column(column)
    share = share_of(found > 0)
    return share.told(f"{share}; {found.mean():.2g} on average")


def _between(results: StoredResults, those: str, others: str, column: str) -> Measurement:
    """By how much the mean of a column is greater in one experiment than in another, and both."""
    one, other = (mean_column(results, name, column) for name in (those, others))
    found = difference_of(one, other)
    return found.told(f"{found}: {one.value:.2f} and {other.value:.2f}")


def _stimuli(results: StoredResults, those: str, others: str) -> Measurement:
    """By how many more stimuli are met in one experiment than in another, and how near RANGERs are in the end."""
    found = _between(results, those, others, "stimuli_met")
    near, far = (mean_column(results, name, "distance_last").value for name in (those, others))
    return found.told(f"{found}; D {near:.2f} and {far:.2f} at the end")


def _weights(results: StoredResults, names: Sequence[str]) -> Measurement:
    least = min(results.runs(name).column("least").min() for name in names)
    greatest = max(results.runs(name).column("greatest").max() for name in names)
    count = sum(results.runs(name).count for name in names)
    return Measurement(
        greatest, least, greatest, count, f"{least:.3f} to {greatest:.3f}, the least and the greatest of all runs"
    )


def _zeros(results: StoredResults, names: Sequence[str]) -> Measurement:
    shares = np.concatenate([results.runs(name).column("zeros") / results.runs(name).column("learnt") for name in names])
    return mean_of(shares)


def _faster(results: StoredResults, slow: str, fast: str, column: str) -> Measurement:
    """How many times as many steps the one takes, and both."""
    those, others = (mean_column(results, name, column) for name in (slow, fast))
    found = ratio_of(those, others)
    return found.told(f"{found}: step {those.value:.0f} and step {others.value:.0f}")


def _settles_faster(results: StoredResults, slow: str, fast: str) -> Measurement:
    """How many times as many steps the one takes; the same of the mean of D over all runs, and whether it rises again."""
    found = _faster(results, slow, fast, "settle_step")
    course, other = (np.array(results.runs(name).data["distance"]) for name in (slow, fast))
    steps = f"step {settle_step(course)} and step {settle_step(other)}"
    return found.told(f"{found}; of the mean D {steps}; D by L1 {course.min():.2f} at least, {course[-1]:.2f} at last")


_SMOOTHED: Final = ("b1d3l1", "b1d3l2", "b2d3l1", "b2d3l2")
_ORIGINAL: Final = ("b1d3l3", "b1d3l4", "b2d3l3", "b2d3l4")
_LONG: Final = ("b1d3s2", "b1d1s2")

CLAIMS: Final = (
    Claim(
        name="long-range-learns-nothing",
        place="8.1, Fig. 8.3, 8.9, rule RE (Eq. 8.1)",
        says="Sensors of long range learn nothing.",
        measured="runs of 50 steps in which all weights of both classes are exactly 1/8 throughout, B1D3S2 and B1D1S2",
        needs=_LONG,
        measure=partial(_learns_nothing, names=_LONG),
        limit=Limit(low=1.0, alone=True),
        asked="every run",
    ),
    *(
        Claim(
            name=f"long-range-leaves-{name}",
            place="8.1, Fig. 8.7" if name == "b1d1" else "8.1, Fig. 8.9",
            says="With sensors of long range some RANGERs leave the area.",
            measured=f"by how much the share outside at step 50 is greater than with short range, {name.upper()}",
            needs=(f"{name}s2", name),
            measure=partial(_between, those=f"{name}s2", others=name, column="outside_50"),
            limit=Limit(low=MORE_THAN_0),
            asked="more than 0",
        )
        for name in ("b1d1", "b1d3")
    ),
    Claim(
        name="fourteen-stimuli",
        place="8.2",
        says="RANGERs meet 14 different stimuli in B1C1D3L1R25S1W8.",
        measured="stimuli met in 100 steps",
        needs=("b1d3l1",),
        measure=partial(mean_column, name="b1d3l1", column="stimuli_met"),
        limit=Limit(13.5, 14.5, otherwise=ClaimVerdict.DIFFERS),
        asked="14",
        why="The book counts one run, and does not say how rare a stimulus may be.",
    ),
    Claim(
        name="fewer-stimuli-scattered",
        place="8.2",
        says="Where WILDs begin scattered, RANGERs meet fewer stimuli.",
        measured="by how many more are met in 100 steps of B1D3 than of B1D1",
        needs=("b1d3l1", "b1d1"),
        measure=partial(_between, those="b1d3l1", others="b1d1", column="stimuli_met"),
        limit=Limit(low=MORE_THAN_0),
        asked="more than 0",
    ),
    Claim(
        name="smoothed-weights",
        place="8.3",
        says="Smoothing keeps every choice alive: no weight becomes 0 or 1.",
        measured="weights of what was learnt in 100 steps, L1 and L2, B1D3 and B2D3",
        needs=_SMOOTHED,
        measure=partial(_weights, names=_SMOOTHED),
        limit=Limit(0.03, 0.55),
        asked="within 0.03 and 0.55",
    ),
    Claim(
        name="original-weights",
        place="8.3",
        says="Without smoothing weights soon become 0, and what has weight 0 is not chosen again.",
        measured="share of learnt vectors with a 0 after 100 steps, L3 and L4, B1D3 and B2D3",
        needs=_ORIGINAL,
        measure=partial(_zeros, names=_ORIGINAL),
        limit=Limit(low=MORE_THAN_0),
        asked="more than 0",
    ),
    *(
        Claim(
            name=f"maximum-settles-faster-{name}",
            place="8.4, Fig. 8.15 to 8.20",
            says="By the largest weight the swarm settles faster than by probability.",
            measured=f"step from which on D of a run stays near its last value, L1 by L2, {name.upper()}, 100 steps",
            needs=(f"{name}l1", f"{name}l2"),
            measure=partial(_settles_faster, slow=f"{name}l1", fast=f"{name}l2"),
            limit=Limit(low=2.0),
            asked="at least 2",
            why=(
                "WILDs that learn to get away have D rise again after it was least, so that the step from which it stays near "
                "its last value hangs on little. When D first comes near its least value is "
                "below."
            ),
        )
        for name in ("b1d3", "b2d3")
    ),
    *(
        Claim(
            name=f"maximum-arrives-sooner-{name}",
            place="8.4, Fig. 8.19, 8.20",
            says="By the largest weight WILDs attract more strongly.",
            measured=f"first step at which D is near its least value, L1 by L2, {name.upper()}, 100 steps",
            needs=(f"{name}l1", f"{name}l2"),
            measure=partial(_faster, slow=f"{name}l1", fast=f"{name}l2", column="reached"),
            limit=Limit(low=2.0),
            asked="at least 2",
        )
        for name in ("b1d3", "b2d3")
    ),
    Claim(
        name="maximum-is-less-robust",
        place="8.4",
        says="Selection by the largest weight is less robust.",
        measured="by how much the share of WILDs surrounded at step 100 is less with L2 than with L1, B1D3",
        needs=("b1d3l1", "b1d3l2"),
        measure=partial(_between, those="b1d3l1", others="b1d3l2", column="share_last"),
        limit=Limit(low=MORE_THAN_0),
        asked="more than 0",
        why="The book gives no measure of it; by this one it is no less robust.",
    ),
    *(
        Claim(
            name=f"stimuli-{those}-{others}",
            place="8.5",
            says=f"RANGERs meet more stimuli where WILDs {how[those[:2]]} than where they {how[others[:2]]} ({where}).",
            measured=f"by how many more are met in 100 steps of {those[:4].upper()} than of {others[:4].upper()}",
            needs=(those, others),
            measure=partial(_stimuli, those=those, others=others),
            limit=Limit(low=MORE_THAN_0, otherwise=ClaimVerdict.DIFFERS),
            asked="more than 0",
            why="Who is nearer sees more at once, and RANGERs end nearest to WILDs that stand still."
            if others[:2] == "b2"
            else "",
        )
        for how in ({"b1": "learn", "b2": "stand still", "b3": "move at random"},)
        for those, others, where in (
            ("b1d3l1", "b2d3l1", "in a crowd"),
            ("b1d1", "b2d1", "scattered"),
            ("b3d3", "b1d3l1", "in a crowd"),
            ("b3d1", "b1d1", "scattered"),
        )
    ),
    *(
        Claim(
            name=f"random-wilds-{name}",
            place="8.5",
            says="Where WILDs move at random, a stable state is reached in the end.",
            measured=f"left of D after 50 steps, {name.upper()}",
            needs=(name,),
            measure=partial(left_of_distance, name=name),
            limit=Limit(high=high),
            asked=f"less than {high}",
        )
        for name, high in (("b3d3", 0.6), ("b3d1", 0.7))
    ),
    Claim(
        name="periodic-motion",
        place="8.6, Fig. 8.23",
        says="With sensors of long range some RANGERs move to and fro.",
        measured="runs of 100 steps in which a RANGER does so for three periods or more, B1D1L3S2",
        needs=("b1d1l3s2",),
        measure=partial(_occurs, name="b1d1l3s2", column="periodic"),
        limit=Limit(low=0.5),
        asked="most runs",
        why=(
            "In the book's example a way has been learnt. With a radius that has no limit nothing is, moves are random, and "
            "who moves at random is seldom back three times in a row."
        ),
    ),
    Claim(
        name="macro-stable-micro-unstable",
        place="8.7, Fig. 8.25, 8.26",
        says="The swarm as a whole may be stable while WILDs still change what they do.",
        measured="runs of 100 steps of B1D4 in which D is within 5 % for 20 steps, and WILDs' largest weight changes meanwhile",
        needs=("b1d4",),
        measure=partial(_occurs, name="b1d4", column="macro_stable"),
        limit=Limit(low=0.5),
        asked="most runs",
    ),
    *(
        Claim(
            name=f"two-dominant-behaviours-{name}",
            place="8.8, Fig. 8.27",
            says="The reaction to a stimulus consists of two behaviours.",
            measured=f"share of the two largest weights of STIMULUS2, {name[:4].upper()}, 100 steps; {_CHANCE:.2f} is chance",
            needs=(name,),
            measure=partial(mean_column, name=name, column="dominance"),
            limit=Limit(low=0.5, otherwise=ClaimVerdict.DIFFERS),
            asked="more than half",
            why="They hold more than chance gives them, and the other six, which smoothing keeps alive, hold the rest.",
        )
        for name in ("b1d1", "b1d3l1", "b2d3l1")
    ),
)
"""In the order of the book."""
