"""Pumps: everything that came is handed over, in order, and then the error."""

from __future__ import annotations

import threading

import pytest

import hil.bridge.pump as pump_module
from firmware_protocol.clock import ManualClock
from firmware_protocol.errors import LinkClosedError, LinkOpenError
from firmware_protocol.link import Link
from hil.bridge.pump import Back, InlinePump, Lost, ThreadedPump
from hil.bridge.reopening import Reopening


class Script(Link):
    """A link that brings what it is told to, and then ends."""

    url = "script:"

    def __init__(self, *items: bytes | Exception) -> None:
        self.items = list(items)
        self.waited: list[float] = []
        self.closed = 0
        self.emptied = threading.Event()

    def write(self, data: bytes) -> None:
        del data

    def read(self, timeout: float) -> bytes:
        self.waited.append(timeout)
        item = self.items.pop(0) if self.items else LinkClosedError(self.url, "over")
        if isinstance(item, Exception):
            self.emptied.set()
            raise item
        return item

    def close(self) -> None:
        self.closed += 1


class Links:
    """Opens the links it was given, one after the other; an error is raised instead.

    Attributes:
        clock: Moved by `wait` alone.
    """

    def __init__(self, *items: Script | LinkOpenError) -> None:
        self.items = list(items)
        self.clock = ManualClock()

    def open(self) -> Link:
        item = self.items.pop(0) if self.items else LinkOpenError("script:", "no such port")
        if isinstance(item, LinkOpenError):
            raise item
        return item

    def let_pass(self, duration: float) -> None:
        self.clock.advance(duration)

    def wait(self, stop: threading.Event, duration: float) -> bool:
        self.clock.advance(duration)
        return stop.is_set()

    def pump(self, first: Script, patience: float = 5.0) -> ThreadedPump:
        return ThreadedPump(first, self.clock, Reopening(self, patience), wait=self.wait)


class Silent(Script):
    """A link on which nothing comes."""

    def read(self, timeout: float) -> bytes:
        self.waited.append(timeout)
        return b""


def turn_of(pump: ThreadedPump | InlinePump) -> Lost | Back | None:
    """The turn at the end of what was taken last; it is seen to."""
    turn, pump.turn = pump.turn, None
    return turn


def taken(pump: ThreadedPump | InlinePump) -> list[bytes]:
    """Everything up to the next turn or the end."""
    came: list[bytes] = []
    while pump.turn is None and pump.error is None:
        came += [data for _, data in pump.take(1.0, float("inf"))]
    return came


def test_a_threaded_pump_hands_over_everything_before_the_error() -> None:
    pump = ThreadedPump(Script(b"a", b"", b"b"), ManualClock(3.0))
    chunks: list[tuple[float, bytes]] = []
    while pump.error is None:
        chunks += pump.take(1.0, float("inf"))
    assert chunks == [(3.0, b"a"), (3.0, b"b")]
    assert "over" in str(pump.error)
    assert pump.take(1.0, float("inf")) == []
    pump.close()
    pump.close()


def test_a_pump_whose_thread_fails_does_not_look_like_a_silent_robot() -> None:
    pump = ThreadedPump(Script(ZeroDivisionError("oops")), ManualClock())
    while pump.error is None:
        pump.take(1.0, float("inf"))
    assert "reading failed" in str(pump.error)
    pump.close()


def test_an_inline_pump_waits_no_longer_than_until_something_is_due() -> None:
    link = Script(b"", b"x", b"")
    pump = InlinePump(link, ManualClock(1.0))
    assert pump.take(0.5, 1.2) == []
    assert pump.take(0.5, 9.0) == [(1.0, b"x")]
    assert pump.take(0.0, 9.0) == []
    assert link.waited == [pytest.approx(0.2), 0.5, 0.0]
    assert pump.take(1.0, 9.0) == []
    assert isinstance(pump.error, LinkClosedError)
    pump.close()


def left_alone(pump: ThreadedPump) -> ThreadedPump:
    """A pump whose thread has read its link to the end while nobody took anything."""
    pump._thread.join(10.0)
    assert not pump._thread.is_alive()
    return pump


def test_a_pump_that_nobody_takes_from_keeps_so_many_bytes_and_drops_the_oldest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pump_module, "LIMIT", 10)
    pump = left_alone(ThreadedPump(Script(*[bytes((k,)) * 3 for k in range(100)]), ManualClock()))
    assert pump.pending
    assert taken(pump) == [b"aaa", b"bbb", b"ccc"]  # 97, 98, 99
    assert pump.overrun == 97 * 3
    assert "over" in str(pump.error)
    assert [pump.pending] == [False]
    pump.close()


def test_a_pump_that_nobody_takes_from_keeps_so_many_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pump_module, "CHUNKS", 4)
    pump = left_alone(ThreadedPump(Script(*[bytes((k,)) for k in range(100)]), ManualClock()))
    assert b"".join(taken(pump)) == b"`abc"
    assert pump.overrun == 96
    pump.close()


def test_a_chunk_longer_than_all_that_may_be_held_is_held(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pump_module, "LIMIT", 10)
    pump = left_alone(ThreadedPump(Script(b"a", b"b" * 20), ManualClock()))
    assert taken(pump) == [b"b" * 20]
    assert pump.overrun == 1
    pump.close()


def test_what_is_taken_makes_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pump_module, "LIMIT", 10)
    monkeypatch.setattr(pump_module, "SLICE", 4)
    clock = ManualClock()
    pump = left_alone(ThreadedPump(Script(b"abcdefgh"), clock))
    assert pump.take(0.0, 0.0) == [(0.0, b"abcd")]
    pump._put((1.0, b"ijklmn"))
    assert pump.overrun == 0
    pump._put((2.0, b"o"))  # what is left of the oldest goes, and that alone
    assert pump.overrun == 4
    pump.close()


@pytest.mark.parametrize("kind", [ThreadedPump, InlinePump])
def test_no_more_than_a_slice_is_taken_at_once(kind: type[ThreadedPump | InlinePump], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pump_module, "SLICE", 4)
    pump = kind(Script(b"abcdefghij", b"k"), ManualClock(3.0))
    pieces: list[list[tuple[float, bytes]]] = []
    while pump.error is None:
        pieces.append(pump.take(1.0, float("inf")))
    assert pieces[:2] == [[(3.0, b"abcd")], [(3.0, b"efgh")]]
    assert b"".join(data for piece in pieces for _, data in piece) == b"abcdefghijk"
    assert all(sum(len(data) for _, data in piece) <= 4 for piece in pieces)
    pump.close()


def test_a_slice_ends_in_the_middle_of_a_later_chunk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pump_module, "SLICE", 4)
    pump = left_alone(ThreadedPump(Script(b"ab", b"cdef"), ManualClock()))
    assert [data for _, data in pump.take(0.0, 0.0)] == [b"ab", b"cd"]
    assert [data for _, data in pump.take(0.0, 0.0)] == [b"ef"]
    pump.close()


def test_a_turn_stays_where_it_is_when_the_oldest_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pump_module, "LIMIT", 3)
    second = Script(*[bytes((k,)) for k in range(90, 100)])
    pump = Links(second).pump(Script())
    taken(pump)
    assert isinstance(turn_of(pump), Lost)
    pump.let_go()
    assert second.emptied.wait(10.0)  # the thread has read all, and nobody has taken
    taken(pump)
    assert turn_of(pump) == Back(second)
    assert taken(pump) == [b"a", b"b", b"c"]
    turn_of(pump)
    pump.close()


def test_a_slice_that_is_left_of_a_link_that_is_dropped_goes_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pump_module, "SLICE", 4)
    links = Links(Script(b"new"))
    pump = InlinePump(Script(b"abcdefghij"), links.clock, Reopening(links, 5.0))
    pump.take(1.0, float("inf"))
    pump.drop(LinkClosedError("script:", "a write has failed"))
    assert not pump.pending
    assert isinstance(turn_of(pump), Lost)
    assert taken(pump) == []
    assert isinstance(turn_of(pump), Back)
    assert [data for _, data in pump.take(1.0, float("inf"))] == [b"new"]


def test_the_thread_opens_a_lost_link_again_when_it_may_be_closed() -> None:
    first, second = Script(b"a"), Script(b"b")
    links = Links(LinkOpenError("script:", "not yet"), second)
    pump = links.pump(first)
    assert taken(pump) == [b"a"]
    assert pump.take(1.0, float("inf")) == []  # not before somebody has seen to it
    assert isinstance(turn_of(pump), Lost)
    assert (first.closed, links.clock.now()) == (0, 0.0)
    pump.let_go()
    taken(pump)
    assert turn_of(pump) == Back(second)
    assert first.closed == 1
    assert links.clock.now() == pytest.approx(0.1 + 0.15)
    assert taken(pump) == [b"b"]
    pump.close()
    assert second.closed


def test_the_thread_gives_up_when_the_patience_is_over() -> None:
    links = Links()
    pump = links.pump(Script())
    taken(pump)
    turn_of(pump)
    pump.let_go()
    taken(pump)
    assert str(pump.error) == "script:: over; it did not come back within 5 s (no such port)"
    assert links.clock.now() == pytest.approx(5.0)
    pump.close()


def test_a_link_that_is_dropped_is_lost_though_reading_finds_nothing_wrong() -> None:
    pump = Links(Script(b"x")).pump(Silent())
    pump.drop(LinkClosedError("script:", "a write has failed"))
    taken(pump)
    turn = turn_of(pump)
    assert isinstance(turn, Lost)
    assert "a write has failed" in str(turn.error)
    pump.let_go()
    taken(pump)
    turn_of(pump)
    assert taken(pump) == [b"x"]
    pump.close()


class Patient(Links):
    """Waits in earnest."""

    def wait(self, stop: threading.Event, duration: float) -> bool:
        del duration
        return stop.wait(10.0)


@pytest.mark.parametrize("seen_to", ["not seen to", "seen to"])
def test_a_pump_can_be_closed_while_its_link_is_lost(seen_to: str) -> None:
    first = Script()
    pump = Patient().pump(first)
    taken(pump)
    if seen_to == "seen to":
        pump.let_go()
    pump.close()
    assert first.closed
    assert not [thread for thread in threading.enumerate() if thread.name == "pump script:"]
