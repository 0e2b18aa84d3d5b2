"""What was recorded and learnt with protocol 1.0 is still read: `protocol1/` holds what `hil coach` left then.

hil coach --budget 8 --seed 3 --held-out 1 --log coach.mcap --advice-out advice.toml --checkpoint checkpoint.json
"""

from __future__ import annotations

import json
import shutil
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.messages import JuniorManeuverResult, RobotAck, RobotResultAck, RobotSession, RobotStatus, State
from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.report.gather import gather
from hil.sumo.advice_file import load_advice

if TYPE_CHECKING:
    import pytest

FOLDER = Path(__file__).with_name("protocol1")
LOG, ADVICE, CHECKPOINT = FOLDER / "coach.mcap", FOLDER / "advice.toml", FOLDER / "checkpoint.json"


def test_every_entry_of_the_log_is_read_as_a_message_of_today() -> None:
    reader = LogReader(LOG)
    entries = list(reader.entries())
    assert reader.health().startswith("whole")
    kinds = Counter(type(entry.value) for entry in entries if entry.topic.startswith(("/robot/", "/junior/maneuver")))
    assert {RobotAck, RobotStatus, RobotSession, RobotResultAck, JuniorManeuverResult} <= kinds.keys()
    assert all(kind.__module__.startswith("firmware_protocol.messages") for kind in kinds)
    assert not [entry for entry in entries if entry.topic in {"/junior/ack", "/junior/status", "/junior/session"}]
    (session,) = {
        entry.value for entry in entries if isinstance(entry.value, RobotSession) and entry.value.target_component == 1
    }
    assert (session.major, session.minor, session.host, session.target_system) == (1, 0, 0, 1)
    assert {entry.value.state for entry in entries if isinstance(entry.value, RobotStatus)} <= set(State)
    results = [entry.value for entry in entries if isinstance(entry.value, JuniorManeuverResult)]
    assert {(result.target_system, result.target_component) for result in results} == {(0, 0)}, "they named nobody"
    assert len({result.sequence for result in results}) >= 8


def test_a_report_is_made_of_the_log() -> None:
    data = gather(LOG)
    assert len(data.trials) == 8
    assert len(data.bouts) >= 2
    assert data.link.robot is not None
    assert data.link.robot.good > 0


def test_the_advice_is_played_and_the_run_is_gone_on_with(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert load_advice(ADVICE).opponent == "flat-light"
    assert run(["bout", "--advice", str(ADVICE), "--trials", "2", "--no-log", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["trials"] == 2
    checkpoint = shutil.copy(CHECKPOINT, tmp_path / "checkpoint.json")
    files = ["--checkpoint", str(checkpoint), "--advice-out", str(tmp_path / "advice.toml")]
    assert run(["coach", "--resume", "--seed", "3", "--budget", "8", "--held-out", "1", "--no-log", "--json", *files]) == 0
    assert json.loads(capsys.readouterr().out)["maneuvers"] == 8
