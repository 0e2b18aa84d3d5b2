"""A run told in parts comes to the same as the whole: bodies, curves, bands, marks and bouts."""

from __future__ import annotations

import base64
import json
import zlib
from typing import TYPE_CHECKING, Any

import pytest
from report_logs import bout_log, coaching_log, driving_log, open_recorder
from scenes import unpacked

from firmware_protocol.events import Received
from firmware_protocol.messages import BoutOutcome, Heartbeat, ParamValue, SwarmObservation
from firmware_protocol.messages.robot import State
from firmware_protocol.vocabulary import RobotClass
from firmware_protocol.wire.fields import MAVLINK
from hil.bridge.taps import NOTHING, Opening
from hil.look.document import document_of
from hil.look.live.overhearing import Overheard, OverhearingSink
from hil.look.live.showing import StopWatch
from hil.look.live.unfolding import TOPICS, Unfolding
from hil.look.reading import read_scene
from hil.mcaplog.reading.reader import LogReader
from hil.mcaplog.schemas import message_schema
from hil.mcaplog.writing.encode import compile_encoder, sender_suffix
from hil.mcaplog.writing.writer import LogWriter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

    from hil.mcaplog.reading.reader import LogEntry


def overheard(path: Path) -> list[Overheard]:
    """The entries of a log, as they were overheard when it was written."""

    def kept(entry: LogEntry) -> Callable[[bytes], tuple[Any, ...]]:
        return lambda _: (entry.value, entry.sender, entry.frame)

    return [Overheard(entry.topic, entry.time, b"", kept(entry)) for entry in LogReader(path).entries(TOPICS)]


class Told:
    """What a page knows that was told parts: it puts each behind what it has, from the moment on that the part begins at."""

    def __init__(self) -> None:
        self.poses: dict[str, list[list[float]]] = {}
        self.curves: dict[str, list[list[float]]] = {}
        self.marks: list[list[Any]] = []
        self.chapters: dict[float, dict[str, Any]] = {}
        self.title = ""
        self.facts: list[list[str]] = []
        self.learnt: list[str] = []

    def take(self, document: dict[str, Any]) -> None:
        data = zlib.decompress(base64.b64decode(document["columns"]))
        since = document.get("since", -1e9) - 5e-4

        def rows(table: dict[str, Any]) -> list[list[float]]:
            return [list(row) for row in zip(*(unpacked(data, place).tolist() for place in table.values()), strict=True)]

        for held in (*self.poses.values(), *self.curves.values()):
            held[:] = [row for row in held if row[0] < since]
        self.marks = [mark for mark in self.marks if mark[0] < since] + document["marks"]
        self.chapters = {begin: one for begin, one in self.chapters.items() if begin < since}
        for track in document["tracks"]:
            self.poses.setdefault(track["key"], []).extend(rows(track["poses"]))
        for trace in document["traces"]:
            self.curves.setdefault(trace["name"], []).extend(
                rows({"t": trace["t"], **{str(at): one for at, one in enumerate(trace["values"])}})
            )
        self.chapters |= {one["begin"]: one for one in document["chapters"]}
        self.title, self.facts = document["title"], document["facts"]
        self.learnt = [lesson["when"] for lesson in document["lessons"]]


def told(entries: list[Overheard], every: int) -> Told:
    """A run told as it goes on."""
    unfolding, page = Unfolding(), Told()
    for first in range(0, len(entries), every):
        for stretch in unfolding.hear(entries[first : first + every]):
            page.take(json.loads(unfolding.part(stretch)))
        assert unfolding.going is not None
        page.take(json.loads(unfolding.part(unfolding.going)))
    return page


def whole(path: Path) -> Told:
    page = Told()
    page.take(json.loads(json.dumps(document_of(read_scene(path)))))
    return page


@pytest.mark.parametrize("every", [97, 5000])
def test_bouts_in_parts_are_the_bouts(tmp_path: Path, every: int) -> None:
    path = tmp_path / "log.mcap"
    bout_log(path, [(BoutOutcome.WIN, 3.0), (BoutOutcome.LOSS, 2.0), (BoutOutcome.DRAW, 8.0)])
    one, other = told(overheard(path), every), whole(path)
    assert one.poses["junior"] == other.poses["junior"]
    assert len(one.poses["junior"]) > 100
    assert one.marks == other.marks
    ends = [(chapter["name"], chapter["outcome"], chapter["against"], chapter["story"]) for chapter in other.chapters.values()]
    assert [(one["name"], one["outcome"], one["against"], one["story"]) for one in one.chapters.values()] == ends
    assert len(ends) == 3
    assert one.title == other.title
    assert one.facts == other.facts


def test_coaching_in_parts_is_the_coaching(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    coaching_log(path, budget=60)
    one, other = told(overheard(path), 1500), whole(path)
    assert one.poses == other.poses
    assert [(chapter["name"], chapter["story"]) for chapter in one.chapters.values()] == [
        (chapter["name"], chapter["story"]) for chapter in other.chapters.values()
    ]
    assert one.learnt == other.learnt != []
    assert one.facts == other.facts


def test_a_bout_that_goes_on_has_not_ended(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    bout_log(path, [(BoutOutcome.WIN, 3.0), (BoutOutcome.LOSS, 4.0)])
    unfolding = Unfolding()
    unfolding.hear(entry for entry in overheard(path) if entry.time < 6.0)
    assert unfolding.going is not None
    ends = [
        [one["outcome"] for one in json.loads(unfolding.part(unfolding.going, unfinished=going))["chapters"]]
        for going in (True, False)
    ]
    assert ends == [["won", ""], ["won", "broken off"]]


def test_a_part_says_how_many_bouts_there_were_and_what_shows_all_of_them(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    coaching_log(path, budget=60)
    entries = overheard(path)
    unfolding = Unfolding()
    over = unfolding.hear(entries)
    assert unfolding.going is not None
    document = json.loads(unfolding.part(unfolding.going))
    played = sum(one.topic == "/events" and one.entry().value.kind == "bout" for one in entries)
    assert (document["played"], document["all"]) == (played, "")
    assert played > 1
    assert over[0].series == "coaching"
    unfolding.about({"run": {"log": "a run/log.mcap"}})
    assert json.loads(unfolding.part(unfolding.going))["all"] == "hil view 'a run/log.mcap'"


def test_a_run_without_bouts_is_told_in_stretches(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    driving_log(path, seconds=35.0)
    entries = sorted(overheard(path), key=lambda entry: entry.time)  # a bridge's clock never goes back
    one, other = told(entries, 500), whole(path)
    assert set(one.curves) == set(other.curves)
    eyes, all_eyes = one.curves["Eyes"], other.curves["Eyes"]
    assert [row[0] for row in eyes] == pytest.approx([row[0] for row in all_eyes], abs=2e-3)
    unfolding = Unfolding()
    over = unfolding.hear(entries)
    assert len(over) == 3
    assert max(len(unfolding.part(stretch)) for stretch in over) < 0.6 * len(json.dumps(document_of(read_scene(path))))


def test_robots_of_several_networks_keep_their_classes(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    networks = ("tcp://127.0.0.1:5760", "tcp://127.0.0.1:5761")
    seen = SwarmObservation(
        0.0, 7, 1, (0.1, 0.2), 0.5, 0.0, 0.2, 0.2, (1, 0), (1, 2), None, None, None, 0.0, (1, 1), (0, 0), 0, 1, 0
    )
    with open_recorder(path) as recorder:
        taps = [recorder.of_network(name) for name in networks]
        for name, tap in zip(networks, taps, strict=True):
            tap.opened(Opening(name, name, MAVLINK, lockstep=False, clock=0.0))
        for number in range(60):
            time = 0.5 * number
            for tap, kind in zip(taps, RobotClass, strict=True):
                tap.step(time, [], NOTHING)
                if number == 1:
                    tap.received(Received(ParamValue("CLASS", float(kind), 9, 1, 0), 1, 1, 0, time, b""))
                tap.received(Received(seen, 1, 1, 0, time, b""))
    unfolding = Unfolding()
    over = unfolding.hear(overheard(path))
    assert len(over) >= 2
    for stretch in over:
        tracks = json.loads(unfolding.part(stretch))["tracks"]
        assert {track["key"]: track["kind"] for track in tracks} == {"1.1": "ranger", "2.1": "wild"}


def test_what_is_written_is_overheard(tmp_path: Path) -> None:
    sink = OverhearingSink(LogWriter(tmp_path / "log.mcap", run={}), {"/mavlink/heartbeat"})
    schema = message_schema(Heartbeat)
    channel = sink.channel(schema.topic, schema)
    sink.metadata("config", {"seed": "3"})
    beat = heartbeat(State.READY)
    sink.write(channel, 1.5, compile_encoder(schema)(beat) + sender_suffix(7, 1))
    sink.close()
    (one,) = sink.take()
    entry = one.entry()
    assert (entry.topic, entry.time, entry.value, entry.sender) == ("/mavlink/heartbeat", 1.5, beat, (7, 1))
    assert not sink.take()
    assert sink.records == {"config": {"seed": "3"}}
    assert [(entry.value, entry.sender) for entry in LogReader(tmp_path / "log.mcap").entries()] == [(beat, (7, 1))]


def heartbeat(state: State) -> Heartbeat:
    return Heartbeat(custom_mode=state, type=10, autopilot=0, base_mode=0, system_status=4, mavlink_version=3)


def beats(*said: tuple[int, State], time: float = 1.0) -> Iterable[Overheard]:
    """Robots say in which state they are."""
    for robot, state in said:
        value, sender = heartbeat(state), (robot, 1)
        yield Overheard("/mavlink/heartbeat", time, b"", lambda _, one=value, who=sender: (one, who, 0))  # type: ignore[misc]


def test_the_stop_is_confirmed_when_every_robot_has_said_so() -> None:
    watch = StopWatch(lambda _: watch.hear(beats((1, State.STOPPED), (2, State.STOPPED))))
    watch.hear(beats((1, State.READY), (2, State.PERFORMING)))
    assert watch.stop() == {"confirmed": True, "robots": 2, "missing": 0}


def test_it_is_not_while_one_has_not() -> None:
    asked: list[str] = []
    watch = StopWatch(asked.append, within=0.0)
    watch.hear(beats((1, State.READY), (2, State.STOPPED)))
    assert watch.stop() == {"confirmed": False, "robots": 2, "missing": 2}  # what was said before does not count
    assert asked == ["stop"]
    watch = StopWatch(lambda _: watch.hear(beats((1, State.STOPPED), (2, State.READY))), within=0.0)
    watch.hear(beats((1, State.READY), (2, State.READY)))
    assert watch.stop() == {"confirmed": False, "robots": 2, "missing": 1}


def test_it_is_not_while_nobody_is_there() -> None:
    assert StopWatch(lambda _: None, within=0.0).stop() == {"confirmed": False, "robots": 0, "missing": 0}


def test_a_robot_that_has_gone_is_not_waited_for() -> None:
    watch = StopWatch(lambda _: watch.hear(beats((1, State.STOPPED), time=20.0)), within=0.0)
    watch.hear(beats((1, State.READY), (2, State.READY)))
    assert watch.stop() == {"confirmed": True, "robots": 1, "missing": 0}
