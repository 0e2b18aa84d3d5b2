"""What a robot is to send by itself, and what is done and said when it does not come."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest
from peer_bench import Bench
from scripted_robot import sensors

from firmware_protocol.events import StreamBack, StreamStopped
from firmware_protocol.messages import Command, CommandLong, JuniorSensors, RobotStatus
from firmware_protocol.peer.streams import ASK_AGAIN, MOST_REQUESTS, STALE_LEAST, Streams
from firmware_protocol.roles.junior import JUNIOR

NEEDS = {JuniorSensors: 0.02, RobotStatus: 1.0}
ROLES = (replace(JUNIOR, streams=NEEDS),)
"""A robot of which just this is needed, whatever a Junior has besides."""


def intervals(bench: Bench) -> list[tuple[int, float]]:
    """(message, interval in us) of the streams asked for; forgets all that was sent."""
    asked = [m for m in bench.take(CommandLong) if m.command == Command.SET_MESSAGE_INTERVAL and not m.confirmation]
    return [(int(m.param1), m.param2) for m in asked]


def live(bench: Bench, seconds: float, *, reading: bool, status: bool = True) -> None:
    """Let time pass with a heartbeat every 0.1 s, and what else comes."""
    for k in range(round(seconds / 0.1)):
        bench.wait(0.1)
        bench.heartbeat(armed=True)
        bench.command_ack(Command.SET_MESSAGE_INTERVAL)
        if reading:
            bench.heard(sensors(bench.clock.now()))
        if status and k % 10 == 0:
            bench.status()


def news(bench: Bench) -> list[StreamStopped | StreamBack]:
    """What was told about streams."""
    return [event for event in bench.events if isinstance(event, StreamStopped | StreamBack)]


def test_who_holds_the_session_sets_the_streams_that_it_needs() -> None:
    bench = Bench(roles=ROLES)
    bench.heartbeat()
    bench.version()
    bench.ack()
    bench.wait(0.005)
    bench.command_ack(Command.SET_MESSAGE_INTERVAL)
    bench.wait(0.005)
    assert intervals(bench) == [(JuniorSensors.ID, 20_000.0), (RobotStatus.ID, 1_000_000.0)]


def test_a_watcher_sets_none() -> None:
    watcher = Bench(open_session=False, roles=ROLES)
    watcher.heartbeat()
    watcher.version()
    watcher.wait(0.2)
    assert intervals(watcher) == []


def test_a_stream_that_stops_is_told_of_and_asked_for_again() -> None:
    bench = Bench(roles=ROLES)
    bench.connect()
    live(bench, 1.0, reading=True)
    assert news(bench) == []
    intervals(bench)
    live(bench, 1.0, reading=False)
    (stopped,) = news(bench)
    assert isinstance(stopped, StreamStopped)
    assert (stopped.stream, stopped.requests, stopped.last) == ("JUNIOR_SENSORS", 1, False)
    assert stopped.text == "robot 1 sends no JUNIOR_SENSORS any more: stopped by another client; asking for it again"
    assert intervals(bench) == [(JuniorSensors.ID, 20_000.0)]
    bench.heard(sensors(bench.clock.now()))
    assert [event.text for event in news(bench)[1:]] == ["robot 1 sends JUNIOR_SENSORS again"]


def test_it_is_asked_for_three_times_five_seconds_apart_and_then_left_at_that() -> None:
    bench = Bench(roles=ROLES)
    bench.connect()
    live(bench, 1.0, reading=True)
    intervals(bench)
    times = []
    for _ in range(400):
        live(bench, 0.1, reading=False)
        times += [bench.clock.now()] * len(intervals(bench))
    assert len(times) == MOST_REQUESTS
    assert all(later - earlier >= ASK_AGAIN - 1e-9 for earlier, later in itertools.pairwise(times))
    last = news(bench)[-1]
    assert isinstance(last, StreamStopped)
    assert last.text.endswith("asked for it 3 times, to no avail")
    assert len(news(bench)) == 2
    live(bench, 1.0, reading=True)
    live(bench, 1.0, reading=False)
    assert len(intervals(bench)) == 1, "when it has come again, it is asked for anew"


def test_a_stream_that_stops_again_soon_is_told_of_at_once_and_asked_for_later() -> None:
    bench = Bench(roles=ROLES)
    bench.connect()
    live(bench, 1.0, reading=True)
    live(bench, 0.6, reading=False)
    live(bench, 0.5, reading=True)
    intervals(bench)
    live(bench, 1.0, reading=False)
    assert [type(event) for event in news(bench)] == [StreamStopped, StreamBack, StreamStopped]
    again = news(bench)[-1]
    assert isinstance(again, StreamStopped)
    assert again.text == "robot 1 sends no JUNIOR_SENSORS any more: stopped by another client"
    assert intervals(bench) == []
    live(bench, ASK_AGAIN, reading=False)
    assert intervals(bench) == [(JuniorSensors.ID, 20_000.0)]
    assert len(news(bench)) == 3


def test_a_watcher_says_so_and_changes_nothing() -> None:
    watcher = Bench(open_session=False, roles=ROLES)
    watcher.heartbeat(armed=True)
    watcher.version()
    watcher.status()
    live(watcher, 1.0, reading=True)
    live(watcher, 30.0, reading=False)
    (stopped,) = news(watcher)
    assert isinstance(stopped, StreamStopped)
    assert stopped.text == "robot 1 sends no JUNIOR_SENSORS any more: stopped by another client"
    assert intervals(watcher) == []


def test_a_silent_line_is_no_stopped_stream() -> None:
    bench = Bench(roles=ROLES)
    bench.connect()
    live(bench, 1.0, reading=True)
    bench.wait(2.0)
    live(bench, 0.2, reading=True)
    assert news(bench) == []


def test_where_nobody_listened_no_stream_has_stopped() -> None:
    bench = Bench(roles=ROLES)
    bench.connect()
    live(bench, 1.0, reading=True)
    bench.clock.advance(30.0)  # this program was held up
    bench.peer.missed(30.0)
    bench.heartbeat(armed=True)
    live(bench, 0.2, reading=True)
    assert news(bench) == []
    live(bench, 1.0, reading=False)
    assert len(news(bench)) == 1, "what stops afterwards is seen as before"


def test_what_is_not_wanted_any_more_is_not_missed() -> None:
    bench = Bench(roles=ROLES)
    bench.connect()
    bench.peer.message_interval(JuniorSensors, -1)
    live(bench, 3.0, reading=False)
    assert news(bench) == []


def test_a_slower_stream_is_missed_later() -> None:
    bench = Bench(roles=ROLES)
    bench.connect()
    bench.peer.message_interval(JuniorSensors, 2.0)
    live(bench, 5.0, reading=False)
    assert news(bench) == []
    live(bench, 3.0, reading=False)
    assert len(news(bench)) == 1


def test_a_restarted_robot_gets_the_same_streams_again() -> None:
    bench = Bench(roles=ROLES)
    bench.connect()
    bench.peer.message_interval(JuniorSensors, 0.1)
    intervals(bench)
    bench.status(boots=2, time=0.1)
    bench.version()
    bench.ack()
    bench.wait(0.005)
    bench.command_ack(Command.SET_MESSAGE_INTERVAL)
    bench.wait(0.005)
    assert intervals(bench)[-2:] == [(RobotStatus.ID, 1_000_000.0), (JuniorSensors.ID, 100_000.0)]


@pytest.mark.parametrize(("interval", "fresh", "stale"), [(0.02, 0.25, 0.251), (0.1, 0.3, 0.301), (1.0, 3.0, 3.001)])
def test_stale_is_older_than_three_intervals_or_a_quarter_of_a_second(interval: float, fresh: float, stale: float) -> None:
    streams = Streams(NEEDS)
    streams.want(JuniorSensors, interval, 0.0)
    assert not streams.stale(JuniorSensors, fresh - 1e-9)
    assert streams.stale(JuniorSensors, stale)
    assert STALE_LEAST == 0.25
