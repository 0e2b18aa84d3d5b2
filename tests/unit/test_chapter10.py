"""Chapter 10: what happened is reduced to what claims ask, claims follow from figures, and the page from what is stored."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from hil.book import ClaimVerdict
from hil.book.chapters.chapter10 import CLAIMS
from hil.book.results import store
from hil.book.sumo.cells import SIDE, stand_in
from hil.book.sumo.figures import mean_curve
from hil.book.sumo.methods import CORNER, LEAST_SEEDS, METHODS, OPPONENTS, SEEDS, SQUARE, Cell
from hil.book.sumo.page import chapter_10
from hil.book.sumo.reduction import Play, best_curve, learning, reduced, settled
from hil.book.sumo.results import COMMAND, NAMES, PAGE, RESULTS, stored
from pal_advisor.maneuvers import PalSettings
from simdevice.sumo.opponents import OPPONENTS as SPECS

if TYPE_CHECKING:
    from pathlib import Path

    from hil.book.claim import Claim

BY_NAME = {claim.name: claim for claim in CLAIMS}
LEFT, BOTH, ANY = 1, 3, 255
HOLD = [30, 30, 30, 0, 0, 150, 150]
HIT = [30, 30, 30, 1, 1, 150, 150]
NOTHING = [30, 0, 0, 0, 0, 0, 0]


def row(seed: int, ram: str = "FF MF SB FF") -> dict[str, Any]:
    """A coaching of 100 maneuvers: 40 with one eye, 60 with both; and a held-out bout of five rams."""
    performed = [[ANY, LEFT, 2.0]] * 20 + [[ANY, BOTH, 6.0]] * 20 + [[LEFT, LEFT, 4.0]] * 20 + [[LEFT, BOTH, 12.0]] * 40
    steps = [
        [ANY, LEFT, 1, 20, 3.0, 2.0], [ANY, BOTH, 1, 40, 8.0, 6.0],
        [LEFT, LEFT, 2, 60, 5.0, 4.0], [LEFT, BOTH, 2, 80, 14.0, 12.0],
    ]  # fmt: skip
    play = [[LEFT, "LSRF S S S", [NOTHING] * 4, 4.0], *([[BOTH, ram, [HOLD, HOLD, NOTHING, HIT], 14.0]] * 5)]
    return {
        "cell": {"method": "book", "opponent": "flat-heavy", "seed": seed, "budget": 100, "bouts": 1},
        "steps": steps, "learning": performed, "seconds": 60.0, "entries": [],
        "wins": 1, "losses": 0, "time": 3.0, "play": [play],
    }  # fmt: skip


def test_curves_are_as_long_as_a_mode_came_up_while_learning() -> None:
    assert len(learning(row(1))) == 80, "the last fifth is the exam"
    assert best_curve(row(1), LEFT) == [3.0, 5.0]
    assert best_curve(row(1), BOTH) == [8.0, 14.0]
    assert best_curve(row(1), 0) == []
    assert mean_curve([[None, 2.0, 4.0], [1.0, 4.0]]).tolist() == [1.0, 3.0]


def test_a_curve_has_settled_where_it_stays_near_its_last_value() -> None:
    assert settled([1.0, 1.0, 1.0, 5.0, 5.0, 5.0, 5.0]) == 4
    assert settled([5.0] * 6) == 1
    assert settled([5.0, 5.0]) is None


def test_a_run_is_reduced_to_columns_and_to_what_its_play_is_called() -> None:
    found = reduced([row(1), row(2, ram="FF FF FF FF")])
    columns = found["columns"]
    assert (columns["seed"], columns["wins"], columns["bouts"]) == ([1, 2], [1, 1], [1, 1])
    assert (columns["length_left"], columns["length_both"], columns["length_none"]) == ([2.0] * 2, [2.0] * 2, [0.0] * 2)
    assert (columns["steps_left"], columns["transitions"]) == ([2] * 2, [1.0] * 2)
    assert (columns["rating_single"], columns["rating_both"], columns["rating_none"]) == ([4.0] * 2, [14.0] * 2, [None] * 2)
    assert found["winners"] == [["both: FF MF SB FF", "left: LSRF S S S"], ["both: FF FF FF FF", "left: LSRF S S S"]]
    assert found["lacking"]["intermittent impact"] == [[], ["forward and backward, and nothing else but stops"]]
    assert found["lacking"]["straight push"][1] == []
    assert Play([]).lacks("straight push") == ("the opponent in sight",)


def test_the_square_stands_where_the_wedge_does_and_no_longer() -> None:
    wedge = SPECS[CORNER]
    with stand_in(SQUARE) as name:
        assert name == CORNER
        corners = np.array(SPECS[CORNER].outline.vertices)
        assert np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1) == pytest.approx(SIDE)
        assert SPECS[CORNER].mass == wedge.mass
    assert SPECS[CORNER] is wedge


def known(tmp_path: Path, name: str, **columns: list[float]) -> None:
    """Store a result of eight seeds, of two kinds by turns."""
    plain = {"wins": [40.0, 42.0], "bouts": [50.0, 50.0], **columns}
    whole = {"seed": list(range(1, SEEDS + 1)), **{column: values * (SEEDS // 2) for column, values in plain.items()}}
    store(tmp_path / f"{name}.json", COMMAND, {}, {"columns": whole, "lacking": {"straight push": [[], ["a"]] * (SEEDS // 2)}})


@pytest.mark.parametrize(
    ("name", "value", "verdict"),
    [
        ("short-flat-light", 0.4, ClaimVerdict.HOLDS),
        ("thirteen-flat-light", 8.0, ClaimVerdict.HOLDS),
        ("settled-flat-light", 14.5, ClaimVerdict.OPEN),
        ("name-flat-light", 0.5, ClaimVerdict.OPEN),
        ("heavy-rates-lower", 1.0, ClaimVerdict.DIFFERS),
        ("point-has-no-curve", None, ClaimVerdict.UNKNOWN),
        ("phases-win-flat-light", 0.02, ClaimVerdict.HOLDS),
    ],
)
def test_claims_by_hand(tmp_path: Path, name: str, value: float | None, verdict: ClaimVerdict) -> None:
    settled = {"settled_left": [10.0, 5.0], "settled_right": [12.0, 17.0]}
    lengths = {"length_left": [6.0, 8.0], "length_right": [10.0, 8.0], "length_both": [20.0, 20.0]}
    known(tmp_path, "book-flat-light", **settled, **lengths, rating_single=[5.0, 5.5])
    known(tmp_path, "book-flat-heavy", rating_single=[6.0, 6.5])
    known(tmp_path, "book-single-flat-light", wins=[38, 42])
    judgement = BY_NAME[name].judge(stored(tmp_path))
    assert judgement.verdict is verdict, judgement
    assert (judgement.measurement and judgement.measurement.value) == (None if value is None else pytest.approx(value))


def test_claims_are_of_results_that_the_command_makes() -> None:
    assert len(BY_NAME) == len(CLAIMS)
    assert {name for claim in CLAIMS for name in claim.needs} == set(NAMES)
    assert [name for claim in CLAIMS for name in missing(claim)] == []
    letters = {claim.says[: claim.says.index(")") + 1] for claim in CLAIMS}
    assert letters >= {f"({letter})" for letter in "abcdef"}


def missing(claim: Claim) -> list[str]:
    """What would spoil a table."""
    return [claim.name for text in (claim.says, claim.measured, claim.asked, claim.place) if "|" in text]


# --- those of the repository -----------------------------------------------------------------------------------------


def test_stored_results_are_of_the_methods() -> None:
    results = stored()
    for path in sorted(RESULTS.glob("*")):
        assert results.has(path.stem), path
        method, opponent = next((m, o) for m in METHODS for o in (*OPPONENTS, SQUARE) if path.stem == f"{m}-{o}")
        runs = results.runs(path.stem)
        coached = PalSettings.of_saved(runs.data["settings"])
        assert coached == Cell(method, opponent, 1).settings, f"{path}: coached otherwise than now"
        assert runs.columns["seed"] == list(range(1, runs.count + 1))
        assert LEAST_SEEDS <= runs.count <= SEEDS
        assert path.stat().st_size < 30_000


def test_the_page_is_what_the_stored_results_make() -> None:
    assert PAGE.read_text(encoding="utf-8") == chapter_10(stored()), f"out of date: {COMMAND} --table"


def test_without_results_nothing_is_said_of_them(tmp_path: Path) -> None:
    assert chapter_10(stored(tmp_path)).count("**not measured**") == len(CLAIMS)
