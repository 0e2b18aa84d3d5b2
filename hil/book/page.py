"""`docs/what-holds.md`: every claim with its figure and the verdict, as stored results have it."""

from __future__ import annotations

from collections import Counter
from itertools import groupby
from typing import TYPE_CHECKING, Final

from hil.book.chapters import CHAPTERS
from hil.book.claim import ClaimVerdict
from hil.book.experiments import EXPERIMENTS, REPEATS, SEARCHES, SEEDS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hil.book.claim import Judgement
    from hil.book.results import StoredResults

_HEAD: Final = f"""\
<!-- Made by `python -m hil.book` from docs/results/surround. Do not edit. -->
# What holds, and what does not

Chapters 6 to 9 of Liu & Wu's *Multi-Agent Robotic Systems* (2001) say how a swarm learns to surround another, what it learns,
what matters for it, and which conditions evolution prefers. This page sets beside each claim what came out here.

Every figure is of emulated robots on a table with physics, each running the C firmware that a real one is flashed with. What is
measured has come over the wire, with noise as it is by default; the emulator's own knowledge is not used. There are {SEEDS}
seeds of each condition, {SEARCHES} evolutions of each fitness, and {REPEATS} runs of each of the 96 conditions of chapter 9.
Nothing was run on real robots.

Behind a figure stands its 95 % interval: normal for means, differences and ratios, Wilson's for shares of runs.

| verdict | where |
|---|---|
| holds | the figure with all of its interval is as asked; where a share of these very runs is asked for, the figure alone |
| open | the interval reaches to both sides of what is asked |
| does not | neither the figure nor any of its interval is as asked |
| differs | the same, where there is something of the kind, and it is another |
| reported | the book says nothing that a figure could decide |
| not measured | the runs have not been made, or what they leave does not tell |

What is asked is a limit that stands for the book's words, which rarely give a number. D is the mean distance from a RANGER to
the nearest WILD, in the book's units; cases have the book's names ([A swarm that learns to surround](swarm.md#cases)).
"""
_WHY: Final = "## What differs, and why"
_COMMANDS: Final = """\
## The commands

Each result is what one command prints, reduced to a file of docs/results/surround. `python -m hil.book.run` makes those that
are not there, `python -m hil.book.run NAME` makes one anew, and `python -m hil.book` makes this page of them.
"""
_UNDECIDED: Final = "So many runs do not decide it."
_BAD: Final = (ClaimVerdict.DOES_NOT, ClaimVerdict.DIFFERS, ClaimVerdict.OPEN)


def what_holds(results: StoredResults) -> str:
    """The page.

    Args:
        results: What the experiments have left.

    Raises:
        ResultError: A stored result can't be read.
    """
    found = {head: [claim.judge(results) for claim in claims] for head, claims in CHAPTERS.items()}
    numbers = {name: number for number, name in enumerate(EXPERIMENTS, 1)}
    judgements = [judgement for each in found.values() for judgement in each]
    parts = [_HEAD, counts(judgements)]
    for head, each in found.items():
        parts += [f"## {head}\n", table(each, numbers)]
    parts += [_WHY + "\n", reasons(judgements), _COMMANDS, _commands(numbers, results)]
    return "\n".join(parts)


def counts(judgements: Sequence[Judgement]) -> str:
    """How often there is which verdict.

    Args:
        judgements: What was found of the claims.
    """
    counts = Counter(judgement.verdict for judgement in judgements)
    told = ", ".join(f"{counts[verdict]} {verdict.value}" for verdict in ClaimVerdict if counts[verdict])
    return f"Of {len(judgements)} claims: {told}.\n"


def table(judgements: Sequence[Judgement], numbers: Mapping[str, int] | None = None) -> str:
    """A row for each claim.

    Args:
        judgements: What was found of them.
        numbers: Numbers of the commands, by name of the result; None: one command makes all.
    """
    heads = ["the book says", "where", "measured", "asked", "figure", "runs", "verdict", *([] if numbers is None else ["by"])]
    rows = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for judgement in judgements:
        claim, measurement = judgement.claim, judgement.measurement
        figure, runs = ("", "") if measurement is None else (str(measurement), str(measurement.count or ""))
        cells = [claim.says, claim.place, claim.measured, claim.asked, figure, runs, f"**{judgement.verdict.value}**"]
        if numbers is not None:
            cells.append(", ".join(f"[{numbers[name]}](#the-commands)" for name in claim.needs))
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows) + "\n"


def reasons(judgements: Sequence[Judgement]) -> str:
    """A paragraph for each thing that the book says and that does not hold, whatever the number of cases.

    Args:
        judgements: What was found of the claims.
    """
    lines = []
    bad = [judgement for judgement in judgements if judgement.verdict in _BAD]
    for (says, place), alike in groupby(bad, key=lambda judgement: (judgement.claim.says, judgement.claim.place)):
        group = list(alike)
        told = [f"{each.claim.measured}: {each.measurement} ({each.verdict.value})" for each in group]
        unknown = _UNDECIDED if all(each.verdict is ClaimVerdict.OPEN for each in group) else "Why is not known."
        why = next((each.claim.why for each in group if each.claim.why), unknown)
        lines.append(f"- *{says}* ({place}). Asked: {group[0].claim.asked}. Found: {'; '.join(told)}. {why}")
    return "\n".join(lines) + "\n" if lines else "Nothing.\n"


def _commands(numbers: Mapping[str, int], results: StoredResults) -> str:
    lines = [f"{number}. `{name}`: `{EXPERIMENTS[name].command}`" for name, number in numbers.items()]
    made: dict[str, list[str]] = {}
    for name in numbers:
        if results.has(name):
            versions = ", ".join(f"{package} {version}" for package, version in results.document(name)["versions"].items())
            made.setdefault(versions, []).append(str(numbers[name]))
    by = [f"Made by {versions}: {', '.join(names)}." for versions, names in made.items()]
    missing = [str(number) for name, number in numbers.items() if not results.has(name)]
    if missing:
        by.append(f"Not made yet: {', '.join(missing)}.")
    return "\n".join(lines) + "\n\n" + "\n".join(by) + "\n"
