"""Commands in any order, repeated and delayed at will, between silences: nothing is performed twice, nothing moves unasked."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from firmware_bench import HOST, HOST_NUMBER, TICK, FirmwareBench
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol.messages import (
    Command,
    CommandLong,
    ContestCommand,
    JuniorManeuver,
    JuniorManeuverResult,
    RobotAck,
    RobotSession,
    RobotStatus,
    State,
)
from firmware_protocol.vocabulary import Action, Outcome

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

MOVING = {State.DRIVING, State.PERFORMING, State.CONTEST}
OPERATIONS = (
    *("maneuver",) * 8, *("repeat",) * 6, *("wait",) * 5, *("arm",) * 6, "wheels", "wheels",
    "disarm", "stop", "contest", "end contest", "session", "silence",
)  # fmt: skip
"""The common ones more often, or nothing would ever be performed."""


def standard(command: Command, param: float) -> CommandLong:
    return CommandLong(target_system=1, target_component=1, command=int(command), param1=param)


class Story:
    """A bench, what was said to it, and what must hold after every tick."""

    def __init__(self) -> None:
        self.bench = FirmwareBench()
        self.said: list[Message] = []
        self.accepted: set[tuple[int, int]] = set()
        self.silent = 0
        self.bench.session = 100
        self.tell(self.opening())
        self.tell(self.bench.write_message((Action.FF,), current=0))

    def opening(self) -> RobotSession:
        self.bench.session += 1
        self.bench.sequence = 0
        return RobotSession(self.bench.session, 0, HOST_NUMBER, target_system=1, target_component=1, major=2, minor=0)

    def tell(self, *messages: Message) -> None:
        before = self.bench.state()
        self.silent = 0 if messages else self.silent + TICK
        for answer in self.bench.tick(*messages):
            if isinstance(answer, RobotAck) and answer.message == JuniorManeuver.ID and not answer.reason:
                self.accepted.add((answer.session, answer.sequence))
        after = self.bench.state()
        if after not in MOVING:
            assert self.bench.wheels == (0, 0)
        if not messages:
            assert before in MOVING or after not in MOVING or before is State.COUNTDOWN, "moves unasked"
            if self.silent >= 250:
                assert after not in {State.DRIVING, State.PERFORMING}, "moves unheard"
        if any(isinstance(m, CommandLong) and m.command == Command.FLIGHT_TERMINATION for m in messages):
            assert after is State.STOPPED
        self.said.extend(messages)

    def do(self, operation: str, choice: int) -> None:
        bench = self.bench
        match operation:
            case "maneuver":
                message = bench.maneuver_message((Action.FF, Action.L), (20 + choice % 80) / 1000)
                self.tell(message)
            case "wheels":
                self.tell(bench.wheels_message(0.5, -0.5, (choice % 300) / 1000))
            case "repeat":
                self.tell(self.said[choice % len(self.said)])
            case "arm" | "disarm":
                self.tell(standard(Command.ARM_DISARM, float(operation == "arm")))
            case "stop":
                self.tell(standard(Command.FLIGHT_TERMINATION, 1.0))
            case "contest":
                self.tell(bench.contest_message(ContestCommand.START, choice % 100 / 1000))
            case "end contest":
                self.tell(bench.contest_message(ContestCommand.STOP))
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
    contests = False
    for operation, choice in operations:
        story.do(operation, choice)
        contests |= story.bench.state() in {State.COUNTDOWN, State.CONTEST}
    story.tell(standard(Command.ARM_DISARM, 0.0))
    story.tell(standard(Command.REQUEST_MESSAGE, RobotStatus.ID))
    begun = story.bench.latest(RobotStatus).maneuvers
    if not contests:
        assert begun == len(story.accepted)
    results = {(r.session, r.sequence): Outcome(r.outcome) for r in story.bench.got(JuniorManeuverResult)}
    assert set(results) <= story.accepted
    for result in story.bench.got(JuniorManeuverResult):
        assert results[result.session, result.sequence] == result.outcome, "a result does not change"
        assert result.done <= 2
