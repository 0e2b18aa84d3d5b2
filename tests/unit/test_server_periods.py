"""A server in real time lets its world live for the control periods that are due, and passes on what is said."""

from __future__ import annotations

import pytest
from period_runner import PERIOD, Runner

from firmware_protocol.clock import ManualClock
from simdevice.serving.endpoints import Endpoint
from simdevice.serving.server import MAX_CATCH_UP, Server


class Wall(Endpoint):
    """An endpoint that keeps what is sent, and has something to receive."""

    url = "wall:"

    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.waiting = b""

    def files(self) -> list[int]:
        return []

    def poll(self, now: float) -> None:
        pass

    def receive(self, now: float) -> bytes:  # noqa: ARG002 - as every endpoint
        data, self.waiting = self.waiting, b""
        return data

    def send(self, data: bytes, now: float) -> None:  # noqa: ARG002 - likewise
        self.sent.append(data)

    def close(self) -> None:
        pass


def served(device: Runner) -> tuple[Server, Wall, ManualClock]:
    """A server that is due for its first period in a moment."""
    wall, clock = Wall(), ManualClock()
    return Server(device, wall, clock, wait=lambda _files, _timeout: None), wall, clock


@pytest.mark.parametrize("due", [1, 2, MAX_CATCH_UP])
def test_it_asks_for_what_is_due(due: int) -> None:
    device = Runner({})
    server, wall, clock = served(device)
    wall.waiting = b"hello"
    clock.advance((due + 0.5) * PERIOD)
    server.turn()
    assert device.asked == [(b"hello", due)]
    assert server.steps == due
    server.turn()
    assert device.asked == [(b"hello", due)]  # nothing more is due


def test_what_is_said_on_the_way_is_sent_before_the_rest_is_lived() -> None:
    device = Runner({2: b"word"})
    server, wall, clock = served(device)
    clock.advance(3.5 * PERIOD)
    server.turn()
    assert device.asked == [(b"", 3), (b"", 1)]
    assert wall.sent == [b"word", b""]
    assert server.steps == 3
    assert device.now() == pytest.approx(3 * PERIOD)
