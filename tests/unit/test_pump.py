"""Pumps: everything that came is handed over, in order, and then the error."""

from __future__ import annotations

import threading

import pytest

import hil.pump as pump_module
from firmware_protocol.clock import ManualClock
from firmware_protocol.errors import LinkClosedError, LinkOpenError
from firmware_protocol.link import Link
from hil.pump import Back, InlinePump, Lost, ThreadedPump
from hil.reopening import Reopening


class Script(Link):
    """A link that brings what it is told to, and then ends."""

    url = "script:"

    def __init__(self, *items: bytes | Exception) -> None:
        self.items = list(items)
        self.waited: list[float] = []
        self.closed = 0

    def write(self, data: bytes) -> None:
        del data

    def read(self, timeout: float) -> bytes:
        self.waited.append(timeout)
        item = self.items.pop(0) if self.items else LinkClosedError(self.url, "over")
        if isinstance(item, Exception):
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


def turn_of(pump: ThreadedPump) -> Lost | Back | None:
    """The turn at the end of what was taken last; it is seen to."""
    turn, pump.turn = pump.turn, None
    return turn


def taken(pump: ThreadedPump) -> list[bytes]:
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


def test_a_pump_that_nobody_takes_from_does_not_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pump_module, "_LIMIT", 3)
    link = Script(*[b"x"] * 10)
    pump = ThreadedPump(link, ManualClock())
    came = 0
    while pump.error is None:
        assert len(link.items) >= 6 - came
        came += len(pump.take(1.0, float("inf")))
    assert came == 10
    pump.close()


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
