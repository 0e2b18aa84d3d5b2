"""`hil log` as a person or a script meets it: what it prints, what it leaves, how it ends."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from report_logs import coaching_log

from hil.cli.app import run
from hil.mcaplog import LogReader

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "run" / "log.mcap"
    path.parent.mkdir()
    coaching_log(path, budget=20)
    return path


@pytest.fixture
def cut(log: Path) -> Path:
    path = log.with_name("cut.mcap")
    path.write_bytes(log.read_bytes()[:-9000])
    return path


def test_info_tells_what_is_in_a_log(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["log", "info", str(log.parent)]) == 0
    printed = capsys.readouterr().out
    assert f"Log: {log}\nwhole, " in printed
    assert "coaching" in printed
    assert "/junior/sensors" in printed
    assert "command: hil coach --seed 3" in printed
    assert run(["log", "info", str(log), "--json", "--sizes"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["whole"]
    topics = {topic["topic"]: topic for topic in told["topics"]}
    sensors = topics["/junior/sensors"]
    assert sensors["entries"] == sum(1 for _ in LogReader(log).entries(["/junior/sensors"]))
    assert sensors["rate"] == pytest.approx(sensors["entries"] / told["duration"])
    assert sensors["size"] > 22 * sensors["entries"]
    assert sensors["schema"] == "hil.JuniorSensors"
    assert told["series"][0]["title"] == "coaching"
    assert told["metadata"]["config"]["seed"] == "3"
    assert run(["log", "info", str(log), "--quiet"]) == 0
    assert capsys.readouterr().out.startswith("whole, ")


def test_info_takes_a_log_that_was_cut_off(cut: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["log", "info", str(cut)]) == 0
    assert "cut off" in capsys.readouterr().out


def test_check_tells_which_rule_is_broken_and_where(log: Path, cut: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["log", "check", str(log)]) == 0
    assert "23 of 23 rules hold (MCAP's and ours)" in capsys.readouterr().out
    assert run(["log", "check", str(cut)]) == 1
    printed = capsys.readouterr().out
    assert "  byte " in printed
    assert "BROKEN: our index (the rule: the summary has " in printed
    assert printed.splitlines()[-1].startswith("21 of 23 rules hold (MCAP's and ours), 2 BROKEN; the log is cut off: ")
    assert run(["log", "check", str(cut), "--json"]) == 1
    rules = {rule["name"]: rule for rule in json.loads(capsys.readouterr().out)}
    assert not rules["our index"]["passed"]
    assert rules["our clock"]["passed"]
    broken = [rule for rule in rules.values() if not rule["passed"]]
    assert all(rule["count"] >= 1 and rule["findings"][0]["text"] and rule["detail"] for rule in broken)
    assert run(["log", "check", str(log), "--quiet"]) == 0
    assert capsys.readouterr().out == ""


def test_recover_makes_a_log_whole(cut: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "whole.mcap"
    assert run(["log", "recover", str(cut), "-o", str(out)]) == 0
    assert "Was:  cut off" in capsys.readouterr().out
    assert run(["log", "check", str(out)]) == 0
    assert run(["log", "info", str(out)]) == 0
    assert "cut: it ends before the run did; cut off: " in capsys.readouterr().out
    assert run(["log", "recover", str(cut), "-o", str(out)]) == 2
    assert "is there already" in capsys.readouterr().err
    assert run(["log", "recover", str(cut), "-o", str(out), "--overwrite", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["log"], told["whole"], told["size"]) == (str(out), False, out.stat().st_size)
    assert run(["log", "recover", str(cut), "-o", str(out), "--overwrite", "--quiet"]) == 0
    assert capsys.readouterr().out == f"{out}\n"


def test_recover_of_nothing_leaves_nothing(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    empty, out = tmp_path / "empty.mcap", tmp_path / "whole.mcap"
    empty.write_bytes(log.read_bytes()[:20])
    assert run(["log", "recover", str(empty), "-o", str(out)]) == 1
    assert "nothing could be had" in capsys.readouterr().err
    assert not out.exists()


def test_slim_makes_a_log_small(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "logs" / "small.mcap"
    assert run(["log", "slim", str(log), "-o", str(out)]) == 0
    assert f"New:  {out}: " in capsys.readouterr().out
    assert out.stat().st_size < log.stat().st_size / 2
    assert run(["log", "check", str(out)]) == 0
    assert run(["log", "info", str(out)]) == 0
    assert "slim: of the topics it has kept /bridge/*, /wire/*" in capsys.readouterr().out


@pytest.mark.parametrize("verb", ["info", "check"])
def test_what_is_no_log_is_told_in_words(tmp_path: Path, verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "text.mcap"
    path.write_text("hello")
    assert run(["log", verb, str(path)]) == 2
    assert "is not a log" in capsys.readouterr().err
    assert run(["log", verb, str(tmp_path / "nowhere.mcap")]) == 2
    assert "there is no log" in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["info", "check", "recover", "slim", "csv", "diff"])
def test_every_verb_has_an_example(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["log", verb, "--help"]) == 0
    assert f"Example: hil log {verb}" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("verb", [["log", "info"], ["log", "check"], ["replay"]])
def test_a_log_of_which_nothing_can_be_read_is_a_file_that_cannot_be_read(
    log: Path, tmp_path: Path, verb: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "tiny.mcap"
    for size, words in ((0, "it is empty"), (6, "0 of 6 bytes could be read"), (300, "of 300 bytes could be read")):
        path.write_bytes(log.read_bytes()[:size])
        assert run([*verb, str(path)]) == 4
        assert words in capsys.readouterr().err


def test_slim_of_nothing_leaves_nothing(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    head, out = tmp_path / "head.mcap", tmp_path / "small.mcap"
    head.write_bytes(log.read_bytes()[:9000])
    assert run(["log", "slim", str(head), "-o", str(out)]) == 1
    assert "no entry could be had" in capsys.readouterr().err
    assert not out.exists()
