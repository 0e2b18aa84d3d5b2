"""`hil coach --vary`: the address of a robot whose world differs from bout to bout."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil.cli.app import run
from hil.cli.coach_vary import varied
from hil.cli.common import UsageError
from hil.sumo.coaching import load_checkpoint


def test_the_address_of_an_emulated_robot_says_how_its_world_varies() -> None:
    assert varied("sim://junior", 0.15) == "sim://junior?vary=0.15"
    assert varied("sim://junior?opponent=flat-heavy&seed=1", 0.3) == "sim://junior?opponent=flat-heavy&seed=1&vary=0.3"
    assert varied("serial:///dev/ttyACM0:115200", None) == "serial:///dev/ttyACM0:115200"


@pytest.mark.parametrize("url", ["serial:///dev/ttyACM0:115200", "tcp://127.0.0.1:5760", "sim://junior?vary=0.1"])
def test_what_cannot_be_varied_is_refused(url: str) -> None:
    with pytest.raises(UsageError, match="leave"):
        varied(url, 0.15)


def test_a_coaching_in_worlds_that_vary_replays_and_is_gone_on_with_in_such_worlds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    coach = ["coach", "--runs", "1", "--budget", "12", "--held-out", "0", "--no-report", "--quiet"]
    assert run([*coach, "--vary", "0.15", "--out", "first"]) == 0
    assert run(["replay", "first", "--quiet"]) == 0
    assert load_checkpoint(Path("first/checkpoint.json")).vary == 0.15
    assert run([*coach, "--resume-from", "first", "--out", "second"]) == 0
    assert load_checkpoint(Path("second/checkpoint.json")).vary == 0.15
    capsys.readouterr()
    assert run([*coach, "--resume-from", "first", "--vary", "0.3"]) == 2
    assert "vary 0.15" in capsys.readouterr().err
