"""The surround mission on a kinematic swarm: who is asked, who moves, what is learnt from, what is measured."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from kinematic_swarm import KinematicSwarm, kinematic_swarm
from surround_world import Conditions, run

from firmware_protocol.vocabulary import RobotClass
from hil.swarm.cast import CastError, cast
from hil.swarm.host import SwarmHost
from hil.swarm.missions.sensing import OwnRings, ReckonedRings
from hil.swarm.missions.surround import SurroundMission, SurroundState
from hil.swarm.missions.surround_settings import Order, SurroundSettings
from pal_advisor.surround import Surround
from pal_advisor.surround.measures import RunTracker

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.swarm.rounds import Round


class Told:
    """Takes down what is told."""

    def __init__(self) -> None:
        self.states: list[SurroundState] = []
        self.rounds: list[tuple[str, int]] = []

    def surround_state(self, state: SurroundState) -> None:
        self.states.append(state)

    def round(self, took_place: Round, labels: Sequence[str], order: str, step: int = -1) -> None:
        del took_place, labels
        self.rounds.append((order, step))


def mission_of(
    swarm: KinematicSwarm, settings: SurroundSettings, *, seed: int = 1, positions: bool = False, spares: bool = False
) -> tuple[SurroundMission, Told]:
    """A mission that has not begun."""
    told = Told()
    chosen = cast(swarm.kinds, settings.robots, spares=spares)
    case = settings.case_of(*(chosen.count(kind) for kind in RobotClass))
    host = SwarmHost(swarm, chosen, observers=(told,))
    adviser = Surround(*settings.groups(case), np.random.default_rng([seed, 1]))
    sensing = ReckonedRings(host, settings.ring) if positions else OwnRings()
    return SurroundMission(host, settings, case, adviser, sensing, seed=seed, observers=(told,)), told


def play(mission: SurroundMission) -> SurroundMission:
    mission.begin()
    while not mission.finished:
        mission.step()
    return mission


@pytest.mark.parametrize("order", list(Order))
def test_a_mission_decides_and_measures_as_the_kinematic_world_does(order: Order) -> None:
    name, steps = "B1D3R9W3", 12
    swarm = kinematic_swarm(name, 4)
    mission, _ = mission_of(swarm, SurroundSettings(case=name, steps=steps, order=order), seed=4)
    play(mission)
    expected = run(name, 4, steps, Conditions(order=order.value))
    assert mission.history.behaviours == [np.bincount(row, minlength=9)[1:].tolist() for row in expected.behaviours]
    measured = np.array(mission.history.series["distance"], np.float64)
    assert measured == pytest.approx(expected.distance, abs=0.006)  # what is reported is rounded to 1 mm, 0.005 units
    weights = np.stack([group.experience.weights for group in mission.adviser.groups])
    assert weights == pytest.approx(expected.weights[-1], abs=1e-12)


def test_sights_that_are_reckoned_from_positions_lead_to_the_same_decisions() -> None:
    name, settings = "B1D3R9W3", SurroundSettings(case="B1D3R9W3", steps=6)
    own, _ = mission_of(kinematic_swarm(name, 2), settings, seed=2)
    reckoned, _ = mission_of(kinematic_swarm(name, 2), settings, seed=2, positions=True)
    assert play(own).history.behaviours == play(reckoned).history.behaviours


def test_a_class_observes_and_then_moves_before_the_other_does() -> None:
    swarm = kinematic_swarm("B1D3R4W2", 1)
    mission, told = mission_of(swarm, SurroundSettings(case="B1D3R4W2", steps=2))
    play(mission)
    step = ["observe rangers", "move rangers", "observe wilds", "move wilds", "observe rangers"]
    assert told.rounds == [("observe rangers and wilds", 0), *((order, 1) for order in step), *((order, 2) for order in step)]


def test_stationary_wilds_are_asked_at_the_end_of_each_step_for_they_are_pushed() -> None:
    swarm = kinematic_swarm("B2D3R4W2", 1)
    mission, told = mission_of(swarm, SurroundSettings(case="B2D3R4W2", steps=1))
    play(mission)
    assert told.rounds[1:] == [("observe rangers", 1), ("move rangers", 1), ("observe wilds", 1)]
    assert not any(moved[4:].any() for moved in swarm.moved)


def test_what_the_fence_refuses_is_drawn_again_once() -> None:
    swarm = kinematic_swarm("B2D3R3W2", 1)
    tried: list[int] = []

    def fenced(row: int, sector: int) -> bool:
        if row == 0:
            tried.append(sector)
        return row == 0

    swarm.fenced = fenced
    mission, told = mission_of(swarm, SurroundSettings(case="B2D3R3W2", steps=1))
    before = mission.adviser.tables().to_dict()
    at = swarm.world.poses[0].copy()
    play(mission)
    assert len(tried) == 2
    assert tried[0] != tried[1]
    assert told.rounds[2:4] == [("move rangers", 1), ("move rangers", 1)]
    assert (swarm.world.poses[0] == at).all()
    assert sum(mission.history.behaviours[0]) == 2, "who is refused twice performs nothing"
    assert before["ranger"] == []


def test_who_is_missing_is_told_of_and_draws_no_number() -> None:
    name = "B2D3R5W2"
    settings = SurroundSettings(case=name, steps=4)
    swarm = kinematic_swarm(name, 3)
    mission, _ = mission_of(swarm, settings, seed=3)
    mission.begin()
    mission.step()
    swarm.mute = {2}
    mission.step()
    assert [(one.step, one.robot, one.until) for one in mission.host.absences] == [(2, "3", None)]
    state = mission.adviser.state_dict()["rng"]
    swarm.mute = set()
    mission.step()
    swarm.there[2] = True
    mission.step()
    assert [(one.step, one.robot, one.until) for one in mission.host.absences] == [(2, "3", 4)]
    after = np.random.default_rng()
    after.bit_generator.state = state
    after.random(4)
    after.random(5)
    assert mission.adviser.state_dict()["rng"]["state"] == after.bit_generator.state["state"]
    assert [sum(row) for row in mission.history.behaviours] == [5, 4, 4, 5]


def test_a_spare_takes_the_place_of_a_missing_robot_of_its_class() -> None:
    swarm = kinematic_swarm("B2D3R6W3", 3)
    mission, _ = mission_of(swarm, SurroundSettings(case="B2D3R4W2", steps=2), spares=True)
    assert (mission.case.rangers, mission.case.wilds) == (4, 2)
    mission.begin()
    swarm.there[1] = False
    mission.step()
    assert mission.host.players[RobotClass.RANGER].tolist() == [0, 4, 2, 3]
    assert sum(mission.history.behaviours[0]) == 4
    swarm.there[1], swarm.there[4] = True, False
    mission.step()
    assert mission.host.players[RobotClass.RANGER].tolist() == [0, 1, 2, 3]
    assert [(one.robot, one.step, one.until) for one in mission.host.absences] == [("2", 1, 2), ("5", 2, None)]


def test_where_everybody_has_last_said_to_be_is_told() -> None:
    """In the book's units; who is missing stays where it was, and who has never said anything is nowhere."""
    name = "B2D3R4W2"
    swarm = kinematic_swarm(name, 1)
    swarm.mute = {5}
    mission, told = mission_of(swarm, SurroundSettings(case=name, steps=3))
    mission.begin()
    mission.step()
    before = told.states[1].positions[0][2].tolist()
    swarm.mute |= {2}
    play(mission)
    rangers, wilds = told.states[-1].positions
    assert (rangers.shape, wilds.shape) == ((4, 2), (2, 2))
    assert rangers[[0, 1, 3]] == pytest.approx(swarm.world.poses[[0, 1, 3], :2], abs=0.006)
    assert rangers[2].tolist() == before
    assert np.isnan(wilds[1]).all()
    assert told.states[-1].case == "B2C1D3L1R4S1W2"
    assert told.states[-1].area == (10.0, 10.0)
    assert told.states[-1].body == pytest.approx(0.1)


@pytest.mark.parametrize("order", list(Order))
@pytest.mark.parametrize("name", ["B1D3R4W2", "B2D3R4W2"])
def test_who_is_pushed_is_seen_before_wilds_move_themselves(name: str, order: Order, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the kinematic world nobody is pushed: RANGERs have moved, and WILDs have not, unless all move at once."""
    seen: list[Any] = []
    monkeypatch.setattr(RunTracker, "push", lambda _, *span: seen.append(span))
    settings = SurroundSettings(case=name, steps=2, order=order)
    mission, told = mission_of(kinematic_swarm(name, 1), settings)
    play(mission)
    for step, (before, after, contact) in enumerate(seen, 1):
        begin, end = told.states[step - 1].positions, told.states[step].positions
        for kind in RobotClass:
            assert before[kind] == pytest.approx(begin[kind], abs=1e-4)
        assert after[RobotClass.RANGER] == pytest.approx(end[RobotClass.RANGER], abs=1e-4)
        wilds = end if order is Order.ALL else begin
        assert after[RobotClass.WILD] == pytest.approx(wilds[RobotClass.WILD], abs=1e-4)
        assert contact == pytest.approx(0.21)
    assert len(seen) == 2


def test_more_robots_than_there_are_can_not_play() -> None:
    kinds = np.array([0, 0, 0, 1, -1])
    with pytest.raises(CastError, match="asks for 2 WILDs; there are 3 RANGERs and 1 WILD, and 1 that have not said"):
        cast(kinds, {RobotClass.WILD: 2}, spares=False)
    everybody = cast(kinds, {}, spares=True)
    assert [everybody.count(kind) for kind in RobotClass] == [3, 1]


def test_nothing_is_measured_where_there_is_nobody() -> None:
    swarm = kinematic_swarm("R3W0", 1)
    mission, told = mission_of(swarm, SurroundSettings(case="R3W0", steps=1))
    play(mission)
    assert mission.history.series["distance"] == [None, None]
    assert mission.history.series["share_surrounded"] == [None, None]
    assert None not in mission.history.series["ranger_distance"]
    assert [state.step for state in told.states] == [0, 1]


def test_a_control_run_keeps_uniform_weights() -> None:
    settings = replace(SurroundSettings(case="B1D3R4W2", steps=3), learning=False)
    mission, _ = mission_of(kinematic_swarm("B1D3R4W2", 1), settings)
    play(mission)
    assert all((group.experience.weights == 1 / 8).all() for group in mission.adviser.groups)


def test_tables_and_digests_are_told_every_ten_steps_and_at_the_end() -> None:
    mission, told = mission_of(kinematic_swarm("B2D3R4W2", 1), SurroundSettings(case="B2D3R4W2", steps=12))
    play(mission)
    assert [state.step for state in told.states if state.tables is not None] == [0, 10, 12]
    assert [state.step for state in told.states if state.digest] == [0, 10, 12]
    assert told.states[-1].digest == mission.digest()
    assert sum(told.states[5].stimuli[0]) == 4
