"""What the swarm is there for, in short: by learning over the wire, with default noise, it surrounds; without, it does not."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pytest

from hil.cli.app import run

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.slow
STEPS, SEEDS = 50, 8


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)


def left(capsys: pytest.CaptureFixture[str], *words: str) -> float:
    """What is left at the end of the distance at the start, the mean over seeds."""
    command = ["swarm", "surround", "--case", "B2D3", "--steps", str(STEPS), "--seeds", str(SEEDS), *words]
    assert run([*command, "--no-log", "--no-report", "--json", "--quiet"]) == 0
    distances = np.array([one["distance"] for one in json.loads(capsys.readouterr().out)["runs"]])
    assert distances.shape == (SEEDS, STEPS + 1)
    return float((distances[:, STEPS] / distances[:, 0]).mean())


def test_robots_that_learn_surround(capsys: pytest.CaptureFixture[str]) -> None:
    assert 0.05 < left(capsys) < 0.35


def test_those_that_do_not_learn_do_not(capsys: pytest.CaptureFixture[str]) -> None:
    assert 0.9 < left(capsys, "--no-learning") < 1.6
