"""A bout on the table without firmware or wire: bodies, start poses, and who is out.

`World` builds on this; a controller that sets the wheels itself can use it directly, to try out physics or tactics.
"""

from __future__ import annotations

import math
from enum import IntEnum
from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import BoutOutcome, OpponentCode
from firmware_protocol.near import did_you_mean
from simdevice.arena import CONTROL_PERIOD, Arena, Dummy, Piece
from simdevice.junior.hardware import JuniorHardware
from simdevice.junior.profile import JuniorProfile
from simdevice.junior.sensors import Sensors
from simdevice.sumo.conditions import NOMINAL
from simdevice.sumo.opponents import JUNIOR_OPPONENT, OPPONENTS

if TYPE_CHECKING:
    from collections.abc import Callable

    from simdevice.junior.sensors import Sensors
    from simdevice.sumo.conditions import Conditions
    from simdevice.sumo.ring import SumoRing

TIME_LIMIT: Final = 15.0
"""A bout that lasts longer is a draw, in s."""
_TURNED: Final = math.radians(90.0)
"""Junior's heading lies within this of the bearing to the opponent, in rad."""
_FACING: Final = math.radians(15.0)
"""The opponent's front is turned to Junior within this, in rad."""
_MARGIN: Final = 0.08
"""Junior's centre starts this far inside the border, in m."""
_OPPONENT_MARGIN: Final = 0.08
"""The opponent's centre likewise."""
_APART: Final = 0.02
"""Least distance between the circles about both bodies, in m."""
PUT_DOWN: Final = 4
"""Control periods that a reset takes: meanwhile a robot is held up and senses nothing, so that thresholds with hysteresis
and debounced switches forget the bout before."""
HELD_UP: Final = 1 << 30
"""Control periods that outlast everybody's patience."""


class Purpose(IntEnum):
    """Purposes that random numbers are drawn for; each has a stream of its own, so that one never shifts another."""

    START = 1
    MOTORS = 2
    SENSORS = 3
    OPPONENT_MOTORS = 4
    OPPONENT_SENSORS = 5
    IDENTITY = 6
    CONDITIONS = 7


def stream(seed: int, purpose: Purpose) -> np.random.Generator:
    """The random numbers of one purpose.

    Args:
        seed: Seed of the run or of the bout; not negative.
        purpose: What they are for.

    Returns:
        A generator that gives the same numbers on every machine.
    """
    return np.random.Generator(np.random.PCG64([seed, int(purpose)]))


@cache
def opponent_code(name: str) -> OpponentCode:
    """The wire code of an opponent.

    Raises:
        ValueError: There is no opponent of this name.
    """
    for code in OpponentCode:
        if code is not OpponentCode.KEEP and code.label == name:
            return code
    known = (*OPPONENTS, JUNIOR_OPPONENT)
    raise ValueError(f"unknown opponent {name!r}: expected one of {', '.join(known)}{did_you_mean(name, known)}")


class Match:
    """Ring, Junior and opponent, and the rules of a bout.

    Args:
        opponent: Name of the opponent.
        seed: Seed of everything that is random.
        profile: Junior's numbers, and those of a second Junior.
        ring: The ring.
        period: One control period, in s.
        conditions: How it differs from the nominal.
        vary: How far each bout's conditions may be from these, as a share.

    Attributes:
        arena: The physics.
        robot: Junior.
        opponent: The other's body.
        name: The opponent's name.
        second: The second Junior's hardware, once one has been asked for; None before.
        outcome: Of the present bout.
        elapsed: Time since the bout began, in s.
        steps: Control periods since the bout began; of one that is over, those it took.
        half_x: Half of the ring's width, in m.
        half_y: Half of its height, in m.
        lifted: Control periods until the robots stand on the table; meanwhile nothing moves.
        conditions: Of the present bout.
    """

    def __init__(
        self,
        opponent: str = "flat-light",
        seed: int = 1,
        profile: JuniorProfile | None = None,
        ring: SumoRing | None = None,
        period: float = CONTROL_PERIOD,
        *,
        conditions: Conditions = NOMINAL,
        vary: float = 0.0,
    ) -> None:
        self._profile = profile if profile is not None else JuniorProfile()
        self._seed = seed
        self._about, self._vary = conditions, vary
        self.conditions = conditions
        self.arena = Arena(ring, period)
        self.half_x, self.half_y = self.arena.ring.width / 2, self.arena.ring.height / 2
        motors, sensors = stream(seed, Purpose.MOTORS), stream(seed, Purpose.SENSORS)
        self.robot = JuniorHardware(conditions.junior(self._profile), self.arena.ring, motors, sensors)
        self.arena.add(self.robot.body)
        self.second: JuniorHardware | None = None
        opponent_code(opponent)
        self.name = opponent
        self.opponent = self._make(opponent)
        self.arena.add(self.opponent)
        self.steps = 0
        self.lifted = 0
        self.outcome = BoutOutcome.UNDECIDED
        self.reset(seed)

    def _make(self, name: str) -> Piece:
        """A body for an opponent; a second Junior is kept, memory and all, when others come between."""
        if name != JUNIOR_OPPONENT:
            return Dummy(self.conditions.dummy(OPPONENTS[name]), self._profile.body_friction)
        profile = self.conditions.second(self._profile)
        if self.second is None:
            motors, sensors = stream(self._seed, Purpose.OPPONENT_MOTORS), stream(self._seed, Purpose.OPPONENT_SENSORS)
            self.second = JuniorHardware(profile, self.arena.ring, motors, sensors)
        self.second.fit(profile)
        return self.second.body

    @property
    def period(self) -> float:
        """One control period, in s."""
        return self.arena.period

    @property
    def elapsed(self) -> float:
        """Time since the bout began, in s; of one that is over, the time it took."""
        return self.steps * self.period

    @property
    def clearance(self) -> float:
        """From the opponent's centre to the border, in m; negative outside."""
        return self.arena.ring.clearance(self.opponent.x, self.opponent.y)

    def reset(self, seed: int, opponent: str | None = None) -> None:
        """Begin a bout: both at rest at a fresh start pose, batteries full.

        What follows depends on the seed and on what the robots do, and on nothing that was before.

        Args:
            seed: Seed of the start pose, and of the conditions where they vary.
            opponent: Another opponent; None keeps the present one.

        Raises:
            ValueError: There is no opponent of this name.
        """
        before = self.name
        if opponent is not None:
            opponent_code(opponent)
            self.name = opponent
        if self._vary:
            self.conditions = self._about.drawn(self._vary, stream(seed, Purpose.CONDITIONS))
            self.robot.fit(self.conditions.junior(self._profile))
        if self.name != before or self._vary:
            self.arena.remove(self.opponent)
            self.opponent = self._make(self.name)
            self.arena.add(self.opponent)
        self.arena.clear_memory()
        self._place(stream(seed, Purpose.START))
        self.robot.begin(stream(seed, Purpose.MOTORS), stream(seed, Purpose.SENSORS))
        if self.second is not None:
            self.second.begin(stream(seed, Purpose.OPPONENT_MOTORS), stream(seed, Purpose.OPPONENT_SENSORS))
        self.lifted = PUT_DOWN
        self.steps = 0
        self.outcome = BoutOutcome.UNDECIDED

    def _place(self, random: np.random.Generator) -> None:
        """Draw start poses until the bodies are apart."""
        ring = self.arena.ring
        least = self.robot.body.outline.radius + self.opponent.outline.radius + _APART
        while True:
            x, y = _inside(ring, _MARGIN, random)
            other_x, other_y = _inside(ring, _OPPONENT_MARGIN, random)
            if math.hypot(other_x - x, other_y - y) >= least:
                break
        bearing = math.atan2(other_y - y, other_x - x)
        self.robot.body.place(x, y, math.remainder(bearing + float(random.uniform(-_TURNED, _TURNED)), math.tau))
        facing = bearing + math.pi + float(random.uniform(-_FACING, _FACING))
        self.opponent.place(other_x, other_y, math.remainder(facing, math.tau))

    def step(self) -> None:
        """Advance the physics by one period and judge."""
        if self.lifted:
            self.lifted -= 1
            return
        self.arena.step()
        if self.outcome is BoutOutcome.UNDECIDED:
            self.steps += 1
            self.judge()

    def judge(self) -> None:
        """Decide the bout where it is decided: out is whose centre has left the ring."""
        half_x = self.half_x
        half_y = self.half_y
        body = self.robot.body
        other = self.opponent
        lost = not (-half_x <= body.x <= half_x and -half_y <= body.y <= half_y)
        won = not (-half_x <= other.x <= half_x and -half_y <= other.y <= half_y)
        if won or lost:
            self.outcome = BoutOutcome.DRAW if won and lost else BoutOutcome.WIN if won else BoutOutcome.LOSS
        elif self.elapsed >= TIME_LIMIT:
            self.outcome = BoutOutcome.DRAW

    def play(self, controller: Callable[[Sensors, float], tuple[float, float]], seed: int) -> tuple[BoutOutcome, float]:
        """Play one bout with a controller that sets the wheels itself, with no firmware in between.

        Args:
            controller: From the sensors and the time in s to the effort of the left and right wheel, -1..1.
            seed: Seed of the start pose.

        Returns:
            Outcome, and the time it took in s.
        """
        self.reset(seed)
        robot = self.robot
        while self.outcome is BoutOutcome.UNDECIDED:
            robot.sensors.sample(() if self.lifted else (self.opponent,))
            left, right = controller(robot.sensors, self.elapsed)
            robot.motors.command(round(1000 * left), round(1000 * right))
            self.step()
        return self.outcome, self.elapsed


def _inside(ring: SumoRing, margin: float, random: np.random.Generator) -> tuple[float, float]:
    """A place at least `margin` inside the border, in m."""
    x, y = ring.width / 2 - margin, ring.height / 2 - margin
    return float(random.uniform(-x, x)), float(random.uniform(-y, y))
