"""What advice is worth in worlds that it was not learnt in: opponents x methods x seeds, each coached, then played in each.

Worlds are the nominal one; those in which one quantity is off by a share; `all`, where every bout has a world of its own and
all quantities are off by up to the share at once; and `corners`, in each of which all of them are off by all of it. Bouts are
from poses, and in worlds, that no coaching has seen, the same for all methods. `there+METHOD` coaches in the very world that it
is judged in. `chase2` is the yardstick by hand.

What is made is kept in a file, a line for each advice and for each series of bouts; what is there is not made again, so that
the command may be broken off and given anew, with more seeds, methods or worlds too. Any number of workers makes the same
table. Intervals are 95 %, over seeds; differences are paired by seed.

    python benchmarks/robustness.py [--methods team,team+vary,chase2] [--against team] [--opponents flat-light,flat-heavy]
        [--worlds nominal,mass-15] [--seeds 600-607 | --seeds-of COMMIT --first 8] [--bouts 200] [--workers 2]
        [--results robustness.jsonl] [--learnt learning.jsonl] [--json | --short] [--table]
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, dataclass, field
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import kept_lines
import numpy as np
from coaching import DUMMIES, JUDGE, Run, coached_team, ring_of, seeds_in
from learning import METHODS, NO_SETTINGS, seeds_of

from hil.book.measurement import Measurement, mean_of
from hil.seeds import Branch, bout_seed
from hil.sumo.bouts import Tally, play
from hil.sumo.controllers import AdviceController, Chase2Controller
from hil.working import open_crew
from pal_advisor.maneuvers import Advice, Objective, PalSettings

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

HAND: Final = "chase2"
THERE: Final = "there"
WAYS: Final[Mapping[str, Mapping[str, Any]]] = {
    **{name: changes for name, changes in METHODS.items() if "faults" not in changes},
    "vary": {"vary": 0.15},
    "vary-30": {"vary": 0.3},
    "vary-exam": {"exam_vary": 0.15},
    THERE: {THERE: True},
}
"""What each changes: settings of Pal, and of the coaching.

`team` is what `hil coach` does with emulated robots, `team+vary` what it does with `--vary 0.15`. In `team+vary-exam` worlds
vary in the team exam alone. What is wrong with a robot is part of a world here (`wheel-15`), not of a method.
"""
NOT_PALS: Final = (*NO_SETTINGS, "vary", "exam_vary", THERE)
QUANTITIES: Final[Mapping[str, tuple[str, ...]]] = {
    "mass": ("mass",),
    "friction": ("friction",),
    "motors": ("force",),
    "wheel": ("left",),
    "eyes": ("eyes",),
    "battery": ("battery",),
    "opponent-mass": ("opponent_mass",),
    "opponent-friction": ("opponent_friction",),
}
"""What is off in a world, as an address names it."""
SHARES: Final = (-30, -15, 15, 30)
CORNERS: Final = 20
"""Worlds that `corners` are drawn as."""


def _corners(share: int) -> tuple[str, ...]:
    """Worlds in which everything is off by all of the share, one way or the other."""
    random = np.random.Generator(np.random.PCG64(share))
    names = [name for names in QUANTITIES.values() for name in names]
    signs = random.choice((-1, 1), (CORNERS, len(names)))
    return tuple(
        "".join(f"&{name}={1 + sign * share / 100:g}" for name, sign in zip(names, row, strict=True))
        + f"&delay={share / 1000:g}"
        for row in signs
    )


def worlds() -> dict[str, tuple[str, ...]]:
    """All worlds by name: what the address of a robot says of each; of several, each has its share of the bouts."""
    single = {
        f"{name}{share:+d}": ("".join(f"&{option}={1 + share / 100:g}" for option in options),)
        for name, options in QUANTITIES.items()
        for share in SHARES
    }
    late = {f"delay+{share}": (f"&delay={share / 1000:g}",) for share in SHARES if share > 0}
    all_at_once = {f"all{share}": (f"&vary={share / 100:g}",) for share in SHARES if share > 0}
    corners = {f"corners{share}": _corners(share) for share in SHARES if share > 0}
    return {"nominal": ("",), **single, **late, **all_at_once, **corners}


@dataclass(frozen=True)
class Wanted:
    """An advice that is wanted.

    Attributes:
        method: Name of the method.
        opponent: Against whom.
        seed: Seed of the coaching.
        changes: What the method changes, as JSON: a method that has changed is another.
        options: What else the address of the robot says where it is coached.
    """

    method: str
    opponent: str
    seed: int
    changes: str
    options: str


@dataclass(frozen=True)
class Series:
    """Bouts that are wanted.

    Attributes:
        wanted: By which advice.
        world: Name of the world.
        bouts: How many.
    """

    wanted: Wanted
    world: str
    bouts: int


@dataclass(frozen=True)
class Made:
    """What is there.

    Attributes:
        advices: As plain values.
        wins: Bouts won, of each series.
        times: Median time to win in s of each, None where none was won.
    """

    advices: dict[Wanted, dict[str, Any]] = field(default_factory=dict)
    wins: dict[Series, int] = field(default_factory=dict)
    times: dict[Series, float | None] = field(default_factory=dict)


def coached(wanted: Wanted) -> dict[str, Any]:
    """Coach, and hold the team exam where there are several runs.

    Args:
        wanted: What.

    Returns:
        The advice, as plain values.
    """
    changes = json.loads(wanted.changes)
    paces = changes.get("paces") or [changes.get("period", PalSettings().period)]
    settings = PalSettings.from_dict({name: value for name, value in changes.items() if name not in NOT_PALS})
    exam_vary = f"&vary={changes['exam_vary']:g}" if "exam_vary" in changes else ""
    run = Run(wanted.opponent, wanted.seed, settings, wanted.options)
    return coached_team(run, paces, changes.get("runs", 1), exam_vary).advice.to_dict()


def played(task: tuple[Series, dict[str, Any] | None]) -> tuple[int, float | None]:
    """Play.

    Args:
        task: The bouts, and the advice, as plain values; None: by hand.

    Returns:
        How many were won, and the median time to win in s.
    """
    series, advice = task
    controller = Chase2Controller() if advice is None else AdviceController(Advice.from_dict(advice))
    seeds = [bout_seed(JUDGE, Branch.BOUTS, number) for number in range(1, series.bouts + 1)]
    bouts = []
    each = worlds()[series.world]
    for number, options in enumerate(each):
        with ring_of(series.wanted.opponent, JUDGE, options) as ring:
            bouts += list(play(ring, controller, seeds[number :: len(each)]))
    tally = Tally.of(series.wanted.opponent, bouts)
    return tally.wins, tally.median_time_to_win


def kept(results: Path) -> Made:
    """What was made before; a last line that was cut short counts as not made.

    Args:
        results: The file.
    """
    made = Made()
    for data in kept_lines.kept(results):
        wanted = Wanted(**data["wanted"])
        if "advice" in data:
            made.advices[wanted] = data["advice"]
        else:
            series = Series(wanted, data["world"], data["bouts"])
            made.wins[series], made.times[series] = data["wins"], data["time"]
    return made


def learnt(results: Path) -> dict[Wanted, dict[str, Any]]:
    """Advice of the nominal world that `learning.py` has made, by methods that have a budget of their own, as `team`.

    Both files have to be of the same program: bouts that were kept are not played again.

    Args:
        results: Its file.
    """
    found = {}
    for data in kept_lines.kept(results):
        cell = data["cell"]
        if data.get("advice") and cell["objective"] == Objective.OUTCOME:
            found[Wanted(cell["method"], cell["opponent"], cell["seed"], cell["changes"], "")] = data["advice"]
    return found


def make(series: Sequence[Series], made: Made, results: Path, workers: int) -> None:
    """Make what is not there.

    Args:
        series: What is wanted.
        made: What is there; what is made is added.
        results: The file.
        workers: Processes.
    """
    missing = [one for one in series if one not in made.wins]
    orders = dict.fromkeys(one.wanted for one in missing if one.wanted.method != HAND and one.wanted not in made.advices)
    with open_crew(workers) as crew:
        advices = kept_lines.make(
            crew, coached, list(orders), results, lambda wanted, advice: {"wanted": asdict(wanted), "advice": advice}
        )
        made.advices.update(advices)
        tasks = [(one, made.advices.get(one.wanted)) for one in missing]
        bouts = kept_lines.make(
            crew, played, tasks, results, lambda task, found: {**asdict(task[0]), "wins": found[0], "time": found[1]}
        )
        for (one, _), (wins, time) in bouts:
            made.wins[one], made.times[one] = wins, time


def _groups(made: Made, series: Sequence[Series]) -> dict[tuple[str, str, str], dict[int, float]]:
    """Share of bouts won by world, opponent and method, of each seed."""
    groups: dict[tuple[str, str, str], dict[int, float]] = {}
    for one in series:
        if one in made.wins:
            key = (one.world, one.wanted.opponent, one.wanted.method)
            groups.setdefault(key, {})[one.wanted.seed] = made.wins[one] / one.bouts
    return groups


def rows(made: Made, series: Sequence[Series], against: str) -> list[dict[str, Any]]:
    """What was found out, a row for each world, opponent and method.

    Args:
        made: What was made.
        series: What is wanted.
        against: The method that others are compared with.
    """
    groups = _groups(made, series)
    found = []
    for (world, opponent, method), rates in groups.items():
        theirs = groups.get((world, opponent, against), {})
        pairs = np.array([rate - theirs[seed] for seed, rate in rates.items() if seed in theirs])
        found.append({
            "world": world,
            "opponent": opponent,
            "method": method,
            "seeds": len(rates),
            "won": _measured(np.array(list(rates.values()))),
            "worst": min(rates.values()),
            "pairs": len(pairs),
            "difference": _measured(pairs) if len(pairs) and method != against else None,
        })  # fmt: skip
    return found


def _measured(values: np.ndarray[Any, np.dtype[np.float64]]) -> Measurement:
    return mean_of(values) if len(values) > 1 else Measurement(float(values[0]), 0.0, 1.0, 1, f"{values[0]:.3f}")


def table(found: Sequence[Mapping[str, Any]]) -> Iterable[str]:
    """The same as Markdown: a table for each opponent, with a line for each world and a column for each method.

    Args:
        found: The rows.

    Yields:
        Lines.
    """
    methods = list(dict.fromkeys(row["method"] for row in found))
    for opponent in dict.fromkeys(row["opponent"] for row in found):
        yield f"\n| {opponent} | " + " | ".join(methods) + " |"
        yield "|---" * (len(methods) + 1) + "|"
        for world in dict.fromkeys(row["world"] for row in found):
            cells = {row["method"]: row for row in found if (row["world"], row["opponent"]) == (world, opponent)}
            yield f"| {world} | " + " | ".join(_cell(cells.get(method)) for method in methods) + " |"


def short_table(found: Sequence[Mapping[str, Any]]) -> Iterable[str]:
    """The same without intervals: one table, with a line for each world, and a column for each opponent with all methods.

    Args:
        found: The rows.

    Yields:
        Lines.
    """
    methods, opponents, names = (list(dict.fromkeys(row[key] for row in found)) for key in ("method", "opponent", "world"))
    yield "| won by " + " / ".join(methods) + " | " + " | ".join(opponents) + " |"
    yield "|---" * (len(opponents) + 1) + "|"
    won = {(row["world"], row["opponent"], row["method"]): f"{row['won'].value:.2f}" for row in found}
    for world in names:
        cells = (" / ".join(won.get((world, opponent, method), "-") for method in methods) for opponent in opponents)
        yield f"| {world} | " + " | ".join(cells) + " |"


def _cell(row: Mapping[str, Any] | None) -> str:
    """Won (worst seed), with the difference."""
    if row is None:
        return "-"
    won, difference = row["won"], row["difference"]
    if row["seeds"] == 1:
        return f"{won.value:.2f}"
    half = (
        f"; {difference.value:+.2f} ± {(difference.high - difference.low) / 2:.2f}" if row["pairs"] > 1 and difference else ""
    )
    return f"{won.value:.2f} ± {(won.high - won.low) / 2:.2f} ({row['worst']:.2f}{half})"


def wanted_series(options: argparse.Namespace) -> list[Series]:
    """What the command line asks for."""
    names = list(worlds()) if options.worlds == "every" else options.worlds.split(",")
    seeds = seeds_of(options.seeds_of, options.first) if options.seeds_of else seeds_in(options.seeds)
    series = []
    for seed, opponent, method, world in product(seeds, options.opponents.split(","), options.methods.split(","), names):
        changes: dict[str, Any] = {}
        if method == HAND:
            series.append(Series(Wanted(HAND, opponent, 0, "{}", ""), world, options.bouts))
            continue
        for name in method.split("+"):
            changes |= WAYS[name]
        vary = f"&vary={changes['vary']:g}" if "vary" in changes else ""
        place = worlds()[world][0] if THERE in changes else vary
        series.append(Series(Wanted(method, opponent, seed, json.dumps(changes, sort_keys=True), place), world, options.bouts))
    return list(dict.fromkeys(series))


def main() -> int:
    """Make and tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--methods", default="team,team+vary,chase2", help=f"of {', '.join(WAYS)}, {HAND}; NAME+NAME joins")
    parser.add_argument("--against", default="team", help="compare the others with this method")
    parser.add_argument("--opponents", default=DUMMIES)
    parser.add_argument("--worlds", default="every", help=f"of {', '.join(worlds())}")
    parser.add_argument("--seeds", default="600-607", help="first-last")
    parser.add_argument("--seeds-of", metavar="COMMIT", help="instead, the first seeds that learning.py draws from it")
    parser.add_argument("--first", type=int, default=8, help="so many of these")
    parser.add_argument("--bouts", type=int, default=200, help="held-out bouts in each world")
    parser.add_argument("--results", type=Path, default=Path("robustness.jsonl"), help="where what is made is kept")
    parser.add_argument("--learnt", type=Path, help="take advice of `team` from what learning.py has kept")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    shape = parser.add_mutually_exclusive_group()
    shape.add_argument("--json", action="store_true", help="print rows as JSON instead of tables")
    shape.add_argument("--short", action="store_true", help="one table of all opponents, without intervals")
    parser.add_argument("--table", action="store_true", help="make nothing: tell of what is there")
    options = parser.parse_args()
    series = wanted_series(options)
    made = kept(options.results)
    if options.learnt and not options.learnt.exists():
        parser.error(f"{options.learnt} is not there")
    if options.learnt:
        made.advices.update(learnt(options.learnt))
    if not options.table:
        make(series, made, options.results, options.workers)
    found = rows(made, series, options.against)
    told = [json.dumps(found, default=asdict)] if options.json else (short_table if options.short else table)(found)
    sys.stdout.write("\n".join(told) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
