"""`docs/chapter-10.md`: every claim of chapter 10 with figure and verdict, and what was learnt, as stored results have it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from hil.book.chapters.chapter10 import CLAIMS
from hil.book.measurement import mean_of_few
from hil.book.page import counts, reasons, table
from hil.book.results import ResultMissingError
from hil.book.sumo.methods import BOUTS, BUDGET, METHODS, OPPONENTS, SEEDS, SQUARE
from hil.book.sumo.reduction import MODES
from hil.book.sumo.results import COMMAND

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hil.book.results import StoredResults

_HEAD: Final = f"""\
<!-- Made by `{COMMAND}` from docs/results/sumo. Do not edit. -->
# Chapter 10: what Pal teaches Junior

Chapter 10 of Liu & Wu's *Multi-Agent Robotic Systems* (2001) has Pal coach Junior against five opponents by multi-phase genetic
programming. This page sets beside each of its claims what came out here, whichever way it came out. Junior is emulated and
runs the C firmware that a real one is flashed with. Nothing was run on a real robot.

`{COMMAND}` makes what is missing, draws the figures, writes this page and prints the verdicts. It may be broken off and given
anew.

## What was coached

**As the book has it** (`book`): fitness is Eq. 10.1 as printed; each maneuver of a population of 20 is performed once, then a
GP step is made; phase 1 has a population for each stimulus (none, left, right, both eyes), phase 2 one for each pair of
previous and current stimulus; left and right are learnt apart. {BUDGET} maneuvers in all, of which the last fifth tests the
best again: that decides which maneuver is handed out, and is no part of the curves.

| Eq. 10.1 | here |
|---|---|
| l = 4 actions | 4, of 150 ms each |
| Y: sees it with side j, n = 2 eyes | 1 for each eye that sees it in half of the action's samples or more |
| hold, m = 2 arms | 1 for each arm that is pressed for 100 ms without a break |
| contact, m = 2 arms | 1 for each arm whose switch closes during the action |
| w_i | 1 |
| (nothing is said) | what is left undone because the bout is won counts in full, 6 an action |
| (nothing is said) | what follows a maneuver is not credited to it (`credit = 0`; Pal's default credits it too) |

An action is worth 6 at most, a maneuver 24. The book says nothing of the size of a population, of how long an action takes,
or of how often a bout is begun anew; what we took is as above.

**A GP step** is 20 performances in a sensing mode. Pal does not perform again what it knows of a population that has
converged, so that a step of its own may take a single performance: counted so, curves would be long where nothing is learnt
any more.

Ratings of what was learnt are of {BOUTS} held-out bouts, the same for all, and not of the performances it was elected by: the
best of many noisy ratings is too good. There are {SEEDS} seeds where the table says no less; behind a figure stands its 95 %
interval over them, Student's for means and Wilson's for shares of runs. The verdicts are those of [what
holds](what-holds.md). What is asked is a limit that stands for the book's words.

**The corner.** The book's is so small that both eyes never see it at once. `corner-light` is a wedge, 14 cm wide and
right-angled: from the front both eyes look along its sides, but once it has been turned a side faces both. `corner-square` is
a square of 3.5 cm with the same mass and friction that stands corner forward: less wide than the eyes are apart. It is there
for this page alone.

**For comparison** `outcome` has pairs of stimuli as well, but the objective `outcome`, repeated ratings and credit, as Pal
coached before it had a model; `product` is what `hil coach --runs 1` does. Each is there with both phases, and (`-single`)
with fine actions alone from the beginning, both with the same number of maneuvers.
"""
_FIGURES: Final = """\
## Figures

![Opponents by the contact when they engage, and by the force that gets them going](figures/chapter10-complexity.png)

*As Fig. 10.5: the opponents by contact and weight, their fronts down. Only the heavy one can't be moved by a steady push.*

![Strobe pictures of a bout against each of the five opponents](figures/chapter10-maneuvers.png)

*As Fig. 10.6: a bout against each, by the coaching that won the middle number of bouts; of the bouts it won the one that took
the middle time. Junior is blue, and darker as time goes on.*

![Best fitness over GP steps, a curve for each sensing mode and a panel for each opponent](figures/chapter10-curves.png)

*As Fig. 10.7: best fitness in the latest generation, mean over the seeds; a curve is as long as that of the middle seed. The
first half of the maneuvers is phase 1. Left-side sensing is dotted with circles, right-side dashed with stars, both-side
solid; none, which the book has no curve of, is thin and grey.*
"""


def chapter_10(results: StoredResults) -> str:
    """The page.

    Args:
        results: What the coaching runs have left.

    Raises:
        ResultError: A stored result can't be read.
    """
    judgements = [claim.judge(results) for claim in CLAIMS]
    parts = [
        _HEAD, _FIGURES, "## Claims\n", counts(judgements), table(judgements), "## What differs, and why\n",
        reasons(judgements), "## What was learnt\n", "\n".join(_learnt(results)), "## Bouts won\n", "\n".join(_won(results)),
        "## How long the curves are\n", "\n".join(_lengths(results)),
    ]  # fmt: skip
    return "\n".join(parts)


def _learnt(results: StoredResults) -> Iterable[str]:
    yield "Maneuvers that are a tenth or more of what is performed with the opponent in sight, in held-out bouts; names earned."
    yield ""
    yield "| opponent | seed | won | performed most | names |"
    yield "|---|---|---|---|---|"
    for opponent in (*OPPONENTS, SQUARE):
        try:
            runs = results.runs(f"book-{opponent}")
        except ResultMissingError:
            continue
        lacking = runs.data["lacking"]
        for index, (seed, wins, winners) in enumerate(
            zip(runs.columns["seed"], runs.columns["wins"], runs.data["winners"], strict=True)
        ):
            names = [name for name, each in lacking.items() if not each[index]]
            yield f"| {opponent} | {seed} | {wins} | {'; '.join(winners)} | {', '.join(names)} |"
    yield ""


def _won(results: StoredResults) -> Iterable[str]:
    yield f"Share of {BOUTS} held-out bouts, mean over seeds."
    yield ""
    yield f"| method | {' | '.join(OPPONENTS)} |"
    yield "|---" * (1 + len(OPPONENTS)) + "|"
    for method in METHODS:
        cells = []
        for opponent in OPPONENTS:
            try:
                runs = results.runs(f"{method}-{opponent}")
                cells.append(str(mean_of_few(runs.column("wins") / runs.column("bouts"))))
            except ResultMissingError:
                cells.append("")
        yield f"| `{method}` | {' | '.join(cells)} |"
    yield ""


def _lengths(results: StoredResults) -> Iterable[str]:
    yield "Method `book`, mean over seeds: GP steps of 20 performances, and in brackets the steps that Pal made."
    yield ""
    yield f"| opponent | {' | '.join(MODES)} |"
    yield "|---" * (1 + len(MODES)) + "|"
    for opponent in (*OPPONENTS, SQUARE):
        try:
            columns = results.runs(f"book-{opponent}").columns
        except ResultMissingError:
            continue
        cells = [f"{np.mean(columns[f'length_{mode}']):.1f} ({np.mean(columns[f'steps_{mode}']):.0f})" for mode in MODES]
        yield f"| {opponent} | {' | '.join(cells)} |"
    yield ""
