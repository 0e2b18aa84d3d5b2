"""A search that goes on: what it asks for, what it says, how it is kept, and how its log replays it. No run is played here."""

from __future__ import annotations

import json
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from io import StringIO
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from rich.console import Console

from hil.jobs.stage import Stage
from hil.jobs.swarm.evolve import EvolutionOutputs, EvolveJob
from hil.mcaplog import LogReader
from hil.mcaplog.records import EventRecord
from hil.recording.recorder import Recorder
from hil.replaying.host import replay
from hil.swarm.missions.evolving.checkpoint import (
    EvolutionCheckpoint,
    EvolutionCheckpointError,
    evolution_of,
    load_evolution,
)
from hil.swarm.missions.evolving.evaluation import EvaluationResult, EvaluationTask
from hil.swarm.missions.evolving.evolution import Evolution, evolution_document
from hil.swarm.missions.evolving.words import evolution_summary
from hil.swarm.missions.surround_settings import SurroundSettings
from hil.working import WorkerError
from hil.working.recorded import CUT_SHORT
from pal_advisor.surround.measures import Fitness
from pal_advisor.surround.search import CONDITIONS, SearchName, SearchSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path

    from firmware_protocol.address import Address
    from firmware_protocol.link import Link
    from hil.connecting.connecting import NetworkOpener
    from hil.working.recorded import Recorded

SETTINGS = SurroundSettings(steps=20, case="R6W2")
SEARCH = SearchSettings(generations=3, repeats=2)


def pretend(task: EvaluationTask) -> EvaluationResult:
    """What a run of a seed might come to: stationary WILDs are good, and nobody learns anything with a long range."""
    noise = float(np.random.default_rng(task.seed).normal(0.0, 0.05))
    contact = max(0.0, (task.case.wild_motion == 2) + 0.1 * task.case.learning + noise)
    focus = None if task.case.long_range else contact / 10
    return EvaluationResult(contact, contact / 2, 0.25, focus, 1.0 + noise, None, 30.0 + noise)


class PretendingStage(Stage):
    """No process and no table: results as `pretend` has them, until there are no more.

    Args:
        log: Where the log goes; None for none.
        job: What was asked for, for the log.
        most: So many results come.
        error: What comes then.
    """

    def __init__(self, log: Path | None, job: EvolveJob, most: int = 10_000, error: BaseException | None = None) -> None:
        super().__init__("", Console(file=StringIO()), quiet=False, key=None)
        self._log = log
        self._job = job
        self._left = most
        self._error = error

    def results(
        self,
        function: Callable[..., Any],  # noqa: ARG002 - nothing is played
        tasks: Sequence[Any],
        recorded: Recorded[Any],  # noqa: ARG002 - nor read
        before: int,  # noqa: ARG002
    ) -> Iterator[Any]:
        for task in tasks:
            if not self._left:
                assert self._error is not None
                raise self._error
            self._left -= 1
            yield pretend(task)

    def begin_log(self) -> Recorder | None:
        if self._log is None:
            return None
        config = {"verb": self._job.VERB, "link": "", "seed": "1", "options": json.dumps(self._job.options())}
        recorder = Recorder(self._log, run={}, config=config, link="", lockstep=True)
        for name, data in self._job.files().items():
            recorder.attachment(f"begun-with/{name}", data)
        return recorder

    def connected(self) -> None:
        pass

    def interrupts(self) -> AbstractContextManager[None]:
        return nullcontext()

    @contextmanager
    def keys(self) -> Iterator[None]:
        yield None

    def lines(self, address: Address) -> AbstractContextManager[Link | None]:
        raise NotImplementedError

    def opener_of(self, address: Address) -> NetworkOpener:
        raise NotImplementedError

    def describe(self, **values: Any) -> None:  # noqa: ANN401
        raise NotImplementedError


def told_all(evolution: Evolution, most: int = 10_000) -> Evolution:
    """A search told of as many results as are given."""
    while not evolution.finished and len(evolution.done) < most:
        evolution.tell(pretend(evolution.task_of(evolution.wanted[0])))
    return evolution


def test_an_evaluation_is_a_run_with_the_robots_of_the_case() -> None:
    evolution = Evolution(SETTINGS, SEARCH, 1)
    task = evolution.task_of(evolution.wanted[0])
    assert (task.case.rangers, task.case.wilds, task.case.increment) == (6, 2, 1)
    assert str(task.case).startswith(f"B{evolution.wanted[0].condition.motion}")
    assert len(evolution.wanted) == 7


def test_results_are_told_one_by_one_and_a_full_generation_is_handed_back() -> None:
    evolution = Evolution(SETTINGS, SEARCH, 1)
    over = [evolution.tell(pretend(evolution.task_of(evolution.wanted[0]))) for _ in range(8)]
    assert [each is not None for each in over] == [False] * 6 + [True, False]
    generation = over[6]
    assert generation is not None
    assert generation.number == 1
    assert generation.best == max(each.result.score(Fitness.CONTACT) for each in evolution.done[:7])
    assert [each.generation for each in evolution.done] == [1] * 7 + [2]
    assert evolution.expected == 21 + 2


def test_what_is_said_of_a_search_that_is_over() -> None:
    evolution = told_all(Evolution(SETTINGS, SEARCH, 1))
    facts = evolution.facts()
    assert facts["finished"]
    assert facts["best"]["case"].startswith("B2")
    assert facts["best"]["n"] == 2
    assert facts["book"]["case"] == "B2C1D2L1R6S1W2"
    assert [len(each["cases"]) for each in facts["generations"]] == [7, 7, 7]
    assert all(each["elite_mean"] is not None for each in facts["generations"])
    words = "\n".join(evolution_summary([evolution]))
    assert f"CONTACT: the best condition found is {facts['best']['case']}: " in words
    assert f"hil swarm surround --case {facts['best']['case']} --steps 20 --seed " in words
    assert evolution_document([evolution, evolution]) == {"runs": [facts, facts]}


def test_a_search_that_was_cut_says_what_is_known() -> None:
    assert Evolution(SETTINGS, SEARCH, 1).facts()["best"] is None
    evolution = told_all(Evolution(SETTINGS, SEARCH, 1), most=9)
    facts = evolution.facts()
    assert not facts["finished"]
    best = max(evolution.means_of(Fitness.CONTACT).values(), key=lambda found: found.mean)
    assert facts["best"]["mean"] == round(best.mean, 6)
    assert len(facts["generations"]) == 1


def test_an_exhaustive_search_has_a_table_of_all_four_fitnesses_with_ranks() -> None:
    search = SearchSettings(fitness=Fitness.FOCUS, search=SearchName.EXHAUSTIVE, repeats=2)
    evolution = told_all(Evolution(SETTINGS, search, 3))
    table = evolution.facts()["table"]
    assert len(table) == len(CONDITIONS)
    assert sorted(row["rank"] for row in table) == list(range(1, 97))
    first = next(row for row in table if row["rank"] == 1)
    assert first["fitnesses"]["focus"]["mean"] == first["mean"] == evolution.facts()["best"]["mean"]
    assert evolution.facts()["book"]["rank"] == evolution.ranks[evolution.book.condition] if evolution.book else False
    long = next(row for row in table if "S2" in row["case"])
    assert long["fitnesses"]["focus"]["mean"] == 0.0
    assert long["fitnesses"]["contact"]["mean"] > 0.0


@pytest.mark.parametrize("most", [0, 1, 7, 12, 21, 22, 24])
def test_a_checkpoint_is_all_that_was_told_and_the_search_goes_on_from_it(most: int, tmp_path: Path) -> None:
    whole = told_all(Evolution(SETTINGS, SEARCH, 1))
    cut = told_all(Evolution(SETTINGS, SEARCH, 1), most=most)
    (tmp_path / "checkpoint.json").write_bytes(EvolutionCheckpoint(SETTINGS, SEARCH, 1, 1, (cut,)).to_bytes())
    saved = load_evolution(tmp_path / "checkpoint.json")
    assert (saved.settings, saved.search, saved.seed, saved.seeds) == (SETTINGS, SEARCH, 1, 1)
    assert saved.evaluations == min(most, len(whole.done))
    assert saved.finished == cut.finished
    assert told_all(saved.begun[0]).facts() == whole.facts()


def damaged(change: Callable[[dict[str, Any]], object]) -> bytes:
    data = json.loads(EvolutionCheckpoint(SETTINGS, SEARCH, 1, 1, (told_all(Evolution(SETTINGS, SEARCH, 1), 9),)).to_bytes())
    change(data)
    return json.dumps(data).encode()


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda data: data.update(version=9), "no checkpoint of a search among conditions of version 1"),
        (lambda data: data.update(mission="surround"), "is the checkpoint of runs, not of a search: go on without --evolve"),
        (lambda data: data.update(extra=1), "extra: no field has this name"),
        (lambda data: data["search"].update(fitness="speed"), "fitness: expected one of contact, surround, chase, focus"),
        (lambda data: data["search"].update(population=1), "population: expected a whole number, 2 to 10000, not 1"),
        (lambda data: data["evaluated"][0][3].__setitem__(2, -1.0), "contact: expected a number, not negative"),
        (lambda data: data["evaluated"][0][3].pop(), "expected a list of 9"),
        (lambda data: data["evaluated"][0][3].__setitem__(1, 5), "made by another version of the program"),
        (lambda data: data["evaluated"].append([]), "there are more searches than were to be made"),
    ],
)
def test_a_checkpoint_that_is_damaged_is_refused_with_the_place(change: Callable[[dict[str, Any]], object], named: str) -> None:
    with pytest.raises(EvolutionCheckpointError, match=named):
        evolution_of(damaged(change))


def performed(job: EvolveJob, log: Path, **stage: Any) -> list[Evolution]:  # noqa: ANN401
    return job.perform(PretendingStage(log, job, **stage))


def test_a_log_replays_the_search_though_nothing_is_played(tmp_path: Path) -> None:
    job = EvolveJob(SETTINGS, SEARCH, seed=1, seeds=2)
    log = tmp_path / "log.mcap"
    searches = performed(job, log)
    assert [search.seed for search in searches] == [1, 2]
    report = replay(log, strict=True)
    assert report.same, report
    assert report.compared > sum(len(search.done) for search in searches)
    topics = [entry.topic for entry in LogReader(log).entries()]
    assert topics.count("/surround/evaluation") == sum(len(search.done) for search in searches)
    assert topics.count("/surround/generation") == 6
    assert topics.count("/surround/condition") == sum(len(search.means) for search in searches)


def test_a_log_with_another_decision_is_not_the_same(tmp_path: Path) -> None:
    job = EvolveJob(SETTINGS, SEARCH)
    replace(job, seed=2).perform(PretendingStage(tmp_path / "other.mcap", job))  # the log says that seed 1 was asked for
    report = replay(tmp_path / "other.mcap")
    assert report.difference is not None
    assert report.difference.topic == "/surround/evaluation"
    assert "NOT THE SAME" in str(report)


def test_the_first_evaluations_of_a_resumed_run_are_told_again_and_the_rest_goes_on(tmp_path: Path) -> None:
    saved: list[bytes] = []
    job = EvolveJob(SETTINGS, SEARCH, seeds=2, outputs=EvolutionOutputs(checkpoint=saved.append))
    whole = performed(job, tmp_path / "whole.mcap")
    with pytest.raises(KeyboardInterrupt):
        performed(job, tmp_path / "cut.mcap", most=33, error=KeyboardInterrupt())
    assert evolution_of(saved[-1]).evaluations == 33
    report = replay(tmp_path / "cut.mcap", strict=True)
    assert report.same, report
    assert report.ended == "interrupted"
    resumed = replace(job, saved=saved[-1])
    again = performed(resumed, tmp_path / "resumed.mcap")
    assert evolution_document(again) == evolution_document(whole)
    assert replay(tmp_path / "resumed.mcap", strict=True).same
    whole_told, again_told = (
        [vars(entry.value) for entry in LogReader(tmp_path / name).entries(["/surround/evaluation"])]
        for name in ("whole.mcap", "resumed.mcap")
    )
    assert whole_told == again_told


def test_workers_that_fail_end_it_with_what_is_known(tmp_path: Path) -> None:
    told: list[str] = []
    job = EvolveJob(SETTINGS, SEARCH, outputs=EvolutionOutputs(failed=told.append))
    log = tmp_path / "log.mcap"
    (search,) = performed(job, log, most=10, error=WorkerError("all of them have died", 1))
    assert told == ["all of them have died"]
    assert len(search.done) == 10
    assert not search.finished
    assert search.best is not None
    events = [entry.value for entry in LogReader(log).entries(["/events"])]
    assert [event.kind for event in events if isinstance(event, EventRecord)] == [CUT_SHORT]
    assert replay(log, strict=True).same


def test_workers_that_never_did_anything_are_an_error(tmp_path: Path) -> None:
    job = EvolveJob(SETTINGS, SEARCH)
    with pytest.raises(WorkerError, match="there is no scheduler"):
        performed(job, tmp_path / "log.mcap", most=0, error=WorkerError("there is no scheduler", 3))


def test_a_log_that_is_cut_off_is_replayed_to_its_end(tmp_path: Path) -> None:
    job = EvolveJob(SETTINGS, SEARCH)
    log = tmp_path / "log.mcap"
    performed(job, log)
    data = log.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    report = replay(tmp_path / "cut.mcap")
    assert report.same, report
    assert report.cut_off
