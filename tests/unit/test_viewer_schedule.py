"""What of a log goes to viewers, and when: without a server, and with a clock that is told what to say."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from mcap.writer import Writer

from hil.look.viewers.playback import FASTEST, SETTLING, SLOWEST, PlaybackClock, PlayStatus
from hil.look.viewers.recorded import RecordedEntries
from hil.look.viewers.schedule import AT_A_TIME, Schedule
from hil.mcaplog.errors import UnreadableLogError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

SECOND = 1_000_000_000
BEGIN = 5 * SECOND
CUT = Path(__file__).parents[1] / "golden" / "small.mcap"


def write_log(path: Path, entries: Sequence[tuple[str, float]]) -> Path:
    """A log of entries that hold their number, with times in s after BEGIN, in this order."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        topics = dict.fromkeys(topic for topic, _ in entries)
        channels = {topic: writer.register_channel(topic=topic, message_encoding="text", schema_id=0) for topic in topics}
        for number, (topic, time) in enumerate(entries):
            stamp = BEGIN + round(time * SECOND)
            writer.add_message(channels[topic], log_time=stamp, publish_time=stamp, data=str(number).encode())
        writer.finish()  # type: ignore[no-untyped-call]
    return path


@pytest.fixture
def entries(tmp_path: Path) -> Iterator[RecordedEntries]:
    log = [("a", 0.0), ("b", 0.0), ("a", 1.0), ("a", 3.0), ("b", 2.0), ("c", 4.0)]  # the fifth was written late
    with RecordedEntries(write_log(tmp_path / "log.mcap", log)) as found:
        yield found


def sent(entries: RecordedEntries, places: list[int]) -> list[int]:
    return [int(entries.data(place)) for place in places]


def test_entries_are_in_the_order_of_their_time(entries: RecordedEntries) -> None:
    assert sent(entries, list(range(len(entries)))) == [0, 1, 2, 4, 3, 5]
    assert (entries.begin, entries.end) == (BEGIN, BEGIN + 4 * SECOND)
    assert entries.health == ""


def test_it_waits_at_the_beginning_and_shows_who_comes_what_there_is(entries: RecordedEntries) -> None:
    schedule = Schedule(entries)
    assert schedule.turn(100.0) == ([], math.inf, None, False)
    for number, channel in entries.channels.items():
        first = {"a": [0], "b": [1], "c": []}[channel.topic]
        assert sent(entries, schedule.last_of(number, 100.0)) == first


def test_each_entry_is_due_at_its_time_reckoned_from_the_request(entries: RecordedEntries) -> None:
    schedule = Schedule(entries)
    schedule.control(10.0, play=True, speed=1.0, seek=None)
    begun = 10.0 + SETTLING
    assert schedule.turn(10.0).places == []
    first = schedule.turn(begun)
    assert sent(entries, first.places) == [0, 1]
    assert first.due == pytest.approx(begun + 1.0)
    late = schedule.turn(begun + 1.9)  # what comes late does not delay the rest
    assert sent(entries, late.places) == [2]
    assert late.due == pytest.approx(begun + 2.0)
    assert sent(entries, schedule.turn(begun + 3.5).places) == [4, 3]
    last = schedule.turn(begun + 4.0)
    assert sent(entries, last.places) == [5]
    assert last.ended == (PlayStatus.ENDED, entries.end, 1.0, False)
    assert schedule.turn(begun + 50.0) == ([], math.inf, None, False)


def test_after_a_jump_the_last_entry_of_every_channel_before_comes_first(entries: RecordedEntries) -> None:
    schedule = Schedule(entries)
    standing = schedule.control(10.0, play=False, speed=1.0, seek=BEGIN + 5 * SECOND // 2)
    assert standing == (PlayStatus.PAUSED, BEGIN + 5 * SECOND // 2, 1.0, True)
    assert schedule.turn(10.0) == ([], 10.0 + SETTLING, None, False)
    turn = schedule.turn(10.0 + SETTLING)
    assert (sent(entries, turn.places), turn.jumped) == ([2, 4], True)
    assert schedule.turn(11.0).places == []
    schedule.control(20.0, play=True, speed=2.0, seek=None)
    assert schedule.turn(20.0 + SETTLING).due == pytest.approx(20.0 + SETTLING + 0.25)
    assert sent(entries, schedule.turn(20.0 + SETTLING + 0.25).places) == [3]
    back = schedule.control(20.5, play=True, speed=2.0, seek=BEGIN + SECOND)
    assert back.jumped
    assert sent(entries, schedule.turn(20.5 + SETTLING).places) == [1, 2]
    assert sent(entries, schedule.turn(20.5 + SETTLING + 0.5).places) == [4]


def test_a_jump_out_of_the_log_ends_at_its_end_and_playing_there_begins_anew(entries: RecordedEntries) -> None:
    schedule = Schedule(entries)
    assert schedule.control(0.0, play=False, speed=1.0, seek=0).time == BEGIN
    assert schedule.control(0.0, play=False, speed=1.0, seek=BEGIN * 10).time == entries.end
    assert sent(entries, schedule.turn(1.0).places) == [4, 3, 5]
    assert schedule.control(2.0, play=True, speed=1.0, seek=None) == (PlayStatus.PLAYING, BEGIN, 1.0, True)
    assert sent(entries, schedule.turn(3.0).places) == [0, 1]


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan, math.inf])
def test_a_speed_that_is_none_changes_nothing(speed: float) -> None:
    playback = PlaybackClock(0, 100 * SECOND)
    playback.control(0.0, play=True, speed=3.0, seek=None)
    assert playback.control(1.0, play=True, speed=speed, seek=None).speed == 3.0


def test_speeds_have_bounds_and_a_change_of_speed_keeps_the_place() -> None:
    playback = PlaybackClock(0, 10**6 * SECOND)
    playback.control(0.0, play=True, speed=2.0, seek=None)
    assert playback.position(SETTLING + 3.0) == 6 * SECOND
    assert playback.control(SETTLING + 3.0, play=True, speed=1e9, seek=None).time == 6 * SECOND
    assert playback.speed == FASTEST
    playback.control(0.0, play=True, speed=1e-9, seek=None)
    assert playback.speed == SLOWEST


def test_a_day_later_an_entry_is_due_to_the_microsecond() -> None:
    day = 86_400
    playback = PlaybackClock(7, day * SECOND)
    playback.control(3.0, play=True, speed=1.0, seek=None)
    for time in range(7, day * SECOND, day * SECOND // 97):
        due = playback.due_at(time)
        assert due == pytest.approx(3.0 + SETTLING + (time - 7) / 1e9, abs=1e-6)
        assert playback.position(due) == pytest.approx(time, abs=1000)


def test_a_crowd_of_entries_leaves_room_for_a_request(tmp_path: Path) -> None:
    log = write_log(tmp_path / "log.mcap", [("a", 0.0), *[("a", 1.0)] * (3 * AT_A_TIME)])
    with RecordedEntries(log) as entries:
        schedule = Schedule(entries)
        schedule.control(0.0, play=True, speed=1.0, seek=None)
        turn = schedule.turn(2.0)
        assert len(turn.places) == AT_A_TIME
        assert turn.due < 2.0


def test_a_log_that_was_cut_off_is_played_to_there(tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(CUT.read_bytes()[:-3000])
    with RecordedEntries(cut) as entries:
        assert len(entries) > 10
        assert entries.health


def test_a_log_without_entries_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnreadableLogError, match="no entry could be had"):
        RecordedEntries(write_log(tmp_path / "log.mcap", []))
