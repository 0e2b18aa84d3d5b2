"""A world behind a bad line."""

from __future__ import annotations

import pytest

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.links import FaultSpec
from simdevice.disturbed import DisturbedWorld
from simdevice.sumo.junior_world import junior_world


def sent(spec: str, seconds: float = 10.0, seed: int = 1) -> tuple[bytes, float]:
    """What a world says on its own, and its time afterwards."""
    world = DisturbedWorld(junior_world(), FaultSpec.parse(spec), seed)
    return b"".join(world.step(b"") for _ in range(round(seconds / world.period))), world.now()


def test_a_good_line_changes_nothing() -> None:
    world = junior_world()
    assert sent("drop:0")[0] == b"".join(world.step(b"") for _ in range(2000))


@pytest.mark.parametrize("spec", ["drop:0.3", "jitter:0.02", "drop:0.05,corrupt:0.01,jitter:0.02"])
def test_time_passes_a_period_a_step_whatever_the_line_does(spec: str) -> None:
    data, now = sent(spec)
    assert now == pytest.approx(10.0)
    assert data


def test_a_line_that_drops_brings_less_and_the_same_for_the_same_seed() -> None:
    assert len(sent("drop:0.3")[0]) == pytest.approx(0.7 * len(sent("drop:0")[0]), rel=0.1)
    assert sent("drop:0.3", seed=2) == sent("drop:0.3", seed=2)
    assert sent("drop:0.3", seed=2) != sent("drop:0.3", seed=3)


def test_a_line_can_die() -> None:
    world = DisturbedWorld(junior_world(), FaultSpec.parse("unplug:1"), 1)
    with pytest.raises(LinkClosedError, match="unplugged"):
        b"".join(world.step(b"") for _ in range(1000))
    assert world.now() == pytest.approx(1.0, abs=0.03)


def test_a_line_that_comes_back_was_silent_meanwhile_and_lost_no_time() -> None:
    world = DisturbedWorld(junior_world(), FaultSpec.parse("unplug:1+2"), 1)
    said = [world.step(b"") for _ in range(1000)]
    assert world.now() == pytest.approx(5.0)
    silent = [k * world.period for k, data in enumerate(said) if not data]
    heard = [k * world.period for k, data in enumerate(said) if data]
    assert not [time for time in heard if 1.0 < time < 2.95]
    assert heard[-1] > 4.9
    assert max(silent) > 2.9
