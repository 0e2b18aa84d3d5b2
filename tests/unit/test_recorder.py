"""The recorder: everything that passes the bridge, and what the learner does, on its own topic."""

from __future__ import annotations

import json
import struct
from collections import Counter
from dataclasses import replace
from math import isnan, sqrt
from typing import TYPE_CHECKING, Any

import pytest
from report_logs import FRAME, FullDisk, Wire, coaching_log, open_recorder

from firmware_protocol.errors import LinkClosedError, LinkError, LinkTimeoutError
from firmware_protocol.events import PeerBack, PeerFound, PeerLost, Received, Rejected, RejectReason
from firmware_protocol.messages import JuniorSensors, JuniorWheels, OpponentCode, Phase, RefereeState, Statustext
from hil.bridge.operator import OperatorInput
from hil.bridge.taps import NOTHING, Circumstances, Opening
from hil.mcaplog import LogError, LogReader, differences
from hil.mcaplog.records import (
    BridgeOpening,
    BridgeStep,
    EventRecord,
    RejectedInput,
    SessionDrawn,
    StepRecord,
    TrialRecord,
    UnsentBytes,
    WireBytes,
)
from hil.mcaplog.writing.joints import PLOTS
from hil.mcaplog.writing.writer import LogWriter

if TYPE_CHECKING:
    from pathlib import Path

SENSORS = JuniorSensors(0.5, (0.0, 0.1), (1, 2), (3, 4), 7.4, 3)


def state(time: float, opponent: OpponentCode = OpponentCode.FLAT_LIGHT, bout: int = 1) -> RefereeState:
    """Junior at (0.1, 0.2), turned by a quarter."""
    return RefereeState(time, bout, time, (0.1, 0.2), 1.5708, (0.2, 0.0), -1.0, 0.1, Phase.RUNNING, 0, opponent)


def values(path: Path, *topics: str) -> list[Any]:
    """The entries of a few topics."""
    return [entry.value for entry in LogReader(path).entries(topics)]


def test_steps_bytes_and_messages_are_recorded(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        recorder.step(1.0, [(0.99, b"ab"), (1.0, b"c")], Circumstances((OperatorInput("key w", "1"),)))
        recorder.wire_rx(0.99, b"ab")
        recorder.received(Received(SENSORS, 3, 1, 200, 0.99, FRAME))
        recorder.received(Rejected(RejectReason.NOISE, b"\x07", 1.0, "one byte"))
        recorder.step(1.5, [])
        recorder.wire_tx(1.5, b"xyz")
        wheels = JuniorWheels(1, 2, (0.5, -0.5), 0.25, 3, 1)
        recorder.sent(1.5, wheels)
    assert values(path, "/bridge/step") == [
        BridgeStep(1.0, (0.99, 1.0), (2, 1), ("key w",), ("1",), network="memory:"),
        BridgeStep(1.5, (), (), network="memory:"),
    ]
    assert values(path, "/wire/rx", "/wire/tx") == [WireBytes("rx", "memory:", b"ab"), WireBytes("tx", "memory:", b"xyz")]
    assert values(path, "/wire/rejected") == [RejectedInput("bytes outside any frame", "one byte", b"\x07")]
    received, sent = LogReader(path).entries(["/junior/sensors", "/junior/wheels"])
    assert (received.value, received.sender, received.frame, received.time) == (SENSORS, (3, 1), 200, 0.99)
    assert (sent.value, sent.sender, sent.frame, sent.time) == (wheels, (255, 190), None, 1.5)


def test_each_of_several_networks_has_its_name_in_one_log(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        taps = [recorder.of_network(name) for name in ("a", "b")]
        for number, tap in enumerate(taps):
            tap.opened(Opening("ab"[number], f"{'ab'[number]}:1", "mavlink", lockstep=False, clock=0.5 + number))
            tap.session_drawn(7 + number)
        for number, tap in enumerate(taps):
            tap.step(2.0 + number, [(1.5, b"ab")], NOTHING)
            tap.wire_rx(1.5, b"ab")
            tap.wire_tx(2.0, b"cd")
        taps[1].step(4.0, [], Circumstances(back="b:2"))
        taps[1].unsent(4.0, b"ef", LinkTimeoutError("b:2", "busy"))
        taps[0].of_network("c").session_drawn(9)
        recorder.note("link", "told")
    opening = [BridgeOpening(name, f"{name}:1", "mavlink", lockstep=False, clock=clock, signing_time=0)
               for name, clock in (("a", 0.5), ("b", 1.5))]  # fmt: skip
    assert values(path, "/bridge/open") == opening
    assert values(path, "/bridge/session") == [SessionDrawn("a", 7), SessionDrawn("b", 8), SessionDrawn("c", 9)]
    assert values(path, "/bridge/step") == [
        BridgeStep(2.0, (1.5,), (2,), network="a"),
        BridgeStep(3.0, (1.5,), (2,), network="b"),
        BridgeStep(4.0, (), (), network="b", back="b:2"),
    ]
    assert [(wire.direction, wire.link) for wire in values(path, "/wire/rx", "/wire/tx")] == [
        ("rx", "a"), ("tx", "a"), ("rx", "b"), ("tx", "b")
    ]  # fmt: skip
    assert values(path, "/wire/unsent") == [UnsentBytes("b", b"ef", timeout=True, error="busy")]
    (told,) = LogReader(path).entries(["/events"])
    assert told.time == 4.0


@pytest.mark.parametrize(("error", "timeout"), [(LinkTimeoutError, True), (LinkClosedError, False)])
def test_bytes_that_were_not_taken_are_not_recorded_as_sent(
    tmp_path: Path,
    error: type[LinkError],
    timeout: bool,  # noqa: FBT001 - as of the record
) -> None:
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        recorder.step(1.0, [])
        recorder.unsent(1.0, b"xyz", error("memory:", "nobody reads"))
    assert values(path, "/wire/unsent") == [UnsentBytes("memory:", b"xyz", timeout=timeout, error="nobody reads")]
    assert values(path, "/wire/tx") == []


def test_what_happens_to_the_link_is_told(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        recorder.step(2.0, [])
        recorder.event(PeerFound(1, 2.0))
        recorder.event(PeerLost(1, 2.0, "unplugged"))
        recorder.event(PeerBack(1, 2.0, rebooted=True))
        recorder.event(Received(SENSORS, 1, 1, 0, 2.0, FRAME))
        recorder.note("safety", "emergency stop", by="operator", distance=0.5)
        recorder.received(Received(Statustext(4, "battery low"), 1, 1, 1, 2.0, FRAME))
    events = values(path, "/events")
    assert [event.text for event in events] == [
        "robot 1 answers", "robot 1 is lost: unplugged", "robot 1 is back, restarted", "emergency stop",
    ]  # fmt: skip
    assert [event.kind for event in events] == ["link", "link", "link", "safety"]
    assert json.loads(events[3].fields) == {"by": "operator", "distance": 0.5}
    lines = values(path, "/log")
    assert [line.message for line in lines] == [*(event.text for event in events), "battery low"]
    assert lines[4].name == "robot 1"
    assert lines[4].level == 3  # foxglove.Log.WARNING


def test_poses_and_outlines_follow_the_referee(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        for index in range(101):
            recorder.received(Received(state(index * 0.05), 1, 25, index, index * 0.05, FRAME))
        recorder.received(Received(state(5.05, OpponentCode.POINT_LIGHT), 1, 25, 101, 5.05, FRAME))
    topics = Counter(entry.topic for entry in LogReader(path).entries())
    assert topics["/tf"] == 52  # ten a second, and when the opponent changes
    assert topics["/arena/scene"] == topics["/arena/outline/opponent"] == 2
    junior, opponent = values(path, "/tf")[0].transforms
    assert (junior.parent_frame_id, junior.child_frame_id, opponent.child_frame_id) == ("world", "junior", "opponent")
    assert (junior.translation.x, junior.translation.y) == (0.1, 0.2)
    assert (junior.rotation.z, junior.rotation.w) == pytest.approx((sqrt(0.5), sqrt(0.5)), abs=1e-5)
    first, second = values(path, "/arena/scene")
    assert [entity.id for entity in first.entities] == ["ring", "junior", "opponent"]
    assert [entity.frame_id for entity in first.entities] == ["world", "junior", "opponent"]
    width = [max(p.y for p in scene.entities[2].lines[0].points) * 2 for scene in (first, second)]
    assert width == pytest.approx([0.14, 0.04], abs=0.002)
    cloud = values(path, "/arena/outline/ring")[0]
    assert len(cloud.data) == cloud.point_stride * 428  # the ring's border, a point every 5 mm


def test_joint_states_are_what_ros_calls_so(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        for index in range(11):
            time = index * 0.04
            sensors = JuniorSensors(time + 0.5, (0.25 + time, -0.5), (index, 2), (3, 4), 7.5, 3)
            recorder.received(Received(sensors, 1, 1, index, time, FRAME))
        recorder.received(Received(replace(sensors, time=0.0), 1, 1, 12, 0.8, FRAME))  # restarted
    assert [len(values(path, topic)) for topic in PLOTS] == [4, 4, 4, 1]  # five a second, the battery once
    for topic, state in (
        ("/junior/plot/eyes", (["eye_left", "eye_right"], [5.0, 2.0], [])),
        ("/junior/plot/floor", (["floor_left", "floor_right"], [3.0, 4.0], [])),
        ("/junior/plot/wheels", (["wheel_left", "wheel_right"], [0.45, -0.5], [1.0, 0.0])),
    ):
        seconds, names, positions, velocities = joint_state(values(path, topic)[1])
        assert names == state[0]
        assert seconds == pytest.approx(0.2)
        assert positions == pytest.approx(state[1])
        assert velocities == pytest.approx(state[2])
    assert joint_state(values(path, "/junior/plot/battery")[0]) == (0.0, ["battery"], [7.5], [])
    for number in (0, 3):  # nothing before it, or what was before was another life
        velocities = joint_state(values(path, "/junior/plot/wheels")[number])[3]
        assert [isnan(speed) for speed in velocities] == [True, True]


def joint_state(data: bytes) -> tuple[float, list[str], list[float], list[float]]:
    """A joint state taken apart by what the standard says of its layout: time in s, names, positions, velocities."""
    assert data[:4] == b"\0\1\0\0"
    body, at = data[4:], 0

    def take(layout: str) -> Any:  # noqa: ANN401 - whatever comes next
        nonlocal at
        size = struct.calcsize("<" + layout)
        at += -at % size
        at += size
        return struct.unpack_from("<" + layout, body, at - size)[0]

    def text() -> str:
        nonlocal at
        length = take("I")
        at += length
        return str(body[at - length : at - 1], "ascii")

    seconds = take("i") + take("I") / 1e9
    assert text() == ""
    names = [text() for _ in range(take("I"))]
    positions, velocities, efforts = ([take("d") for _ in range(take("I"))] for _ in range(3))
    assert (efforts, len(body)) == ([], at)
    return seconds, names, positions, velocities


def test_an_opponent_that_nobody_knows_is_not_drawn(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        recorder.received(Received(state(0.0, OpponentCode.KEEP), 1, 25, 0, 0.0, FRAME))
    assert [entity.id for entity in values(path, "/arena/scene")[0].entities] == ["ring", "junior"]


def test_the_learner_is_recorded(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    coaching_log(path, budget=60)
    trials, steps = values(path, "/pal/trial"), values(path, "/pal/generation")
    assert [trial.id for trial in trials] == list(range(1, 61))
    decisions, credited = values(path, "/pal/decision"), values(path, "/pal/credit")
    assert [(one.trial, one.current, one.actions, one.exam) for one in decisions] == [
        (trial.id, trial.current, trial.actions, trial.exam) for trial in trials
    ]
    assert (decisions[0].motive, decisions[0].origin, decisions[0].previous) == ("untried", "random", "any")
    assert [(one.trial, one.telling, one.credits[one.trials.index(one.trial)]) for one in credited] == [
        (trial.id, "performed", trial.fitness) for trial in trials
    ]
    assert len({one.digest for one in (*decisions, *credited)}) == 120
    assert all(
        isinstance(trial, TrialRecord) and trial.ended == "completed" and len(trial.actions.split()) == 4 for trial in trials
    )
    assert all(isinstance(step, StepRecord) and step.previous == "any" for step in steps)
    rated = {trial.actions: trial.fitness for trial in trials if trial.phase == 1 and not trial.exam}
    assert all(step.best >= step.mean for step in steps)
    assert {step.actions for step in steps if step.phase == 1} <= set(rated)
    advice = json.loads(values(path, "/pal/advice")[0].json)
    assert advice["opponent"] == "flat-light"
    bouts = [event for event in values(path, "/events") if event.kind == "bout"]
    assert json.loads(bouts[0].fields)["number"] == 1
    assert LogReader(path).metadata == {}


def test_equal_runs_leave_equal_logs(tmp_path: Path) -> None:
    paths = [tmp_path / "one.mcap", tmp_path / "two.mcap", tmp_path / "three.mcap"]
    for path, seed in zip(paths, (3, 3, 4), strict=True):
        coaching_log(path, budget=40, seed=seed)
    assert differences(paths[0], paths[1]) == []
    assert differences(paths[0], paths[2])


def test_a_recorder_that_was_not_closed_leaves_a_log(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    recorder = coaching_log(path, budget=60, close=False)
    assert len(values(path, "/pal/trial")) > 30
    recorder.close()
    recorder.close()
    assert len(values(path, "/pal/trial")) == 60


def test_after_a_full_disk_the_robot_can_still_be_spoken_to(tmp_path: Path) -> None:
    recorder = open_recorder(tmp_path / "log.mcap")
    wire = Wire(recorder)
    wire.up(SENSORS)
    writer = recorder._writer
    assert isinstance(writer, LogWriter)
    writer._output.file.close()
    writer._output.file = FullDisk()  # type: ignore[assignment]
    wire.now = 10.0
    with pytest.raises(LogError, match="No space left"):
        wire.up(SENSORS)
    for _ in range(10):
        wire.now += 1.0
        wire.command()
    recorder.note("safety", "stopped")
    recorder.close()


def test_events_survive_fields_that_json_has_no_word_for(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        recorder.note("link", "odd", where=tmp_path)
    (event,) = values(path, "/events")
    assert isinstance(event, EventRecord)
    assert json.loads(event.fields) == {"where": str(tmp_path)}
