"""The whole way of a robot on silicon: coached, taught, switched off, and winning with nobody at the other end of the line."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.messages import BoutOutcome
from hil.bridge.bridge import Bridge
from hil.cli.app import run
from hil.sumo.advice_file import load_advice
from hil.sumo.deploying import deploy, read_memory
from hil.sumo.junior import Junior
from simdevice.avr.board import AvrBoard
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = [pytest.mark.avr, pytest.mark.slow]
COUNTDOWN = 1000
"""Control periods from the start module's signal to the first move."""
BOUT = 3000


def test_coached_deployed_switched_off_and_won_from_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    learnt = tmp_path / "silicon.advice.toml"
    coach = ["coach", "sim://junior?board=avr&opponent=flat-light", "--budget", "120", "--seed", "2", "--held-out", "0"]
    assert run([*coach, "--no-log", "--quiet", "--advice-out", str(learnt)]) == 0, capsys.readouterr().err

    world = junior_world(WorldSettings(opponent="flat-light", seed=4, referee=False, board=AvrBoard))
    with Junior(Bridge(MemoryLink(world), world)) as junior:
        junior.find()
        done = deploy(junior, load_advice(learnt))
    world.step(b"")
    world.device.power_cycle()

    outcomes = []
    for seed in (11, 12, 13):
        world.device.set_start(go=False)
        world.step(b"")
        world.device.set_start(go=True)
        for _ in range(COUNTDOWN):
            world.step(b"")
        world.match.reset(seed, None)
        for _ in range(BOUT):
            world.step(b"")
            if world.match.outcome is not BoutOutcome.UNDECIDED:
                break
        outcomes.append(world.match.outcome)
    assert outcomes.count(BoutOutcome.WIN) >= 2

    with Junior(Bridge(MemoryLink(world), world)) as junior:
        junior.find()
        assert read_memory(junior) == (list(done.plan.slots), done.checksum)
        assert junior.status().boot_count == 2
