"""The commands where several robots share a link."""

from __future__ import annotations

import json
import re
import signal
from typing import TYPE_CHECKING

import pytest
from processes import Hil

from hil.cli.app import run

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def printed(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> pytest.CaptureFixture[str]:
    monkeypatch.chdir(tmp_path)
    return capsys


def test_param_says_which_robot_it_took_and_how_to_take_another(printed: pytest.CaptureFixture[str]) -> None:
    assert run(["param", "sim://junior?count=3", "SYS_ID"]) == 0
    captured = printed.readouterr()
    assert captured.out == "1\n"
    assert captured.err.startswith("This is robot 1. Also on this link: robot")
    assert "'sim://junior?count=3&system=2'" in captured.err
    assert run(["param", "sim://junior?count=3&system=2", "SYS_ID"]) == 0
    assert printed.readouterr() == ("2\n", "")
    assert run(["param", "sim://junior?count=3", "SYS_ID", "--quiet"]) == 0
    assert printed.readouterr().err == ""


def test_on_can_the_other_is_named_by_its_node() -> None:
    from hil.connecting.connecting import with_system  # noqa: PLC0415

    assert with_system("can://virtual/a?port=3&node=1", 2) == "can://virtual/a?port=3&node=2"
    assert with_system("tcp://127.0.0.1:5760", 2) == "tcp://127.0.0.1:5760?system=2"


def test_check_and_bout_say_it_too(printed: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "sim://junior?count=2", "--only", "frame-in-pieces"]) == 0
    assert "Also on this link: robot 2" in printed.readouterr().out
    arguments = ["bout", "sim://junior?count=2", "--controller", "random", "--trials", "1", "--no-log"]
    assert run(arguments) == 0
    assert "Also on this link: robot 2" in printed.readouterr().out


def test_monitor_shows_all(printed: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run(["monitor", "sim://junior?count=3", "--duration", "1.5", "--log", "all.mcap"]) == 0
    text = printed.readouterr().out
    assert [len(re.findall(rf"^robot {system}  disarmed", text, re.MULTILINE)) for system in (1, 2, 3)] == [2, 2, 2]
    assert (tmp_path / "all.mcap").stat().st_size > 1000
    assert run(["monitor", "sim://junior?count=3", "--duration", "1", "--no-log", "--json"]) == 0
    assert [robot["system"] for robot in json.loads(printed.readouterr().out)] == [1, 2, 3]
    assert run(["monitor", "sim://junior?count=1", "--duration", "1", "--no-log", "--json"]) == 0
    assert json.loads(printed.readouterr().out)["system"] == 1
    assert run(["monitor", "sim://junior?count=3&system=3", "--duration", "1", "--no-log", "--json"]) == 0
    assert json.loads(printed.readouterr().out)["system"] == 3


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs POSIX signals")
def test_emulate_serves_several_and_keeps_their_memories(printed: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    command = ("emulate", "junior", "--count", "3", "--link", "tcp://127.0.0.1:0", "--memory", "all.bin", "--seed", "2")
    for value in ("300", "310"):
        with Hil(tmp_path, *command) as robots:
            line = robots.until("3 Juniors, system ids 1 to 3, are at")
            url = line.split()[-1]
            assert run(["param", f"{url}?system=3", "EYE_L_ON"]) == 0
            assert printed.readouterr().out == ("250\n" if value == "300" else "300\n")
            assert run(["param", f"{url}?system=3", "EYE_L_ON", value]) == 0
            printed.readouterr()
            robots.send(signal.SIGTERM)
            assert robots.end() == 130
    assert (tmp_path / "all.bin").stat().st_size == 3 * 1024
    assert run(["emulate", "junior", "--count", "2", "--link", "tcp://127.0.0.1:0", "--memory", "all.bin"]) == 2
    assert "all.bin is no memory image of 2 robots: expected 2048 bytes, not 3072" in printed.readouterr().err
    assert run(["emulate", "junior", "--count", "200", "--link", "can://virtual/many"]) == 2
    assert "1 to 127 robots can share this line, not 200" in printed.readouterr().err
