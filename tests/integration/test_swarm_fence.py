"""Robots keep within their fence on an emulated table, through a mission, and who was put outside comes back in."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import pytest
from swarm_bench import BOOTED, SwarmBench

from firmware_protocol.messages import ROBOT_COMPONENT, AckResult, ParamSet, Reason, RobotAck, SwarmObservation
from firmware_protocol.vocabulary import SwarmOutcome
from hil.cli.app import run
from hil.swarm.handle import Swarm
from hil.swarm.missions.surround import SurroundMission
from simdevice.swarm.world import SwarmWorld

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from firmware_protocol.messages import CommandAck
    from hil.connecting.handles import Answers

FENCE: Final = 0.6
"""Half the sides of the fence, in m."""
SLACK: Final = 0.02
"""By so much fix, slip and stopping let a robot's centre be beyond it, in m."""


def fenced(x: float, **settings: object) -> SwarmBench:
    """A robot that stands somewhere on the x axis, and has a fence."""
    bench = SwarmBench(rangers=2, wilds=0, **settings)
    bench.live(BOOTED)
    bench.say(bench.place(1, 1, x, 0.0), bench.place(2, 2, 0.0, -0.5), seconds=0.2)
    bench.open()
    for system in (1, 2):
        for name in ("FENCE_X", "FENCE_Y"):
            bench.say(ParamSet(system, ROBOT_COMPONENT, name, FENCE), seconds=0.1)
    bench.keep(0.2)
    return bench


def sent(bench: SwarmBench, sequence: int, heading: float, distance: float) -> tuple[RobotAck, list[SwarmObservation]]:
    """Have it make a move; what it answers."""
    bench.heard.clear()
    bench.live(0.02, bench.encode(bench.move(sequence, 1, heading, distance)))
    bench.keep(4.0)
    return bench.of(RobotAck, 1)[0], [one for one in bench.of(SwarmObservation, 1) if one.sequence == sequence]


def test_who_was_put_outside_is_let_back_in_and_not_farther_out() -> None:
    bench = fenced(0.9)
    ack, _ = sent(bench, 1, 0.0, 0.1)
    assert (ack.result, ack.reason) == (AckResult.REFUSED, Reason.BAD_VALUE)
    assert bench.world.table.arrays.x[0] == pytest.approx(0.9, abs=0.005)
    ack, seen = sent(bench, 2, np.pi, 0.5)
    assert ack.result == AckResult.ACCEPTED
    assert seen[0].outcome == SwarmOutcome.ARRIVED
    assert bench.world.table.arrays.x[0] == pytest.approx(0.4, abs=0.03)
    ack, _ = sent(bench, 3, 0.0, 0.5)
    assert ack.result == AckResult.REFUSED


def test_who_is_pushed_out_while_it_drives_stops_and_comes_back() -> None:
    bench = fenced(-0.3)
    bench.live(0.02, bench.encode(bench.move(1, 1, 0.6, 0.6)))
    bench.keep(1.0)
    bench.heard.clear()
    bench.live(0.02, bench.encode(bench.place(4, 1, -0.15, 0.65, 0.6)))
    bench.keep(1.0)
    seen = bench.of(SwarmObservation, 1)[0]
    assert (seen.outcome, seen.reason) == (SwarmOutcome.STOPPED, Reason.BAD_VALUE)
    assert bench.world.table.arrays.y[0] == pytest.approx(0.65, abs=SLACK)
    ack, seen_then = sent(bench, 2, -np.pi / 2, 0.3)
    assert ack.result == AckResult.ACCEPTED
    assert seen_then[0].outcome == SwarmOutcome.ARRIVED
    assert bench.world.table.arrays.y[0] == pytest.approx(0.35, abs=0.03)


def test_who_is_pushed_out_beside_its_way_steers_back_in() -> None:
    bench = fenced(-0.5)
    bench.live(0.02, bench.encode(bench.move(1, 1, 0.0, 1.0)))
    bench.keep(1.0)
    bench.live(0.02, bench.encode(bench.place(4, 1, -0.3, 0.65, 0.0)))
    for _ in range(40):
        bench.keep(0.05)
        assert bench.world.table.arrays.y[0] < 0.65 + SLACK
    assert bench.world.table.arrays.y[0] < FENCE


@pytest.mark.parametrize(("heading", "turned"), [(np.pi, np.pi), (np.pi / 2 + 0.2, np.pi / 2)])
def test_who_is_put_outside_and_turned_round_stops_at_once(heading: float, turned: float) -> None:
    bench = fenced(0.5)
    bench.live(0.02, bench.encode(bench.move(1, 1, heading, 0.5)))
    bench.keep(1.0)
    bench.heard.clear()
    y = float(bench.world.table.arrays.y[0])
    bench.live(0.02, bench.encode(bench.place(4, 1, 0.65, y, heading - turned)))
    bench.keep(1.0)
    seen = bench.of(SwarmObservation, 1)[0]
    assert (seen.outcome, seen.reason) == (SwarmOutcome.STOPPED, Reason.BAD_VALUE)
    assert bench.world.table.arrays.x[0] == pytest.approx(0.65, abs=0.01)


class Beyond:
    """How far beyond the fence each robot is.

    Attributes:
        first: When it was looked at first, in m.
        last: When it was looked at last, likewise.
        grown: Most that anybody got farther out than before.
    """

    def __init__(self) -> None:
        self.first = self.last = self._least = np.zeros(0)
        self.grown = 0.0

    def look(self, world: SwarmWorld) -> None:
        """See where everybody is."""
        arrays = world.table.arrays
        self.last = np.maximum(np.maximum(np.abs(arrays.x), np.abs(arrays.y)) - FENCE, 0.0)
        if not self.first.size:
            self.first = self._least = self.last
        self.grown = max(self.grown, float((self.last - self._least).max()))
        self._least = np.minimum(self._least, self.last)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["B1D3R12W4", "B3D1R12W4"])
def test_nobody_drives_over_the_fence_in_a_mission_and_those_outside_come_in(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run_networks, arm, begin = SwarmWorld.run_networks, Swarm.arm, SurroundMission.begin
    begun = False
    beyond = Beyond()

    def watched(world: SwarmWorld, inbound: Sequence[bytes], periods: int) -> list[bytes]:
        said = run_networks(world, inbound, min(periods, 4))
        if begun:
            beyond.look(world)
        return said

    def fence_and_arm(swarm: Swarm) -> Answers[CommandAck]:
        for name in ("FENCE_X", "FENCE_Y"):
            assert not swarm.ask(lambda robot, name=name: robot.peer.set_parameter(name, FENCE)).errors  # type: ignore[misc]
        return arm(swarm)

    def note_and_begin(mission: SurroundMission) -> None:
        nonlocal begun
        begun = True
        begin(mission)

    monkeypatch.setattr(SwarmWorld, "run_networks", watched)
    monkeypatch.setattr(Swarm, "arm", fence_and_arm)
    monkeypatch.setattr(SurroundMission, "begin", note_and_begin)
    assert run(["swarm", "surround", "--case", case, "--steps", "40", "--no-report", "--no-log", "--json", "--quiet"]) == 0
    outside = np.count_nonzero(beyond.first > 0.0)
    assert outside > 5
    assert beyond.grown < SLACK
    assert np.count_nonzero(beyond.last > SLACK) < outside / 2
