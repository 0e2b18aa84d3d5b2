"""What the recorder says to a person, how badly, and of which robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from report_logs import FRAME, open_recorder

from firmware_protocol.events import Received
from firmware_protocol.faults.failures import FailureType
from firmware_protocol.messages import (
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    JuniorSensors,
    OpponentCode,
    Phase,
    RefereeState,
    RobotSession,
)
from hil.mcaplog import LogReader

if TYPE_CHECKING:
    from pathlib import Path

    from hil.recording.recorder import Recorder

FATAL, ERROR, WARNING, INFO = 5, 4, 3, 2
"""foxglove.Log's levels."""


def values(path: Path, *topics: str) -> list[Any]:
    return [entry.value for entry in LogReader(path).entries(topics)]


@pytest.mark.parametrize(
    ("kind", "level"),
    [("emergency", FATAL), ("safety", WARNING), ("error", ERROR), ("warning", WARNING), ("link", INFO), ("bout", INFO)],
)
def test_a_note_is_as_severe_as_its_kind(tmp_path: Path, kind: str, level: int) -> None:
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        recorder.note(kind, "something")
    (line,) = values(path, "/log")
    assert (line.level, line.message, line.name) == (level, "something", kind)


# --- rehearsed failures ----------------------------------------------------------------------------------------------


def rehearse(recorder: Recorder, *results: CommandResult, system: int = 1) -> None:
    """The left wheel is asked to be off, and the robot answers."""
    asked = CommandLong(system, 1, Command.INJECT_FAILURE, 0, 102.0, float(FailureType.OFF), 1.0)
    recorder.sent(1.0, asked)
    for number, result in enumerate(results):
        ack = CommandAck(Command.INJECT_FAILURE, int(result), target_system=255, target_component=190)
        recorder.received(Received(ack, system, 1, number, 1.1, FRAME))


def faults(path: Path) -> list[str]:
    return [event.text for event in values(path, "/events") if event.kind == "fault"]


@pytest.mark.parametrize(
    "result",
    [result for result in CommandResult if result not in {CommandResult.ACCEPTED, CommandResult.IN_PROGRESS}],
)
def test_a_rehearsal_that_is_refused_is_no_fault(tmp_path: Path, result: CommandResult) -> None:
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        rehearse(recorder, result)
        recorder.received(Received(CommandAck(Command.INJECT_FAILURE, 0), 1, 1, 9, 2.0, FRAME))  # nobody's any more
    assert faults(path) == []


@pytest.mark.parametrize("results", [[CommandResult.ACCEPTED], [CommandResult.IN_PROGRESS, CommandResult.ACCEPTED]])
def test_one_that_is_taken_is_noted_once(tmp_path: Path, results: list[CommandResult]) -> None:
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        rehearse(recorder, *results, CommandResult.ACCEPTED)
    (text,) = faults(path)
    assert text.startswith("fault begins: ")
    assert text.endswith(", rehearsed")


# --- of several robots, the one that pictures are about --------------------------------------------------------------


def state(time: float, x: float) -> RefereeState:
    return RefereeState(time, 1, time, (x, 0.0), 0.0, (0.2, 0.0), 0.0, 0.1, Phase.RUNNING, 0, OpponentCode.FLAT_LIGHT)


@pytest.mark.parametrize("ours", [1, 2])
def test_another_robots_referee_is_not_drawn(tmp_path: Path, ours: int) -> None:
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        recorder.sent(0.0, RobotSession(7, 0, 1, ours, 1, major=2, minor=0))
        for index in range(20):
            for system in (1, 2):
                recorder.received(Received(state(index * 0.05, 0.1 * system), system, 25, index, index * 0.05, FRAME))
                sensors = JuniorSensors(index * 0.05, (0.1 * system, 0.0), (1, 2), (3, 4), 7.4, 0)
                recorder.received(Received(sensors, system, 1, index, index * 0.05, FRAME))
    drawn = {round(transforms.transforms[0].translation.x, 6) for transforms in values(path, "/tf")}
    assert drawn == {round(0.1 * ours, 6)}
    assert len(values(path, "/referee/state")) == 40, "but both are in the log"
    assert len(values(path, "/arena/scene")) == 1
