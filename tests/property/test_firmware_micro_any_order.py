"""A micro-robot told things in any order, twice and late: no move is made twice, none unasked, and every move ends once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from firmware_bench import HOST, HOST_NUMBER, TICK
from hypothesis import given, settings
from hypothesis import strategies as st
from micro_bench import MicroBench, Other

from firmware_protocol.messages import (
    Command,
    CommandLong,
    RobotAck,
    RobotResultAck,
    RobotSession,
    RobotStatus,
    State,
    SwarmMove,
    SwarmObservation,
)
from firmware_protocol.vocabulary import SwarmOutcome

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

MOVING = {State.DRIVING, State.PERFORMING}
OPERATIONS = (
    *("move",) * 8, *("repeat",) * 6, *("wait",) * 6, *("arm",) * 5, *("acknowledge",) * 3, *("ask",) * 3,
    "sense", "bump", "hold", "disarm", "stop", "session", "silence",
)  # fmt: skip
"""The common ones more often, or nothing would ever be done."""


def standard(command: Command, param1: float, param3: float = 0.0) -> CommandLong:
    return CommandLong(target_system=1, target_component=1, command=int(command), param1=param1, param3=param3)


class Story:
    """A bench, what was said to it, and what must hold after every tick."""

    def __init__(self) -> None:
        self.bench = MicroBench()
        self.bench.others = [Other(1, 1.0, 0.3), Other(0, 2.0, 0.1)]
        self.said: list[Message] = []
        self.accepted: list[tuple[int, int]] = []
        self.waited_for: set[tuple[int, int]] = set()
        self.silent = 0
        self.bench.session = 100
        self.tell(self.opening())
        self.tell(standard(Command.ARM_DISARM, 1.0, HOST_NUMBER))

    def opening(self) -> RobotSession:
        self.bench.session += 1
        self.bench.sequence = 0
        return RobotSession(self.bench.session, 0, HOST_NUMBER, target_system=1, target_component=1, major=2, minor=1)

    def tell(self, *messages: Message) -> None:
        before = self.bench.state()
        self.silent = 0 if messages else self.silent + TICK
        if any(isinstance(message, RobotSession) for message in messages):
            self.waited_for.clear()  # it may be another session now: nobody waits for that of the one before
        for answer in self.bench.tick(*messages):
            if isinstance(answer, RobotAck) and answer.message == SwarmMove.ID and not answer.reason:
                self.accepted.append((answer.session, answer.sequence))
                self.waited_for.add((answer.session, answer.sequence))
        after = self.bench.state()
        if after not in MOVING:
            assert self.bench.wheels == (0, 0)
        if not messages:
            assert before in MOVING or after not in MOVING, "moves unasked"
            if self.silent >= 250:
                assert after not in MOVING, "moves unheard"
        if any(isinstance(m, CommandLong) and m.command == Command.FLIGHT_TERMINATION for m in messages):
            assert after is State.STOPPED
        self.said.extend(messages)

    def do(self, operation: str, choice: int) -> None:
        bench = self.bench
        match operation:
            case "move":
                self.tell(bench.move_message(choice % 60 / 10 - 3, choice % 7 / 100, options=choice % 64))
            case "sense":
                self.tell(bench.sense_message(choice % 500 / 1000))
            case "repeat":
                self.tell(self.said[choice % len(self.said)])
            case "acknowledge":
                for observation in bench.got(SwarmObservation)[-1:]:
                    self.tell(RobotResultAck(observation.session, observation.sequence, 1, 1))
            case "ask":
                self.tell(standard(Command.REQUEST_MESSAGE, SwarmObservation.ID, choice % 2 * HOST_NUMBER))
            case "bump" | "hold":
                bench.io.bump, bench.held = choice % 256, operation == "hold"
            case "arm" | "disarm":
                self.tell(standard(Command.ARM_DISARM, float(operation == "arm"), HOST_NUMBER))
            case "stop":
                self.tell(standard(Command.FLIGHT_TERMINATION, 1.0))
            case "session":
                self.tell(self.opening())
            case _:
                for _ in range(choice % 60):
                    self.tell(*([HOST] if operation == "wait" else []))


@pytest.mark.slow
@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.lists(st.tuples(st.sampled_from(OPERATIONS), st.integers(0, 10_000)), min_size=10, max_size=60))
def test_nothing_twice_and_nothing_unasked(operations: list[tuple[str, int]]) -> None:
    story = Story()
    for operation, choice in operations:
        story.do(operation, choice)
    story.tell(standard(Command.ARM_DISARM, 0.0))
    for _ in range(4):
        story.tell()
    story.tell(standard(Command.REQUEST_MESSAGE, RobotStatus.ID))
    accepted = set(story.accepted)
    assert story.bench.latest(RobotStatus).maneuvers == len(accepted)
    ended: dict[tuple[int, int], SwarmObservation] = {}
    for observation in story.bench.got(SwarmObservation):
        if observation.outcome != SwarmOutcome.NONE:
            first = ended.setdefault((observation.session, observation.sequence), observation)
            assert observation == first, "an observation does not change"
    assert set(ended) <= accepted
    assert story.waited_for <= set(ended)
