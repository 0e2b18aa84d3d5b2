"""Chapter 9, evolution: which conditions are best for which fitness, and whether the genetic algorithm finds them."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from hil.book.claim import MORE_THAN_0, Claim, ClaimVerdict, Limit
from hil.book.experiments import FITNESSES
from hil.book.measurement import Measurement, difference_of, mean_of, ratio_of, share_of
from pal_advisor.surround import Case
from pal_advisor.surround.measures import Fitness
from pal_advisor.surround.search import BOOK_WINNERS

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from hil.book.results import StoredResults

_TABLE: Final = "exhaustive"
_TOP: Final = 24
"""The best quarter of 96 conditions."""
_WHY_L1: Final = {
    "contact": "Fitness counts the first 20 steps, in which RANGERs have not come near by L1 (8.4).",
    "focus": "FOCUS grows with the spread of the weights, which smoothing evens out.",
}
_FIGURES: Final = {"contact": "Fig. 9.5", "surround": "Fig. 9.6", "chase": "Fig. 9.7", "focus": "Fig. 9.8"}


def _groups(
    those: Callable[[Case], bool], others: Callable[[Case], bool], fitness: str
) -> Callable[[StoredResults], Measurement]:
    """By how much the mean over some conditions is greater than that over others, and both."""

    def measure(results: StoredResults) -> Measurement:
        table = results.table(_TABLE)
        one, other = (table.group(fitness, belongs) for belongs in (those, others))
        found = difference_of(one, other)
        return found.told(f"{found}: {one.value:.4g} and {other.value:.4g}")

    return measure


def _short_by_long(results: StoredResults) -> Measurement:
    table = results.table(_TABLE)
    short, long = (table.group("contact", lambda case, far=far: case.long_range == far) for far in (False, True))  # type: ignore[misc]
    found = ratio_of(short, long)
    return found.told(f"{found}: {short.value:.4g} and {long.value:.4g}")


def _prefers(fitness: str, *, centralised: bool) -> Claim:
    where = "centralised" if centralised else "decentralised"
    return Claim(
        name=f"{fitness}-{where}",
        place="9.3",
        says=f"{fitness.upper()} is best where WILDs begin {'in a crowd' if centralised else 'scattered'}.",
        measured=f"by how much it is greater there, means over 48 conditions each, D{'3, D4' if centralised else '1, D2'}",
        needs=(_TABLE,),
        measure=_groups(lambda case: case.centralised == centralised, lambda case: case.centralised != centralised, fitness),
        limit=Limit(low=MORE_THAN_0, otherwise=ClaimVerdict.DIFFERS),
        asked="more than 0",
    )


def _learning(fitness: str, how: int, says: str) -> Claim:
    return Claim(
        name=f"{fitness}-l{how}",
        place="9.3",
        says=says,
        measured=f"by how much {fitness.upper()} is greater for L{how} than for the best of the other three",
        needs=(_TABLE,),
        measure=_of_four(fitness, how),
        limit=Limit(low=MORE_THAN_0, otherwise=ClaimVerdict.DIFFERS),
        asked="more than 0",
        why=_WHY_L1.get(fitness, ""),
    )


def _of_four(fitness: str, how: int) -> Callable[[StoredResults], Measurement]:
    def measure(results: StoredResults) -> Measurement:
        table = results.table(_TABLE)
        means = {each: table.group(fitness, lambda case, each=each: case.learning == each) for each in (1, 2, 3, 4)}  # type: ignore[misc]
        found = difference_of(means[how], max((means[each] for each in means if each != how), key=lambda mean: mean.value))
        told = ", ".join(f"L{each} {mean.value:.4g}" for each, mean in means.items())
        return found.told(f"{found}: {told}")

    return measure


def _moving(fitness: str) -> Claim:
    return Claim(
        name=f"{fitness}-moving",
        place="9.3",
        says=f"{fitness.upper()} is best with WILDs that move.",
        measured="by how much it is greater for B1 and B3 than for B2",
        needs=(_TABLE,),
        measure=_groups(lambda case: case.wild_motion != 2, lambda case: case.wild_motion == 2, fitness),
        limit=Limit(low=MORE_THAN_0, otherwise=ClaimVerdict.DIFFERS),
        asked="more than 0",
    )


def _stationary(other: int) -> Claim:
    return Claim(
        name=f"contact-stationary-{'learning' if other == 1 else 'random'}",
        place="9.3",
        says=f"CONTACT is best with WILDs that stand still (here: than that {'learn' if other == 1 else 'move at random'}).",
        measured=f"by how much it is greater for B2 than for B{other}",
        needs=(_TABLE,),
        measure=_groups(lambda case: case.wild_motion == 2, lambda case: case.wild_motion == other, "contact"),
        limit=Limit(low=MORE_THAN_0) if other == 1 else None,
        asked="more than 0" if other == 1 else "",
    )


def _stationary_seen() -> Claim:
    return Claim(
        name="contact-stationary-seen",
        place="9.3",
        says="CONTACT is best with WILDs that stand still (here: than that learn, where RANGERs have sensors of short range).",
        measured="by how much it is greater for B2S1 than for B1S1",
        needs=(_TABLE,),
        measure=_groups(
            lambda case: case.wild_motion == 2 and not case.long_range,
            lambda case: case.wild_motion == 1 and not case.long_range,
            "contact",
        ),
        limit=Limit(low=MORE_THAN_0),
        asked="more than 0",
    )


def _winner(fitness: str) -> Claim:
    case = Case.parse(str(BOOK_WINNERS[Fitness(fitness)]))
    return Claim(
        name=f"{fitness}-winner",
        place=f"9.3, {_FIGURES[fitness]}",
        says=f"{fitness.upper()} is greatest in {case}.",
        measured="its rank in the table of all conditions; in brackets the ranks that chance allows",
        needs=(_TABLE,),
        measure=lambda results: results.table(_TABLE).measured_rank(fitness, case),
        limit=Limit(high=1.0, otherwise=ClaimVerdict.DIFFERS),
        asked="1",
        why="One run of a condition is noisy, and an evolution ends with the luckiest of 280 runs.",
    )


def _ranks(results: StoredResults, search: str, fitness: str) -> NDArray[np.float64]:
    """True ranks of what searches have ended with."""
    table = results.table(_TABLE)
    found = results.runs(f"{search}-{fitness}").columns["best"]
    return np.array([table.rank(fitness, Case.parse(case)) for case in found], dtype=np.float64)


def _in_top(results: StoredResults, search: str, fitness: str) -> Measurement:
    ranks = _ranks(results, search, fitness)
    found = share_of(ranks <= _TOP)
    return found.told(f"{found}; ranks {ranks.min():.0f} to {ranks.max():.0f}")


def _better_than_chance(results: StoredResults, fitness: str) -> Measurement:
    chance, evolved = (mean_of(_ranks(results, search, fitness)) for search in ("random", "ga"))
    found = difference_of(chance, evolved)
    told = f"{found}: {evolved.value:.1f} by evolution, {chance.value:.1f} by chance"
    return found.told(told)


CLAIMS: Final = (
    Claim(
        name="short-range-contact",
        place="8.1, 9.3",
        says="Sensors of short range are better (all four winners have them).",
        measured="CONTACT of short range by that of long range, means over 48 conditions each",
        needs=(_TABLE,),
        measure=_short_by_long,
        limit=Limit(low=1.8),
        asked="at least 1.8",
    ),
    _prefers("surround", centralised=True),
    _prefers("focus", centralised=False),
    _prefers("contact", centralised=False),
    _prefers("chase", centralised=True),
    _stationary(1),
    _stationary(3),
    _stationary_seen(),
    *(_moving(fitness) for fitness in ("surround", "chase", "focus")),
    _learning("contact", 1, "CONTACT is best with smoothed weights and selection by probability."),
    _learning("surround", 3, "SURROUND is best with original weights and selection by probability."),
    _learning("chase", 4, "CHASE is best with the largest weight."),
    _learning("focus", 1, "FOCUS is best with smoothed weights and selection by probability."),
    *(_winner(fitness) for fitness in FITNESSES),
    *(
        Claim(
            name=f"ga-finds-{fitness}",
            place=f"9.2, {figure}",
            says="The genetic algorithm soon comes to a condition that is nearly the best.",
            measured=f"evolutions that end with one of the best {_TOP} of 96 conditions by {fitness.upper()}",
            needs=(f"ga-{fitness}", _TABLE),
            measure=partial(_in_top, search="ga", fitness=fitness),
            limit=Limit(low=0.95, alone=True),
            asked="at least 0.95",
        )
        for fitness, figure in zip(FITNESSES, ("Fig. 9.9", "Fig. 9.10", "Fig. 9.11", "Fig. 9.12"), strict=True)
    ),
    *(
        Claim(
            name=f"ga-better-{fitness}",
            place="9.2",
            says="A genetic algorithm is the means to find it.",
            measured=f"by how many ranks it ends better than as many runs of random conditions, {fitness.upper()}",
            needs=(f"ga-{fitness}", f"random-{fitness}", _TABLE),
            measure=partial(_better_than_chance, fitness=fitness),
            limit=Limit(low=MORE_THAN_0, otherwise=ClaimVerdict.DIFFERS),
            asked="more than 0",
            why=(
                "280 runs at random are three for nearly each of the 96 conditions. Surer than both is the table of all "
                "(`--search exhaustive`)."
            ),
        )
        for fitness in FITNESSES
    ),
)
"""In the order of the book."""
