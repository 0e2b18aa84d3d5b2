"""Chapter 10 of the book: coach what is missing, draw its figures, and print the verdict on each of its claims.

A cell is a coaching run on an emulated robot, and held-out bouts by its advice. What happened in each is kept in a file, a
line for each cell, so that the command may be broken off and given anew; any number of workers makes the same. Of these lines
the results in docs/results/sumo are made, and of the results the figures and docs/chapter-10.md.

    python benchmarks/chapter10.py [--cells chapter10.jsonl] [--workers 2] [--methods book,...] [--table]
"""

from __future__ import annotations

import argparse
import sys
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import kept_lines

from hil.book.chapters.chapter10 import CLAIMS
from hil.book.results import store
from hil.book.sumo.cells import made, shown
from hil.book.sumo.figures import complexity, curves, maneuvers
from hil.book.sumo.methods import LEAST_SEEDS, METHODS, OPPONENTS, SEEDS, SQUARE, Cell
from hil.book.sumo.page import chapter_10
from hil.book.sumo.reduction import reduced
from hil.book.sumo.results import COMMAND, FIGURES, PAGE, RESULTS, stored
from hil.files.outputs import replace_file
from hil.report.style import png, styled
from hil.versions import versions
from hil.working import open_crew

if TYPE_CHECKING:
    from collections.abc import Sequence

Plain = dict[str, Any]


def kept(path: Path) -> dict[Cell, Plain]:
    """What was made before; a last line that was cut short counts as not made.

    Args:
        path: The file.
    """
    return {Cell(**row["cell"]): row for row in kept_lines.kept(path)}


def make(cells: Sequence[Cell], path: Path, workers: int) -> dict[Cell, Plain]:
    """Make what is not there; Ctrl-C ends it with what there is by then.

    Args:
        cells: What is wanted.
        path: The file.
        workers: Processes.
    """
    rows = kept(path)
    missing = [cell for cell in cells if cell not in rows]
    try:
        with open_crew(workers) as crew:
            for cell, row in kept_lines.make(crew, made, missing, path, lambda _, row: row):
                rows[cell] = row
    except KeyboardInterrupt:
        sys.stderr.write("broken off: what there is by now is told; give the command again for the rest\n")
    return rows


def keep(rows: dict[Cell, Plain], results: Path) -> None:
    """Reduce what happened to the results, each method and opponent of which there are seeds enough.

    Args:
        rows: What happened.
        results: The folder.
    """
    groups: dict[tuple[str, str], list[Plain]] = {}
    for cell, row in sorted(rows.items(), key=lambda each: each[0].seed):
        if cell == Cell(cell.method, cell.opponent, cell.seed) and cell.seed in range(1, SEEDS + 1):
            groups.setdefault((cell.method, cell.opponent), []).append(row)
    for (method, opponent), found in groups.items():
        group = [row for seed, row in enumerate(found, start=1) if row["cell"]["seed"] == seed]
        if len(group) < LEAST_SEEDS:
            continue
        result = reduced(group)
        if method == "book":
            result["bout"] = shown(sorted(group, key=lambda row: row["wins"])[len(group) // 2])
        else:
            del result["curves"]
        store(results / f"{method}-{opponent}.json", COMMAND, versions(), result)


def main() -> int:
    """Make, draw and tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--cells", type=Path, default=Path("chapter10.jsonl"), help="where what happened is kept")
    parser.add_argument("--results", type=Path, default=RESULTS, help="where results are stored")
    parser.add_argument("--page", type=Path, default=PAGE)
    parser.add_argument("--figures", type=Path, default=FIGURES)
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--table", action="store_true", help="make nothing: draw and tell what the results have")
    options = parser.parse_args()
    if not options.table:
        cells = [
            Cell(method, opponent, seed)
            for method, seed, opponent in product(options.methods.split(","), range(1, SEEDS + 1), (*OPPONENTS, SQUARE))
            if opponent != SQUARE or method == "book"
        ]
        keep(make(cells, options.cells, options.workers), options.results)
    results = stored(options.results)
    with styled():
        for name, drawn in (("complexity", complexity()), ("maneuvers", maneuvers(results)), ("curves", curves(results))):
            replace_file(options.figures / f"chapter10-{name}.png", png(drawn))
    replace_file(options.page, chapter_10(results).encode())
    for judgement in (claim.judge(results) for claim in CLAIMS):
        claim = judgement.claim
        found = "" if judgement.measurement is None else f": {judgement.measurement}"
        asked = f" (asked: {claim.asked})" if claim.asked else ""
        sys.stdout.write(f"{judgement.verdict.value:12} {claim.says} {claim.measured}{found}{asked}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
