"""Pumps: everything that came is handed over, in order, and then the error."""

from __future__ import annotations

import pytest

import hil.pump as pump_module
from firmware_protocol.clock import ManualClock
from firmware_protocol.errors import LinkClosedError
from firmware_protocol.link import Link
from hil.pump import InlinePump, ThreadedPump


class Script(Link):
    """A link that brings what it is told to, and then ends."""

    url = "script:"

    def __init__(self, *items: bytes | Exception) -> None:
        self.items = list(items)
        self.waited: list[float] = []

    def write(self, data: bytes) -> None:
        del data

    def read(self, timeout: float) -> bytes:
        self.waited.append(timeout)
        item = self.items.pop(0) if self.items else LinkClosedError(self.url, "over")
        if isinstance(item, Exception):
            raise item
        return item

    def close(self) -> None:
        pass


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
