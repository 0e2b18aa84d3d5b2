"""Coaching over the whole stack in lock-step: it is repeatable, can be cut and resumed, and survives a bad line."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

import hil
from hil.sumo.coaching import CheckpointError, Coaching, check_objective, load_checkpoint, new_pal
from hil.sumo.ring import RingError, open_ring
from pal_advisor.maneuvers import Objective, PalSettings

if TYPE_CHECKING:
    from pathlib import Path

    from hil.sumo.bouts import Bout
    from hil.sumo.ring import Encounter
    from pal_advisor.maneuvers import Credit, GenerationRecord, Performance, Trial

URL = "sim://junior?opponent=flat-light&seed=3"
SETTINGS = PalSettings(budget=120, population=6, elite=1, exam_share=0.2)


class Cut(Exception):  # noqa: N818 - what a lost link or a Ctrl-C is to the run
    """Ends a run in the middle."""


class CutAfter:
    """An observer that ends the run after so many maneuvers."""

    def __init__(self, maneuvers: int) -> None:
        self.left = maneuvers

    def decision(self, trial: Trial) -> None:
        pass

    def credit(self, credit: Credit) -> None:
        pass

    def checkpoint(self, used: int, digest: str) -> None:
        pass

    def trial(
        self,
        trial: Trial,  # noqa: ARG002
        encounter: Encounter,  # noqa: ARG002
        performance: Performance,  # noqa: ARG002
        fitness: float,  # noqa: ARG002
    ) -> None:
        self.left -= 1
        if self.left == 0:
            raise Cut

    def generation(self, record: GenerationRecord) -> None:
        pass

    def interrupted(self, bout: int, error: str) -> None:
        pass

    def bout(self, bout: Bout) -> None:
        pass


def coach(url: str, checkpoint: Path | None = None, *, cut_after: int = 0, idle: float = 0.0) -> dict[str, object]:
    """Coach to the end, or to the cut, and give Pal's state."""
    with hil.connect(url) as junior:
        junior.wait(idle)
        junior.arm()
        observers = (CutAfter(cut_after),) if cut_after else ()
        run = Coaching(open_ring(junior), new_pal(SETTINGS, 3), seed=3, checkpoint=checkpoint, observers=observers)
        run.run()
        return run.pal.state_dict()


def resume(url: str, checkpoint: Path) -> dict[str, object]:
    saved = load_checkpoint(checkpoint)
    with hil.connect(url) as junior:
        junior.arm()
        run = Coaching(open_ring(junior), saved.pal, seed=saved.seed, checkpoint=checkpoint, progress=saved.progress)
        run.run()
        return run.pal.state_dict()


@pytest.fixture(scope="module")
def whole() -> dict[str, object]:
    """A run that was not cut."""
    return coach(URL)


@pytest.mark.slow
def test_the_same_seed_learns_the_same_whatever_happened_before(whole: dict[str, object]) -> None:
    assert coach(URL, idle=0.333) == whole


@pytest.mark.slow
@pytest.mark.parametrize("maneuvers", [1, 37, 90])
def test_a_run_cut_and_resumed_equals_the_run_not_cut(whole: dict[str, object], tmp_path: Path, maneuvers: int) -> None:
    checkpoint = tmp_path / "run.json"
    with pytest.raises(Cut):
        coach(URL, checkpoint, cut_after=maneuvers)
    assert load_checkpoint(checkpoint).pal.used <= maneuvers
    assert resume(URL, checkpoint) == whole


def test_a_bad_line_costs_time_and_nothing_else() -> None:
    with hil.connect(f"{URL}&faults=drop:0.05,corrupt:0.01,jitter:0.02") as junior:
        junior.arm()
        run = Coaching(open_ring(junior), new_pal(SETTINGS, 3), seed=3)
        run.run()
        assert run.pal.used == SETTINGS.budget
        assert junior.peer.counters.retries > 0
        performed = junior.status().maneuvers
    assert performed == SETTINGS.budget  # from the robot's own counter: none twice, none left out


def test_an_objective_that_nobody_can_judge_is_refused() -> None:
    with hil.connect(f"{URL}&referee=0") as junior:
        assert junior.referee is None
        ring = open_ring(junior, "flat-light")
        with pytest.raises(RingError, match="referee"):
            check_objective(Objective.OUTCOME, ring)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"version": 1}', json.dumps({"version": 1, "pal": {}, "bouts": "x"})])
def test_a_damaged_checkpoint_is_named(tmp_path: Path, text: str) -> None:
    path = tmp_path / "run.json"
    path.write_text(text)
    with pytest.raises(CheckpointError, match=r"run\.json"):
        load_checkpoint(path)
