"""A log is played by a viewer that is not ours: a client of Foxglove's protocol, by a library of somebody else's."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from hil.bridge.clock import MonotonicClock
from hil.look.viewers.foxglove_server import ViewerError
from hil.look.viewers.recorded import RecordedEntries
from hil.look.viewers.streaming import LogStream
from hil.mcaplog.reading.reader import LogReader

pytest.importorskip("websockets", reason="the viewer speaks by it: pip install websockets")
from viewer_client import PAUSE, PLAY, Shown, Told, ViewerClient

if TYPE_CHECKING:
    from collections.abc import Iterator

LOG = Path(__file__).parents[1] / "golden" / "small.mcap"


@pytest.fixture
def entries() -> Iterator[RecordedEntries]:
    with RecordedEntries(LOG) as found:
        yield found


@pytest.fixture
def stream(entries: RecordedEntries) -> Iterator[LogStream]:
    with LogStream(entries, "small", MonotonicClock(), port=0) as served:
        yield served


@pytest.fixture
def viewer(stream: LogStream) -> Iterator[ViewerClient]:
    with ViewerClient(stream.url) as client:
        client.meet()
        yield client


def nanoseconds(time: dict[str, int]) -> int:
    return time["sec"] * 1_000_000_000 + time["nsec"]


def shown(came: list[Any]) -> list[Shown]:
    return [one for one in came if isinstance(one, Shown)]


def test_a_viewer_hears_what_there_is_and_when(viewer: ViewerClient, entries: RecordedEntries) -> None:
    assert set(viewer.info["capabilities"]) == {"playbackControl", "time"}
    assert (nanoseconds(viewer.info["dataStartTime"]), nanoseconds(viewer.info["dataEndTime"])) == (entries.begin, entries.end)
    assert set(viewer.channels) == {one.topic for one in entries.channels.values()}
    assert not viewer.services
    scene = viewer.channels["/arena/scene"]
    assert (scene["schemaName"], scene["encoding"], scene["schemaEncoding"]) == ("foxglove.SceneUpdate", "protobuf", "protobuf")


def see_beginning(viewer: ViewerClient, entries: RecordedEntries) -> None:
    """Subscribe to everything, and take what is shown of the log's first moment."""
    viewer.subscribe(viewer.channels)
    take(viewer, len(entries.last_before(entries.first_after(entries.begin))))


def take(viewer: ViewerClient, count: int) -> list[Any]:
    """What comes, up to so many entries."""
    came: list[Any] = []
    while len(shown(came)) < count:
        came.append(viewer.next())
    return came


def answer_to(viewer: ViewerClient, request: str) -> list[Any]:
    """What comes, up to the answer to a request."""
    return viewer.until(lambda one: isinstance(one, Told) and one.request == request)


def test_played_fast_every_entry_comes_once_in_order_with_its_bytes_and_time(
    viewer: ViewerClient, entries: RecordedEntries
) -> None:
    raw = sorted(LogReader(LOG).raw_entries(), key=lambda entry: entry.log_time)
    see_beginning(viewer, entries)
    viewer.control(PLAY, speed=1000.0)
    came = take(viewer, len(raw))
    if not any(isinstance(one, Told) and one.status == "ended" for one in came):  # it goes by a queue of its own
        came += viewer.until(lambda one: isinstance(one, Told) and one.status == "ended")
    assert [(one.topic, one.time, one.data) for one in shown(came)] == [(one.topic, one.log_time, one.data) for one in raw]
    assert not viewer.warnings


def test_after_a_jump_the_last_of_every_topic_comes_first(viewer: ViewerClient, entries: RecordedEntries) -> None:
    see_beginning(viewer, entries)
    seek = (entries.begin + entries.end) // 2
    expected = {}
    for entry in LogReader(LOG).raw_entries():
        if entry.log_time <= seek:
            expected[entry.topic] = entry.log_time, entry.data
    number = viewer.control(PAUSE, seek=seek)
    viewer.until(lambda one: isinstance(one, Told) and one == Told("paused", seek, 1.0, jumped=True, request=number))
    came = shown(take(viewer, len(expected)))
    assert {one.topic: (one.time, one.data) for one in came} == expected
    number = viewer.control(PLAY, speed=0.5)
    came = shown(viewer.until(lambda one: isinstance(one, Shown)))
    assert came[0].time > seek


def test_answers_of_many_jumps_are_not_overtaken_by_entries(viewer: ViewerClient, entries: RecordedEntries) -> None:
    see_beginning(viewer, entries)
    overtaken = 0
    for jump in range(20):
        seek = entries.begin + (entries.end - entries.begin) * (1 + jump * 37 % 97) // 100
        number = viewer.control(PAUSE, seek=seek)
        before = answer_to(viewer, number)
        overtaken += len(shown(before))
        take(viewer, len(entries.last_before(entries.first_after(seek))))
    assert overtaken == 0


def test_pausing_holds_the_time_and_speed_is_told(viewer: ViewerClient) -> None:
    first = viewer.control(PLAY, speed=0.25)
    told = answer_to(viewer, first)[-1]
    assert (told.status, told.speed, told.jumped) == ("playing", 0.25, False)
    viewer.until(lambda one: isinstance(one, int) and one > told.time)  # time passes
    second = viewer.control(PAUSE, speed=0.25)
    paused = answer_to(viewer, second)[-1]
    assert paused.status == "paused"
    third = viewer.control(PAUSE, speed=0.25)
    assert answer_to(viewer, third)[-1].time == paused.time


def test_who_comes_late_sees_what_was_shown_last(stream: LogStream, viewer: ViewerClient, entries: RecordedEntries) -> None:
    number = viewer.control(PAUSE, seek=entries.end)
    answer_to(viewer, number)
    with ViewerClient(stream.url) as other:
        other.meet()
        other.subscribe(["/arena/scene"])
        came = other.until(lambda one: isinstance(one, Shown))[-1]
    last = [entry for entry in LogReader(LOG).raw_entries() if entry.topic == "/arena/scene"][-1]
    assert (came.topic, came.time, came.data) == (last.topic, last.log_time, last.data)


@pytest.mark.slow
def test_who_comes_and_goes_while_it_plays_holds_nothing_up(stream: LogStream, viewer: ViewerClient) -> None:
    viewer.subscribe(viewer.channels)
    viewer.control(PLAY, speed=1.0)
    for _ in range(60):
        with ViewerClient(stream.url) as other:
            other.meet()
            other.subscribe(other.channels)
            other.control(PLAY, speed=1.0)
            other.until(lambda one: isinstance(one, Told))
    viewer.control(PLAY, speed=1000.0)
    viewer.until(lambda one: isinstance(one, Told) and one.status == "ended")


def test_a_port_that_is_taken_is_an_error_with_a_way_out(stream: LogStream, entries: RecordedEntries) -> None:
    port = int(stream.url.rpartition(":")[2])
    with pytest.raises(ViewerError, match="Choose another; 0 is any that is free"):
        LogStream(entries, "again", MonotonicClock(), port=port)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_the_verb_serves_until_it_is_interrupted() -> None:
    command = [sys.executable, "-m", "hil", "replay", str(LOG), "--to", "viewer", "--port", "0", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:  # noqa: S603
        assert process.stdout is not None
        said = json.loads(process.stdout.readline())
        assert Path(said["layout"]).name == "junior.layout.json"
        assert said["url"].split("//")[1] in said["app_url"].replace("%3A", ":").replace("%2F", "/")
        with ViewerClient(said["url"]) as viewer:
            viewer.meet()
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=20)
        assert (process.returncode, errors) == (130, "Interrupted.\n")
