"""A micro-robot's hours: moves of every kind, and everything that may come between."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from firmware_bench import HOST, HOST_NUMBER
from host_life import Life
from micro_bench import MicroBench

from firmware_protocol.messages import (
    Command,
    ParamSet,
    RobotResultAck,
    SwarmFix,
    SwarmObservation,
    SwarmRanges,
)
from firmware_protocol.parameters import SWARM_PARAMETERS
from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.vocabulary import MoveOption

if TYPE_CHECKING:
    from collections.abc import Iterator

    from avr_micro_twins import MicroTwins

    from firmware_protocol.messages import SwarmMove
    from firmware_protocol.wire.fields import Message

ALIVE_EVERY, FIX_EVERY = 8, 10
"""Control periods between two of the host's words, and of the camera's."""
PACE: Final = 6
"""Control periods between two things that are said without sense: what both say then fits the line."""
SCENES: Final = {
    "drive": 30, "bumped": 12, "held": 8, "silence": 5, "fence": 8, "blind": 6, "lifted": 4, "replace": 8, "end": 6,
    "nonsense": 8, "reboot": 1, "cut": 1,
}  # fmt: skip
"""How often something happens."""
OPTIONS: Final = 64
USUAL: Final = {"MOVE_SPEED": 0.2, "TURN_SPEED": 6.28, "STALL_TIME": 0.1, "ARRIVE_DIST": 0.002, "ARRIVE_ANGLE": 0.035,
                "FIX_AGE": 1.0, "WATCHDOG": 250.0}  # fmt: skip
"""What nonsense may have changed, and moves need."""


class Speaker(MicroBench):
    """Messages of a host, and no robot."""

    def __init__(self) -> None:
        self.session, self.sequence = 100, 0


class MicroLife(Life):
    """What a swarm's host says, and what happens to the robot meanwhile.

    Args:
        seed: Of everything random.
        robot: The robot.
    """

    def __init__(self, seed: int, robot: MicroTwins) -> None:
        self.make = Speaker()
        super().__init__(seed, self.make, MICRO_ROBOT, SWARM_PARAMETERS)
        self.robot = robot
        self.seeing = True
        self.fence = False
        self.kinds |= {
            "move": (30, self.any_move),
            "sense": (4, self.sense),
            "fix": (10, self.fix),
            "ask": (10, self.ask),
            "manual": (4, self.manual),
            "acknowledge": (4, self.acknowledge),
        }

    # --- what is said -----------------------------------------------------------------------------------------------

    def move(self, longest: float = 0.15, options: int | None = None) -> SwarmMove:
        """A move that can be done."""
        choose = self.random
        body = choose.random() < 0.4
        sectors = choose.randint(1, 16)
        return self.make.move_message(
            None if body else choose.uniform(-math.pi, math.pi),
            choose.choice((0.0, choose.uniform(0.0, longest), choose.uniform(0.0, longest), 0.08)),
            sector=choose.randint(1, sectors) if body else 0,
            sectors=sectors if body else 0,
            face=choose.choice((None, None, choose.uniform(-math.pi, math.pi))),
            speed=choose.choice((0.0, 0.0, choose.uniform(0.05, 0.4))),
            effort=choose.choice((0, 0, choose.randint(1, 100))),
            options=choose.randrange(OPTIONS) if options is None else options,
        )

    def any_move(self) -> Message:
        """A move that may be refused, too."""
        choose = self.random
        if choose.random() < 0.7:
            return self.move(1.0)
        sectors = choose.randint(0, 16)
        return self.make.move_message(
            choose.choice((None, choose.uniform(-3, 3))),
            choose.uniform(0, 60),
            sector=choose.randint(0, sectors),
            sectors=sectors,
            options=choose.randrange(OPTIONS),
        )

    def sense(self) -> Message:
        """How the ring is to be read, if there were one."""
        choose = self.random
        radius, limit = choose.choice((0.2, 65.535, choose.uniform(0, 1))), choose.choice((65.535, choose.uniform(0, 2)))
        sectors, ranges = choose.randint(1, 16), choose.randint(0, 32)
        return self.make.sense_message(radius, choose.uniform(0, 0.1), limit, sectors=sectors, ranges=ranges)

    def fix(self) -> Message:
        """Where a camera sees it."""
        choose, robot = self.random, self.robot
        x, y = (max(-30.0, min(30.0, place + choose.gauss(0, 0.001))) for place in (robot.x, robot.y))
        heading = math.remainder(robot.angle + choose.gauss(0, 0.01), math.tau)
        session = self.make.session if choose.random() < 0.98 else 1
        return SwarmFix(session, (x, y), heading, choose.choice((0.0, 0.03, choose.uniform(0, 1.2))), 1, 1)

    def ask(self) -> Message:
        """An observation, or ranges: the holder of the session, or a watcher; of this robot or of all."""
        choose = self.random
        asked = choose.choice((SwarmObservation, SwarmObservation, SwarmRanges))
        command = self.command(
            Command.REQUEST_MESSAGE, float(asked.ID), float(choose.randint(1, 65535)), choose.choice((float(HOST_NUMBER), 0.0))
        )
        return replace(command, target_system=choose.choice((1, 1, 0)))

    def acknowledge(self) -> Message:
        """A result has come."""
        return RobotResultAck(self.make.session, self.make.sequence, 1, 1)

    # --- what happens -----------------------------------------------------------------------------------------------

    def periods(self) -> Iterator[bytes]:
        """What sets out to the robot in one control period after the other, without end."""
        yield self.say(self.open())
        while True:
            self.robot.inputs.bumper_left = self.robot.inputs.bumper_right = self.robot.held = False
            self.seeing = True
            (scene,) = self.random.choices(list(SCENES), list(SCENES.values()))
            yield from getattr(self, f"_{scene}")()

    def _pass(self, seconds: float, *, alive: bool = True) -> Iterator[bytes]:
        """Time goes by; the host and the camera say what they always say."""
        for period in range(round(seconds / 0.005)):
            said = b""
            if alive and period % ALIVE_EVERY == 0:
                said += self.say(HOST)
            if self.seeing and period % FIX_EVERY == 3:
                said += self.say(self.fix())
            if self.random.random() < 0.002:
                said += self.damage()
            if self.random.random() < 0.01:
                said += self.say(self.ask())
            yield said

    def _begin(self, *, options: int | None = None, longest: float = 0.15) -> Iterator[bytes]:
        """Arm, and set out on a move."""
        yield self.say(self.command(Command.ARM_DISARM, 1.0, param3=float(HOST_NUMBER)))
        yield from self._pass(0.03)
        yield self.say(self.move(longest, options))

    def _usual(self) -> Iterator[bytes]:
        """A session of its own, and parameters that a move can be done with."""
        yield self.say(self.command(Command.ARM_DISARM, 0.0))
        yield from self._pass(0.03)
        yield self.say(self.open())
        for name, value in {**USUAL, "FENCE_X": 0.0, "FENCE_Y": 0.0}.items():
            yield from self._pass(0.03)
            yield self.say(ParamSet(1, 1, name, value))
        yield from self._pass(0.1)

    def _drive(self) -> Iterator[bytes]:
        yield from self._begin()
        yield from self._pass(self.random.uniform(0.1, 2.5))
        if self.random.random() < 0.6:
            yield self.say(self.acknowledge())
        elif self.said:
            yield self.said[-1]

    def _bumped(self) -> Iterator[bytes]:
        """Contact, while it moves or before."""
        stop = MoveOption.STOP_ON_CONTACT | MoveOption.SENSE
        yield from self._begin(options=self.random.choice((stop, self.random.randrange(OPTIONS))))
        yield from self._pass(self.random.uniform(0, 0.5))
        self.robot.inputs.bumper_left = self.random.random() < 0.7
        self.robot.inputs.bumper_right = self.random.random() < 0.7
        yield from self._pass(self.random.uniform(0.1, 1.0))

    def _held(self) -> Iterator[bytes]:
        """Wheels that stand, for less or more than a move may take."""
        yield from self._begin(options=self.random.randrange(OPTIONS), longest=0.05)
        yield from self._pass(self.random.uniform(0, 0.3))
        self.robot.held = True
        yield from self._pass(self.random.choice((0.3, 4.0)))

    def _silence(self) -> Iterator[bytes]:
        yield from self._begin(longest=1.0)
        yield from self._pass(0.1)
        self.seeing = self.random.random() < 0.5
        yield from self._pass(0.6, alive=False)

    def _fence(self) -> Iterator[bytes]:
        """A fence about where it is, or beside it; with a camera, and without."""
        for name, place in (("FENCE_X", self.robot.x), ("FENCE_Y", self.robot.y)):
            half = min(abs(place) + self.random.uniform(-0.05, 0.08), 32.0)
            yield self.say(ParamSet(1, 1, name, max(half, 0.01)))
            yield from self._pass(0.05)
        for _ in range(4):
            self.seeing = self.random.random() < 0.6
            yield from self._begin(longest=0.3)
            yield from self._pass(self.random.uniform(0.1, 2.5))
        self.seeing = True
        for name in ("FENCE_X", "FENCE_Y"):
            yield self.say(ParamSet(1, 1, name, 0.0))
            yield from self._pass(0.05)

    def _blind(self) -> Iterator[bytes]:
        self.seeing = False
        yield from self._begin()
        yield from self._pass(self.random.uniform(0.5, 3.0))

    def _lifted(self) -> Iterator[bytes]:
        """Somebody puts it elsewhere, under way or not."""
        yield from self._begin()
        yield from self._pass(0.2)
        self.robot.x, self.robot.y = self.random.uniform(-1, 1), self.random.uniform(-1, 1)
        self.robot.angle = self.random.uniform(-3, 3)
        yield from self._pass(1.0)

    def _replace(self) -> Iterator[bytes]:
        yield from self._begin()
        for _ in range(3):
            yield from self._pass(self.random.uniform(0.02, 0.4))
            yield self.say(self.move())
        yield from self._pass(1.0)

    def _end(self) -> Iterator[bytes]:
        """Disarmed, stopped or another session, in mid-move."""
        yield from self._begin(longest=0.5)
        yield from self._pass(self.random.uniform(0.02, 0.6))
        ends = (self.command(Command.ARM_DISARM, 0.0), self.command(Command.FLIGHT_TERMINATION, 1.0), self.open())
        yield self.say(self.random.choice(ends))
        yield from self._pass(0.5)
        yield self.say(self.command(Command.ARM_DISARM, 0.0))
        yield from self._usual()

    def _nonsense(self) -> Iterator[bytes]:
        for period in range(600):
            yield self.next() if period % PACE == 0 else b""
        yield from self._usual()

    def _reboot(self) -> Iterator[bytes]:
        yield from self._begin()
        yield self.say(self.command(Command.PREFLIGHT_REBOOT, 1.0))
        yield from self._pass(1.0)
        yield from self._usual()

    def _cut(self) -> Iterator[bytes]:
        """The power fails, with something to store, and comes back."""
        yield self.parameter()
        yield from self._pass(self.random.uniform(0.005, 0.1))
        self.robot.inputs.voltage = self.random.uniform(6.0, 8.4)
        self.robot.power_on()
        yield from self._usual()
