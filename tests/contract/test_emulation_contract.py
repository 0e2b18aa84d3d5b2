"""One suite for everything emulated: in Python or in the kernel, alone or on a line, and behind a bad line."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import pytest

from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.links.memory import Runnable
from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM, ROBOT_COMPONENT, Ping
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN, MAVLINK
from simdevice.boards import board_host
from simdevice.disturbed import DisturbedWorld
from simdevice.kernel.world import KernelWorld
from simdevice.sumo.crowd import Crowd
from simdevice.sumo.settings import WorldSettings
from simdevice.sumo.world import World
from simdevice.swarm.settings import SwarmSettings
from simdevice.swarm.world import SwarmWorld

if TYPE_CHECKING:
    from collections.abc import Callable

    from simdevice.emulation import Emulation, Powered


def swarm(settings: WorldSettings, rangers: int, wilds: int) -> SwarmWorld:
    """Micro-robots on a table that speak and live likewise."""
    return SwarmWorld(SwarmSettings(rangers, wilds, seed=settings.seed, wire=settings.wire, period=settings.period))


KINDS: Final[dict[str, Callable[[WorldSettings], Emulation]]] = {
    "world": World,
    "kernel": KernelWorld,
    "crowd": lambda settings: Crowd(2, settings),
    "crowd in Python": lambda settings: Crowd(2, replace(settings, host=board_host())),
    "disturbed": lambda settings: DisturbedWorld(KernelWorld(settings), FaultSpec(drop=0.1, delay=0.003), 1),
    "disturbed crowd": lambda settings: DisturbedWorld(Crowd(2, settings), FaultSpec(drop=0.1), 1),
    "swarm": lambda settings: swarm(settings, 2, 1),
    "one micro-robot": lambda settings: swarm(settings, 1, 0),
    "disturbed swarm": lambda settings: DisturbedWorld(swarm(settings, 2, 1), FaultSpec(drop=0.1), 1),
}
SETTINGS: Final = {
    "mavlink": WorldSettings(seed=3),
    "can": WorldSettings(seed=3, wire=CAN),
    "4 ms": WorldSettings(seed=3, period=0.004, referee=False),
    "10 ms": WorldSettings(seed=3, period=0.01, referee=False),
}
MICRO: Final = frozenset({"swarm", "one micro-robot", "disturbed swarm"})
"""A table has a period of 5 or of 10 ms."""
CASES: Final = [(kind, name) for kind in KINDS for name in SETTINGS if name != ("4 ms" if kind in MICRO else "10 ms")]


@pytest.fixture(params=CASES, ids=", ".join)
def case(request: pytest.FixtureRequest) -> tuple[str, str]:
    kind, name = request.param
    return kind, name


@pytest.fixture
def settings(case: tuple[str, str]) -> WorldSettings:
    return SETTINGS[case[1]]


@pytest.fixture
def make(case: tuple[str, str]) -> Callable[[WorldSettings], Emulation]:
    return KINDS[case[0]]


def test_it_says_what_it_speaks_and_how_long_its_periods_are(
    make: Callable[[WorldSettings], Emulation], settings: WorldSettings
) -> None:
    emulation = make(settings)
    assert (emulation.wire, emulation.period) == (settings.wire, settings.period)
    assert emulation.now() == 0.0
    assert isinstance(emulation, Runnable), "a link can let it live for many periods at a time"


def test_time_passes_in_its_periods_and_no_other_way(
    make: Callable[[WorldSettings], Emulation], settings: WorldSettings
) -> None:
    emulation = make(settings)
    for number in range(1, 60):
        emulation.step(b"")
        assert emulation.now() == pytest.approx(number * settings.period)
        assert emulation.now() == emulation.now()


def test_runs_say_what_steps_say_and_when(make: Callable[[WorldSettings], Emulation], settings: WorldSettings) -> None:
    by_steps, by_runs = make(settings), make(settings)
    codec = open_codec(settings.wire, system=HOST_SYSTEM, component=HOST_COMPONENT)
    first, second = [], []
    for number, periods in enumerate((1, 2, 7, 30, 30, 100, 100)):
        data = codec.encode(Ping(number, number, 1, ROBOT_COMPONENT))
        inbound, end = data, by_steps.now() + (periods - 0.5) * settings.period
        while by_steps.now() < end:
            sent, inbound = by_steps.step(inbound), b""
            first += [(by_steps.now(), sent)] if sent else []
        inbound = data
        while by_runs.now() < end:
            since, most = by_runs.now(), round((end - by_runs.now()) / settings.period + 0.5)
            chunks, inbound = by_runs.run(inbound, most), b""
            assert 1 <= round((by_runs.now() - since) / settings.period) <= most
            assert all(since < stamp <= by_runs.now() for stamp, _ in chunks)
            second += chunks
    assert second == first
    assert first


@pytest.mark.parametrize("periods", [0, -1])
def test_no_control_periods_are_none_that_can_be_asked_for(make: Callable[[WorldSettings], Emulation], periods: int) -> None:
    with pytest.raises(ValueError, match=f"1 or more control periods, not {periods}"):
        make(WorldSettings()).run(b"", periods)


@pytest.mark.parametrize("make_robot", [World, KernelWorld])
def test_a_robot_without_power_is_silent_and_keeps_its_memory(make_robot: Callable[[WorldSettings], Powered]) -> None:
    robot = make_robot(WorldSettings(wire=MAVLINK))
    assert robot.step(b"")
    robot.switch_off()
    kept = robot.nvm
    assert not any(robot.step(b"") for _ in range(300))
    assert robot.now() == pytest.approx(301 * robot.period)
    assert robot.nvm == kept
    robot.switch_on()
    assert robot.step(b"")


def test_a_control_period_takes_time() -> None:
    with pytest.raises(ValueError, match="a control period is longer than 0 s, not 0"):
        WorldSettings(period=0.0)
