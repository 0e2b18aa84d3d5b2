"""What a report draws and says of searches among conditions, of results that are known."""

from __future__ import annotations

import math
from itertools import product
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.colors import to_hex
from surround_log import evaluation, write_log

from hil.mcaplog.records import SurroundConditionRecord, SurroundGenerationRecord
from hil.report import write_report
from hil.report.run_data import RunData
from hil.report.style import BLUE, INK, VERMILLION, styled
from hil.report.swarm.search_figures import LEVELS, conditions, evolution
from hil.report.swarm.search_words import conditions_table, search_numbers, search_said, search_title
from hil.report.swarm.searches import condition_of_case, level_means, searches_of
from hil.statistics import Z95
from pal_advisor.surround.search import CONDITIONS, Condition

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GA = {"fitness": "contact", "search": "ga", "steps": "20"}


@pytest.fixture(autouse=True)
def in_style() -> Iterator[None]:
    with styled():
        yield


def data_of(entries: list[Any], **search: str) -> RunData:
    data = RunData(Path("a.mcap"), metadata={"search": {**GA, **search}})
    for entry in entries:
        if isinstance(entry, SurroundGenerationRecord):
            data.search_generations.append(entry)
        elif isinstance(entry, SurroundConditionRecord):
            data.conditions.append(entry)
        else:
            data.evaluations.append(entry)
    return data


def genetic(seed: int = 1, more: float = 0.0) -> list[Any]:
    """Two generations: the elite is B1D1L1S1, then B2D1L1S1, of which the means are known."""
    cases = ("B1D1L1S1", "B2D1L1S1")
    return [
        *(evaluation(number, case, 0.5 + more, search_seed=seed, generation=number + 1) for number, case in enumerate(cases)),
        *(SurroundGenerationRecord(seed, n + 1, 0.8 + n + more, 0.4 + n + more, case, (case,)) for n, case in enumerate(cases)),
        *(SurroundConditionRecord(seed, case, 0.6 + n + more, 0.3, 9) for n, case in enumerate(cases)),
    ]


def exhaustive() -> list[Any]:
    """All 96, twice each: CONTACT is 1 for S1 and 0.5 for S2, and more the greater D is."""
    found = []
    for number, (condition, twice) in enumerate(product(CONDITIONS, (-0.1, 0.1))):
        score = 1.0 / condition.sensor_range + 0.01 * condition.distribution + twice
        found.append(evaluation(number, f"{condition}R25W8", score))
    return found


def heights(axes: Axes) -> list[list[float]]:
    return [np.asarray(line.get_ydata()).tolist() for line in axes.get_lines()]


def first(drawn: Figure | None) -> Axes:
    assert drawn is not None
    return drawn.axes[0]


def test_a_search_is_put_together_from_its_entries() -> None:
    one, two = searches_of(data_of([*genetic(1), *genetic(2, more=1.0)]))
    assert (one.seed, two.seed) == (1, 2)
    assert [(str(found.condition), found.mean) for found in one.means] == [("B2D1L1S1", 1.6), ("B1D1L1S1", 0.6)]
    assert one.means[0].half == pytest.approx(Z95 * 0.1)
    assert two.best is not None
    assert two.best.mean == 2.6
    assert one.book is None
    assert not one.exhaustive


def test_before_a_search_is_over_its_evaluations_speak() -> None:
    scores = {"B2D2L1S1": 0.4, "B2D2L1S1R9": 0.8, "B1": None, "X": 1.0}
    entries = [evaluation(number, case, score) for number, (case, score) in enumerate(scores.items())]
    (search,) = searches_of(data_of(entries))
    (found,) = search.means
    assert (str(found.condition), found.runs) == ("B2D2L1S1", 2)
    assert found.mean == pytest.approx(0.6)
    assert found.half == pytest.approx(Z95 * math.sqrt(0.08) / math.sqrt(2))
    assert search.book == found
    (other,) = searches_of(data_of(entries, fitness="chase"))
    assert {one.mean for one in other.means} == {0.2}


def test_the_condition_of_a_case() -> None:
    assert condition_of_case("L4S2D1B3R9W1") == Condition(3, 1, 4, 2)
    assert condition_of_case("B4") is None


def test_generations_are_drawn_with_what_their_elite_came_to() -> None:
    """Figs. 9.9 to 9.12."""
    one = searches_of(data_of(genetic()))
    assert heights(first(evolution(one))) == [[0.8, 1.8], [0.4, 1.4], [0.6, 1.6]]
    two = searches_of(data_of([*genetic(1), *genetic(2, more=1.0)]))
    lines = heights(first(evolution(two)))
    assert lines[:3] == [[0.8, 1.8], [1.8, 2.8], pytest.approx([1.3, 2.3])]
    assert evolution(searches_of(data_of([evaluation(1, "B1", 0.5)]))) is None


def test_of_a_cut_search_the_elite_was_not_run_again() -> None:
    entries = [entry for entry in genetic() if not isinstance(entry, SurroundConditionRecord)]
    assert heights(first(evolution(searches_of(data_of(entries)))))[2] == pytest.approx([nan, nan], nan_ok=True)


def test_all_conditions_are_drawn_the_best_first_with_their_letters() -> None:
    (search,) = searches_of(data_of(exhaustive(), search="exhaustive"))
    assert search.exhaustive
    drawn = conditions(search)
    assert drawn is not None
    above, below = drawn.axes
    points, book = [one for one in above.collections if isinstance(one, PathCollection)]
    offsets = np.asarray(points.get_offsets())
    assert offsets[:, 0].tolist() == list(range(1, 97))
    assert offsets[:, 1].tolist() == pytest.approx(sorted(offsets[:, 1], reverse=True))
    assert (offsets[0, 1], offsets[-1, 1]) == (pytest.approx(1.04), pytest.approx(0.51))
    (bars,) = [one for one in above.collections if isinstance(one, LineCollection)]
    low, high = np.asarray(bars.get_segments()[0])[:, 1]
    assert (high - low) / 2 == pytest.approx(Z95 * 0.1)
    place = [str(one.condition) for one in search.means].index("B2D2L1S1") + 1
    assert np.asarray(book.get_offsets()).tolist() == [[place, pytest.approx(1.02)]]
    assert to_hex(np.asarray(book.get_facecolor())[0]) == VERMILLION.lower()
    assert f"the book’s: B2D2L1S1, {place} of 96" in [text.get_text() for text in above.texts]
    rows = [np.asarray(one.get_offsets()) for one in below.collections if isinstance(one, PathCollection)]
    assert [len(row) for row in rows] == [32] * 3 + [24] * 8 + [48] * 2
    short = rows[list(LEVELS).index("S1")]
    assert short[:, 0].tolist() == list(range(1, 49)), "short range is better, all of it"
    assert {to_hex(color) for color in np.asarray(points.get_facecolor())[:48]} == {INK}
    assert BLUE.lower() == to_hex(np.asarray(below.collections[0].get_facecolor())[0])
    assert "1.025" in [text.get_text() for text in below.texts]


def test_means_of_letters() -> None:
    (search,) = searches_of(data_of(exhaustive(), search="exhaustive"))
    found = level_means(search.means)
    assert set(found) == set(LEVELS)
    assert [found[level] for level in ("S1", "S2", "D4")] == pytest.approx([1.025, 0.525, 0.79])


def test_words_say_what_is_best_and_where_the_book_stands() -> None:
    data = data_of(exhaustive(), search="exhaustive")
    assert search_title(data) == "Which conditions suit CONTACT best"
    (said,) = search_said(data)
    assert said.startswith("The search through all conditions made 192 evaluations of 20 steps each.")
    assert "The best condition is B1D4L1S1: 1.040 ± 0.196 (mean of 2 runs, with 95 % interval)." in said
    assert "The book’s winner comes to B2D2L1S1: 1.020 ± 0.196, which is place 29 of 96." in said
    assert search_numbers(data) == [("192", "evaluations"), ("1.040", "CONTACT of B1D4L1S1")]
    table = conditions_table(searches_of(data))
    assert [row[1] for row in table.rows] == [*(str(place) for place in range(1, 11)), "29"]
    assert table.rows[-1][2:] == ("B2D2L1S1", "1.020", "± 0.196", "2", "yes")


@pytest.mark.slow
def test_a_report_of_a_search_speaks_of_no_link(tmp_path: Path) -> None:
    report = write_report(write_log(tmp_path / "ga.mcap", genetic(), GA), tmp_path / "report")
    page = report.page.read_text("utf-8")
    assert [path.name for path in report.pictures] == ["evolution.svg"]
    assert "The link" not in page
    report = write_report(write_log(tmp_path / "all.mcap", exhaustive(), {**GA, "search": "exhaustive"}), tmp_path / "all")
    assert [path.name for path in report.pictures] == ["conditions.png"]


@pytest.mark.slow
@pytest.mark.parametrize("value", [nan, math.inf, -1.0, 1e300])
def test_odd_results_never_cost_the_report(tmp_path: Path, value: float) -> None:
    entries = [
        *exhaustive(),
        evaluation(1, "B1D1", value),
        evaluation(-1, "no case", 1.0, seconds=value),
        SurroundGenerationRecord(1, -5, value, value, "no case", ()),
        SurroundConditionRecord(1, "B1D1", value, 0.1, 0),
        SurroundConditionRecord(1, "B1D2", 0.5, value, 3),
        SurroundConditionRecord(7, "B1D2", 0.5, 0.1, -3),
    ]
    log = write_log(tmp_path / "odd.mcap", entries, {"fitness": "beauty", "steps": "many"})
    report = write_report(log, tmp_path / "report")
    assert "can’t be drawn" not in report.page.read_text("utf-8")
