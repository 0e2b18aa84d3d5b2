"""What is gathered of a log for a page: places, bouts and how they ended, states, maneuvers, what was learnt."""

from __future__ import annotations

import random
from itertools import pairwise
from math import inf, nan
from typing import IO, TYPE_CHECKING, Final

import numpy as np
import pytest
from damaged import damaged_log, records_of
from mcap.writer import Writer
from report_logs import FRAME, Wire, bout_log, coaching_log, driving_log, open_recorder
from scenes import HOSTILE, hostile_log

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    BoutOutcome,
    Heartbeat,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorSensors,
    OpponentCode,
    ParamValue,
    Phase,
    RefereeState,
    RobotAck,
    RobotSession,
    Statustext,
    SwarmObservation,
    SwarmRanges,
    SwarmSense,
)
from firmware_protocol.messages.junior import SensorFlag
from firmware_protocol.messages.robot import AckResult, Reason, State
from firmware_protocol.messages.table import TableKind, TableReset, TableState
from firmware_protocol.vocabulary import Action, Outcome
from hil.bridge.operator import OperatorInput
from hil.bridge.taps import Circumstances
from hil.look import micro
from hil.look.document import text_of
from hil.look.lessons import LearningPart
from hil.look.pages import page_of
from hil.look.reading import read_scene
from hil.look.scene import Ground, Scene, Terrain
from hil.mcaplog.errors import LogError, UnreadableLogError
from hil.mcaplog.reading.reader import LogEntry, LogReader
from hil.questions import ASKED
from simdevice.swarm.rooms import NAMES, built_in

if TYPE_CHECKING:
    from pathlib import Path

    from hil.look.scene import Lane

WIN, LOSS, DRAW = BoutOutcome.WIN, BoutOutcome.LOSS, BoutOutcome.DRAW
NONE8: Final = (0,) * 8


def lane(scene: Scene, name: str) -> Lane:
    (found,) = (one for one in scene.lanes if one.name == name)
    return found


def said(lane: Lane) -> list[str]:
    return [lane.words[int(code)] for code in lane.code]


def kinds(scene: Scene, kind: str) -> list[str]:
    return [mark.text for mark in scene.marks if mark.kind == kind]


# --- bouts -----------------------------------------------------------------------------------------------------------


def test_bouts_are_chapters_with_their_outcomes(tmp_path: Path) -> None:
    bout_log(tmp_path / "b.mcap", [(WIN, 2.0), (LOSS, 3.0), (DRAW, 4.0)], [OpponentCode.FLAT_LIGHT] * 3)
    scene = read_scene(tmp_path / "b.mcap")
    assert [(one.name, one.outcome, one.against) for one in scene.chapters] == [
        ("Bout 1", "won", "flat-light"),
        ("Bout 2", "lost", "flat-light"),
        ("Bout 3", "drawn", "flat-light"),
    ]
    assert [one.end - one.begin for one in scene.chapters] == pytest.approx([2.0, 3.0, 4.0])
    assert scene.title == "Junior’s bouts against flat-light"
    assert "1 of 3 won" in scene.said[0]
    assert scene.terrain == Terrain(Ground.RING, 0.65, 0.42)
    assert [track.kind for track in scene.tracks] == ["opponent", "junior"]
    assert np.count_nonzero(scene.tracks[1].poses["gap"]) == 2


def test_bouts_are_numbered_anew_in_each_series(tmp_path: Path) -> None:
    coaching_log(tmp_path / "c.mcap", budget=60)
    scene = read_scene(tmp_path / "c.mcap")
    assert {one.series for one in scene.chapters} == {"coaching"}
    assert [one.name for one in scene.chapters] == [f"Bout {number}" for number in range(1, len(scene.chapters) + 1)]
    assert scene.chapters[-1].outcome in {"won", "lost", "drawn", "broken off"}


def lost_bout(path: Path, *, arms: bool, backward: bool) -> str:
    """How a bout is said to have ended that was lost over the left border."""
    with open_recorder(path) as recorder:
        wire = Wire(recorder)
        wire.down(RobotSession(7, 0, 9, 1, 1, 2, 1))
        wire.down(JuniorManeuver(7, 1, 0.2, 5, 1, 1, 2, (Action.FB, Action.L, *(0,) * 6)))
        for number in range(21):
            wire.now = 0.05 * number
            flags = SensorFlag.ARM_LEFT if arms and number > 14 else 0
            wire.up(JuniorSensors(wire.now, (0.0, 0.0), (60, 60), (120, 120), 7.4, int(flags)))
            over = number == 20
            heading = 0.0 if backward else 3.1
            place = (-0.1 - 0.012 * number, 0.0)
            ended = (Phase.OVER, LOSS) if over else (Phase.RUNNING, BoutOutcome.UNDECIDED)
            wire.up(RefereeState(wire.now, 1, wire.now, place, heading, (0.1, 0.0), 0.0, 0.2, *ended, 1), component=25)
        wire.up(
            JuniorManeuverResult(7, 1, *(NONE8,) * 3, *((0.0,) * 8,) * 3, *(NONE8,) * 2, 255, 190, Outcome.REPLACED, 0, 1, 0, 0)
        )
    (chapter,) = read_scene(path).chapters
    return chapter.story


@pytest.mark.parametrize("arms", [False, True])
@pytest.mark.parametrize("backward", [False, True])
def test_how_a_bout_was_lost_is_said_in_words(tmp_path: Path, *, arms: bool, backward: bool) -> None:
    story = lost_bout(tmp_path / "l.mcap", arms=arms, backward=backward)
    assert story.startswith("Lost after 1.0 s: Junior left the ring on the left")
    assert f"driving {'backward' if backward else 'forward'}" in story
    assert ("an arm touching the opponent" if arms else "its arms touching nothing") in story
    assert story.endswith("It was performing: fast backward; left turn.")


def test_maneuvers_are_a_band_whose_words_say_how_they_ended(tmp_path: Path) -> None:
    lost_bout(tmp_path / "l.mcap", arms=False, backward=True)
    band = lane(read_scene(tmp_path / "l.mcap"), "Maneuver")
    assert said(band) == ["FB L · replaced"]
    assert band.meanings == ("fast backward; left turn (replaced by another command)",)
    assert (band.begin[0], band.end[0]) == pytest.approx((0.0, 1.0))


# --- any robot -------------------------------------------------------------------------------------------------------


def test_driving_is_sensors_wheels_and_marks(tmp_path: Path) -> None:
    driving_log(tmp_path / "d.mcap", 8.0)
    scene = read_scene(tmp_path / "d.mcap")
    assert scene.terrain is not None
    assert scene.terrain.ground is Ground.NONE
    assert [trace.name for trace in scene.traces] == ["Eyes", "Wheels", "Floor sensors", "Battery", "Wheels were told"]
    assert "robot 1 is lost: silent for 3 s" in kinds(scene, "link")
    assert set(said(lane(scene, "Eyes see it"))) == {"left", "right", "both"}
    speeds = scene.traces[1].values[0]
    assert np.nanmedian(speeds) == pytest.approx(0.1, abs=0.02)


def test_of_several_robots_one_is_shown(tmp_path: Path) -> None:
    with open_recorder(tmp_path / "r.mcap") as recorder:
        for number in range(6):
            for system in (3, 5):
                sensors = JuniorSensors(0.1 * number, (0.0, 0.0), (100 * system, 0), (1, 2), 7.4, 0)
                recorder.received(Received(sensors, system, 1, number, 0.1 * number, FRAME))
    assert read_scene(tmp_path / "r.mcap").traces[0].values[0][0] == 300
    scene = read_scene(tmp_path / "r.mcap", robot=5)
    assert scene.traces[0].values[0][0] == 500
    assert "There are 2 sumo robots in the log: this is robot 5" in scene.notes[0]
    with pytest.raises(LogError, match=r"no sumo robot 4 in .*: there is 3, 5"):
        read_scene(tmp_path / "r.mcap", robot=4)


def test_keys_of_a_bout_that_is_judged_are_answers(tmp_path: Path) -> None:
    with open_recorder(tmp_path / "k.mcap") as recorder:
        recorder.note(ASKED, "how does it end?", choices=["won", "lost", "drawn"])
        recorder.step(4.1, [(4.1, FRAME)], Circumstances((OperatorInput("key d"), OperatorInput("key \n"))))
    assert kinds(read_scene(tmp_path / "k.mcap"), "key") == ["key: d, drawn", "key: Enter, ready"]


def test_keys_e_stop_and_refusals_are_marks(tmp_path: Path) -> None:
    with open_recorder(tmp_path / "k.mcap") as recorder:
        wire = Wire(recorder)
        for now, state in (
            (0.0, State.DISARMED),
            (1.0, State.READY),
            (2.0, State.STOPPED),
            (3.0, State.STOPPED),
            (4.0, State.DISARMED),
        ):
            wire.now = now
            wire.up(Heartbeat(10, 0, 65, state, 3))
        recorder.step(4.1, [(4.1, FRAME)], Circumstances((OperatorInput("key e", "1"), OperatorInput("interrupt"))))
        wire.now = 4.2
        wire.up(RobotAck(47101, 7, 3, 255, 190, AckResult.REFUSED, Reason.EMERGENCY_STOP))
    scene = read_scene(tmp_path / "k.mcap")
    assert kinds(scene, "safety") == [
        "robot 1 has stopped: its e-stop is engaged",
        "robot 1 is no longer stopped by its e-stop",
    ]
    assert kinds(scene, "key") == ["key: e, emergency stop (robot 1)"]
    assert kinds(scene, "operator") == ["the run was interrupted (Ctrl-C or a signal)"]
    assert kinds(scene, "refused") == ["robot 1 refused a command: emergency stop"]
    states = lane(scene, "State")
    assert said(states) == ["disarmed", "ready", "stopped", "disarmed"]
    assert states.end[2] - states.begin[2] == pytest.approx(2.0)
    assert "The e-stop was engaged once." in scene.said


def test_what_the_robot_says_and_the_learner_decides_are_marks(tmp_path: Path) -> None:
    path = tmp_path / "c.mcap"
    coaching_log(path, budget=60)
    decided = kinds(read_scene(path), "decision")
    assert len(decided) == 60
    assert decided[0].startswith("trial 1, eyes ")
    assert "(untried; arose by: random; expected 0.0 +- " in decided[0]
    with open_recorder(tmp_path / "t.mcap") as recorder:
        Wire(recorder).up(Statustext(4, "EEPROM is worn"))
    assert kinds(read_scene(tmp_path / "t.mcap"), "robot") == ["robot 1: EEPROM is worn"]


def test_what_was_learnt_is_told_by_situation(tmp_path: Path) -> None:
    coaching_log(tmp_path / "c.mcap", budget=120)
    scene = read_scene(tmp_path / "c.mcap")
    assert [lesson.when for lesson in scene.lessons] == [
        "When no eye sees it", "When the left eye sees it", "When the right eye sees it", "When both eyes see it",
    ]  # fmt: skip
    assert all(len(lesson.steps) == 4 for lesson in scene.lessons)
    assert scene.curves[0].name == "Best fitness of each situation"
    assert scene.title == "Pal coached Junior against flat-light"
    for lesson in scene.lessons:
        assert lesson.why[0].startswith("Performed ")
        assert sum(text.startswith("Next: ") for text in lesson.why) == 4


def test_a_log_without_the_learner_s_state_explains_nothing(tmp_path: Path) -> None:
    coaching_log(tmp_path / "c.mcap", budget=60)
    part, scene = LearningPart(), Scene()
    for entry in LogReader(tmp_path / "c.mcap").entries():
        part.take(entry)
    part.put(scene)
    assert [lesson.why for lesson in scene.lessons] == [()] * 4


# --- a swarm ---------------------------------------------------------------------------------------------------------


def observation(place: tuple[float, float], flags: int = 0) -> SwarmObservation:
    return SwarmObservation(
        0.0, 7, 1, place, 0.5, 0.0, 0.2, 0.2, (1, 0), (1, 2), None, None, None, 0.0, (1, 1), (0, 0), flags, 1, 0
    )  # fmt: skip


def swarm_log(path: Path, kind: TableKind = TableKind.PLAIN, room: int = 0) -> None:
    """Two networks with a robot 1 and a robot 2 each, one of which measures ranges."""
    with open_recorder(path) as recorder:
        networks = [recorder.of_network(name) for name in ("a", "b")]
        recorder.sent(0.0, TableReset(1, 7, 1, (2.0, 1.5), 254, 25, 1, kind, 0, room))
        recorder.sent(0.0, SwarmSense(7, 1, 0.2, 0.05, 65.535, 1, 1, 8, 4))
        for network in networks:
            for system in (1, 2):
                network.step(0.1, [(0.1, FRAME)], Circumstances())
                parameter = ParamValue("CLASS", float(system - 1), 9, 1, 0)
                network.received(Received(parameter, system, 1, 0, 0.1, FRAME))
        for moment in range(5):
            now = 1.0 + moment
            for number, network in enumerate(networks):
                network.step(now, [(now, FRAME)], Circumstances())
                for system in (1, 2):
                    seen = observation((0.1 * number + 0.01 * moment, 0.2 * system), flags=2 * (moment == 2))
                    network.received(Received(seen, system, 1, 1, now, FRAME))
            ranges = (0.5, None, 0.3, 0.4, *(0.0,) * 28)
            message = SwarmRanges(0.0, 0b0100, 7, 1, (0.1, 0.2), 0.5, ranges, 4)
            networks[1].received(Received(message, 2, 1, 2, now, FRAME))


def test_obstacles_of_a_room_that_every_table_knows_stand_on_the_table(tmp_path: Path) -> None:
    assert micro.ROOMS == NAMES
    for number, name in enumerate(NAMES, 1):
        log = tmp_path / f"{name}.mcap"
        swarm_log(log, TableKind.OBSTACLES, number)
        terrain = read_scene(log).terrain
        assert terrain is not None
        drawn = {(*start, *end) for outline in terrain.obstacles for start, end in pairwise(outline)}
        assert drawn == set(built_in(name).walls)
        assert all(outline[0] == outline[-1] for outline in terrain.obstacles)
        assert f'"terrain":["table",2.0,1.5,true,[[[{terrain.obstacles[0][0][0]}'[:40] in text_of(read_scene(log))


def test_a_box_that_is_nowhere_is_left_out(tmp_path: Path) -> None:
    swarm_log(tmp_path / "box.mcap", TableKind.BOX)
    entries = LogReader(tmp_path / "box.mcap").entries(micro.TOPICS)
    part, scene = micro.MicroPart(), Scene(begin=0.0, end=9.0)
    for entry in entries:
        part.take(entry)
    for time, x in enumerate((nan, 0.25, inf, 1e9)):
        state = TableState(time, (x, 0.5), 0.1, (0.0, 0.0), 0, 1)
        part.take(LogEntry("/table/state", float(time), state, None, None))
    part.put(scene)
    assert [track.poses["x"].tolist() for track in scene.tracks if track.key == "box"] == [[0.25]]


def test_obstacles_that_the_log_does_not_tell_are_said_to_be_there(tmp_path: Path) -> None:
    swarm_log(tmp_path / "s.mcap", TableKind.OBSTACLES, len(NAMES) + 1)
    scene = read_scene(tmp_path / "s.mcap")
    assert scene.terrain == Terrain(Ground.TABLE, 2.0, 1.5, wall=True)
    assert any("Obstacles stood on the table" in note for note in scene.notes)


def test_robots_of_several_networks_are_told_apart(tmp_path: Path) -> None:
    swarm_log(tmp_path / "s.mcap")
    scene = read_scene(tmp_path / "s.mcap")
    assert [(track.key, track.kind) for track in scene.tracks] == [
        ("1.1", "ranger"), ("1.2", "wild"), ("2.1", "ranger"), ("2.2", "wild"),
    ]  # fmt: skip
    assert scene.tracks[2].poses["x"].tolist() == pytest.approx([0.1, 0.11, 0.12, 0.13, 0.14], abs=1e-3)
    assert scene.terrain == Terrain(Ground.TABLE, 2.0, 1.5, wall=True)
    rays = scene.tracks[3].rays
    assert [name for name in rays if name != "t"] == ["hits", "r0", "r1", "r2", "r3"]
    assert np.isnan(rays["r1"]).all()
    assert rays["hits"].tolist() == [4.0] * 5
    assert scene.tracks[0].shape.sectors == 8
    assert ("2", "RANGERs") in scene.facts


# --- logs that are damaged, foreign, or hostile --------------------------------------------------------------------------


def test_a_log_that_is_cut_is_shown_as_far_as_it_goes(tmp_path: Path) -> None:
    path = tmp_path / "c.mcap"
    coaching_log(path, budget=60)
    whole = read_scene(path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    scene = read_scene(path)
    assert 0 < scene.end < whole.end
    assert any("that could be read" in note for note in scene.notes)


def foreign(file: IO[bytes], entries: int = 3) -> None:
    """Somebody else's log."""
    writer = Writer(file)
    writer.start()
    schema = writer.register_schema("std_msgs/String", "ros1msg", b"string data")
    channel = writer.register_channel("/chatter<b>", "ros1", schema)
    for number in range(entries):
        writer.add_message(channel, number, b"\1\0\0\0x", number)
    writer.finish()  # type: ignore[no-untyped-call]


def test_what_is_no_log_of_ours_is_said_to_hold_what_it_holds(tmp_path: Path) -> None:
    path = tmp_path / "f.mcap"
    with path.open("wb") as file:
        foreign(file)
    with pytest.raises(UnreadableLogError, match=r"has nothing that hil can show: it holds '/chatter<b>' \(3\)"):
        read_scene(path)


def test_a_log_without_an_entry_says_so(tmp_path: Path) -> None:
    path = tmp_path / "e.mcap"
    with path.open("wb") as file:
        foreign(file, entries=0)
    with pytest.raises(UnreadableLogError, match="no entry at all"):
        read_scene(path)


@pytest.mark.parametrize("hostile", HOSTILE)
def test_hostile_texts_are_gathered(tmp_path: Path, hostile: str) -> None:
    text = hostile.encode(errors="replace").decode()
    hostile_log(tmp_path / "h.mcap", text)
    scene = read_scene(tmp_path / "h.mcap")
    assert scene.chapters[0].series == text
    assert page_of(scene)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_a_damaged_log_is_shown_or_refused_in_words(tmp_path: Path, seed: int) -> None:
    good = tmp_path / "g.mcap"
    coaching_log(good, budget=20)
    rng = random.Random(seed)
    path = tmp_path / "d.mcap"
    path.write_bytes(damaged_log(good.read_bytes(), records_of(good), rng))
    try:
        said = page_of(read_scene(path)).decode()
    except LogError as error:
        said = str(error)
    assert said.startswith("<!DOCTYPE html>") or len(said) < 2000
