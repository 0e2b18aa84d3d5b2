"""Of several robots in one log, pictures show one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import hil
from hil.mcaplog.reading.reader import LogReader
from hil.recording.protagonist import Protagonist
from hil.recording.recorder import Recorder
from hil.report.gather import gather

if TYPE_CHECKING:
    from pathlib import Path


def test_it_is_the_first_heard_until_one_is_taken_and_stays_that() -> None:
    robot = Protagonist()
    assert robot.heard(3)
    assert not robot.heard(1)
    robot.taken(1)
    assert robot.heard(1)
    assert not robot.heard(3)
    robot.taken(3)
    assert robot.heard(1)


def test_a_log_of_three_is_drawn_and_reported_for_the_one_that_was_taken_first(tmp_path: Path) -> None:
    path = tmp_path / "three.mcap"
    with (
        Recorder(path, run={}, config={}, link="sim", lockstep=True) as recorder,
        hil.connect_all("sim://junior?count=3&seed=2", taps=[recorder]) as robots,
    ):
        robots.arm()
        robots[2].perform("L R", period=0.1)
        robots.wait(3.0)
        expected = robots.now()
    entries = list(LogReader(path).entries(["/junior/sensors"]))
    heard = {entry.sender[0] for entry in entries if entry.sender}
    assert heard == {1, 2, 3}
    data = gather(path)
    assert data.sensors is not None
    one = [entry for entry in entries if entry.sender and entry.sender[0] == 1]
    assert len(data.sensors.times) == len(one)
    assert data.sensors.times[-1] <= expected + 0.05  # leaving waits until they say that they are disarmed
    joints = [entry.time for entry in LogReader(path).entries(["/junior/plot/eyes"])]
    assert len(joints) <= 10 * expected + 2
    poses = [entry.time for entry in LogReader(path).entries(["/tf"])]
    assert len(poses) <= 10 * expected + 2
