"""A micro-robot's ATmega328P does in every control period what the host build does, whatever moves it is sent on."""

from __future__ import annotations

from collections import Counter

import pytest
from avr_micro_twins import PERIOD, MicroTwins
from micro_life import MicroLife

from firmware_protocol.events import Received
from firmware_protocol.messages import Reason, RobotAck, SwarmMove, SwarmObservation
from firmware_protocol.vocabulary import ObservationFlag, SwarmOutcome
from firmware_protocol.wire.mavlink import MavlinkCodec

pytestmark = pytest.mark.avr


class Heard:
    """What the host has got."""

    def __init__(self) -> None:
        self.codec = MavlinkCodec(system=255, component=190)
        self.outcomes: Counter[SwarmOutcome] = Counter()
        self.answers: Counter[Reason] = Counter()
        self.flags = 0

    def listen(self, data: bytes, now: float) -> None:
        for event in self.codec.receive(data, now):
            if not isinstance(event, Received):
                continue
            if isinstance(event.message, SwarmObservation):
                self.outcomes[SwarmOutcome(event.message.outcome)] += 1
                self.flags |= event.message.flags
            elif isinstance(event.message, RobotAck) and event.message.message == SwarmMove.ID:
                self.answers[Reason(event.message.reason)] += 1


def live(seed: int, seconds: float) -> tuple[MicroTwins, Heard]:
    """Let a robot live; both its boards are compared in every period."""
    robot, heard = MicroTwins(), Heard()
    life = MicroLife(seed, robot).periods()
    for period in range(round(seconds / PERIOD)):
        heard.listen(robot.step(next(life)), period * PERIOD)
    return robot, heard


@pytest.mark.slow
def test_moves_of_every_kind_and_what_comes_between() -> None:
    robot, heard = live(seed=4, seconds=120)
    assert set(heard.outcomes) == set(SwarmOutcome)
    assert {Reason.NONE, Reason.BAD_VALUE, Reason.DISARMED} <= set(heard.answers)
    assert robot.turning > 5000
    assert robot.short > 0
    assert robot.boots > 1


@pytest.mark.nightly
def test_an_hour_of_moves() -> None:
    robot, heard = live(seed=2, seconds=3600)
    assert min(heard.outcomes[outcome] for outcome in SwarmOutcome) > 5
    assert heard.answers[Reason.NOT_FOUND] > 0
    assert heard.flags == ObservationFlag(31) & ~ObservationFlag.TOUCHES_BOX
    assert robot.boots > 10
