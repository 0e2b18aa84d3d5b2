"""What the book claims: all claims are there, verdicts follow from figures, and the page from what is stored."""

from __future__ import annotations

from itertools import product
from math import log, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from doc_pages import parse

from hil.book import ClaimVerdict, Limit, StoredResults, what_holds
from hil.book.__main__ import main
from hil.book.chapters import CHAPTERS
from hil.book.experiments import EXPERIMENTS, FITNESSES
from hil.book.measurement import Measurement, about, difference_of, mean_of, ratio_of, share_of, student95
from hil.book.places import PAGE, RESULTS
from hil.book.results import save
from pal_advisor.surround import Case

if TYPE_CHECKING:
    from pathlib import Path

CLAIMS = {claim.name: claim for claims in CHAPTERS.values() for claim in claims}

ASKED = {
    "converges, B2 D3 L1": ("converges-b2d3", "surrounds-b2d3", "control-b2d3"),
    "converges, B1 D3 L1": ("converges-b1d3", "surrounds-b1d3", "control-b1d3"),
    "decentralised, D1": ("converges-b1d1", "converges-b2d1"),
    "bears a real table": ("bears-loss", "bears-wall-b2d4", "bears-wall-b1d4", "bears-wall-b1d2"),
    "long range learns nothing (RE, 8.1)": ("long-range-learns-nothing",),
    "smoothing keeps every choice alive (8.3)": ("smoothed-weights", "original-weights", "bound-of-function2"),
    "maximum selection settles faster (8.4)": (
        *(f"maximum-{what}-{case}" for what in ("settles-faster", "arrives-sooner") for case in ("b1d3", "b2d3")),
    ),
    "rules": (
        *(f"rule-{rule}-{case}" for rule in ("ra1", "rb1", "rb2", "rb3", "rb4", "rb5") for case in ("b1d3", "b2d3")),
        *(f"rule-{rule}-b1d4" for rule in ("rd1", "rd2", "rd3")),
    ),
    "short >> long, CONTACT": ("short-range-contact",),
    "SURROUND prefers centralised, FOCUS decentralised, CONTACT decentralised": (
        "surround-centralised",
        "focus-decentralised",
        "contact-decentralised",
    ),
    "CONTACT prefers stationary WILDs": ("contact-stationary-learning", "contact-stationary-seen", "contact-stationary-random"),
    "GA finds a top condition": tuple(f"ga-finds-{fitness}" for fitness in FITNESSES),
}
"""What is asked of the product: one entry for each line of the table of claims."""
NOT_ASKED = {
    "the book's single winners": tuple(f"{fitness}-winner" for fitness in FITNESSES),
    "CHASE centralised": ("chase-centralised",),
    "L1 for CONTACT, and which L for the others": ("contact-l1", "surround-l3", "chase-l4", "focus-l1"),
    "moving WILDs for SURROUND, CHASE and FOCUS": ("surround-moving", "chase-moving", "focus-moving"),
    "more stimuli for learning than for stationary WILDs in D3": ("stimuli-b1d3l1-b2d3l1",),
    "14 stimuli met in B1C1D3": ("fourteen-stimuli",),
    "two dominant behaviours": ("two-dominant-behaviours-b1d1", "two-dominant-behaviours-b1d3l1"),
    "no better than a random search": tuple(f"ga-better-{fitness}" for fitness in FITNESSES),
    "cooperative pushing": ("pushing-b1d3", "pushing-b2d3"),
    "periodic motion": ("periodic-motion",),
    "macro-stable, micro-unstable": ("macro-stable-micro-unstable",),
    "Table 6.1 and STIMULUS25": ("stimuli-of-n-sectors", "stimulus-25"),
}
"""What is reported without being asked."""


@pytest.mark.parametrize(("line", "names"), [*ASKED.items(), *NOT_ASKED.items()])
def test_every_line_of_what_is_to_be_shown_has_its_claims(line: str, names: tuple[str, ...]) -> None:
    assert [name for name in names if name not in CLAIMS] == [], line


def test_what_is_asked_has_a_limit_but_for_what_is_only_reported() -> None:
    without = {name for names in ASKED.values() for name in names if CLAIMS[name].limit is None}
    assert without == {
        "surrounds-b1d3", "bears-wall-b2d4", "bears-wall-b1d4", "bears-wall-b1d2", "contact-stationary-random",
    }  # fmt: skip


def test_claims_and_experiments_belong_together() -> None:
    assert len(CLAIMS) == sum(map(len, CHAPTERS.values()))
    needed = {name for claim in CLAIMS.values() for name in claim.needs}
    assert needed == set(EXPERIMENTS)
    for claim in CLAIMS.values():
        assert bool(claim.asked) == (claim.limit is not None), claim.name
        assert "|" not in claim.says + claim.measured + claim.asked + claim.place, "it stands in a table"


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_commands_exist(name: str) -> None:
    parse(list(EXPERIMENTS[name].arguments))


@pytest.mark.parametrize(
    ("limit", "measurement", "verdict"),
    [
        (Limit(high=0.3), (0.2, 0.1, 0.3), ClaimVerdict.HOLDS),
        (Limit(high=0.3), (0.2, 0.1, 0.31), ClaimVerdict.OPEN),
        (Limit(high=0.3), (0.4, 0.29, 0.5), ClaimVerdict.OPEN),
        (Limit(high=0.3), (0.4, 0.31, 0.5), ClaimVerdict.DOES_NOT),
        (Limit(low=2.0), (2.5, 2.0, 3.0), ClaimVerdict.HOLDS),
        (Limit(low=2.0, otherwise=ClaimVerdict.DIFFERS), (1.0, 0.5, 1.9), ClaimVerdict.DIFFERS),
        (Limit(low=1.0, alone=True), (1.0, 0.9, 1.0), ClaimVerdict.HOLDS),
        (Limit(low=0.95, alone=True), (0.9, 0.7, 1.0), ClaimVerdict.DOES_NOT),
        (Limit(0.03, 0.55), (0.5, 0.037, 0.545), ClaimVerdict.HOLDS),
        (Limit(0.03, 0.55), (0.5, 0.02, 0.545), ClaimVerdict.OPEN),
    ],
)
def test_the_figure_and_its_interval_decide(
    limit: Limit, measurement: tuple[float, float, float], verdict: ClaimVerdict
) -> None:
    assert limit.judge(Measurement(*measurement, count=40)) is verdict


@pytest.mark.parametrize(("freedom", "point"), [(1, 12.706), (7, 2.365), (10, 2.228), (11, 2.201), (15, 2.131), (39, 2.023)])
def test_few_runs_have_wider_intervals(freedom: int, point: float) -> None:
    assert student95(freedom) == pytest.approx(point, abs=6e-4)


def test_estimates_by_hand() -> None:
    mean = mean_of(np.array([1.0, 2.0, 3.0]))
    half = 1.959963984540054 / sqrt(3.0)
    assert (mean.value, mean.low, mean.high, mean.count) == pytest.approx((2.0, 2.0 - half, 2.0 + half, 3))
    difference = difference_of(about(5.0, 0.3, 10), about(2.0, 0.4, 20))
    assert (difference.value, difference.high, difference.count) == pytest.approx((3.0, 3.0 + 1.959963984540054 * 0.5, 10))
    ratio = ratio_of(about(6.0, 0.6, 10), about(2.0, 0.0, 10))
    assert (ratio.value, log(ratio.high) - log(ratio.value)) == pytest.approx((3.0, 1.959963984540054 * 0.1))
    assert str(share_of(np.array([True] * 20))) == "20 of 20 (0.84 to 1.00)"


# --- chapter 9, on a table that is known -----------------------------------------------------------------------------


def conditions() -> list[Case]:
    return [Case.parse(f"B{b}D{d}L{how}S{far}") for b, d, how, far in product((1, 2, 3), (1, 2, 3, 4), (1, 2, 3, 4), (1, 2))]


def known_table(spread: float = 0.01) -> dict[str, Any]:
    """All fitnesses are 1 for short and 0.4 for long range, more for B2, D1 and D2, and a little more for L4 and D1."""
    cases = conditions()
    columns: dict[str, Any] = {"case": [str(case) for case in cases], "n": [10] * len(cases)}
    values = [
        (0.4 if case.long_range else 1.0)
        + 0.1 * (case.wild_motion == 2)
        + 0.2 * (not case.centralised)
        + 0.01 * case.learning
        + 0.001 * (case.distribution == 1)
        for case in cases
    ]
    for fitness in FITNESSES:
        columns[f"{fitness}_mean"], columns[f"{fitness}_sd"] = values, [spread] * len(cases)
    return {"columns": columns}


def searched(fitness: str, search: str, best: list[str]) -> dict[str, Any]:
    columns = {"seed": list(range(1, len(best) + 1)), "best": [str(Case.parse(case)) for case in best]}
    return {"fitness": fitness, "search": search, "columns": columns}


@pytest.fixture
def evolved(tmp_path: Path) -> StoredResults:
    save(tmp_path, EXPERIMENTS["exhaustive"], {}, known_table())
    save(
        tmp_path, EXPERIMENTS["ga-contact"], {}, searched("contact", "ga", ["B2D1L4", "B2D2L4", "B2D1L3"] * 6 + ["B1D3S2"] * 2)
    )
    save(tmp_path, EXPERIMENTS["random-contact"], {}, searched("contact", "random", ["B2D1L4", "B2D2L4"] * 10))
    return StoredResults(tmp_path)


@pytest.mark.parametrize(
    ("name", "value", "verdict"),
    [
        (
            "short-range-contact",
            (1.0 + 0.1 / 3 + 0.1 + 0.025 + 0.00025) / (0.4 + 0.1 / 3 + 0.1 + 0.025 + 0.00025),
            ClaimVerdict.HOLDS,
        ),
        ("contact-decentralised", 0.2005, ClaimVerdict.HOLDS),
        ("surround-centralised", -0.2005, ClaimVerdict.DIFFERS),
        ("contact-stationary-learning", 0.1, ClaimVerdict.HOLDS),
        ("contact-stationary-random", 0.1, ClaimVerdict.REPORTED),
        ("contact-stationary-seen", 0.1, ClaimVerdict.HOLDS),
        ("surround-moving", -0.1, ClaimVerdict.DIFFERS),
        ("contact-l1", -0.03, ClaimVerdict.DIFFERS),
        ("chase-l4", 0.01, ClaimVerdict.HOLDS),
        ("contact-winner", 8, ClaimVerdict.DIFFERS),
        ("ga-finds-contact", 0.9, ClaimVerdict.DOES_NOT),
        ("ga-better-contact", 1.5 - (6 * (1 + 2 + 3) + 2 * 93) / 20, ClaimVerdict.OPEN),  # three others are as bad
        ("ga-finds-focus", None, ClaimVerdict.UNKNOWN),
    ],
)
def test_chapter_9_by_hand(evolved: StoredResults, name: str, value: float | None, verdict: ClaimVerdict) -> None:
    judgement = CLAIMS[name].judge(evolved)
    assert judgement.verdict is verdict, judgement
    found = None if judgement.measurement is None else judgement.measurement.value
    assert found == (None if value is None else pytest.approx(value, abs=1e-6))


def test_ranks_that_chance_allows(tmp_path: Path) -> None:
    best, third = Case.parse("B2D1L4S1"), Case.parse("B2D1L3S1")
    for spread, low, high in ((1e-6, 3, 3), (0.02, 1, 6)):
        save(tmp_path, EXPERIMENTS["exhaustive"], {}, known_table(spread))
        table = StoredResults(tmp_path).table()
        assert table.rank("contact", best) == 1
        ranked = table.measured_rank("contact", third)
        assert (ranked.value, ranked.low, ranked.high) == (3, low, high)


# --- the page --------------------------------------------------------------------------------------------------------


def test_the_page_is_what_the_stored_results_make(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--check"]) == 0, capsys.readouterr().err


def test_a_page_that_is_out_of_date_is_told_and_made_anew(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "page.md"
    words = ["--page", str(page), "--results", str(RESULTS)]
    assert main([*words, "--check"]) == 1
    assert "python -m hil.book" in capsys.readouterr().err
    assert main(words) == 0
    assert page.read_text(encoding="utf-8") == PAGE.read_text(encoding="utf-8")
    page.write_text(page.read_text(encoding="utf-8").replace("holds", "does not"), encoding="utf-8")
    assert main([*words, "--check"]) == 1


def test_without_results_nothing_is_said_of_them(tmp_path: Path) -> None:
    text = what_holds(StoredResults(tmp_path))
    assert text.count("**not measured**") == sum(bool(claim.needs) for claim in CLAIMS.values())
    assert "Not made yet" in text


def test_figures_are_computed(tmp_path: Path) -> None:
    name = "b2d3"
    data = StoredResults(RESULTS).document(name)["result"]
    data["columns"]["distance_50"] = [2.0 * value for value in data["columns"]["distance_0"]]
    save(tmp_path, EXPERIMENTS[name], {}, data)
    judgement = CLAIMS["converges-b2d3"].judge(StoredResults(tmp_path))
    assert judgement.verdict is ClaimVerdict.DOES_NOT
    assert judgement.measurement is not None
    assert judgement.measurement.value == pytest.approx(2.0)


@pytest.mark.parametrize(
    "text", ["", "{", '{"version": 2}', '{"version": 1, "command": "hil", "versions": {}, "result": {}}', "[]"]
)
def test_a_result_that_is_none_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str) -> None:
    (tmp_path / "b2d3.json").write_text(text, encoding="utf-8")
    assert main(["--results", str(tmp_path), "--page", str(tmp_path / "page.md")]) == 1
    assert "b2d3.json" in capsys.readouterr().err
