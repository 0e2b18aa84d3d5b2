"""`hil coach` in the same process: what it leaves, what it prints, and how its endings are told."""

from __future__ import annotations

import json
import re
import shutil
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from firmware_protocol.vocabulary import spelled_out
from hil.cli.app import run
from hil.cli.running import ActiveRun
from hil.mcaplog import LogReader, differences
from hil.runs import load_run
from hil.sumo.advice_file import load_advice
from hil.sumo.coaching import load_checkpoint

ONE = ("coach", "--runs", "1")
COACH = (*ONE, "--budget", "60", "--held-out", "2", "--no-report")


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
    assert run([*ONE, "--budget", "60", "--held-out", "3"]) == 0
    said = capsys.readouterr().out
    assert "Pal coaches it against flat-light: 60 maneuvers" in said
    assert "60/60 maneuvers" in said
    assert "What Junior learnt:" in said
    assert "When both eyes see it: " in said
    assert "How it plays: won " in said
    (made,) = files("runs/*-coach-flat-light")
    log, page, advice, checkpoint = (
        f"{made}/{name}" for name in ("log.mcap", "report/report.html", "advice.toml", "checkpoint.json")
    )
    for path in (log, page, advice, checkpoint):
        assert path in said
        assert Path(path).stat().st_size > 1000
    learnt = load_advice(Path(advice))
    for entry in learnt.entries:
        assert f"\n      {spelled_out(entry.actions)}\n" in said
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
    assert files("runs/*/log.mcap") == []


def test_more_than_was_reached_can_be_required(capsys: pytest.CaptureFixture[str]) -> None:
    cheap = [*ONE, "--budget", "5", "--no-log", "--quiet", "--held-out"]
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
    begin = [*ONE, "--no-log", "--quiet", "--held-out", "0", "--opponent", "corner-light", "--budget", "20"]
    assert run([*begin, "--seed", "4", "--out", "first"]) == 0
    learnt = Path("first/advice.toml").read_bytes()
    capsys.readouterr()
    resume = ["coach", "--no-log", "--quiet", "--held-out", "0"]
    # Named by its folder or its checkpoint alone, it keeps its opponent and seed, and the new run has a folder of its own.
    for number, named in enumerate(("first", "first/checkpoint.json")):
        assert run([*resume, "--resume-from", named, "--out", f"again{number}"]) == 0
        assert "against corner-light: 20 maneuvers" in capsys.readouterr().out
        assert Path(f"again{number}/advice.toml").read_bytes() == learnt
        assert load_run(Path(f"again{number}")).record.resumed_from == "first/checkpoint.json"
    assert run([*resume, "--resume-from", "first", "--opponent", "corner-light", "--seed", "4", "--budget", "20"]) == 0
    for option, value in (("--opponent", "flat-light"), ("--seed", "5"), ("--budget", "30"), ("--objective", "contact")):
        assert run([*resume, "--resume-from", "first", option, value]) == 2
        assert f"begun with {option[2:]}" in capsys.readouterr().err
    assert run([*resume, "--resume"]) == 2
    assert "did not finish" in capsys.readouterr().err
    shutil.copy("first/checkpoint.json", "kept.json")
    assert run([*resume, "--resume", "--checkpoint", "kept.json"]) == 0, "kept up to date where it is"


def test_a_configuration_file_sets_options_and_the_command_line_wins(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    (folder / "hil.toml").write_text(
        'seed = 7\n[coach]\nruns = 1\nbudget = 9\nheld-out = 0\nopponent = "point-light"\nno-log = true\n'
    )
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
        (["--out", "."], "choose another name for --out"),
        (["--resume"], "hil runs lists the runs"),
        (["--advice-out", "x.json", "--checkpoint", "./x.json"], "the same"),
        (["sim://junior?referee=0", "--objective", "outcome"], "referee"),
        (["--checkpoint", "/dev/null/a.json"], "/dev/null/a.json"),
    ],
)
def test_wrong_usage_is_named_without_a_traceback(capsys: pytest.CaptureFixture[str], arguments: list[str], named: str) -> None:
    extra = [] if "--log" in arguments else ["--no-log"]
    assert run([*ONE, "--budget", "5", "--held-out", "0", *extra, *arguments]) == 2
    said = capsys.readouterr().err
    assert named in said
    assert "Traceback" not in said


def test_without_a_referee_contact_is_the_objective(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["coach", "sim://junior?referee=0", "--budget", "10", "--no-log", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["objective"], document["held_out"]) == ("contact", None)
    assert document["advice"] == f"{document['run']}/advice.toml"
    assert re.fullmatch(r"runs/\d{8}-\d{6}-coach-robot", document["run"])


@pytest.mark.parametrize("option", ["--log", "--checkpoint", "--advice-out"])
def test_a_full_disk_is_said_and_does_not_end_the_run(capsys: pytest.CaptureFixture[str], option: str) -> None:
    if not Path("/dev/full").is_char_device():
        pytest.skip("this system has no /dev/full")
    assert run([*COACH, option, "/dev/full"]) == 4
    said = capsys.readouterr()
    assert said.err.count("No space left") == 2, "at once, and at the end"
    assert "How it plays: won" in said.out
    (made,) = files("runs/*")
    record = load_run(Path(made)).record
    assert (record.state, record.status) == ("failed", 4)
    assert record.error.endswith(("No space left on device", "No space left on device; nothing of it is kept"))
    assert ("Log: " in said.out) == (option != "--log")
    assert run(["runs"]) == 0
    assert record.error in capsys.readouterr().out, "the cause is the result"
    if option == "--advice-out":
        assert "[[entries]]" in said.err, "what was learnt is printed where no file holds it"
        assert "Advice: " not in said.out
        assert "hil bout --advice" not in said.out


@pytest.mark.parametrize("arguments", [("--json",), ()])
def test_a_result_that_can_t_be_printed_is_a_failure(monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...]) -> None:
    if not Path("/dev/full").is_char_device():
        pytest.skip("this system has no /dev/full")
    with suppress(OSError), Path("/dev/full").open("w", encoding="utf-8") as full:
        monkeypatch.setattr("sys.stdout", full)
        assert run([*COACH, "--no-log", *arguments]) == 4
    (made,) = files("runs/*")
    record = load_run(Path(made)).record
    assert (record.state, record.status) == ("failed", 4)
    assert record.error == "the output cannot be written or read: No space left on device"


def test_a_run_says_how_it_ended_where_the_disk_has_no_room_for_a_new_record(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_path: Path, _data: bytes) -> None:
        raise OSError(28, "No space left on device")

    def cut(self: ActiveRun, error: BaseException | None) -> None:
        monkeypatch.setattr("hil.runs.replace_file", full)
        end(self, error)

    end = ActiveRun.end
    monkeypatch.setattr(ActiveRun, "end", cut)
    assert run([*COACH, "--no-log"]) == 4
    (made,) = files("runs/*")
    record = load_run(Path(made)).record
    assert (record.state, record.status) == ("failed", 4)
    assert "run.json cannot be written anew: No space left" in record.error


@pytest.mark.slow
def test_log_and_report_are_never_those_of_the_run_before(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    short = [*ONE, "--budget", "40", "--held-out", "1", "--log", "x.mcap", "--overwrite", "--json"]
    assert run([*short, "--seed", "1"]) == 0
    old = Path("x.mcap").read_bytes()
    capsys.readouterr()

    def full(_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("hil.files.outputs.Output.finish", full)
    monkeypatch.setattr("hil.recording.process.can_start", lambda: False)  # in this process, where the disk is full
    assert run([*short, "--seed", "2"]) == 4
    said = capsys.readouterr()
    document = json.loads(said.out)
    assert document["log"] == "x.unfinished.mcap"
    assert "x.unfinished.mcap" in said.err
    assert "from x.unfinished.mcap" in Path(document["report"]).read_text("utf-8")
    assert Path("x.mcap").read_bytes() == old


def test_what_was_learnt_is_printed_when_a_run_is_cut_and_no_file_holds_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    if not Path("/dev/full").is_char_device():
        pytest.skip("this system has no /dev/full")
    cut_short(monkeypatch, 55)
    assert run([*COACH, "--no-log", "--checkpoint", "/dev/full"]) == 130
    said = capsys.readouterr()
    assert "no file holds what was learnt" in said.err
    assert "[[entries]]" in said.err
    assert "To go on" not in said.out


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

    monkeypatch.setattr("hil.jobs.progress.CoachingDisplay.trial", counting)


@pytest.mark.slow
def test_what_a_run_that_was_cut_had_learnt_stays_and_the_newest_is_gone_on_with(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("first", "second", "third"):
        with monkeypatch.context() as patched:
            cut_short(patched, 55)
            opponent = ["--opponent", "point-light"] if name == "second" else []
            assert run([*COACH, "--no-log", *opponent, "--out", f"runs/{name}"]) == 130
        assert f"hil coach --resume-from runs/{name}" in capsys.readouterr().out
        assert load_run(Path(f"runs/{name}")).record.state == "interrupted"
    before = {name: Path(f"runs/{name}/checkpoint.json").read_bytes() for name in ("first", "second", "third")}
    assert run([*COACH, "--no-log", "--resume", "--opponent", "point-light", "--out", "runs/fourth"]) == 0
    assert "Going on from runs/second/checkpoint.json" in capsys.readouterr().out
    assert run([*COACH, "--no-log", "--resume", "--out", "runs/fifth"]) == 0
    assert "Going on from runs/" in capsys.readouterr().out
    gone_on_from = load_run(Path("runs/fifth")).record.resumed_from
    assert gone_on_from in {"runs/first/checkpoint.json", "runs/third/checkpoint.json"}
    assert load_checkpoint(Path("runs/fifth/checkpoint.json")).pal.finished
    assert {name: Path(f"runs/{name}/checkpoint.json").read_bytes() for name in before} == before
    assert run([*COACH, "--no-log", "--resume", "--out", "runs/sixth"]) == 0
    assert load_run(Path("runs/sixth")).record.resumed_from not in {gone_on_from, "runs/second/checkpoint.json"}
    assert run([*COACH, "--no-log", "--resume"]) == 2, "all are finished, or were gone on with"


def test_a_link_that_cannot_be_opened_leaves_no_log(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["coach", "serial:///dev/no-such-port:115200"]) == 3
    assert "no-such-port" in capsys.readouterr().err
    assert files("runs/*") == []
