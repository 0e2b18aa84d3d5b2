"""`hil swarm list` and `hil swarm identify` on emulated robots."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from hil.cli import main
from hil.jobs.swarm_robots import show_which
from hil.swarm.connecting import connect_swarm

if TYPE_CHECKING:
    import pytest


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """A command's exit status."""
    monkeypatch.setattr("sys.argv", ["hil", "swarm", *arguments])
    try:
        main()
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


def test_list_says_who_is_there_on_every_network(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(monkeypatch, "list", "sim://swarm?rangers=3&wilds=1&networks=2", "--json") == 0
    robots = json.loads(capsys.readouterr().out)
    assert [robot["address"] for robot in robots] == ["1.1", "1.2", "2.1", "2.2"]
    assert [robot["class"] for robot in robots] == ["ranger", "ranger", "ranger", "wild"]
    assert len({robot["uid"] for robot in robots}) == 4
    assert all(robot["fence"] == [0, 0] and robot["armed"] is False for robot in robots)


def test_identify_turns_one_robot_and_leaves_the_others_alone() -> None:
    with connect_swarm("sim://swarm?rangers=3&wilds=0&noise=none", watch=True) as swarm:
        before = swarm.observe()
        show_which(swarm, 1)
        after = swarm.observe()
        assert abs(after.heading - before.heading).max() < 0.05
        assert [robot.peer.session is not None for robot in swarm.robots.values()] == [False, True, False]


def test_identify_names_who_is_there(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(monkeypatch, "identify", "9", "sim://swarm?rangers=2&wilds=0") == 2
    assert "there is no robot 9; there are 1, 2" in capsys.readouterr().err
