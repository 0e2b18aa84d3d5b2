"""A mission over a real TCP link in real time, on a bad line: robots are unplugged and lose their power, and it goes on."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

import pytest
from served_swarm import served_swarm

from firmware_protocol.faults.spec import FaultSpec
from hil.cli.app import run
from hil.replaying.host import replay
from hil.swarm.host import SwarmHost
from simdevice.swarm.settings import SwarmSettings

if TYPE_CHECKING:
    from pathlib import Path

    from firmware_protocol.vocabulary import RobotClass

UNPLUGGED, DEAD, SPARE = 3, 5, 25
"""Ids of robots."""


@dataclass(frozen=True)
class Plan:
    """In which steps what happens.

    Attributes:
        out: A robot is unplugged.
        cut: Another one's power is cut, for good.
        back: The first one is plugged in again.
        steps: How many there are.
        speed: Seconds of robot time per second.
    """

    out: int
    cut: int
    back: int
    steps: int
    speed: float = 1.0


@pytest.mark.slow
@pytest.mark.parametrize("plan", [Plan(2, 2, 3, 5, 2.0), pytest.param(Plan(10, 15, 20, 25), marks=pytest.mark.nightly)])
def test_a_mission_goes_on_without_those_that_are_gone_and_no_move_is_performed_twice(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    begin_step = SwarmHost.begin_step
    faults = FaultSpec.parse("drop:0.05,corrupt:0.01")
    with served_swarm(SwarmSettings(rangers=25, wilds=8), "tcp://127.0.0.1:0", faults=faults, speed=plan.speed) as robots:

        def befall(host: SwarmHost, step: int) -> list[tuple[RobotClass, int]]:
            if step == plan.out:
                robots.unplug(UNPLUGGED - 1)
            if step == plan.cut:
                robots.switch_off(DEAD - 1)
            if step == plan.back:
                robots.plug(UNPLUGGED - 1)
            return begin_step(host, step)

        monkeypatch.setattr(SwarmHost, "begin_step", befall)
        options = ["--case", "B2D3R24W8", "--spare", "--steps", str(plan.steps), "--yes", "--no-report", "--json", "--quiet"]
        assert run(["swarm", "surround", *robots.urls, *options]) == 0
        ended = robots.now()
        robots.until(lambda: robots.now() > ended + 1.2)
    found = json.loads(capsys.readouterr().out)
    gone = {one["robot"]: (one["step"], one["until"]) for one in found["missing"]}
    assert gone[str(UNPLUGGED)][0] == plan.out
    assert gone[str(UNPLUGGED)][1] in {plan.back, plan.back + 1, plan.back + 2}
    assert gone[str(DEAD)] == (plan.cut, None)
    assert [sum(row) for row in found["behaviours"]][: plan.out - 1] == [24] * (plan.out - 1)
    assert sum(found["behaviours"][-1]) == 24, "the spare has taken the place of one, who has come back that of the other"
    repeated = sum(times > 1 for times in robots.told.values())
    assert repeated > 0
    accepted = [move for move in robots.accepted if move[1] != DEAD]
    own = {system: count for (_, system), count in robots.begun.items() if system not in {DEAD, 254}}
    assert own == {system: sum(move[1] == system for move in accepted) for system in own}
    assert sum(own.values()) > 22 * plan.steps
    assert replay(found["log"], strict=True).same
