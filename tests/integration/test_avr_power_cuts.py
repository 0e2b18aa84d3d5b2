"""The power of an ATmega328P is cut a thousand times, at any clock cycle and in the middle of any byte."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Final

import numpy as np
import pytest
from avr_bench import AvrBench
from firmware_bench import HOST, TICK

from firmware_protocol.maneuver_fields import to_fields
from firmware_protocol.memory_table import MemorySlot, memory_checksum
from firmware_protocol.messages import (
    Command,
    ContestCommand,
    JuniorContest,
    JuniorManeuver,
    JuniorMemoryEntry,
    JuniorMemoryRead,
    JuniorMemoryWrite,
    ParamSet,
    ParamValue,
    Reason,
    RobotStatus,
    State,
)
from firmware_protocol.vocabulary import ANY_STIMULUS, FINE_ACTIONS, Action, Maneuver
from simdevice.avr.board import CYCLES

if TYPE_CHECKING:
    from collections.abc import Iterator

    from firmware_protocol.wire.fields import Message

pytestmark = [pytest.mark.avr, pytest.mark.slow]
CUTS: Final = 250
"""For each of four kinds."""
KEYS: Final = tuple(product((ANY_STIMULUS, 1), range(2)))
"""Slots that are written to: few, so that most writes replace something."""
PARAMETERS: Final = {"EYE_L_ON": (200, 900), "SPD_SLOW": (0.25, 0.75)}
BOOT: Final = 6 * CYCLES
"""Clock cycles that booting takes, about."""


class Victim(AvrBench):
    """A robot whose power fails, and what its memory may hold when it is back.

    Args:
        seed: Of everything that is left to chance.
    """

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.memory: dict[tuple[int, int], Maneuver] = {}
        self.parameters: dict[str, float] = {}
        self.boots = 1
        super().__init__()

    def cut(self) -> None:
        """Let a random part of a control period pass, then cut the power; now and then again while it boots."""
        self.board.run(int(self.rng.integers(CYCLES)))
        torn = int(self.rng.integers(256))
        interrupted = 0
        while self.rng.random() < 0.2:
            self.board.cut(torn)
            self.board.run(int(self.rng.integers(1, BOOT)))
            torn = int(self.rng.integers(256))
            interrupted += 1
        self.power_on(torn=torn)
        self.now += TICK
        self.period(b"")  # of a frame that was cut short
        status = self.requested(RobotStatus)
        assert self.boots < status.boot_count <= self.boots + 1 + interrupted, "the host is told"
        assert status.maneuvers == 0
        assert status.session == 0
        assert State(status.state) is State.DISARMED
        assert self.wheels == (0, 0)
        self.boots = status.boot_count

    def recover(self, torn: int) -> None:
        """Boot, and pass over the first control period: what comes in it begins with a frame that was cut short."""
        self.power_on(torn=torn)
        self.now += TICK
        self.period(b"")

    def requested(self, kind: type[RobotStatus]) -> RobotStatus:
        """A message that has been asked for."""
        self.streamed.clear()
        self.command(Command.REQUEST_MESSAGE, float(kind.ID))
        return next(message for message in self.streamed if isinstance(message, kind))

    def maneuver(self) -> Maneuver:
        """Some maneuver."""
        chosen = self.rng.integers(len(FINE_ACTIONS), size=int(self.rng.integers(1, 9)))
        return Maneuver(tuple(FINE_ACTIONS[index] for index in chosen), period=int(self.rng.integers(20, 60)) / 1000)

    def write(self, key: tuple[int, int], maneuver: Maneuver) -> JuniorMemoryWrite:
        """The message that stores a maneuver."""
        target = {"target_system": 1, "target_component": 1, "previous": key[0], "current": key[1]}
        self.sequence += 1
        return JuniorMemoryWrite(self.session, self.sequence, **to_fields(maneuver), **target)

    def stored(self) -> dict[tuple[int, int], Maneuver]:
        """All that its memory holds; its checksum is seen to be right."""
        entries: list[JuniorMemoryEntry] = []
        while not entries or len(entries) < entries[-1].used:
            self.sequence += 1
            answers = self.answers_to(JuniorMemoryRead(self.session, self.sequence, 1, 1, len(entries), ANY_STIMULUS, 0))
            found = [answer for answer in answers if isinstance(answer, JuniorMemoryEntry)]
            if not found:
                break
            entries += found
        slots = [MemorySlot.of(entry) for entry in entries]
        assert all(entry.checksum == memory_checksum(slots) for entry in entries)
        assert len({slot.key for slot in slots}) == len(slots), "two slots have one key"
        return {slot.key: slot.maneuver for slot in slots}

    def value(self, name: str) -> float:
        """What a parameter is, by what it answers to being set to what can't be."""
        answers = self.answers_to(ParamSet(1, 1, name, -1.0))
        return next(answer.param_value for answer in answers if isinstance(answer, ParamValue))


def wait(victim: Victim, most: int, *messages: Message) -> None:
    """Send something, and let up to so many control periods pass."""
    victim.tick(*messages)
    for _ in range(int(victim.rng.integers(most))):
        victim.tick(HOST)


def cuts(victim: Victim) -> Iterator[int]:
    """Count them; every one finds the robot in a new session."""
    for number in range(CUTS):
        victim.open()
        yield number


def test_a_memory_write_that_is_cut_leaves_the_old_or_the_new_maneuver() -> None:
    victim = Victim(1)
    old = new = 0
    for _ in cuts(victim):
        key = KEYS[int(victim.rng.integers(len(KEYS)))]
        maneuver = victim.maneuver()
        wait(victim, 45, victim.write(key, maneuver))
        victim.cut()
        victim.open()
        found = victim.stored()
        before = victim.memory
        assert {k: m for k, m in found.items() if k != key} == {k: m for k, m in before.items() if k != key}, "others are whole"
        assert found.get(key) in (before.get(key), maneuver)
        new += found.get(key) == maneuver
        old += found.get(key) == before.get(key)
        victim.memory = found
    assert min(old, new) > CUTS / 10, "cuts fell before and after the moment that counts"


def test_a_parameter_that_is_cut_has_the_old_or_the_new_value() -> None:
    victim = Victim(2)
    old = new = 0
    values = {name: victim.value(name) for name in PARAMETERS}
    for number in cuts(victim):
        name = list(PARAMETERS)[number % len(PARAMETERS)]
        low, high = PARAMETERS[name]
        drawn = victim.rng.uniform(low, high)
        wanted = float(np.float32(drawn)) if name == "SPD_SLOW" else float(round(drawn))
        wait(victim, 16, ParamSet(1, 1, name, wanted))
        victim.cut()
        found = {known: victim.value(known) for known in PARAMETERS}
        assert found[name] in (values[name], wanted)
        assert {k: v for k, v in found.items() if k != name} == {k: v for k, v in values.items() if k != name}
        new += found[name] == wanted
        old += found[name] == values[name]
        values = found
    assert min(old, new) > CUTS / 10


def test_a_maneuver_that_is_cut_is_over() -> None:
    victim = Victim(3)
    turning = 0
    for _ in cuts(victim):
        victim.arm()
        victim.sequence += 1
        fields = to_fields(Maneuver((Action.FF, Action.LBRF, Action.FB), period=0.03, floor_reflex=False))
        wait(victim, 18, JuniorManeuver(victim.session, victim.sequence, **fields, target_system=1, target_component=1))
        turning += any(victim.wheels)
        victim.cut()
        for _ in range(3):
            victim.tick(HOST)
            assert victim.wheels == (0, 0)
    assert turning > CUTS / 3


def test_a_contest_that_is_cut_is_over_and_the_memory_is_whole() -> None:
    victim = Victim(4)
    victim.open()
    taught = {(ANY_STIMULUS, current): Maneuver((Action.FF, Action.FB), period=0.02 + 0.01 * current) for current in range(4)}
    for key, maneuver in taught.items():
        assert victim.ask(victim.write(key, maneuver)) in {Reason.NONE, None}
        for _ in range(40):
            victim.tick(HOST)
    playing = 0
    for _ in cuts(victim):
        victim.arm()
        victim.sequence += 1
        wait(victim, 30, JuniorContest(victim.session, victim.sequence, 0.02, 1, 1, ContestCommand.START))
        playing += any(victim.wheels)
        victim.cut()
        assert victim.ask(JuniorContest(1, 1, 0.0, 1, 1, ContestCommand.START)) is Reason.WRONG_SESSION, "as of a new robot"
        victim.tick(HOST)
        assert victim.wheels == (0, 0)
    assert playing > CUTS / 3
    victim.open()
    assert victim.stored() == taught


def test_a_new_robot_s_first_boot_may_be_cut_too() -> None:
    for seed in range(20):
        victim = Victim(100 + seed)
        victim.board.cut()
        victim.board.run(int(victim.rng.integers(1, BOOT)))
        victim.recover(int(victim.rng.integers(256)))
        assert 1 < victim.requested(RobotStatus).boot_count <= 3


@pytest.mark.parametrize("torn", [0, 255])
def test_however_often_booting_is_cut_the_count_of_boots_goes_on(torn: int) -> None:
    victim = Victim(5)
    victim.tick(HOST)
    for cycles in range(1000, BOOT, 20_000):
        victim.board.cut(torn)
        victim.board.run(cycles)
    victim.recover(torn)
    assert 2 <= victim.requested(RobotStatus).boot_count <= 2 + BOOT // 20_000
