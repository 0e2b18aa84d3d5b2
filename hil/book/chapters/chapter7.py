"""Chapter 7: RANGERs learn to surround, push and chase; the rules that they and WILDs learn."""

from __future__ import annotations

from functools import partial
from math import sqrt
from typing import TYPE_CHECKING, Final

from firmware_protocol.vocabulary import RobotClass
from hil.book.chapters.measuring import below, left_of_distance, mean_column
from hil.book.claim import MORE_THAN_0, Claim, ClaimVerdict, Limit
from hil.book.measurement import Measurement, about, difference_of, share_of
from pal_advisor.surround.rules import BOOK_RULES

if TYPE_CHECKING:
    from hil.book.results import StoredResults

_EQUATIONS: Final = {
    "RA1": "Eq. 7.6", "RB1": "Eq. 7.7", "RB2": "Eq. 7.10", "RB3": "Eq. 7.11", "RB4": "Eq. 7.12", "RB5": "Eq. 7.13",
    "RD1": "Eq. 7.14", "RD2": "Eq. 7.15", "RD3": "Eq. 7.16",
}  # fmt: skip
_PRINTED: Final = {"RD3": "STIMULUS25 (01110101, number 23 here)"}
"""Stimuli that have another number in the book."""
_NO_OPTIMA: Final = "With smoothing no behaviour is ever given up, so that selection by probability does what the rule is for."
_MOST_TOLD: Final = 4
"""Behaviours that are told of a rule."""


def _rule(kind: RobotClass, stimulus: int, name: str, steps: int) -> Claim:
    book = BOOK_RULES[kind, stimulus]
    group = f"{kind.name}s"

    def measure(results: StoredResults) -> Measurement:
        learnt = results.runs(name).rule(kind.name.lower(), stimulus)
        runs, weights = int(learnt.pop("learnt")), learnt.pop("weights")
        most = ", ".join(f"{behaviour} {count}" for behaviour, count in list(learnt.items())[:_MOST_TOLD])
        rest = runs - sum(list(learnt.values())[:_MOST_TOLD])  # those that are not kept, too
        first, second = sorted(range(len(weights)), key=lambda index: -float(weights[index]))[:2]
        means = f"mean weights B{first + 1} {weights[first]:.2f}, B{second + 1} {weights[second]:.2f}"
        theirs = {f"B{each}" for each in book.behaviours}
        alike = sum(count for behaviour, count in learnt.items() if behaviour in theirs) / runs
        other = max((count for behaviour, count in learnt.items() if behaviour not in theirs), default=0) / runs
        found = about(alike - other, sqrt((alike + other - (alike - other) ** 2) / runs), runs)  # of a multinomial
        return found.told(f"{most}{f', others {rest}' if rest else ''}; {means}")

    return Claim(
        name=f"rule-{book.name.lower()}-{name}",
        place=_EQUATIONS[book.name],
        says=f"{group} that meet {_PRINTED.get(book.name, f'STIMULUS{stimulus}')} learn {book.behaviour} (rule {book.name}).",
        measured=f"in how many runs which behaviour has the largest weight after {steps} steps, {name.upper()}",
        needs=(name,),
        measure=measure,
        limit=Limit(low=MORE_THAN_0, otherwise=ClaimVerdict.DIFFERS),
        asked=f"{book.behaviour.replace(' x ', ' or ')} more often than any other",
        why=_WHY.get(book.name, ""),
    )


_WHY: Final = {
    "RA1": (
        "Behaviours are counted in the frame of the canonical pattern, in which whom only the grown radius shows is nearly "
        "always to the side of sector 8: B8 leads to it, and B1 and B7 lead past it on either side."
    ),
    "RB1": (
        "B8 leads to the one that is seen, and B1 and B7 lead past it on either side. All three come nearer, and which of them "
        "gets ahead in a run is chance."
    ),
    "RB4": (
        "Its occupied sectors are 6, 7 and 8. The book's B1 and B5 lead past them on either side, what is learnt here straight "
        "to them."
    ),
}


def _converges(name: str, limit: Limit, asked: str, place: str, says: str) -> Claim:
    return Claim(
        name=f"converges-{name}",
        place=place,
        says=says,
        measured=f"left of D after 50 steps, {name.upper()}",
        needs=(name,),
        measure=partial(left_of_distance, name=name),
        limit=limit,
        asked=asked,
    )


def _control(name: str) -> Claim:
    return Claim(
        name=f"control-{name}",
        place="7.2.1",
        says="It is learning that brings them together.",
        measured=f"left of D after 50 steps without learning, {name.upper()}",
        needs=(f"{name}-control",),
        measure=partial(left_of_distance, name=f"{name}-control"),
        limit=Limit(low=0.9),
        asked="more than 0.9",
    )


def _mutation(results: StoredResults, name: str, column: str, sign: int) -> Measurement:
    """By how much a column is greater with rule RC1 (or less, with sign -1), and both means."""
    with_it, without = (mean_column(results, each, column) for each in (f"{name}-mutate", f"{name}l1"))
    found = difference_of(with_it, without) if sign > 0 else difference_of(without, with_it)
    told = f"{found}: {with_it.value:.2f} with, {without.value:.2f} without"
    return found.told(told)


def _pushed(results: StoredResults, name: str) -> Measurement:
    found = results.runs(name).column("pushed")
    share = share_of(found > 0)
    return share.told(f"{share}; {found.mean():.2g} times on average")


def _settles(results: StoredResults) -> Measurement:
    return mean_column(results, "b2d3l1", "settle_step")


CLAIMS: Final = (
    _converges(
        "b2d3",
        Limit(high=0.3),
        "at most 0.30",
        "7.2.1, Fig. 7.3",
        "RANGERs learn to go to the crowd of WILDs and to surround it.",
    ),
    Claim(
        name="surrounds-b2d3",
        place="7.2.1, Fig. 7.3",
        says="In the end the WILDs are surrounded.",
        measured="share of WILDs with three RANGERs or more within R0 at step 50, B2D3",
        needs=("b2d3",),
        measure=partial(mean_column, name="b2d3", column="share_50"),
        limit=Limit(low=0.9),
        asked="at least 0.9",
    ),
    _control("b2d3"),
    Claim(
        name="converges-b1d3",
        place="7.2.3, 8.5",
        says="They do so where WILDs learn to get away at the same time.",
        measured="runs that leave less than 0.6 of D after 50 steps, B1D3",
        needs=("b1d3",),
        measure=partial(below, name="b1d3", limit=0.6),
        limit=Limit(low=1.0, alone=True),
        asked="every run",
    ),
    Claim(
        name="surrounds-b1d3",
        place="7.2.3",
        says="WILDs that learn are surrounded, too.",
        measured="share of WILDs with three RANGERs or more within R0 at step 50, B1D3",
        needs=("b1d3",),
        measure=partial(mean_column, name="b1d3", column="share_50"),
    ),
    _control("b1d3"),
    *(
        _converges(
            name,
            Limit(high=0.7),
            "less than 0.7",
            "8.2, Fig. 8.6",
            f"They find WILDs that begin scattered, and {'learn to get away' if name == 'b1d1' else 'stand still'}.",
        )
        for name in ("b1d1", "b2d1")
    ),
    Claim(
        name="settles-at-20",
        place="Fig. 7.3 (d), 7.4",
        says="A stable distribution is reached after about 20 steps.",
        measured="step from which on D stays within 10 % of its whole change of its last value, 100 steps of B2D3",
        needs=("b2d3l1",),
        measure=_settles,
        limit=Limit(15.0, 25.0, otherwise=ClaimVerdict.DIFFERS),
        asked="15 to 25",
        why=(
            "The book does not say how long a step is. Here one is 0.4 units, so that who begins in a corner needs 15 of them "
            "for the straight way to the crowd."
        ),
    ),
    *(_rule(RobotClass.RANGER, stimulus, name, 50) for stimulus in (1, 2, 3, 4, 7, 8) for name in ("b1d3", "b2d3")),
    *(_rule(RobotClass.WILD, stimulus, "b1d4", 100) for stimulus in (8, 2, 23)),
    *(
        Claim(
            name=f"mutation-{name}",
            place="7.2.2, Eq. 7.8",
            says="Rule RC1, a random behaviour now and then, frees the swarm from local optima.",
            measured=f"by how much D is less after 100 steps, {name.upper()}, K = 10",
            needs=(f"{name}-mutate", f"{name}l1"),
            measure=partial(_mutation, name=name, column="distance_last", sign=-1),
            limit=Limit(low=MORE_THAN_0),
            asked="more than 0",
            why=_NO_OPTIMA,
        )
        for name in ("b2d3", "b1d3")
    ),
    Claim(
        name="sharing-b1d3",
        place="7.2.2.4, Eq. 7.9",
        says="RA1, RB1 and RC1 together have RANGERs spread over the WILDs.",
        measured="by how much the share of WILDs surrounded after 100 steps is greater with RC1, B1D3, K = 10",
        needs=("b1d3-mutate", "b1d3l1"),
        measure=partial(_mutation, name="b1d3", column="share_last", sign=1),
        limit=Limit(low=MORE_THAN_0),
        asked="more than 0",
        why=_NO_OPTIMA,
    ),
    *(
        Claim(
            name=f"pushing-{name}",
            place="7.2.2.3, Fig. 7.11, 7.12",
            says="RANGERs push a WILD together.",
            measured=f"runs of 100 steps in which two do so, {name.upper()}",
            needs=(f"{name}l1",),
            measure=partial(_pushed, name=f"{name}l1"),
            limit=Limit(low=0.5),
            asked="most runs",
            why=(
                "A move ends where it meets somebody: who comes upon a WILD shifts it by some millimetres and stops, so that a "
                "push is over before a second RANGER joins in."
            ),
        )
        for name in ("b1d3", "b2d3")
    ),
    Claim(
        name="bears-loss",
        place="not in the book",
        says="(It should bear a real line and real sensors.)",
        measured="left of D after 50 steps, B2D3, default noise and 5 % of all frames lost",
        needs=("b2d3-loss",),
        measure=partial(left_of_distance, name="b2d3-loss"),
        limit=Limit(high=0.3),
        asked="at most 0.30",
    ),
    *(
        Claim(
            name=f"bears-wall-{name}",
            place="Table 7.1",
            says="A wall around the area changes little.",
            measured=f"left of D after 50 steps, {name.upper()}, where a robot stops at the wall",
            needs=(name,),
            measure=partial(left_of_distance, name=name),
        )
        for name in ("b2d4", "b1d4", "b1d2")
    ),
)
"""In the order of the book."""
