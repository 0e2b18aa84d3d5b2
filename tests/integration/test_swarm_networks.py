"""The same seed decides the same on any number of networks, and over any wire."""

from __future__ import annotations

import json

import pytest

from hil.cli.app import run

STEPS = ["--steps", "30"]


def decided(capsys: pytest.CaptureFixture[str], options: str) -> dict[str, object]:
    """What a mission of 30 steps comes to."""
    assert run(["swarm", "surround", "--no-log", "--quiet", "--json", *STEPS, f"sim://swarm?seed=3{options}"]) == 0
    found: dict[str, object] = json.loads(capsys.readouterr().out)
    return {name: value for name, value in found.items() if name not in {"wall_seconds", "run", "table", "link", "links"}}


@pytest.mark.slow
def test_networks_and_wire_change_no_decision(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> None:
    monkeypatch.chdir(tmp_path_factory.mktemp("runs"))
    alone = decided(capsys, "")
    assert alone["missing"] == []
    for options in ("&networks=3", "&networks=2&wire=can"):
        assert decided(capsys, options) == alone
