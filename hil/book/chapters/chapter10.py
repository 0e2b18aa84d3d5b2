"""Chapter 10: Pal coaches Junior by multi-phase genetic programming; what is learnt against five opponents."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from hil.book.claim import MORE_THAN_0, Claim, ClaimVerdict, Limit
from hil.book.measurement import Measurement, mean_of_few, share_of
from hil.book.results import ResultMissingError
from hil.book.sumo.methods import CORNER, CURVED, FLAT, HEAVY, OPPONENTS, PHASES_COMPARED, POINT, SQUARE
from pal_advisor.maneuvers.names import ALTERNATING_TWIST, CORNER_TO_EDGE, INTERMITTENT_IMPACT, STALL_TURNING, STRAIGHT_PUSH

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hil.book.results import StoredResults

_STEPS: Final = 13
"""GP steps within which single-side sensing is corrected in the book."""
_LETTERS: Final = dict(zip((*OPPONENTS, SQUARE), ("a", "b", "c", "d", "e", "d, small"), strict=True))
_CALLED: Final = {
    FLAT: "the light flat opponent", HEAVY: "the heavy flat opponent", CURVED: "the curved opponent",
    CORNER: "the corner", POINT: "the point", SQUARE: "a square of 3.5 cm, corner forward",
}  # fmt: skip


def book(opponent: str, method: str = "book") -> str:
    """Name of the stored result.

    Args:
        opponent: Against whom.
        method: How.
    """
    return f"{method}-{opponent}"


def _column(results: StoredResults, name: str, column: str) -> NDArray[np.float64]:
    """A value for each seed, in order; NaN where there is none."""
    columns = results.runs(name).columns
    if columns["seed"] != list(range(1, len(columns["seed"]) + 1)):
        raise ResultMissingError(f"{name} has not been coached with seeds from 1 on")
    return np.array(columns[column], dtype=np.float64)


def _paired(each: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Values of the seeds that all have, shape (n, seeds)."""
    seeds = min(len(values) for values in each)
    return np.array([values[:seeds] for values in each])


def _mean(values: NDArray[np.float64]) -> Measurement:
    known = values[~np.isnan(values)]
    if len(known) < 2:
        raise ResultMissingError("too few runs tell of it")
    return mean_of_few(known)


def _sides(results: StoredResults, name: str, column: str) -> NDArray[np.float64]:
    """Mean of left and right, for each seed."""
    found: NDArray[np.float64] = (_column(results, name, f"{column}_left") + _column(results, name, f"{column}_right")) / 2.0
    return found


def _ratio(results: StoredResults, name: str, *, upside_down: bool = False) -> Measurement:
    """Length of the single-side curves by that of the both-side one, of each seed; or the inverse."""
    single, both = _sides(results, name, "length"), _column(results, name, "length_both")
    found = _mean(both / single if upside_down else single / both)
    left, right = (_column(results, name, f"length_{side}").mean() for side in ("left", "right"))
    return found.told(f"{found}: {left:.1f} left, {right:.1f} right, {both.mean():.1f} both")


def _length(results: StoredResults, name: str) -> Measurement:
    return _mean(_sides(results, name, "length"))


def _settled(results: StoredResults, name: str) -> Measurement:
    """The later of the sides."""
    return _mean(np.fmax(_column(results, name, "settled_left"), _column(results, name, "settled_right")))


def _less(results: StoredResults, those: str, others: Sequence[str], column: str) -> Measurement:
    """By how much a column is greater against one than against others, pairs of seeds."""
    one, *rest = _paired([_column(results, name, column) for name in (those, *others)])
    other = np.mean(rest, axis=0)
    found = _mean(one - other)
    return found.told(f"{found}: {np.nanmean(one):.2f} and {np.nanmean(other):.2f} of 24")


def _named(results: StoredResults, name: str, called: str) -> Measurement:
    """In how many runs the play has a maneuver of this name, and what is lacking most often elsewhere."""
    _column(results, name, "seed")
    lacking = results.runs(name).data["lacking"][called]
    found = share_of(np.array([not parts for parts in lacking]))
    missed = [part for parts in lacking for part in parts]
    if not missed:
        return found
    most = max(dict.fromkeys(missed), key=missed.count)
    return found.told(f"{found}; lacking most often: {most} ({missed.count(most)})")


def _share_of_both(results: StoredResults, name: str) -> Measurement:
    """Share of the performances while learning at whose start both eyes see the opponent."""
    lengths = [_column(results, name, f"length_{mode}") for mode in ("none", "left", "right", "both")]
    return _mean(lengths[-1] / np.sum(lengths, axis=0))


def _steady(results: StoredResults, name: str) -> Measurement:
    """By which share the mean rating of the last fifth differs from that of the fifth before, single-side."""
    last, before = _sides(results, name, "last"), _sides(results, name, "before")
    return _mean(last / before - 1.0)


def _wins(results: StoredResults, name: str) -> NDArray[np.float64]:
    return _column(results, name, "wins") / _column(results, name, "bouts")


def _both_phases(results: StoredResults, methods: tuple[str, str], opponents: Sequence[str], column: str) -> Measurement:
    """What two phases are worth against one, mean over opponents, pairs of seeds."""
    each = [
        _wins(results, book(opponent, method)) if column == "wins" else _column(results, book(opponent, method), column)
        for method in methods
        for opponent in opponents
    ]
    multi, single = _paired(each).reshape(len(methods), len(opponents), -1).mean(axis=1)
    found = _mean(multi - single)
    return found.told(f"{found}: {multi.mean():.3f} and {single.mean():.3f}")


_BOUTS: Final = (
    "Here a bout ends when somebody is out, and the next begins with Junior turned up to 90 degrees away: single-side "
    "sensing comes up anew in every bout, however well it is corrected."
)
_WIDE: Final = (
    "The book's corner is too small for both eyes. The wedge here is 14 cm wide: once it has been turned, a side of it faces "
    "both. The square of 3.5 cm that stands corner forward is as small as the book's."
)
_STANDING: Final = (
    "Eq. 10.1 does not ask whether the opponent moves: an action that holds it with both arms, in sight of both eyes, is worth "
    "4 of 6 where it stands as it is. To push and stop is enough for that; how many bouts it wins stands below."
)
_DIFFERENT: Final = ClaimVerdict.DIFFERS


def _shapes(opponent: str, place: str) -> tuple[Claim, ...]:
    """What is claimed of both flat opponents."""
    name, letter = book(opponent), _LETTERS[opponent]
    return (
        Claim(
            name=f"short-{opponent}",
            place=place,
            says=f"({letter}) Against {_CALLED[opponent]} the single-side curves are much shorter than the both-side one.",
            measured="length of the single-side curves (the mean of left and right) by that of the both-side curve",
            needs=(name,),
            measure=partial(_ratio, name=name),
            limit=Limit(high=0.5, otherwise=_DIFFERENT),
            asked="at most a half",
            why=_BOUTS,
        ),
        Claim(
            name=f"thirteen-{opponent}",
            place=place,
            says=f"({letter}) Single-side sensing is corrected within 13 GP steps.",
            measured="length of the single-side curves, GP steps of 20 performances",
            needs=(name,),
            measure=partial(_length, name=name),
            limit=Limit(high=_STEPS, otherwise=_DIFFERENT),
            asked="at most 13",
            why=_BOUTS,
        ),
        Claim(
            name=f"settled-{opponent}",
            place=place,
            says=f"({letter}) Single-side sensing is corrected within 13 GP steps.",
            measured="GP step from which on the mean rating of single-side maneuvers stays within 10 % of its last value",
            needs=(name,),
            measure=partial(_settled, name=name),
            limit=Limit(high=_STEPS, otherwise=_DIFFERENT),
            asked="at most 13",
        ),
    )


def _called(opponent: str, called: str, place: str, why: str = "") -> tuple[Claim, Claim]:
    """The name that the book has for what is learnt against an opponent; asked of Eq. 10.1, and reported of Pal's defaults."""
    says = f"({_LETTERS[opponent]}) What is learnt against {_CALLED[opponent]} is {called}."
    measured = (
        "runs in whose held-out bouts a maneuver that is a tenth or more of what is performed with the opponent in sight "
        "earns the name"
    )
    measures = {method: partial(_named, name=book(opponent, method), called=called) for method in ("book", "product")}
    return (
        Claim(
            name=f"name-{opponent}",
            place=place,
            says=says,
            measured=measured,
            needs=(book(opponent),),
            measure=measures["book"],
            limit=Limit(low=0.5, otherwise=_DIFFERENT),
            asked="most runs",
            why=why,
        ),
        Claim(
            name=f"name-{opponent}-by-default",
            place=place,
            says=says,
            measured=f"the same of what Pal learns by default: {measured}",
            needs=(book(opponent, "product"),),
            measure=measures["product"],
        ),
    )


_SINGLE: Final = "single-side maneuvers in held-out bouts, mean of Eq. 10.1"

CLAIMS: Final = (
    *_shapes(FLAT, "10.6.4, Fig. 10.7 (a)"),
    *_called(FLAT, STRAIGHT_PUSH, "Fig. 10.6 (a)"),
    *_shapes(HEAVY, "10.6.4, Fig. 10.7 (b)"),
    Claim(
        name="heavy-rates-lower",
        place="10.6.4, Fig. 10.7 (b)",
        says="(b) Against the heavy flat opponent single-side maneuvers are less effective than against the light one.",
        measured=f"{_SINGLE}: heavy less light",
        needs=(book(HEAVY), book(FLAT)),
        measure=partial(_less, those=book(HEAVY), others=(book(FLAT),), column="rating_single"),
        limit=Limit(high=-MORE_THAN_0, otherwise=_DIFFERENT),
        asked="less than 0",
    ),
    Claim(
        name="heavy-rates-high",
        place="10.6.4",
        says="(b) What is learnt with both eyes scores high fitness against the heavy opponent.",
        measured="both-side maneuvers in held-out bouts, mean of Eq. 10.1, which is 24 at most: heavy less light",
        needs=(book(HEAVY), book(FLAT)),
        measure=partial(_less, those=book(HEAVY), others=(book(FLAT),), column="rating_both"),
        limit=Limit(low=-1.0, otherwise=_DIFFERENT),
        asked="no more than 1 lower",
    ),
    *_called(HEAVY, INTERMITTENT_IMPACT, "10.6.4, Fig. 10.6 (b)", _STANDING),
    Claim(
        name="heavy-rates-what-wins",
        place="not in the book",
        says="(b) (Eq. 10.1 does not ask whether the opponent moves.)",
        measured="both-side maneuvers, mean of Eq. 10.1: what Pal learns by default, and wins by, less what Eq. 10.1 elects",
        needs=(book(HEAVY, "product"), book(HEAVY)),
        measure=partial(_less, those=book(HEAVY, "product"), others=(book(HEAVY),), column="rating_both"),
    ),
    Claim(
        name="curved-grows-together",
        place="10.6.5, Fig. 10.7 (c)",
        says="(c) Against the curved opponent all three curves grow together.",
        measured="length of the single-side curves by that of the both-side curve",
        needs=(book(CURVED),),
        measure=partial(_ratio, name=book(CURVED)),
        limit=Limit(0.5, 2.0, otherwise=_DIFFERENT),
        asked="a half to twice",
    ),
    Claim(
        name="curved-repeatedly",
        place="10.6.5",
        says="(c) Single-side sensing becomes both-side sensing again and again.",
        measured="how often in a held-out bout",
        needs=(book(CURVED),),
        measure=lambda results: _mean(_column(results, book(CURVED), "transitions")),
        limit=Limit(low=2.0, otherwise=_DIFFERENT),
        asked="at least twice",
    ),
    Claim(
        name="curved-like-flat",
        place="10.6.5, Fig. 10.7 (c)",
        says="(c) The both-side curve is as that against the light flat opponent.",
        measured="both-side maneuvers in held-out bouts, mean of Eq. 10.1: curved less flat",
        needs=(book(CURVED), book(FLAT)),
        measure=partial(_less, those=book(CURVED), others=(book(FLAT),), column="rating_both"),
        limit=Limit(-2.0, 2.0, otherwise=_DIFFERENT),
        asked="within 2 of 24",
    ),
    *_called(CURVED, STALL_TURNING, "10.6.5, Fig. 10.6 (c)"),
    *(
        Claim(
            name=f"impossible-{opponent}",
            place="10.6.6",
            says="(d) Both-side sensing of a corner is impossible.",
            measured=f"share of what is performed while learning that begins with both eyes seeing it, {_CALLED[opponent]}",
            needs=(book(opponent),),
            measure=partial(_share_of_both, name=book(opponent)),
            limit=Limit(high=0.01, otherwise=_DIFFERENT),
            asked="at most 0.01",
            why=_WIDE if opponent == CORNER else "",
        )
        for opponent in (CORNER, SQUARE)
    ),
    *(
        Claim(
            name=f"both-short-{opponent}",
            place="10.6.6, Fig. 10.7 (d)",
            says="(d) So the both-side curve is short.",
            measured=f"its length by that of the single-side curves, {_CALLED[opponent]}",
            needs=(book(opponent),),
            measure=partial(_ratio, name=book(opponent), upside_down=True),
            limit=Limit(high=0.5, otherwise=_DIFFERENT),
            asked="at most a half",
        )
        for opponent in (CORNER, SQUARE)
    ),
    *(
        Claim(
            name=f"less-{opponent}",
            place="10.6.6, Fig. 10.7 (d)",
            says="(d) Single-side maneuvers are less effective than against the three opponents before.",
            measured=f"{_SINGLE}: {_CALLED[opponent]} less the mean of (a), (b) and (c)",
            needs=(book(opponent), book(FLAT), book(HEAVY), book(CURVED)),
            measure=partial(
                _less, those=book(opponent), others=(book(FLAT), book(HEAVY), book(CURVED)), column="rating_single"
            ),
            limit=Limit(high=-MORE_THAN_0, otherwise=_DIFFERENT),
            asked="less than 0",
        )
        for opponent in (CORNER, SQUARE)
    ),
    *(
        Claim(
            name=f"stable-{opponent}",
            place="10.6.6, Fig. 10.7 (d)",
            says="(d) But fitness is stable in the end.",
            measured=(
                "share by which single-side maneuvers rate higher in the last fifth of learning than in the one before, "
                f"{_CALLED[opponent]}"
            ),
            needs=(book(opponent),),
            measure=partial(_steady, name=book(opponent)),
            limit=Limit(-0.15, 0.15, otherwise=_DIFFERENT),
            asked="within 0.15",
        )
        for opponent in (CORNER, SQUARE)
    ),
    *_called(CORNER, CORNER_TO_EDGE, "10.6.6, Fig. 10.6 (d)"),
    Claim(
        name="point-has-no-curve",
        place="10.6.7, Fig. 10.7 (e)",
        says="(e) Against the point there is no both-side curve at all.",
        measured="runs without any performance at whose start both eyes see it",
        needs=(book(POINT),),
        measure=lambda results: share_of(_column(results, book(POINT), "length_both") == 0.0),
        limit=Limit(low=1.0, alone=True),
        asked="every run",
    ),
    *(
        Claim(
            name=f"point-more-than-{opponent}",
            place="10.6.7, Fig. 10.7 (e)",
            says="(e) Single-side maneuvers are slightly more effective than against the corner.",
            measured=f"{_SINGLE}: the point less {_CALLED[opponent]}",
            needs=(book(POINT), book(opponent)),
            measure=partial(_less, those=book(POINT), others=(book(opponent),), column="rating_single"),
            limit=Limit(low=MORE_THAN_0, otherwise=_DIFFERENT),
            asked="more than 0",
        )
        for opponent in (CORNER, SQUARE)
    ),
    *_called(POINT, ALTERNATING_TWIST, "10.6.7, Fig. 10.6 (e)"),
    *(
        Claim(
            name=f"phases-{what}-{methods[0]}",
            place="10.7",
            says="(f) Learning in several phases is more efficient than learning in one.",
            measured=f"{measured}, both phases less one, {told}; mean of the five opponents, pairs of seeds",
            needs=tuple(book(opponent, method) for method in methods for opponent in OPPONENTS),
            measure=partial(_both_phases, methods=methods, opponents=OPPONENTS, column=column),
            limit=Limit(low=MORE_THAN_0, otherwise=_DIFFERENT),
            asked="more than 0",
        )
        for methods, told in zip(
            PHASES_COMPARED,
            ("Eq. 10.1 as printed", "objective `outcome` with pairs", "the defaults"),
            strict=True,
        )
        for what, column, measured in (
            ("win", "wins", "held-out bouts won"),
            ("learn", "late", "mean of Eq. 10.1 in the last quarter of learning"),
        )
    ),
    *(
        Claim(
            name=f"phases-win-{opponent}",
            place="10.7",
            says=f"(f) Learning in several phases is more efficient than learning in one, here against {_CALLED[opponent]}.",
            measured="held-out bouts won, both phases less one, Eq. 10.1 as printed; pairs of seeds",
            needs=tuple(book(opponent, method) for method in PHASES_COMPARED[0]),
            measure=partial(_both_phases, methods=PHASES_COMPARED[0], opponents=(opponent,), column="wins"),
            limit=Limit(low=MORE_THAN_0, otherwise=_DIFFERENT),
            asked="more than 0",
        )
        for opponent in OPPONENTS
    ),
)
"""In the order of the book."""
