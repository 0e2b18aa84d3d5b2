"""An explanation in words, for the terminal and for pages."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Final

from firmware_protocol.vocabulary import codes
from hil.sumo.summary import situation_in_words
from pal_advisor.maneuvers import Origin

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.vocabulary import Action
    from hil.explaining.explanation import Candidacy, Explanation
    from hil.explaining.history import Performed

PLAIN: Final = 2.0
"""Standard errors from which on a difference is called plain."""
_BRED: Final = {
    Origin.CROSSOVER: "as a crossing of {}",
    Origin.MUTATION: "by a mutation of {}",
    Origin.CROSSED_MUTANT: "by crossover and mutation from {}",
}


def reasons(one: Explanation) -> list[str]:
    """Why a maneuver is there, a paragraph an item; the runners-up are not listed.

    Args:
        one: The explanation.
    """
    if not one.known:
        return [text for text in (_team(one), *_from_the_file(one)) if text]
    if one.chosen is None:
        return ["This maneuver was never tried in this situation in this run: the advice was edited, or it is another run's."]
    chosen = one.chosen
    found = (
        _team(one),
        _tried(one, chosen),
        _bred(one, chosen),
        _foretold(chosen),
        _beaten(one, chosen),
        _mirror(one),
        _named(one, chosen),
    )
    return [text for text in found if text]


def _from_the_file(one: Explanation) -> list[str]:
    entry = one.entry
    if entry.parents:
        bred = f"It arose in phase {entry.phase}, from {_listed(entry.parents)}."
    else:
        bred = f"It arose in phase {entry.phase}; no parents are given."
    return [f"Worth {entry.fitness:.1f}; performed {_times(entry.evaluations)}.", bred]


def _team(one: Explanation) -> str:
    """Which run it comes from, and what the team exam found out."""
    if not one.run:
        return "None of the runs that are known has learnt this: the advice was edited, or its run is gone." if one.runs else ""
    here = [verdict for verdict in one.verdicts if verdict.current]
    whole = next((verdict for verdict in one.verdicts if verdict.kept and not verdict.current), None)
    kept = next((verdict for verdict in reversed(here) if verdict.kept), None)
    text = f"It comes from run {one.run}"
    if kept is not None and kept.run == one.run:
        text += f": with it the advice won {kept.wins} of {kept.trials} bouts of the team exam, and did better than without."
    elif whole is not None and whole.run == one.run:
        text += f", whose advice did best in the team exam: it won {whole.wins} of {whole.trials} bouts."
    else:
        text += "."
    others = [f"run {verdict.run}, {verdict.wins} of {verdict.trials}" for verdict in here if not verdict.kept]
    return f"{text} Tried in its place, and not kept: what was learnt here by {'; '.join(others)}." if others else text


def _tried(one: Explanation, chosen: Candidacy) -> str:
    share = f"{one.performances:,} performances of {one.tried:,} maneuvers in this situation" + (
        " and its mirror image" if one.shared else ""
    )
    told = chosen.history
    if told is None or not told.count:
        return f"Performed {_times(chosen.performed)}, of {share}."
    motives = ", ".join(f"{motive} {count:,}" for motive, count in told.motives.most_common())
    which = "" if told.count == chosen.performed else f" (the log has {told.count:,} of them)"
    return f"Performed {_times(chosen.performed)}, of {share}. What for{which}: {motives}."


def _bred(one: Explanation, chosen: Candidacy) -> str:
    when = f"phase {chosen.phase}" if chosen.born is None else f"generation {chosen.born} of phase {chosen.phase}"
    parents = _listed([_parent(parent, one.parents) for parent in chosen.parents])
    if chosen.origin is Origin.RANDOM:
        bred = f"Drawn at random for {when}."
    elif chosen.origin is Origin.REFINED:
        bred = f"Bred for {when} by refining {parents}: every action replaced by one of its family."
    elif chosen.origin in _BRED and chosen.parents:
        bred = f"Bred for {when} {_BRED[chosen.origin].format(parents)}."
    else:
        bred = f"How it arose in {when} was not kept" + (f"; it descends from {parents}." if parents else ".")
    return f"{bred} The last generation bred for this situation was {one.generation} of phase {one.phase}."


def _parent(parent: Sequence[Action], known: Sequence[Candidacy]) -> str:
    name = codes(parent)
    found = next((one for one in known if one.actions == tuple(parent)), None)
    return (
        name if found is None else f"{name} (worth {with_error(found.value, found.error)}, performed {_times(found.performed)})"
    )


def _foretold(chosen: Candidacy) -> str:
    told, parts = chosen.history, []
    if told is not None and told.expected is not None and told.error is not None:
        parts.append(f"Before it was first performed {with_error(told.expected, told.error)} was expected.")
    if chosen.mean is None or chosen.mean_error is None:
        parts.append("No performance of it has been rated.")
    else:
        span = _span(told)
        gave = "1 performance gave" if chosen.rated == 1 else f"{chosen.rated:,} performances gave"
        parts.append(f"{gave} {with_error(chosen.mean, chosen.mean_error)} on the average{span}.")
        if chosen.rated > chosen.performed:
            parts.append("Some of these were of maneuvers that turn the wheels in the same way.")
        if told is not None and told.expected is not None and told.error is not None:
            parts.append(_against(chosen.mean - told.expected, math.hypot(told.error, chosen.mean_error)))
    value = with_error(chosen.value, chosen.error)
    if chosen.foretold is None or chosen.foretold_error is None:
        parts.append(f"With what is known of those that begin like it, it is worth {value}.")
    else:
        parts.append(
            f"Its parts alone foretell {with_error(chosen.foretold, chosen.foretold_error)} now; with both it is worth {value}."
        )
    return " ".join(part for part in parts if part)


def _span(told: Performed | None) -> str:
    if told is None or len(told.fitness) < 2:
        return ""
    return f", between {min(told.fitness):.1f} and {max(told.fitness):.1f}"


def _against(difference: float, error: float) -> str:
    if not error or abs(difference) < error:
        return "That is as expected."
    return f"That is {abs(difference) / error:.1f} standard errors {'more' if difference > 0 else 'less'} than expected."


def _beaten(one: Explanation, chosen: Candidacy) -> str:
    if not one.rivals:
        return "Nothing else is known in this situation."
    if one.ahead:
        ahead = "one other maneuver" if one.ahead == 1 else f"{one.ahead:,} other maneuvers"
        return f"The run holds {ahead} for better than this one: {codes(one.rivals[0].actions)} is its best."
    next_best = one.rivals[0]
    difference, error = chosen.value - next_best.value, math.hypot(chosen.error, next_best.error)
    own, others = _exam(chosen), sum(map(_exam, one.rivals))
    tested = f" The exam tested it {_times(own)}, and those that come next {_times(others)}." if own or others else ""
    more = f"{abs(difference):.1f} {'less' if difference >= 0 else 'more, but less surely,'}"
    sure = "plain" if difference > PLAIN * error else "not certain"
    return (
        f"What came next, {codes(next_best.actions)}, is worth {more} (standard error of the difference {error:.1f}): which of "
        f"the two is better is {sure}.{tested}"
    )


def _exam(one: Candidacy) -> int:
    """Its performances in the exam, as far as the log has them."""
    return 0 if one.history is None else one.history.exam


def _mirror(one: Explanation) -> str:
    if one.mirrored:
        return "It is the mirror image of what was learnt for the other side: what both sides performed counts together."
    if one.shared:
        return "What was performed on the other side counts too, as its mirror image."
    if one.folded:
        return "Left and right are alike here: of a maneuver and its mirror image the one that turns left first is kept."
    return ""


def when(one: Explanation) -> str:
    """The situation in words: `When both eyes see it`.

    Args:
        one: The explanation.
    """
    return f"When {situation_in_words(one.entry)}"


def runner_up(one: Candidacy) -> str:
    """A runner-up in a line.

    Args:
        one: What is known of it.
    """
    mean = "" if one.mean is None else f", mean {one.mean:.1f}"
    return f"{codes(one.actions)}: worth {with_error(one.value, one.error)}, performed {_times(one.performed)}{mean}"


def with_error(value: float, error: float) -> str:
    """A value with its standard error: `13.8 +- 0.6`.

    Args:
        value: The value.
        error: Its standard error.
    """
    return f"{value:.1f} +- {error:.1f}"


def _named(one: Explanation, chosen: Candidacy) -> str:
    """What it lacks for a name, where the opponent is seen and it has earned none."""
    if not one.entry.current or not chosen.performed or not all(chosen.lacking.values()):
        return ""
    nearest = min(chosen.lacking, key=lambda name: len(chosen.lacking[name]))
    return f"None of the five names is its own. For {nearest} it lacks: {'; '.join(chosen.lacking[nearest])}."


def _times(count: int) -> str:
    return {0: "never", 1: "once", 2: "twice"}.get(count, f"{count:,} times")


def _listed(words: Sequence[str]) -> str:
    return " and ".join(words)


def plain(one: Explanation) -> dict[str, object]:
    """An explanation as plain values.

    Args:
        one: The explanation.
    """
    entry = one.entry
    return {
        "maneuver": [action.name for action in entry.actions],
        "period": entry.period,
        "fitness": entry.fitness,
        "evaluations": entry.evaluations,
        "names": list(entry.names),
        "known": one.known,
        "mirrored": one.mirrored,
        "shared": one.shared,
        "folded": one.folded,
        "tried": one.tried,
        "performances": one.performances,
        "ahead": one.ahead,
        "chosen": None if one.chosen is None else _plain(one.chosen),
        "parents": [_plain(parent) for parent in one.parents],
        "rivals": [_plain(rival) for rival in one.rivals],
        "run": one.run or None,
        "verdicts": [asdict(verdict) for verdict in one.verdicts],
        "reasons": reasons(one),
    }


def _plain(one: Candidacy) -> dict[str, object]:
    told = one.history
    return {
        "maneuver": [action.name for action in one.actions],
        "phase": one.phase,
        "generation": one.born,
        "origin": one.origin.value,
        "parents": [[action.name for action in parent] for parent in one.parents],
        "value": one.value,
        "error": one.error,
        "performed": one.performed,
        "rated": one.rated,
        "mean": one.mean,
        "mean_error": one.mean_error,
        "foretold": one.foretold,
        "foretold_error": one.foretold_error,
        "lacking": {name: list(parts) for name, parts in one.lacking.items()},
        "expected": None if told is None else told.expected,
        "expected_error": None if told is None else told.error,
        "motives": None if told is None else dict(told.motives),
        "exam": None if told is None else told.exam,
    }
