"""`hil coach` in the same process: what it leaves, what it prints, and how its endings are told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from hil.advice_file import load_advice
from hil.cli.app import run
from hil.coaching import load_checkpoint
from hil.mcaplog import LogReader, differences

COACH = ("coach", "--budget", "60", "--held-out", "2", "--no-report")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    return tmp_path


def files(pattern: str) -> list[str]:
    return sorted(str(path) for path in Path().glob(pattern))


@pytest.mark.slow
def test_the_main_job_leaves_advice_log_report_and_checkpoint(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["coach", "--budget", "60", "--held-out", "3"]) == 0
    said = capsys.readouterr().out
    assert "Pal coaches it against flat-light: 60 maneuvers" in said
    assert "60/60 maneuvers" in said
    assert "What Junior learnt:" in said
    assert "When both eyes see it: " in said
    assert "How it plays: won " in said
    (log,) = files("logs/*-coach.mcap")
    (page,) = files("logs/*-coach-report/report.html")
    advice, checkpoint = "advice/flat-light-1.advice.toml", "advice/flat-light-1.checkpoint.json"
    for path in (log, page, advice, checkpoint):
        assert path in said
        assert Path(path).stat().st_size > 1000
    learnt = load_advice(Path(advice))
    assert (learnt.opponent, learnt.seed, learnt.settings.budget) == ("flat-light", 1, 60)
    saved = load_checkpoint(Path(checkpoint))
    assert saved.pal.finished
    assert saved.progress.bouts > 1
    reader = LogReader(Path(log))
    topics = {entry.topic for entry in reader.entries()}
    assert {"/wire/rx", "/wire/tx", "/junior/sensors", "/junior/maneuver_result", "/pal/trial", "/pal/advice", "/tf"} <= topics
    assert not reader.truncated
    assert not reader.damage
    assert {"run", "config", "robot"} <= set(reader.metadata)
    assert reader.metadata["config"]["seed"] == "1"


def test_json_is_one_object_on_stdout_and_everything_else_is_on_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*COACH, "--json"]) == 0
    said = capsys.readouterr()
    document: dict[str, Any] = json.loads(said.out)
    assert set(document) >= {"advice", "log", "report", "maneuvers", "robot_seconds", "per_stimulus"}
    assert document["maneuvers"] == 60
    assert document["robot_seconds"] > 10
    assert document["report"] is None
    assert set(document["per_stimulus"]) <= {"none", "left", "right", "both"}
    for learnt in document["per_stimulus"].values():
        assert 1 <= len(learnt["maneuver"]) <= 8
    assert Path(document["advice"]).is_file()
    assert Path(document["log"]).is_file()
    assert document["held_out"]["trials"] == 2
    assert "60/60 maneuvers" in said.err


@pytest.mark.slow
def test_quiet_prints_the_result_only(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*COACH, "--quiet", "--no-log"]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("\nPal coached Junior")
    assert said.err == ""
    assert run([*COACH, "--quiet", "--json", "--no-log"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["log"] is None
    assert said.err == ""
    assert files("logs/*") == []


def test_more_than_was_reached_can_be_required(capsys: pytest.CaptureFixture[str]) -> None:
    cheap = ["coach", "--budget", "5", "--no-log", "--quiet", "--held-out"]
    assert run([*cheap, "1", "--require", "0"]) == 0
    assert run([*cheap, "0", "--require", "0.5"]) == 1
    assert "required 0.5" in capsys.readouterr().out


@pytest.mark.slow
def test_the_same_seed_leaves_the_same_bytes_and_another_seed_others(folder: Path) -> None:
    for name, seed in (("a", "1"), ("b", "1"), ("c", "2")):
        out = ["--log", f"{name}.mcap", "--advice-out", f"{name}.advice.toml", "--checkpoint", f"{name}.json"]
        assert run([*COACH, "--quiet", "--seed", seed, *out]) == 0
    assert (folder / "a.advice.toml").read_bytes() == (folder / "b.advice.toml").read_bytes()
    assert (folder / "a.json").read_bytes() == (folder / "b.json").read_bytes()
    assert differences(folder / "a.mcap", folder / "b.mcap") == []
    assert (folder / "a.mcap").read_bytes() != (folder / "b.mcap").read_bytes()  # the record `run` names the file
    assert differences(folder / "a.mcap", folder / "c.mcap")
    assert (folder / "a.advice.toml").read_bytes() != (folder / "c.advice.toml").read_bytes()
    assert run([*COACH, "--quiet", "--no-log", "--advice-out", "d.advice.toml"]) == 0
    assert (folder / "a.advice.toml").read_bytes() == (folder / "d.advice.toml").read_bytes()


def test_a_run_can_be_gone_on_with_but_not_as_another(capsys: pytest.CaptureFixture[str]) -> None:
    begin = ["coach", "--no-log", "--quiet", "--held-out", "0", "--opponent", "corner-light", "--budget", "20"]
    assert run([*begin, "--seed", "4"]) == 0
    learnt = Path("advice/corner-light-4.advice.toml").read_bytes()
    Path("advice/corner-light-4.advice.toml").unlink()
    capsys.readouterr()
    resume = ["coach", "--no-log", "--quiet", "--held-out", "0", "--resume"]
    # Named by its file alone, it keeps its opponent, seed and names.
    assert run([*resume, "--checkpoint", "advice/corner-light-4.checkpoint.json"]) == 0
    assert "against corner-light: 20 maneuvers" in capsys.readouterr().out
    assert Path("advice/corner-light-4.advice.toml").read_bytes() == learnt
    assert run([*resume, "--opponent", "corner-light", "--seed", "4", "--budget", "20"]) == 0
    for option, value in (("--opponent", "flat-light"), ("--seed", "5"), ("--budget", "30"), ("--objective", "contact")):
        assert run([*resume, "--checkpoint", "advice/corner-light-4.checkpoint.json", option, value]) == 2
        assert f"begun with {option[2:]}" in capsys.readouterr().err
    assert run([*resume, "--seed", "99"]) == 2
    assert "run without --resume first" in capsys.readouterr().err


def test_a_configuration_file_sets_options_and_the_command_line_wins(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    (folder / "hil.toml").write_text('seed = 7\n[coach]\nbudget = 9\nheld-out = 0\nopponent = "point-light"\nno-log = true\n')
    assert run(["coach", "--config", "hil.toml", "--budget", "12", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["maneuvers"], document["seed"], document["opponent"]) == (12, 7, "point-light")
    assert (document["held_out"], document["log"]) == (None, None)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("budgett = 3", "budgett"),
        ("coach = 3", "must be a table"),
        ("x = [", "no valid TOML"),
        ('[coach]\nbudget = "x"', "--budget"),
    ],
)
def test_a_wrong_configuration_is_named(capsys: pytest.CaptureFixture[str], folder: Path, text: str, named: str) -> None:
    (folder / "hil.toml").write_text(text)
    assert run(["coach", "--config", "hil.toml"]) == 2
    said = capsys.readouterr().err
    assert named in said
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--opponent", "nobody"], "choose one of flat-light"),
        (["sim://junior?opponent=nobody"], "expected one of flat-light"),
        (["sim://junior?faults=drop:2"], "drop"),
        (["sim://junior?budget=2"], "budget"),
        (["robot"], "not an address"),
        (["--budget", "0"], "--budget"),
        (["--log", "a.mcap", "--no-log"], "exclude each other"),
        (["--log", "/dev/null/a.mcap"], "/dev/null"),
        (["--resume", "--checkpoint", "none.json"], "none.json"),
        (["--advice-out", "x.json", "--checkpoint", "./x.json"], "the same"),
        (["sim://junior?referee=0", "--objective", "outcome"], "referee"),
        (["--checkpoint", "/dev/null/a.json"], "/dev/null/a.json"),
    ],
)
def test_wrong_usage_is_named_without_a_traceback(capsys: pytest.CaptureFixture[str], arguments: list[str], named: str) -> None:
    extra = [] if "--log" in arguments else ["--no-log"]
    assert run(["coach", "--budget", "5", "--held-out", "0", *extra, *arguments]) == 2
    said = capsys.readouterr().err
    assert named in said
    assert "Traceback" not in said


def test_without_a_referee_contact_is_the_objective(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["coach", "sim://junior?referee=0", "--budget", "10", "--no-log", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["objective"], document["held_out"]) == ("contact", None)
    assert document["advice"] == "advice/robot-1.advice.toml"


def test_a_full_disk_ends_the_run_and_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    if not Path("/dev/full").is_char_device():
        pytest.skip("this system has no /dev/full")
    assert run([*COACH, "--log", "/dev/full"]) == 2
    assert "No space left" in capsys.readouterr().err


def test_over_a_bad_line_every_maneuver_is_performed_once(capsys: pytest.CaptureFixture[str]) -> None:
    bad = "sim://junior?seed=1&faults=drop:0.05,corrupt:0.01,jitter:0.02"
    assert run(["coach", bad, "--budget", "80", "--held-out", "0", "--no-report", "--json", "--log", "bad.mcap"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["maneuvers"] == 80
    asked: set[int] = set()
    performed = 0
    for entry in LogReader(Path("bad.mcap")).entries({"/junior/maneuver", "/robot/status"}):
        if entry.topic == "/junior/maneuver":
            asked.add(entry.value.sequence)
        else:
            performed = max(performed, entry.value.maneuvers)
    assert performed <= len(asked) == 80


def cut_short(monkeypatch: pytest.MonkeyPatch, after: int) -> None:
    """Have somebody press Ctrl-C when a run has rated so many maneuvers."""
    left = after

    def counting(*_: object) -> None:
        nonlocal left
        left -= 1
        if left == 0:
            raise KeyboardInterrupt

    monkeypatch.setattr("hil.cli.progress.CoachingDisplay.trial", counting)


@pytest.mark.slow
def test_beginning_anew_keeps_what_a_run_that_was_cut_had_learnt(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        cut_short(patched, 55)
        assert run([*COACH, "--no-log", "--advice-out", "my advice.toml"]) == 130
    said = capsys.readouterr().out
    assert "hil coach --resume --checkpoint advice/flat-light-1.checkpoint.json --advice-out 'my advice.toml'" in said
    used = load_checkpoint(Path("advice/flat-light-1.checkpoint.json")).pal.used
    assert used > 0
    for number in ("", "2"):
        with monkeypatch.context() as patched:
            cut_short(patched, 55)
            assert run([*COACH, "--no-log"]) == 130
        assert f"kept as advice/flat-light-1.checkpoint.json.old{number}" in capsys.readouterr().out
        assert load_checkpoint(Path(f"advice/flat-light-1.checkpoint.json.old{number}")).pal.used == used
    assert run([*COACH, "--no-log", "--resume"]) == 0
    assert run([*COACH, "--no-log"]) == 0
    assert len(files("advice/*.old*")) == 2  # a run that was finished is nothing to be resumed


def test_a_link_that_cannot_be_opened_leaves_no_log(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["coach", "serial:///dev/no-such-port:115200"]) == 3
    assert "no-such-port" in capsys.readouterr().err
    assert files("logs/*") == []
