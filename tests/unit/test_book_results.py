"""Stored results: documents are reduced to what claims need, and made only where they are not there."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from hil.book import run
from hil.book.experiments import EXPERIMENTS, FITNESSES, Experiment, ResultKind
from hil.book.places import RESULTS
from hil.book.reduction import reduced
from hil.book.results import ResultMissingError, StoredResults, save, stored_text

if TYPE_CHECKING:
    from pathlib import Path

UNIFORM = [0.125] * 8
LEARNT = [0.0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.4]


def stimulus(number: int, met: int, weights: list[float], behaviour: str) -> dict[str, Any]:
    return {"number": number, "pattern": "", "met": met, "weights": weights, "behaviour": behaviour, "book": None}


def one_run(seed: int, measures: dict[str, Any] | None = None) -> dict[str, Any]:
    """51 distances, from 4 down to 1 at step 30, and then so."""
    distance = [max(1.0, 4.0 - 0.1 * step) for step in range(51)]
    stimuli = [stimulus(1, 9, UNIFORM, "B1 x B2"), stimulus(2, 5, LEARNT, "B8"), stimulus(3, 0, LEARNT, "B8")]
    return {
        "case": "B2C1D3L1R25S1W8", "seed": seed, "distance": distance, "share_surrounded": [0.0] * 50 + [1.0],
        "outside": [0.25] * 51, "stimuli": stimuli, "wild_stimuli": [], "missing": [],
        **({} if measures is None else {"measures": measures}),
    }  # fmt: skip


def test_runs_are_reduced_to_columns() -> None:
    found = reduced(ResultKind.RUNS, {"runs": [one_run(1), one_run(2)], "mean": {}})
    columns = found["columns"]
    assert columns["seed"] == [1, 2]
    assert (columns["distance_0"], columns["distance_20"], columns["distance_50"]) == ([4.0] * 2, [2.0] * 2, [1.0] * 2)
    assert (columns["share_50"], columns["outside_50"]) == ([1.0] * 2, [0.25] * 2)
    assert columns["settle_step"] == columns["reached"] == [27, 27]  # within 0.3 of the last value
    assert (columns["stimuli_met"], columns["learnt"], columns["zeros"]) == ([2] * 2, [2] * 2, [2] * 2)
    assert (columns["least"], columns["greatest"], columns["dominance"]) == ([0.0] * 2, [0.4] * 2, [0.5] * 2)
    assert columns["uniform"] == [0] * 2
    assert "pushed" not in columns, "nobody has measured it"
    assert found["rules"]["ranger"] == {"2": {"learnt": 2, "weights": LEARNT, "B8": 2}}
    assert len(found["distance"]) == 51


def test_what_is_measured_of_whole_histories_is_kept() -> None:
    measures = {
        "pushed": 3, "periodic": {"ranger": 0.04, "wild": 0.0}, "macro_stable": [30, 31],
        "weights": {"ranger": [0.01, 0.6], "wild": None}, "uniform": {"ranger": False, "wild": True},
    }  # fmt: skip
    columns = reduced(ResultKind.RUNS, one_run(7, measures=measures))["columns"]
    assert columns["seed"] == [7]
    assert (columns["pushed"], columns["periodic"], columns["macro_stable"]) == ([3], [0.04], [2])
    assert (columns["least"], columns["greatest"], columns["uniform"]) == ([0.01], [0.6], [0])


def test_a_short_run_has_no_step_50(tmp_path: Path) -> None:
    short = {**one_run(1), "distance": [2.0, 1.0], "share_surrounded": [0.0, 1.0], "outside": [0.0, 0.0]}
    save(tmp_path, EXPERIMENTS["b2d3"], {}, reduced(ResultKind.RUNS, short))
    runs = StoredResults(tmp_path).runs("b2d3")
    assert runs.column("distance_last").tolist() == [1.0]
    with pytest.raises(ResultMissingError, match="distance_50"):
        runs.column("distance_50")


def searched(seed: int) -> dict[str, Any]:
    best = {"case": "B2C1D1L4R25S1W8", "mean": 0.9, "sd": 0.1, "n": 10}
    generations = [{"best": 0.5, "mean": 0.3, "cases": []}]
    return {"fitness": "contact", "search": "ga", "seed": seed, "evaluations": 280, "best": best, "generations": generations}


def test_searches_are_reduced_to_what_they_ended_with() -> None:
    found = reduced(ResultKind.SEARCH, {"runs": [searched(1), searched(2)]})
    assert (found["fitness"], found["search"]) == ("contact", "ga")
    assert found["columns"] == {
        "seed": [1, 2], "evaluations": [280] * 2, "best": ["B2C1D1L4R25S1W8"] * 2, "mean": [0.9] * 2, "sd": [0.1] * 2,
    }  # fmt: skip


def test_the_table_of_conditions_keeps_all_four_fitnesses(tmp_path: Path) -> None:
    fitnesses = {fitness: {"mean": 0.1 * index, "sd": 0.02} for index, fitness in enumerate(FITNESSES)}
    row = {"case": "B1C1D1L1R25S1W8", "mean": 0.0, "sd": 0.02, "n": 4, "fitnesses": fitnesses}
    save(tmp_path, EXPERIMENTS["exhaustive"], {}, reduced(ResultKind.TABLE, {"search": "exhaustive", "table": [row]}))
    table = StoredResults(tmp_path).table()
    assert [table.means(fitness).tolist() for fitness in FITNESSES] == [[0.0], [0.1], [0.2], [pytest.approx(0.3)]]
    assert table.errors("focus").tolist() == [pytest.approx(0.01)]


def test_lists_stand_in_one_line() -> None:
    document = {"version": 1, "result": {"columns": {"seed": [1, 2]}, "distance": [0.5, 1.0]}}
    text = stored_text(document)
    assert json.loads(text) == document
    assert '"seed": [1, 2]' in text.splitlines()[4]


# --- making them -----------------------------------------------------------------------------------------------------


class Played:
    """Takes down which experiments are made; all print the same."""

    def __init__(self, text: str) -> None:
        self.names: list[str] = []
        self._text = text

    def __call__(self, experiment: Experiment) -> str:
        self.names.append(experiment.name)
        return self._text


@pytest.fixture
def two(monkeypatch: pytest.MonkeyPatch) -> Played:
    """There are two experiments; they print a run."""
    monkeypatch.setattr(run, "EXPERIMENTS", {name: EXPERIMENTS[name] for name in ("b2d3", "b1d3")})
    return Played(json.dumps(one_run(1)))


def test_what_is_there_is_not_made_again(tmp_path: Path, two: Played, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--results", str(tmp_path)]
    assert run.main([*words, "b1d3"], play=two) == 0
    assert run.main(words, play=two) == 0
    assert two.names == ["b1d3", "b2d3"]
    assert run.main(words, play=two) == 0
    assert run.main([*words, "b2d3"], play=two) == 0
    assert two.names == ["b1d3", "b2d3", "b2d3"]
    assert run.main([*words, "--list"], play=two) == 0
    assert two.names == ["b1d3", "b2d3", "b2d3"]
    assert "b1d3: made" in capsys.readouterr().out


def test_what_another_command_has_made_is_made_again(tmp_path: Path, two: Played) -> None:
    save(
        tmp_path,
        Experiment("b2d3", ResultKind.RUNS, ("swarm", "surround", "--steps", "3")),
        {},
        reduced(ResultKind.RUNS, one_run(1)),
    )
    assert not StoredResults(tmp_path).has("b2d3")
    assert run.main(["--results", str(tmp_path)], play=two) == 0
    assert two.names == ["b2d3", "b1d3"]


def test_a_name_that_nobody_knows_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        run.main(["b9d9"])
    assert "no experiment b9d9" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"runs": []}', '{"runs": [{"seed": 1}]}'])
def test_a_document_that_lacks_what_claims_need_is_not_stored(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    assert run.main(["--results", str(tmp_path), "b2d3", "ga-contact", "exhaustive"], play=Played(text)) == 1
    told = capsys.readouterr().err
    assert all(name in told for name in ("b2d3", "ga-contact", "exhaustive"))
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_command_that_fails_is_told_with_its_last_words() -> None:
    with pytest.raises(run.ExperimentError, match=r"b2d3: hil swarm surround .* exit status 2:\n(.|\n)*B9"):
        run.printed(Experiment("b2d3", ResultKind.RUNS, ("swarm", "surround", "--case", "B9")))


@pytest.mark.slow
def test_a_command_is_run_where_it_leaves_nothing(tmp_path: Path) -> None:
    words = ("swarm", "surround", "--case", "B2R3W1", "--steps", "2", "--seeds", "2", "--no-log", "--no-report", "--json")
    experiment = Experiment("b2d3", ResultKind.RUNS, words)
    run.make(experiment, tmp_path, play=run.printed)
    document = json.loads((tmp_path / "b2d3.json").read_text(encoding="utf-8"))
    assert document["command"] == experiment.command
    assert document["result"]["columns"]["seed"] == [1, 2]
    assert [path.name for path in tmp_path.iterdir()] == ["b2d3.json"]


# --- those of the repository -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted(RESULTS.glob("*")), ids=lambda path: path.name)
def test_stored_results_are_of_the_experiments(path: Path) -> None:
    results = StoredResults(RESULTS)
    assert path.stem in EXPERIMENTS
    assert results.has(path.stem), f"its command has changed: python -m hil.book.run {path.stem}"
    assert path.stat().st_size < 20_000
    if EXPERIMENTS[path.stem].kind is ResultKind.RUNS:
        runs = results.runs(path.stem)
        assert runs.columns["seed"] == list(range(1, 41))
        assert np.isfinite(runs.column("distance_last")).all()


def test_the_program_is_there() -> None:
    done = subprocess.run([sys.executable, "-m", "hil.book.run", "--list"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == len(EXPERIMENTS)
