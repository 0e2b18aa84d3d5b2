"""The link in lock-step asks for as many control periods as the host waits for, and for no more."""

from __future__ import annotations

import pytest
from period_runner import PERIOD, Runner

from firmware_protocol.links.memory import MemoryLink


@pytest.mark.parametrize(("wait", "periods"), [(0.005, 1), (0.05, 10), (0.012, 3), (0.0001, 1), (0.1 + 0.2, 60), (15.0, 3000)])
def test_it_asks_for_the_periods_of_the_wait(wait: float, periods: int) -> None:
    device = Runner({})
    assert MemoryLink(device).read(wait) == b""
    assert device.asked == [(b"", periods)]


def test_it_returns_what_is_said_at_the_time_it_is_said() -> None:
    device = Runner({3: b"one", 4: b"two"})
    link = MemoryLink(device)
    link.write(b"a")
    link.write(b"b")
    assert link.read(0.1) == b"one"
    assert device.now() == 3 * PERIOD
    assert link.read(0.1) == b"two"
    assert device.asked == [(b"ab", 20), (b"", 20)]


def test_it_asks_again_for_the_rest_when_the_device_comes_back_early() -> None:
    device = Runner({9: b"late"}, pauses=(2, 5))
    link = MemoryLink(device)
    link.write(b"x")
    assert link.read(0.1) == b"late"
    assert device.asked == [(b"x", 20), (b"", 18), (b"", 15)]


def test_it_does_not_live_beyond_the_wait() -> None:
    device = Runner({30: b"late"}, pauses=(2,))
    assert MemoryLink(device).read(0.1) == b""
    assert device.now() == pytest.approx(0.1)


def test_a_device_that_lives_one_period_at_a_time_is_stepped() -> None:
    class Stepper:
        """It repeats in the third period what came in the first."""

        def __init__(self) -> None:
            self.came: list[bytes] = []

        def now(self) -> float:
            return len(self.came) * PERIOD

        def step(self, inbound: bytes) -> bytes:
            self.came.append(inbound)
            return self.came[0] if len(self.came) == 3 else b""

    device = Stepper()
    link = MemoryLink(device)
    link.write(b"echo")
    assert link.read(0.1) == b"echo"
    assert device.came == [b"echo", b"", b""]
