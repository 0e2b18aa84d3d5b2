"""What a report draws of the surround task: the numbers that are drawn, of runs whose numbers are known."""

from __future__ import annotations

import json
import math
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import to_rgba
from matplotlib.patches import Rectangle, StepPatch, Wedge
from surround_log import state, tables, write_log

from firmware_protocol.vocabulary import RobotClass
from hil.report import write_report
from hil.report.run_data import RunData
from hil.report.style import AMBER, BLUE, INK, VERMILLION, styled
from hil.report.swarm.distance_figures import distances
from hil.report.swarm.experience_figures import behaviours, stimuli, stimulus_curves
from hil.report.swarm.place_figures import snapshots, trajectories
from hil.report.swarm.rule_figures import drawn_rules, rings
from hil.report.swarm.runs import StepsError, SurroundRun, across, see_steps, surround_runs
from hil.report.swarm.words import measures_table, surround_said
from hil.statistics import Z95
from pal_advisor.surround import Tables
from pal_advisor.surround.measures import RunTracker, measures_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    from hil.mcaplog.records import SurroundStateRecord

UNIFORM = (0.25,) * 4


@pytest.fixture(autouse=True)
def in_style() -> Iterator[None]:
    with styled():
        yield


def run_of(states: Sequence[SurroundStateRecord], seed: int = 1) -> SurroundRun:
    return SurroundRun(seed, tuple(states))


def panels(drawn: Figure | None) -> list[Axes]:
    assert drawn is not None
    return [axes for axes in drawn.axes if axes.get_visible()]


def steps_of(patch: StepPatch) -> list[float]:
    values: list[float] = np.asarray(patch.get_data()[0]).tolist()
    return values


def outline(axes: Axes) -> list[float]:
    """What the line of a histogram shows."""
    (found,) = [patch for patch in axes.patches if isinstance(patch, StepPatch) and patch.get_linewidth()]
    return steps_of(found)


def heights(line: Line2D) -> list[float]:
    values: list[float] = np.asarray(line.get_ydata()).tolist()
    return values


def discs(axes: Axes, color: str) -> list[list[float]]:
    """Where robots of a colour are drawn."""
    found = [one for one in axes.collections if isinstance(one, EllipseCollection)]
    colored = [one for one in found if same_color(np.asarray(one.get_facecolor())[0], color)]
    return [place for one in colored for place in np.asarray(one.get_offsets()).tolist()]


def same_color(found: object, color: str) -> bool:
    return bool(np.allclose(to_rgba(found), to_rgba(color), atol=1e-2))  # type: ignore[arg-type]


def wedges(axes: Axes) -> list[Wedge]:
    return [patch for patch in axes.patches if isinstance(patch, Wedge)]


# --- runs --------------------------------------------------------------------------------------------------------------


def test_a_log_is_parted_into_runs_and_steps_are_chosen() -> None:
    data = RunData(Path("a.mcap"))
    data.surround = [
        *(state(step) for step in range(4)),
        *(state(step, seed=2) for step in range(3)),
        state(-1),
        state(1 << 40),
    ]
    assert [(run.seed, run.steps) for run in surround_runs(data)] == [(1, [0, 1, 2, 3]), (2, [0, 1, 2])]
    data.steps = (2, None)
    assert [(run.seed, run.steps, len(run.before)) for run in surround_runs(data)] == [(1, [2, 3], 2), (2, [2], 2)]
    data.steps = (3, 3)
    assert [run.seed for run in surround_runs(data)] == [1]
    see_steps(data)
    data.steps = (4, 9)
    with pytest.raises(StepsError, match=r"a\.mcap has steps 0 to 3, and none of those that were chosen"):
        see_steps(data)
    data.surround = []
    with pytest.raises(StepsError, match="has no run of the surround task"):
        see_steps(data)


def test_what_was_known_before_the_chosen_steps_is_known() -> None:
    told = {step: tables({1: (step + 1, (0.4, 0.2, 0.2, 0.2))}) for step in (0, 2, 4)}
    run = run_of([state(step, tables=told.get(step, "")) for step in range(6)])
    assert [step for step, _ in run.learnt] == [0, 2, 4]
    cut = run.between(3, 5)
    assert cut is not None
    assert [step for step, _ in cut.learnt] == [2, 4]
    early = run.between(3, 3)
    assert early is not None
    assert early.tables == told[2]


def test_of_a_long_run_some_tables_are_read() -> None:
    text = tables({1: (1, UNIFORM)})
    steps = [step for step, _ in run_of([state(step, tables=text) for step in range(500)]).learnt]
    assert (len(steps), steps[0], steps[-1]) == (60, 0, 499)


def test_mean_and_interval_go_as_far_as_all_runs_do() -> None:
    mean, half = across([[1.0, 2.0, 9.0], [3.0, 2.0]])
    assert mean.tolist() == [2.0, 2.0]
    assert half.tolist() == pytest.approx([Z95, 0.0])  # sd of 1 and 3 is the root of 2, of two runs
    assert across([[1.0]])[1].tolist() == [0.0]


# --- what they met and did ---------------------------------------------------------------------------------------------


def test_stimuli_met_most_come_first_with_what_was_known_of_them() -> None:
    """Figs. 7.1, 7.4: counts of each step, and weights where they were told."""
    met = [(2, 0, 0, 0, 0, 0), (1, 1, 0, 0, 0, 0), (0, 2, 0, 0, 0, 0), (0, 2, 0, 0, 0, 0)]
    told = {0: tables({1: (0, UNIFORM)}), 4: tables({2: (5, (0.1, 0.2, 0.3, 0.4)), 1: (3, (-1.0, 0.5, 0.5, 0.0))})}
    moved = [state(step, ranger_stimuli=met[step - 1], tables=told.get(step, "")) for step in range(1, 5)]
    run = run_of([state(0, tables=told[0]), *moved])
    second, first = stimulus_curves([run], RobotClass.RANGER)
    assert [(curve.number, curve.pattern) for curve in (first, second)] == [(1, "0000"), (2, "0001")]
    assert second.steps.tolist() == [1, 2, 3, 4]
    assert second.met.tolist() == [0, 1, 2, 2]
    assert second.told.tolist() == [0, 4]
    assert second.weights.tolist() == [list(UNIFORM), [0.1, 0.2, 0.3, 0.4]]
    assert first.weights[1].tolist() == pytest.approx([nan, 0.5, 0.5, 0.0], nan_ok=True)
    assert stimulus_curves([run], RobotClass.WILD) == []
    above, other, below, _ = panels(stimuli([run], RobotClass.RANGER))
    assert above.get_title(loc="left") == "STIMULUS2 0001"
    assert (outline(above), outline(other)) == ([0, 1, 2, 2], [2, 1, 0, 0])
    assert [heights(line)[-1] for line in below.get_lines()] == [0.1, 0.2, 0.3, 0.4]


def test_of_several_seeds_counts_and_weights_are_means() -> None:
    runs = []
    for seed, count, low in ((1, 1, 0.2), (2, 3, 0.4)):
        told = tables({1: (1, (low, 1.0 - low, 0.0, 0.0))})
        runs.append(run_of([state(0), state(1, ranger_stimuli=(count, 0, 0, 0, 0, 0), tables=told)], seed))
    (curve,) = stimulus_curves(runs, RobotClass.RANGER)
    assert (curve.met.tolist(), curve.half.tolist()) == ([2.0], [pytest.approx(Z95)])
    assert curve.weights.tolist() == [pytest.approx([0.3, 0.7, 0.0, 0.0])]
    above = panels(stimuli(runs, RobotClass.RANGER))[0]
    bands = [steps_of(patch)[0] for patch in above.patches if isinstance(patch, StepPatch)]
    assert bands == pytest.approx([2.0, 2.0 + Z95, 2.0])


def test_at_most_six_stimuli_are_drawn() -> None:
    many = tuple(range(30, 0, -1))
    run = run_of([state(0), state(1, ranger_stimuli=many)])
    drawn = panels(stimuli([run], RobotClass.RANGER))
    assert len(drawn) == 12
    assert [axes.get_title(loc="left") for axes in drawn if axes.get_title(loc="left")] == [f"STIMULUS{n}" for n in range(1, 7)]


def test_behaviours_are_counted_step_by_step() -> None:
    """Fig. 7.2."""
    rows = [(2, 0, 0, 0), (1, 1, 0, 0), (0, 1, 0, 0)]
    run = run_of([state(0), *(state(step + 1, ranger_behaviours=row) for step, row in enumerate(rows))])
    drawn = panels(behaviours([run]))
    assert [outline(axes) for axes in drawn] == [[2, 1, 0], [0, 1, 1], [0, 0, 0], [0, 0, 0]]
    assert [axes.get_title(loc="left") for axes in drawn] == ["B1, 60%", "B2, 40%", "B3, 0%", "B4, 0%"]
    assert behaviours([run_of([state(0)])]) is None


def test_distances_are_drawn_with_their_mean() -> None:
    runs = [run_of([state(step, distance=value) for step, value in enumerate(row)]) for row in ((3.0, 2.0), (1.0, 0.0, 5.0))]
    near = panels(distances(runs))[0]
    assert [heights(line) for line in near.get_lines()] == [[3, 2], [1, 0, 5], [2, 1]]


# --- where they were ---------------------------------------------------------------------------------------------------


def test_snapshots_show_start_two_between_and_end_to_scale() -> None:
    """Fig. 7.3: positions are those of the log, and discs are as large as robots."""
    drawn = panels(snapshots(run_of([state(step) for step in range(31)])))
    assert [axes.get_title(loc="left") for axes in drawn] == ["start", "step 10", "step 20", "step 30"]
    assert discs(drawn[1], BLUE) == [[-3.0, 1.0], [3.0, 2.0]]
    assert discs(drawn[1], VERMILLION) == [[0.0, 0.0]]
    robots = next(one for one in drawn[0].collections if isinstance(one, EllipseCollection))
    assert np.asarray(robots.get_widths()).tolist() == pytest.approx([0.2, 0.2])
    border = next(patch for patch in drawn[0].patches if isinstance(patch, Rectangle))
    assert border.get_bbox().bounds == (-5.0, -5.0, 10.0, 10.0)
    assert border.get_linestyle() not in {"-", "solid"}


@pytest.mark.parametrize(("steps", "titles"), [(1, ["start"]), (2, ["start", "step 1"]), (3, ["start", "step 1", "step 2"])])
def test_a_short_run_has_fewer_snapshots(steps: int, titles: list[str]) -> None:
    drawn = panels(snapshots(run_of([state(step) for step in range(steps)])))
    assert [axes.get_title(loc="left") for axes in drawn] == titles


def test_a_wall_is_a_line_and_who_is_far_off_is_counted() -> None:
    (axes,) = panels(snapshots(run_of([state(0, case="B2D4R2W1", ranger_positions=(6.0, 0.0, 40.0, 0.0))])))
    border = next(patch for patch in axes.patches if isinstance(patch, Rectangle))
    assert border.get_linestyle() in {"-", "solid"}
    assert axes.get_title(loc="left") == "start; 1 farther out"
    assert 6.1 < axes.get_xlim()[1] < 7.0
    assert discs(axes, BLUE) == [[6.0, 0.0]]


def ways(axes: Axes) -> list[list[list[float]]]:
    found = [one for one in axes.collections if isinstance(one, LineCollection)]
    return [np.asarray(path.vertices).tolist() for one in found for path in one.get_paths()]


def test_trajectories_are_of_the_first_ten_steps_and_the_next() -> None:
    """Figs. 8.19, 9.5."""
    run = run_of([state(step) for step in range(26)])
    first, second = panels(trajectories(run))
    assert [axes.get_title(loc="left") for axes in (first, second)] == ["steps 0 to 10", "steps 10 to 20"]
    assert [len(way) for way in ways(first)] == [11, 11, 11]
    assert ways(second)[0][0] == [-3.0, 1.0]
    assert ways(second)[0][-1] == [-2.0, 1.0]
    assert discs(second, BLUE)[0] == [-2.0, 1.0]
    cut = run.between(4, 25)
    assert cut is not None
    (chosen,) = panels(trajectories(cut, chosen=True))
    assert chosen.get_title(loc="left") == "steps 4 to 25"
    assert [len(way) for way in ways(chosen)] == [22, 22, 22]
    assert trajectories(run_of([state(0)])) is None


def test_who_was_nowhere_for_a_while_has_a_gap() -> None:
    states = [state(step, ranger_positions=(float(step), 0.0, *((nan, nan) if step == 1 else (0.0, 1.0)))) for step in range(3)]
    (axes,) = panels(trajectories(run_of(states)))
    assert ways(axes)[1] == [[0.0, 1.0], pytest.approx([nan, nan], nan_ok=True), [0.0, 1.0]]
    assert snapshots(run_of([state(0, ranger_positions=(nan,) * 4, wild_positions=())])) is None


# --- what was learnt ---------------------------------------------------------------------------------------------------


def chosen_sectors(axes: Axes, color: str) -> list[float]:
    """Where the wedges begin that have an edge of a colour, in degrees."""
    return [wedge.theta1 for wedge in wedges(axes) if same_color(wedge.get_edgecolor(), color)]


def test_rings_show_the_chosen_sector_and_below_it_the_book_s() -> None:
    """Fig. 7.5: STIMULUS2 is 00000001, whose one is in the last sector, right of the nose; RB1 is B8."""
    known = {2: (9, (0.6, *[0.4 / 7] * 7)), 5: (3, (0.0, 0.5, 0.5, *[0.0] * 5)), 1: (4, (0.125,) * 8)}
    run = run_of([state(0, tables=tables(known))])
    drawn = panels(rings(run))
    learnt, other, book, none = drawn
    assert [axes.get_title(loc="center") for axes in (learnt, other)] == ["STIMULUS2", "STIMULUS5"]
    assert chosen_sectors(learnt, BLUE) == [90.0]
    assert chosen_sectors(other, BLUE) == [135.0, 180.0]
    assert chosen_sectors(book, INK) == [405.0]
    assert [axes.get_xlabel() for axes in drawn] == ["B1, 0.60", "B2 x B3, 0.50", "RB1: B8", "no rule"]
    occupied = [wedge.theta1 for wedge in wedges(learnt) if same_color(wedge.get_facecolor(), AMBER)]
    assert occupied == [405.0]
    assert chosen_sectors(none, INK) == []


def test_the_book_s_rules_are_drawn_before_others() -> None:
    known = {number: (50 if number > 8 else 1, (0.3, *[0.1] * 7)) for number in range(1, 15)}
    read = Tables.from_dict(json.loads(tables(known)))
    assert [rule.stimulus for rule in drawn_rules(read, RobotClass.RANGER)] == [1, 2, 3, 4, 7, 8]
    assert rings(run_of([state(0, tables=tables({1: (3, UNIFORM)}))])) is None


# --- words -------------------------------------------------------------------------------------------------------------


def measured(dominance: float, *, learnt: bool = True) -> str:
    tracker = RunTracker((2, 1))
    weights = np.array([[dominance, 1.0 - dominance]]) if learnt else np.array([[0.5, 0.5]])
    tracker.take((np.zeros((2, 2)), np.zeros((1, 2))), 1.0, (weights, np.array([[0.5, 0.5]])))
    return json.dumps(measures_of(tracker, [1.0], Tables(2)).to_dict())


def test_measures_of_runs_are_told_with_their_interval() -> None:
    one = measures_table([run_of([state(0, measures=measured(0.3))])])
    assert one is not None
    assert ("greatest weight that RANGERs learnt", "8.3", "0.7") in one.rows
    two = measures_table([run_of([state(0, measures=measured(share))]) for share in (0.3, 0.1)])
    assert two is not None
    assert ("greatest weight that RANGERs learnt", "8.3", "0.8 ± 0.2") in two.rows
    assert measures_table([run_of([state(0, measures="{}")]), run_of([state(0, measures="[")])]) is None


def test_a_run_that_learnt_nothing_is_told_of_as_rule_re() -> None:
    assert "as rule RE has it" in surround_said([run_of([state(0, measures=measured(0.3, learnt=False))])])[0]
    assert "as rule RE has it" not in surround_said([run_of([state(0, measures=measured(0.3))])])[0]


# --- whole reports -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    "odd",
    [
        {"ranger_positions": (nan, math.inf, 1e300)},
        {"ranger_positions": (), "wild_positions": (1.0,)},
        {"area": (), "body": nan},
        {"area": (-1.0, math.inf), "body": -1.0},
        {"area": (1e-300, 1e4), "body": 1e300},
        {"case": "no case"},
        {"ranger_stimuli": (2**62,) * 3, "ranger_behaviours": (-(2**62), 5)},
        {"ranger_stimuli": (), "ranger_behaviours": (), "wild_stimuli": (), "wild_behaviours": ()},
        {"ranger_stimuli": (1,) * 5000, "ranger_behaviours": (1,) * 16},
        {"distance": nan, "ranger_distance": math.inf, "share_surrounded": 1e300},
        {"tables": "[", "measures": "[" * 10_000},
        {"tables": "{}", "measures": "{}"},
        {"tables": tables({5: (1, (0.5, *[0.25] * 2, *[0.0] * 13))})},
    ],
)
def test_odd_numbers_never_cost_the_report(tmp_path: Path, odd: dict[str, Any]) -> None:
    states = [state(step, tables=tables({1: (2, (0.4, 0.2, 0.2, 0.2))}) if step == 1 else "") for step in range(12)]
    for step in (0, 5, 11):
        states[step] = state(step, **odd)
    report = write_report(write_log(tmp_path / "odd.mcap", states), tmp_path / "report")
    assert "can’t be drawn" not in report.page.read_text("utf-8")
    assert {"distances"} <= {path.stem for path in report.pictures}


@pytest.mark.slow
def test_a_log_of_states_alone_has_every_picture_of_the_run(tmp_path: Path) -> None:
    told = tables({1: (2, (0.4, 0.2, 0.2, 0.2))}, {2: (1, (0.4, 0.2, 0.2, 0.2))})
    states = [state(step, tables=told, wild_stimuli=(0, 1, 0, 0, 0, 0) if step else (0,) * 6) for step in range(12)]
    report = write_report(write_log(tmp_path / "worker.mcap", states), tmp_path / "report", steps=(3, 9))
    names = {"distances", "snapshots", "trajectories", "rules", "stimuli", "stimuli-wilds", "behaviours"}
    assert {path.stem for path in report.pictures} == names
    assert "Their ways in the steps that were chosen" in report.page.read_text("utf-8")
