"""What came of a surround mission, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.vocabulary import RobotClass
from hil.swarm.missions.surround_outcome import over_seeds
from pal_advisor.surround import rules, stimuli_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.swarm.missions.surround_outcome import SurroundOutcome

STEPS: Final = (0, 20, 50)
"""Steps of which is told, besides the last."""
MOST_RULES: Final = 8
"""Rules that are told of each class."""
MOST_MISSING: Final = 20


def surround_summary(outcomes: Sequence[SurroundOutcome]) -> list[str]:
    """What came of it.

    Args:
        outcomes: The runs, at least one.

    Returns:
        Lines.
    """
    lines: list[str] = []
    for outcome in outcomes if len(outcomes) == 1 else ():
        lines += _learnt(outcome)
    lines += _measured(outcomes)
    lines += _of_the_whole(outcomes)
    for outcome in outcomes:
        lines += _missing(outcome, several=len(outcomes) > 1)
    return lines


def _learnt(outcome: SurroundOutcome) -> list[str]:
    lines = []
    for kind in RobotClass:
        found = [rule for rule in rules(outcome.tables, kind) if rule.met]
        if found and any(len(rule.behaviours) < len(rule.pattern) for rule in found):
            lines.append(f"What {kind.name}s have learnt, of what they met most:")
            lines += [f"  {rule}" for rule in found[:MOST_RULES]]
    return lines or ["Nothing has been learnt."]


def _measured(outcomes: Sequence[SurroundOutcome]) -> list[str]:
    last = min(outcome.history.steps for outcome in outcomes)
    steps = [*(step for step in STEPS if step < last), last]
    several = len(outcomes) > 1
    of = over_seeds(outcomes) if several else {}
    series = of["mean"] if several else outcomes[0].history.series
    head = f"Mean of {len(outcomes)} seeds, with 95 % intervals:" if several else "How close they came:"
    lines = [head]
    for step in steps:
        distance = _told(series["distance"][step], of["ci95"]["distance"][step] if several else None, "{:.2f}")
        share = _told(series["share_surrounded"][step], of["ci95"]["share_surrounded"][step] if several else None, "{:.2f}")
        lines.append(f"  step {step:3}: distance to the nearest WILD {distance} units, share of WILDs surrounded {share}")
    return lines


def _told(value: float | None, half: float | None, form: str) -> str:
    if value is None:
        return "unknown"
    return form.format(value) + ("" if half is None else f" +- {form.format(half)}")


def _of_the_whole(outcomes: Sequence[SurroundOutcome]) -> list[str]:
    """Measures of whole runs: of several runs their means."""
    found = [outcome.history.measures(outcome.tables) for outcome in outcomes]
    lines = []
    settled = [one.settle_step for one in found if one.settle_step is not None]
    if settled:
        lines.append(f"  settled from step {_mean(settled)} on")
    met, known = _mean([one.stimuli_met[0] for one in found]), len(stimuli_of(outcomes[0].tables.sectors))
    pushed = _mean([one.pushed for one in found])
    lines.append(f"  RANGERs met {met} of {known} stimuli, and pushed a WILD together {pushed} times")
    seen = [pair for one in found for pair in one.weights if pair is not None]
    if seen:
        low, high = min(low for low, _ in seen), max(high for _, high in seen)
        lines.append(f"  weights of what was learnt: {low:.3f} to {high:.3f}")
    return ["Of the whole run:" if len(outcomes) == 1 else "Of whole runs, on the average:", *lines]


def _mean(values: Sequence[int]) -> str:
    return f"{sum(values) / len(values):.3g}" if len(values) > 1 else str(values[0])


def _missing(outcome: SurroundOutcome, *, several: bool) -> list[str]:
    if not outcome.absences:
        return []
    lines = [f"Missing{f' with seed {outcome.seed}' if several else ''}:"]
    for one in outcome.absences[:MOST_MISSING]:
        until = "to the end" if one.until is None else f"until step {one.until}"
        lines.append(f"  robot {one.robot} from step {one.step} {until}")
    if len(outcome.absences) > MOST_MISSING:
        lines.append(f"  and {len(outcome.absences) - MOST_MISSING} more")
    return lines


def surround_document(outcomes: Sequence[SurroundOutcome], order: str) -> dict[str, Any]:
    """What came of it, as `--json` has it, without files and wall time.

    Args:
        outcomes: The runs, at least one.
        order: Which robots moved at once.
    """
    facts = [outcome.facts(order) for outcome in outcomes]
    return facts[0] if len(facts) == 1 else {"runs": facts, **over_seeds(outcomes)}
