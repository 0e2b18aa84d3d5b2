"""What `--json` prints, reduced to what claims need: plain values of a few kB, one list a column, one value a seed."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from hil.book.experiments import FITNESSES, ResultKind
from pal_advisor.surround.measures import dominance, settle_step

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

Plain = dict[str, Any]

DIGITS: Final = 4
"""Decimal places that are kept, but for weights and fitness."""
FINE: Final = 6
STEPS: Final = (0, 20, 50)
"""Steps whose distances are kept, besides the last."""
UNIFORM: Final = 1e-9
"""Weights that are nearer to 1/N have not been changed."""
CLASSES: Final = {"ranger": "stimuli", "wild": "wild_stimuli"}
STIMULI: Final = (*range(1, 9), 23)
"""Stimuli of which it is kept what was learnt: those that the book has rules of, and those between."""
BEHAVIOURS: Final = 6
"""Behaviours that are kept of each, those learnt most often."""
NEAR: Final = 0.1
"""D has come near its least value within this share of the way to it."""


def _at(step: int, name: str = "distance") -> Callable[[Plain], float | None]:
    def value(run: Plain) -> float | None:
        series = run[name]
        return series[step] if step < len(series) else None

    return value


def _learnt(run: Plain) -> list[NDArray[np.float64]]:
    """Weight vectors of the RANGERs that are not as they were at first."""
    return [np.array(entry["weights"]) for entry in run["stimuli"] if _changed(entry)]


def _uniform(run: Plain) -> bool:
    """All weights of both classes are as they were at first: at every step where that was measured, else at the end."""
    if "measures" in run:
        return all(run["measures"]["uniform"].values())
    return not any(_changed(entry) for name in CLASSES.values() for entry in run[name])


def _seen(run: Plain) -> list[float | None]:
    """Least and greatest weight of the RANGERs' learnt vectors: of all steps where that was measured, else of the end."""
    if "measures" in run:
        return run["measures"]["weights"]["ranger"] or [None, None]
    vectors = _learnt(run)
    return [float(np.min(vectors)), float(np.max(vectors))] if vectors else [None, None]


def _dominance(run: Plain) -> float | None:
    vectors = [np.array(entry["weights"]) for entry in run["stimuli"] if entry["number"] == 2 and entry["met"]]
    return dominance(vectors[0]) if vectors else None


def _met(run: Plain) -> int:
    return sum(entry["met"] > 0 for entry in run["stimuli"])


def _settled(run: Plain) -> int | None:
    distance = np.array(run["distance"], dtype=np.float64)
    return None if np.isnan(distance).any() else settle_step(distance)


def _reached(run: Plain) -> int | None:
    """The first step at which D is near its least value."""
    distance = np.array(run["distance"], dtype=np.float64)
    if np.isnan(distance).any():
        return None
    near = distance.min() + NEAR * (distance[0] - distance.min())
    return int(np.flatnonzero(distance <= near)[0])


def _measure(*path: str) -> Callable[[Plain], Any]:
    """A number of the document's `measures`, which what has no such field leaves unknown."""

    def value(run: Plain) -> Any:  # noqa: ANN401 - whatever is measured
        found: Any = run.get("measures", {})
        for name in path:
            found = found.get(name) if isinstance(found, dict) else None
        if isinstance(found, list):  # where or when: how often
            found = len(found)
        return found if isinstance(found, int | float) else None

    return value


COLUMNS: Final[Mapping[str, Callable[[Plain], Any]]] = {
    "seed": lambda run: run["seed"],
    **{f"distance_{step}": _at(step) for step in STEPS},
    "distance_last": _at(-1),
    "share_50": _at(50, "share_surrounded"),
    "share_last": _at(-1, "share_surrounded"),
    "outside_50": _at(50, "outside"),
    "outside_last": _at(-1, "outside"),
    "settle_step": _settled,
    "reached": _reached,
    "stimuli_met": _met,
    "uniform": lambda run: int(_uniform(run)),
    "learnt": lambda run: len(_learnt(run)),
    "zeros": lambda run: sum(bool((vector == 0.0).any()) for vector in _learnt(run)),
    "least": lambda run: _seen(run)[0],
    "greatest": lambda run: _seen(run)[1],
    "dominance": _dominance,
    "missing": lambda run: len(run["missing"]),
    "pushed": _measure("pushed"),
    "periodic": _measure("periodic", "ranger"),
    "macro_stable": _measure("macro_stable"),
}
"""What is kept of each run of one condition."""


def reduced(kind: ResultKind, document: Plain) -> Plain:
    """What is kept of a document.

    Args:
        kind: What it is about.
        document: As `--json` printed it.

    Returns:
        Plain values.

    Raises:
        KeyError: The document lacks what claims need.
    """
    match kind:
        case ResultKind.RUNS:
            return _runs(document)
        case ResultKind.SEARCH:
            return _searches(document)
        case ResultKind.TABLE:
            return _table(document)


def _each(document: Any) -> list[Plain]:  # noqa: ANN401 - whatever was printed
    """The runs of a document: one for each seed, or it is one itself."""
    runs = document.get("runs", [document]) if isinstance(document, dict) else []
    if not runs:
        raise KeyError("runs")
    return list(runs)


def _runs(document: Plain) -> Plain:
    runs = _each(document)
    columns = {name: [_rounded(value(run)) for run in runs] for name, value in COLUMNS.items()}
    distance = np.array([run["distance"] for run in runs], dtype=np.float64)
    return {
        "columns": {name: column for name, column in columns.items() if any(value is not None for value in column)},
        "rules": {kind: _rules(runs, name) for kind, name in CLASSES.items()},
        "distance": [_rounded(value, 3) for value in distance.mean(axis=0).tolist()],
    }


def _rules(runs: list[Plain], name: str) -> Plain:
    """For each stimulus in how many runs something was learnt, mean weights, and which behaviour is largest how often."""
    found: Plain = {}
    for number in STIMULI:
        learnt = [
            entry for run in runs for entry in run[name] if entry["number"] == number and entry["met"] and _changed(entry)
        ]
        if learnt:
            mean = np.mean([entry["weights"] for entry in learnt], axis=0)
            most = Counter(entry["behaviour"] for entry in learnt).most_common(BEHAVIOURS)
            found[str(number)] = {"learnt": len(learnt), "weights": [round(value, 3) for value in mean.tolist()], **dict(most)}
    return found


def _changed(entry: Plain) -> bool:
    """Weights are not as they were at first."""
    weights = entry["weights"]
    return bool(np.abs(np.array(weights) - 1.0 / len(weights)).max() > UNIFORM)


def _searches(document: Plain) -> Plain:
    runs = _each(document)
    return {
        "fitness": runs[0]["fitness"],
        "search": runs[0]["search"],
        "columns": {
            "seed": [run["seed"] for run in runs],
            "evaluations": [run["evaluations"] for run in runs],
            "best": [run["best"]["case"] for run in runs],
            "mean": [_rounded(run["best"]["mean"], FINE) for run in runs],
            "sd": [_rounded(run["best"]["sd"], FINE) for run in runs],
        },
    }


def _table(document: Plain) -> Plain:
    rows = _each(document)[0]["table"]
    columns: Plain = {"case": [row["case"] for row in rows], "n": [row["n"] for row in rows]}
    for fitness in FITNESSES:
        for figure in ("mean", "sd"):
            columns[f"{fitness}_{figure}"] = [_rounded(row["fitnesses"][fitness][figure], FINE) for row in rows]
    return {"columns": columns}


def _rounded(value: Any, digits: int = DIGITS) -> Any:  # noqa: ANN401 - a number, a truth value, or None
    if not isinstance(value, float):
        return value
    return None if not np.isfinite(value) else round(value, digits)
