"""Driving by a key that is held down: it ends 0.25 s after the last key, however bad the line is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from scripted_robot import ScriptedRobot

from firmware_protocol.errors import RefusedError
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import JuniorWheels, Reason
from hil.bridge.bridge import Bridge
from hil.jobs.watched.dead_man import HOLD, DeadMan
from hil.sumo.junior import Junior

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.errors import HilError
    from firmware_protocol.wire.fields import Message

AHEAD, LEFT = (0.6, 0.6), (-0.35, 0.35)
REPEATED = 0.033
"""A key that is held down comes so often, in s."""


class Driven:
    """A scripted Junior that is armed, and told when to turn its wheels.

    Attributes:
        robot: The robot.
        lost: Whether a command is lost on the line.
        refused: Why it did not drive.
        told: When it was told what, by its own clock, in s.
    """

    def __init__(self) -> None:
        self.robot = ScriptedRobot()
        self.junior = Junior(Bridge(MemoryLink(self.robot), self.robot))
        self.junior.find()
        self.junior.arm()
        self.dead_man = DeadMan(self.junior, HOLD, measured=True)
        self.refused: list[HilError] = []
        self.told: list[tuple[float, JuniorWheels]] = []
        self.lost: Callable[[JuniorWheels], bool] = lambda _: False
        self.robot.deaf = self._deaf

    def _deaf(self, message: Message) -> bool:
        if not isinstance(message, JuniorWheels):
            return False
        if self.lost(message):
            return True
        self.told.append((self.robot.now(), message))
        return False

    def live(self, duration: float, *, free: bool = True) -> None:
        end = self.junior.now() + duration
        while self.junior.now() < end - 1e-9:
            self.junior.step(0.005)
            self.refused += self.dead_man.step(free=free)

    def hold(self, wheels: tuple[float, float], duration: float) -> float:
        """Hold a key down; when the last one came, in s."""
        end = self.junior.now() + duration
        last = 0.0
        while self.junior.now() < end - 1e-9:
            last = self.press(wheels)
            self.live(REPEATED)
        return last

    def press(self, wheels: tuple[float, float]) -> float:
        """Press a key once; when that was, in s."""
        self.dead_man.press(wheels)
        self.refused += self.dead_man.step(free=True)
        return self.junior.now()

    @property
    def ends(self) -> float:
        """When its wheels stand, by the last that it was told, in s."""
        when, message = self.told[-1]
        return when + (message.duration if any(message.speed) else 0.0)


def test_one_key_drives_for_a_quarter_of_a_second() -> None:
    driven = Driven()
    began = driven.press(AHEAD)
    driven.live(1.0)
    ((when, message),) = driven.told
    assert (message.speed, message.duration) == (AHEAD, HOLD)
    assert when - began < 0.02
    assert not driven.dead_man.open


def test_a_key_that_is_held_down_drives_without_a_gap_and_ends_after_the_last() -> None:
    driven = Driven()
    last = driven.hold(AHEAD, 1.0)
    driven.live(1.0)
    gaps = [later - (earlier + HOLD) for (earlier, _), (later, _) in zip(driven.told, driven.told[1:], strict=False)]
    assert max(gaps) < 0
    assert driven.ends <= last + HOLD + 0.02


def test_another_key_is_told_at_once() -> None:
    driven = Driven()
    driven.hold(AHEAD, 0.2)
    driven.press(LEFT)
    driven.live(0.02)
    assert driven.told[-1][1].speed == LEFT


@pytest.mark.parametrize("answered_after", [1, 2, 3])
def test_a_command_that_has_to_be_repeated_ends_at_the_same_time(answered_after: int) -> None:
    driven = Driven()
    lost = iter([True] * answered_after)
    driven.lost = lambda message: any(message.speed) and next(lost, False)
    last = driven.press(AHEAD)
    driven.live(2.0)
    assert driven.ends <= last + HOLD + 0.05 + 0.02


def test_a_robot_that_hears_nothing_of_it_is_told_to_stop() -> None:
    driven = Driven()
    driven.lost = lambda message: any(message.speed)
    last = driven.press(AHEAD)
    driven.live(5.0)
    ((when, message),) = driven.told
    assert message.speed == (0.0, 0.0)
    assert last + HOLD <= when <= last + HOLD + 0.03


def test_while_it_is_armed_it_waits_and_forgets_a_key_that_is_too_old() -> None:
    driven = Driven()
    driven.dead_man.press(AHEAD)
    driven.live(0.1, free=False)
    assert driven.told == []
    driven.live(0.1)
    assert driven.told[-1][1].duration == pytest.approx(HOLD - 0.1, abs=0.01)
    driven.live(0.5)
    driven.dead_man.press(AHEAD)
    before = len(driven.told)
    driven.live(HOLD + 0.01, free=False)
    driven.live(0.5)
    assert len(driven.told) == before


def test_a_refusal_is_told_once_and_ends_it() -> None:
    driven = Driven()
    driven.robot.refuse[JuniorWheels] = Reason.DISARMED
    driven.press(AHEAD)
    driven.live(1.0)
    assert [type(error) for error in driven.refused] == [RefusedError]
    assert not driven.dead_man.open
