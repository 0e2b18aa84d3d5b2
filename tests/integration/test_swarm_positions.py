"""Robots without rings of their own: whom they see is reckoned from where all are, which a camera's program may tell."""

from __future__ import annotations

import json
import socket
from typing import TYPE_CHECKING, Any

import pytest
from processes import Hil

from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.replaying.host import replay

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.slow


def mission(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """What a mission comes to."""
    assert run(["swarm", "surround", *arguments, "--ring", "positions", "--no-report", "--json", "--quiet"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def free_port() -> int:
    """A UDP port that nobody has."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_robots_without_rings_learn_by_their_positions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    found = mission(capsys, "sim://swarm?ring=0&seed=2", "--case", "B2D3", "--seed", "2", "--steps", "50")
    assert found["missing"] == []
    assert found["distance"][-1] < 0.4 * found["distance"][0]


@pytest.mark.parametrize("who", [(6, 2, 4), pytest.param((25, 8, 50), marks=pytest.mark.nightly)])
def test_a_camera_tells_where_robots_are_that_have_neither_rings_nor_fixes(
    who: tuple[int, int, int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rangers, wilds, steps = who
    speed = "1" if steps >= 50 else "2"
    monkeypatch.chdir(tmp_path)
    port = free_port()
    robots = [
        "--rangers",
        str(rangers),
        "--wilds",
        str(wilds),
        "--no-ring",
        "--link",
        "tcp://127.0.0.1:0",
        "--json",
        "--speed",
        speed,
    ]
    with Hil(tmp_path, "emulate", "swarm", *robots, "--poses-to", f"udpout://127.0.0.1:{port}") as table:
        document = ""
        while not document.rstrip().endswith("}"):
            document += table.until("\n")
        (url,) = json.loads(document)["urls"]
        case = ["--case", f"B2D3R{rangers}W{wilds}", "--steps", str(steps)]
        found = mission(capsys, url, *case, "--poses", f"udpin://127.0.0.1:{port}")
    assert found["missing"] == []
    assert [sum(row) for row in found["behaviours"]] == [rangers] * steps
    assert found["path"] > 0.3 * steps * 0.4
    if steps >= 50:
        assert found["distance"][-1] <= 0.3 * found["distance"][0]
    log = tmp_path / found["log"]
    fixes = sum(1 for _ in LogReader(log).entries(topics=("/swarm/fix",)))
    assert fixes > 10 * (rangers + wilds)
    assert replay(log, strict=True).same
