"""What a report says first: states of robots, emergency stops, keys, whatever kind of run it was."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer
from report_logs import Wire, driving_log, open_recorder

from firmware_protocol.messages import CommandLong, Heartbeat, RobotStatus, Statustext
from firmware_protocol.messages.robot import State
from firmware_protocol.messages.standard import GROUND_STATION, ROVER, Command
from firmware_protocol.vocabulary import ANY_STIMULUS, Action, situation_name, spelled_out
from hil.bridge.operator import OperatorInput
from hil.bridge.taps import Circumstances
from hil.mcaplog.errors import UnreadableLogError
from hil.mcaplog.records import EventRecord
from hil.questions import ASKED
from hil.report.gather import gather
from hil.report.happened.course import MOST_HAPPENINGS, SILENCE, Course
from hil.report.happened.course_figures import COLUMNS, MOST_LANES, thinned, time_line
from hil.report.happened.words import MOST_ROWS, happenings_table, results_said, states_table, stops_said
from hil.report.run_data import RunData
from hil.report.style import styled
from hil.report.words import summary, title_of
from hil.statistics import quantile

DISARMED, READY, DRIVING, STOPPED = State.DISARMED, State.READY, State.DRIVING, State.STOPPED


def heartbeat(state: int, kind: int = ROVER) -> Heartbeat:
    return Heartbeat(kind, 0, 0, state, 4)


def stop(system: int = 1, confirmation: int = 0) -> CommandLong:
    return CommandLong(system, 1, Command.FLIGHT_TERMINATION, confirmation, 1.0)


def run_of(course: Course, end: float) -> RunData:
    return RunData(Path("log.mcap"), end=end, course=course)


def told(course: Course, *states: tuple[float, int], system: int = 1) -> None:
    for time, state in states:
        course.received(heartbeat(state), (system, 1), time)


def stopped_course() -> Course:
    course = Course()
    told(course, (0.0, DISARMED), (1.0, READY), (2.0, DRIVING))
    course.asked(2.5, ["key e", "pose 1 2 3"], ["1", ""])
    course.sent(stop(), 2.51)
    course.sent(stop(confirmation=1), 2.6)
    told(course, (2.53, STOPPED), (3.5, STOPPED), (4.0, DISARMED), (5.0, DISARMED))
    return course


def test_keys_of_a_run_that_asks_questions_are_answers(tmp_path: Path) -> None:
    pressed = [OperatorInput(f"key {key}") for key in ("d", "\r", "x")]
    with open_recorder(tmp_path / "log.mcap") as recorder:
        recorder.step(1.0, [], Circumstances((OperatorInput("key d"),)))
        recorder.note(ASKED, "how does it end?", choices=["drawn"])
        recorder.step(2.0, [], Circumstances((*pressed, OperatorInput("drawn"))))
    texts = [one.text for one in gather(tmp_path / "log.mcap").course.happenings]
    assert texts == ["d, disarm", "d, drawn", "Enter, ready", "x", "drawn, said on the live page"]


def test_states_follow_one_another_and_end_in_silence() -> None:
    course = Course()
    told(course, (0.0, DISARMED), (1.0, DISARMED), (2.0, READY), (20.0, READY), (21.0, DISARMED))
    assert course.spans(1, 30.0) == [
        (0.0, 2.0, DISARMED), (2.0, 2.0 + SILENCE, READY), (20.0, 21.0, READY), (21.0, 21.0 + SILENCE, DISARMED),
    ]  # fmt: skip
    assert course.spans(1, 22.0)[-1] == (21.0, 22.0, DISARMED), "not beyond the log's end"


def test_only_robots_have_states() -> None:
    course = Course()
    course.received(heartbeat(READY), (255, 190), 0.0)
    course.received(heartbeat(READY, GROUND_STATION), (7, 1), 0.0)
    course.received(heartbeat(READY), (3, 25), 0.0)
    assert course.states == {}
    status = RobotStatus(**dict.fromkeys(RobotStatus.__dataclass_fields__, 0) | {"state": int(DRIVING)})
    course.received(status, (3, 1), 1.0)
    assert list(course.states) == [3]


def test_an_emergency_stop_is_told_first_with_its_key() -> None:
    data = run_of(stopped_course(), 6.0)
    (said,) = stops_said(data)
    assert said == (
        "The emergency stop was engaged at 2.51 s, by the key e; the robot confirmed it 20 ms later. It was released at 4.00 s."
    )
    assert summary(data)[0] == said
    table = happenings_table(data)
    assert table is not None
    assert table.rows == (
        ("2.50 s", "key", "e, emergency stop"),
        ("2.51 s", "emergency stop", "commanded, by the key e"),
        ("2.53 s", "emergency stop", "engaged, as the robot said"),
        ("4.00 s", "emergency stop", "released"),
    )


def test_a_stop_that_nobody_confirms_is_told_as_that() -> None:
    course = Course()
    told(course, (0.0, READY))
    course.sent(stop(), 1.0)
    told(course, (2.0, READY))
    assert stops_said(run_of(course, 3.0)) == ["The emergency stop was engaged at 1.00 s, by command; no robot confirmed it."]


def test_a_stop_at_the_robot_itself_is_nobody_s_command() -> None:
    course = Course()
    course.sent(stop(), 1.0)
    told(course, (1.0, STOPPED), (2.0, READY), (20.0, STOPPED), (21.0, STOPPED))
    first, second = course.stops()
    assert (first.commanded, first.released) == (1.0, 2.0)
    assert (second.commanded, second.confirmed, second.released) == (None, 20.0, None)
    (said,) = stops_said(run_of(course, 22.0))
    assert "At 20.00 s the robot told of an emergency stop that nobody here had commanded. It was still engaged" in said


def test_one_stop_of_many_robots_is_one() -> None:
    course = Course()
    for system in (1, 2, 3):
        told(course, (0.0, READY), system=system)
    course.sent(stop(0), 1.0)
    for system in (1, 2, 3):
        told(course, (1.0 + system / 10, STOPPED), (2.0 + system / 10, DISARMED), system=system)
    (found,) = course.stops()
    assert (found.robots, found.confirmed, found.released) == ({1, 2, 3}, 1.1, 2.3)
    (said,) = stops_said(run_of(course, 3.0))
    assert "robots 1, 2 and 3 confirmed it 100 ms later" in said


def test_a_stop_of_what_is_stopped_is_no_new_one() -> None:
    course = Course()
    course.sent(stop(), 1.0)
    told(course, (1.1, STOPPED), (2.0, STOPPED))
    course.sent(stop(), 1.9)
    assert len(course.stops()) == 1


def test_what_is_done_again_and_again_is_one_row() -> None:
    course = Course()
    for number in range(5):
        course.asked(1.0 + number / 10, ["key ^"], ["1"])
    for system in range(1, 34):
        course.happened(2.0, "link", f"robot {system} answers")
    course.asked(3.0, ["interrupt"], [""])
    data = run_of(course, 4.0)
    table = happenings_table(data)
    assert table is not None
    assert [row[2] for row in table.rows] == [
        "drive forward, 5 times in 0.4 s",
        "each robot answers, 33 times in 0.0 s",
        "the run was interrupted (Ctrl-C or a signal)",
    ]
    assert summary(data)[0] == "At 3.00 s the run was interrupted (Ctrl-C or a signal)."


def test_what_is_grave_is_kept_where_not_all_can_be() -> None:
    course = Course()
    for number in range(MOST_HAPPENINGS + 10):
        course.happened(number / 100, "key", f"key {number}")
    course.sent(stop(), 49.0)
    data = run_of(course, 100.0)
    table = happenings_table(data)
    assert table is not None
    assert len(table.rows) == MOST_ROWS
    assert table.title == f"{MOST_ROWS} of the {MOST_HAPPENINGS + 12:,} things that happened"
    assert [row[1] for row in table.rows].count("emergency stop") == 2


def test_the_log_tells_of_it_all(tmp_path: Path) -> None:
    with open_recorder(tmp_path / "log.mcap") as recorder:
        wire = Wire(recorder)
        for state in (DISARMED, READY):
            wire.up(heartbeat(state))
            wire.now += 1.0
        recorder.step(wire.now, [], Circumstances(inputs=(OperatorInput("key e", "1"), OperatorInput("pose 1 0 0 0"))))
        wire.down(stop())
        wire.now += 0.05
        wire.up(heartbeat(STOPPED))
        wire.up(Statustext(2, "Emergency stop"))
        wire.now += 1.0
        wire.up(heartbeat(DISARMED))
    data = gather(tmp_path / "log.mcap")
    assert summary(data)[0].startswith("The emergency stop was engaged at 2.00 s, by the key e; the robot confirmed it 50 ms")
    assert [one.text for one in data.course.happenings] == ["e, emergency stop", "robot 1: Emergency stop"]
    table = states_table(data)
    assert table is not None
    assert {row[0]: row[2] for row in table.rows} == {"disarmed": "1.0 s", "ready": "1.0 s", "stopped": "1.0 s"}


def test_somebody_else_s_log_is_told_as_that(tmp_path: Path) -> None:
    with (tmp_path / "foreign.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("sensor_msgs/Imu", "jsonschema", b"{}")
        for topic, count in (("/imu", 3), ("/camera", 1)):
            channel = writer.register_channel(topic, "json", schema)
            for time in range(count):
                writer.add_message(channel, log_time=time, publish_time=time, data=b"{}")
        writer.finish()  # type: ignore[no-untyped-call]
    with pytest.raises(
        UnreadableLogError, match=r"nothing in it was recorded by hil. It holds /imu \(3 entries\), /camera \(1 entry\)"
    ):
        gather(tmp_path / "foreign.mcap")


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ('{"checks": [{"name": "a", "passed": true}, {"name": "b", "passed": null}]}', ["1 of 1 check passed."]),
        (
            '{"checks": [{"name": "a", "passed": true}, {"name": "b", "passed": false}, 3]}',
            ["1 of 2 checks passed; what failed: b."],
        ),
        ('{"slots": [{}, {}]}', ["The memory of the robot holds what to do in 2 situations, as read back."]),
        ('{"maneuvers": 5}', []),
        ("[1]", []),
        ("{", []),
        ("", []),
    ],
)
def test_what_came_of_a_check_or_a_deployment_is_told(fields: str, said: list[str]) -> None:
    data = run_of(Course(), 1.0)
    data.events = [(0.5, EventRecord("result", "done", fields))]
    assert results_said(data) == said
    assert happenings_table(data) is None


def test_the_headline_is_of_who_was_there() -> None:
    course = Course()
    told(course, (0.0, READY))
    assert title_of(run_of(course, 1.0)) == "What the robot did"
    told(course, (0.0, READY), system=2)
    data = run_of(course, 1.0)
    assert title_of(data) == "What 2 robots did"
    data.metadata = {"config": {"verb": "check"}}
    assert title_of(data) == "A robot was checked"


def test_few_bars_show_what_lasted_and_every_stop() -> None:
    spans = [(number / 10, (number + 1) / 10, READY if number % 10 else DRIVING) for number in range(10_000)]
    spans[5_555] = (555.5, 555.51, STOPPED)
    few = thinned(spans, 0.0, 1_000.0)
    assert len(few) <= COLUMNS
    assert [state for _, _, state in few].count(STOPPED) == 1
    shown = sum(end - start for start, end, state in few if state == READY)
    assert shown > 900.0
    assert all(before[1] <= after[0] for before, after in pairwise(few))
    assert thinned(spans[:5], 0.0, 1_000.0) == spans[:5]


@pytest.mark.slow
@pytest.mark.parametrize("robots", [1, MOST_LANES, MOST_LANES + 1])
def test_a_row_for_each_state_or_robot_or_a_count(robots: int) -> None:
    course = Course()
    for system in range(1, robots + 1):
        told(course, (0.0, DISARMED), (1.0, READY), (3.0, 77), system=system)
    with styled():
        drawn = time_line(run_of(course, 5.0))
    assert drawn is not None
    upper = drawn.axes[0]
    names = [label.get_text() for label in upper.get_yticklabels()]
    if robots == 1:
        assert names == ["state 77", "ready", "disarmed"]
    elif robots <= MOST_LANES:
        assert names[::-1] == [f"robot {system}" for system in range(1, robots + 1)]
    else:
        assert upper.get_ylim() == (0.0, robots)
        (first, *_) = [bar.get_paths()[0].vertices for bar in upper.collections]
        assert np.asarray(first)[:, 1].max() == robots, "all of them were disarmed at first"


def test_no_state_no_time_line(tmp_path: Path) -> None:
    driving_log(tmp_path / "drive.mcap")
    data = gather(tmp_path / "drive.mcap")
    assert time_line(data) is None
    assert states_table(data) is None


def test_a_maneuver_is_spelled_out() -> None:
    actions = (Action.MF, Action.FF, Action.FF, Action.LSRB, Action.S, Action.S, Action.S)
    assert spelled_out(actions) == (
        "moderate forward; fast forward, twice; left wheel stalled, right wheel backward; stop, 3 times"
    )
    assert situation_name(ANY_STIMULUS, 0) == "none"
    assert situation_name(2, 3 | 12) == "both, both arms touch, before: right"


def test_a_quantile_lies_between_neighbours() -> None:
    assert quantile([3.0, 1.0], 0.5) == 2.0
    assert quantile([1.0, 2.0, 3.0, 4.0, 5.0], 0.25) == 2.0
    assert quantile([7.0], 0.99) == 7.0
