"""Robots that all have one id, each on a link of its own, take part in one mission."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from served_swarm import served_swarm

from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.replaying.host import replay
from simdevice.swarm.settings import SwarmSettings

if TYPE_CHECKING:
    from pathlib import Path

LINKS = 10


@pytest.mark.slow
def test_ten_robots_of_id_1_drive_to_their_places_and_learn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    mission = ["--case", "B2D3R7W3", "--place", "drive", "--steps", "3", "--no-report", "--json", "--quiet"]
    settings = SwarmSettings(rangers=7, wilds=3, networks=LINKS)
    with served_swarm(settings, *["tcp://127.0.0.1:0"] * LINKS, speed=4.0) as robots:
        assert run(["swarm", "surround", *robots.urls, *mission]) == 0
        ended = robots.now()
        robots.until(lambda: robots.now() > ended + 1.2)
    found = json.loads(capsys.readouterr().out)
    assert found["robots"] == {"ranger": 7, "wild": 3}
    assert found["missing"] == []
    assert [sum(row) for row in found["behaviours"]] == [7] * 3
    assert None not in found["distance"]
    assert {(network, 1) for network in range(1, LINKS + 1)} == {move[:2] for move in robots.accepted}
    log = tmp_path / found["log"]
    asked = [entry.value.asked for entry in LogReader(log).entries(topics=("/swarm/round",))]
    assert set().union(*asked) == {f"{network}.1" for network in range(1, LINKS + 1)}
    assert replay(log, strict=True).same
