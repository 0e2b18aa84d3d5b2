"""Two Juniors against each other: who plays them, and what the referee says."""

from __future__ import annotations

import numpy as np
import pytest
from known_players import CHARGE

import hil
from firmware_protocol.errors import RefusedError
from firmware_protocol.messages import BoutOutcome, JuniorSensors, State
from firmware_protocol.vocabulary import Action, Maneuver, Stimulus
from hil.sumo.connecting import connect_all
from hil.sumo.controllers import BUILT_IN
from hil.sumo.driving import DriverPlayer
from hil.sumo.ring import RingError
from hil.sumo.tournament.duels import Duel, duel_url, fight
from hil.sumo.tournament.players import HostPlayer, MemoryPlayer, Player


class Idle:
    """Stands where it is."""

    def choose(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:  # noqa: ARG002
        return Maneuver((Action.S,), period=1.0)


def host(name: str, seed: int = 1) -> HostPlayer:
    return HostPlayer(BUILT_IN[name](np.random.default_rng(seed)))


def duel(home: Player, away: Player, seed: int) -> Duel:
    with connect_all(duel_url(seed)) as robots:
        return fight(robots, home, away, seed)


def test_who_pushes_wins_in_either_seat() -> None:
    ends = [duel(host("chase"), host("random", seed), seed).outcome for seed in range(6)]
    assert ends.count(BoutOutcome.WIN) >= 5
    ends = [duel(host("random", seed), host("chase"), seed).outcome for seed in range(6)]
    assert ends.count(BoutOutcome.LOSS) >= 5


def test_when_the_time_is_over_it_is_drawn() -> None:
    over = duel(HostPlayer(Idle()), HostPlayer(Idle()), 1)
    assert over.outcome is BoutOutcome.DRAW
    assert over.time == pytest.approx(15.0)
    assert over.maneuvers[0] == over.maneuvers[1] > 10


def test_a_duel_follows_from_its_seed_and_who_plays() -> None:
    assert duel(host("random"), host("hobby"), 5) == duel(host("random"), host("hobby"), 5)
    assert len({duel(host("random"), host("hobby"), seed).time for seed in range(4)}) > 1


def test_a_robot_plays_from_its_own_memory_and_its_host_says_nothing() -> None:
    over = duel(MemoryPlayer(CHARGE), HostPlayer(Idle()), 3)
    assert over.outcome is BoutOutcome.WIN
    assert over.maneuvers[0] == 0
    both = duel(MemoryPlayer(CHARGE), MemoryPlayer(CHARGE), 3)
    assert both.maneuvers == (0, 0)


def test_a_driver_has_the_wheels_at_every_reading() -> None:
    class Spinning:
        """Turns on the spot, and counts."""

        def __init__(self) -> None:
            self.readings: list[int] = []

        def begin(self) -> None:
            self.readings.append(0)

        def drive(self, sensors: JuniorSensors) -> tuple[float, float]:
            self.readings[-1] += sensors.battery > 0
            return 0.3, -0.3

    driver = Spinning()
    over = duel(HostPlayer(Idle()), DriverPlayer(driver), 1)
    assert over.maneuvers[1] == 0
    assert len(driver.readings) == 1
    assert driver.readings[0] == pytest.approx(over.time / 0.02, abs=6)


def test_both_begin_at_the_same_time_and_are_answered_as_soon() -> None:
    """Alike players on both sides are asked equally often in the same time."""
    asked = np.array([duel(HostPlayer(Idle()), HostPlayer(Idle()), seed).maneuvers for seed in range(2)])
    assert (asked[:, 0] == asked[:, 1]).all()


def test_two_robots_are_needed_and_a_referee() -> None:
    with connect_all("sim://junior") as one, pytest.raises(RingError, match="there are 1 robots"):
        fight(one, host("chase"), host("chase"), 1)
    with connect_all("sim://junior?networks=2&referee=0") as two, pytest.raises(RingError, match="a referee with the first"):
        fight(two, host("chase"), host("chase"), 1)


def test_a_memory_that_can_not_be_played_from_is_an_error() -> None:
    with hil.connect("sim://junior") as junior:
        player = MemoryPlayer(CHARGE)
        junior.arm()
        player.begin(junior)
        junior.wait(0.2)
        with pytest.raises(RefusedError, match="there is no such entry"):
            player.attend(junior)
        assert junior.state is not State.CONTEST
