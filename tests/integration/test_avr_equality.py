"""The ATmega328P does in every control period what the host build does: sixty seconds and more of a robot's life."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import pytest
from avr_twins import Twins, comparable
from firmware_bench import FirmwareBench
from host_life import Life

from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.messages import (
    AutopilotVersion,
    Command,
    ContestCommand,
    SysStatus,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from firmware_protocol.peer.pacing import by_itself
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

pytestmark = [pytest.mark.avr, pytest.mark.slow]
PACE = 6
"""Control periods between two things that the host says: what both say then fits the line."""
STREAMS: Final[tuple[type[Message], ...]] = tuple(by_itself(JUNIOR))
ASKED: Final[tuple[type[Message], ...]] = (*STREAMS, AutopilotVersion)
KEPT = ("SYS_ID", "MEM_SLOTS")


class Hostly(FirmwareBench):
    """Messages of a host, and no robot."""

    def __init__(self) -> None:
        self.session, self.sequence = 100, 0


class JuniorLife(Life):
    """What Junior's host says.

    Args:
        seed: Of everything random.
    """

    def __init__(self, seed: int) -> None:
        self.make = Hostly()
        super().__init__(seed, self.make, JUNIOR, JUNIOR_PARAMETERS)
        self.kinds |= {"motion": (40, self.motion), "memory": (14, self.memory), "contest": (2, self.contest)}

    def actions(self) -> tuple[Action, ...]:
        return tuple(Action(self.random.randrange(17)) for _ in range(self.random.randint(1, 8)))

    def motion(self) -> Message:
        choose, make = self.random, self.make
        match choose.randrange(4):
            case 0:
                return make.wheels_message(choose.uniform(-1, 1), choose.uniform(-1, 1), choose.uniform(0, 2))
            case 1:
                return self.manual()
            case _:
                return make.maneuver_message(self.actions(), choose.uniform(0.02, 0.4), choose.randrange(32))

    def memory(self) -> Message:
        choose, make = self.random, self.make
        previous, current = choose.choice((ANY_STIMULUS, 0, 1, 2)), choose.randrange(4)
        match choose.randrange(6):
            case 0:
                return make.read_message(choose.randrange(12), previous, current)
            case 1:
                return make.read_message(255, previous, current)
            case 2:
                return make.write_message((), current, previous)
            case _:
                return make.write_message(self.actions(), current, previous, choose.uniform(0.02, 0.4), choose.randrange(32))

    def contest(self) -> Message:
        start = self.random.choice((ContestCommand.START, ContestCommand.STOP))
        return self.make.contest_message(start, self.random.uniform(0, 0.5))


class Rig:
    """A world whose robot has both boards."""

    def __init__(self, **options: object) -> None:
        self.made: list[Twins] = []
        self.world = junior_world(WorldSettings(board=self.board, **options))  # type: ignore[arg-type]

    def board(self, *, uid: int, nvm: bytes | None) -> Twins:
        self.made.append(Twins(uid=uid, nvm=nvm))
        return self.made[-1]

    @property
    def twins(self) -> Twins:
        return self.made[0]


@pytest.mark.parametrize(("seed", "opponent"), [(1, "flat-light"), (2, "flat-heavy"), (3, "curved-light"), (4, "corner-light")])
def test_driving_storing_setting_in_any_order_over_a_line_with_damage(seed: int, opponent: str) -> None:
    rig, life = Rig(opponent=opponent, seed=seed), JuniorLife(seed)
    step = rig.world.step
    step(life.codec.encode(life.open()))
    for period in range(3600):
        if period % 1200 == 900:
            step(life.codec.encode(life.command(Command.PREFLIGHT_REBOOT, 1.0)))
        elif period % 1200 == 0:
            rig.world.device.power_cycle()
            rig.world.match.reset(seed + period)
            step(life.codec.encode(life.open()))
        else:
            step(life.next() if period % PACE == 0 else b"")
    assert rig.twins.frames > 1500
    assert rig.twins.turning > 300
    assert rig.twins.short > 0
    assert rig.twins.boots == 7


def test_contests_from_memory_with_a_start_module_and_sensors_that_fail() -> None:
    spec = FaultSpec.parse("stuck:eye_left=900@4+3,stuck:floor_right=1000@9+0.5,brownout:12+0.3")
    rig, life = Rig(opponent="flat-heavy", seed=5, faults=spec), JuniorLife(5)
    step, device = rig.world.step, rig.world.device
    step(life.codec.encode(life.open()))
    for current in range(4):
        for _ in range(20):
            step(b"")
        step(life.codec.encode(life.make.write_message((Action(1 + current), Action.FF), current, period=0.1)))
    for period in range(4800):
        if period % 1600 == 100:
            device.set_start(go=True)
        elif period % 1600 == 1500:
            device.set_start(go=False)
            rig.world.match.reset(period)
        step(b"")
    assert rig.twins.turning > 600
    assert rig.twins.boots == 2


def test_what_may_differ_is_the_load_alone() -> None:
    def frame(load: int, battery: int) -> bytes:
        zero = (0,) * 4
        return MavlinkCodec(system=1, component=1).encode(SysStatus(*zero[:3], load, battery, -1, -1, *zero, *zero[:2]))

    assert comparable(frame(0, 7500)) == comparable(frame(321, 7500))
    assert comparable(frame(0, 7500)) != comparable(frame(0, 7490))
