"""The other sub-commands in the same process, and how a robot that is not there is told."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import tomllib
from functools import partial
from importlib import metadata
from pathlib import Path

import pytest
from mcap.writer import Writer

from firmware_protocol.parameters import JUNIOR_PARAMETERS
from hil.cli.app import Verbs, run
from hil.conformance import CHECKS
from hil.connecting.connecting import connect_as
from hil.mcaplog import LogReader
from simdevice.serving.endpoints import PtyEndpoint

GROUPS = {"emulate", "log", "swarm"}
VERBS = sorted({verb.name for verb in Verbs.VERBS} - GROUPS)
CHASE = ["bout", "--controller", "chase", "--trials", "5"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    return tmp_path


@pytest.fixture
def advice(folder: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """A small advice file."""
    path = folder / "small.advice.toml"
    assert (
        run(["coach", "--runs", "1", "--budget", "8", "--held-out", "0", "--no-log", "--quiet", "--advice-out", str(path)]) == 0
    )
    capsys.readouterr()
    return path


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_help_with_an_example(capsys: pytest.CaptureFixture[str], verb: str) -> None:
    assert run([verb, "--help"]) == 0
    said = capsys.readouterr().out
    assert f"hil {verb}" in said.partition("Example")[2]
    for option in ("--json", "--quiet", "--config"):
        assert option in said


def test_the_version_is_the_packages(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"hil {metadata.version('junior-hil')}\n"


def test_no_or_an_unknown_verb_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["dance"]) == 2
    assert "dance" in capsys.readouterr().err
    assert run([]) == 2


# --- bout ------------------------------------------------------------------------------------------------------------


def test_bouts_are_counted_in_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*CHASE, "--opponent", "curved-light"]) == 0
    said = capsys.readouterr().out
    assert "5 bouts against curved-light, controller: chase" in said
    assert "95 % interval" in said
    (log,) = Path("runs").glob("*-bout-curved-light/log.mcap")
    assert str(log) in said
    reader = LogReader(log)
    ended = [entry.value for entry in reader.entries({"/events"}) if entry.value.kind == "bout"]
    assert len(ended) == 5
    assert not reader.truncated


def test_bouts_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    documents = []
    for _ in range(2):
        assert run([*CHASE, "--json", "--no-log"]) == 0
        documents.append(json.loads(capsys.readouterr().out))
    first = documents[0]
    assert documents[0] == documents[1]
    keys = {"opponent", "trials", "wins", "losses", "draws", "win_rate", "win_rate_ci95", "median_time_to_win_s"}
    assert set(first) >= keys
    assert first["advice"] is None
    assert first["wins"] + first["losses"] + first["draws"] == first["trials"] == 5
    assert first["win_rate"] == first["wins"] / 5
    low, high = first["win_rate_ci95"]
    assert 0 <= low <= first["win_rate"] <= high <= 1


def test_bouts_say_by_which_advice(capsys: pytest.CaptureFixture[str], advice: Path) -> None:
    assert run(["bout", "--advice", str(advice), "--trials", "1", "--json", "--no-log"]) == 0
    assert json.loads(capsys.readouterr().out)["advice"] == str(advice)


def test_a_robot_that_never_won_has_no_time_to_win(capsys: pytest.CaptureFixture[str], advice: Path) -> None:
    text = advice.read_text()
    start, end = text.index("actions = ["), text.index("]", text.index("actions = ["))
    while start >= 0:
        text = text[:start] + 'actions = ["S"' + text[end:]
        start = text.find("actions = [", start + 1)
        end = text.find("]", start)
    advice.write_text(text)
    assert run(["bout", "--advice", str(advice), "--trials", "2", "--no-log", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["wins"], document["median_time_to_win_s"]) == (0, None)
    assert run(["bout", "--advice", str(advice), "--trials", "2", "--no-log", "--require", "0.5"]) == 1
    assert "required was 0.5" in capsys.readouterr().out


def test_the_advice_names_its_opponent(capsys: pytest.CaptureFixture[str], advice: Path) -> None:
    assert run(["bout", "--advice", str(advice), "--trials", "1", "--no-log", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["opponent"] == "flat-light"
    other = ["--opponent", "point-light", "--trials", "1", "--no-log", "--json"]
    assert run(["bout", "--advice", str(advice), *other]) == 0
    assert json.loads(capsys.readouterr().out)["opponent"] == "point-light"


@pytest.mark.parametrize(
    ("line", "replacement", "named"),
    [
        ("current = ", 'current = "sideways"', "entries[0].current"),
        ("evaluations = ", 'evaluations = "many"', "entries[0].evaluations"),
        ("fitness = ", "fitnes = 3.0", "entries[0].fitness"),
        ("budget = ", "budget = -3", "settings.budget"),
        ("version = ", "version = 99", "version"),
    ],
)
def test_a_wrong_advice_field_is_named_with_its_file_and_line(
    capsys: pytest.CaptureFixture[str], advice: Path, line: str, replacement: str, named: str
) -> None:
    lines = advice.read_text().splitlines()
    number = next(index for index, text in enumerate(lines) if text.startswith(line))
    lines[number] = replacement
    advice.write_text("\n".join(lines))
    assert run(["bout", "--advice", str(advice), "--no-log"]) == 2
    said = capsys.readouterr().err
    assert str(advice) in said
    assert named in said
    if not replacement.startswith("fitnes"):  # a field that is missing has no line of its own: that of its table is named
        assert f"line {number + 1}:" in said
    assert "Traceback" not in said


@pytest.mark.parametrize("content", [b"\x00\xff\xfe" * 100, b"", b"a = [", b"[" * 100_000, b"{}", b'"text"'])
@pytest.mark.parametrize("suffix", ["toml", "json"])
def test_junk_is_no_advice(capsys: pytest.CaptureFixture[str], folder: Path, suffix: str, content: bytes) -> None:
    path = folder / f"junk.{suffix}"
    path.write_bytes(content)
    assert run(["bout", "--advice", str(path), "--no-log"]) == 2
    said = capsys.readouterr().err
    assert f"junk.{suffix}" in said
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ([], "there is no run of hil coach with advice.toml"),
        (["--advice", "."], "there is no advice.toml in ."),
        (["--controller", "cheat"], "cheat"),
        (["--controller", "chase", "--trials", "0"], "--trials"),
        (["--controller", "chase", "sim://junior?referee=0"], "needs a referee"),
    ],
)
def test_wrong_usage_of_bout(capsys: pytest.CaptureFixture[str], arguments: list[str], named: str) -> None:
    assert run(["bout", "--no-log", *arguments]) == 2
    assert named in capsys.readouterr().err


def test_a_file_that_cannot_be_read_has_a_status_of_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (["bout", "--no-log", "--advice"], ["param", "sim://junior", "--load"], ["deploy", "none.toml"]):
        extra = "none.toml" if arguments[0] != "deploy" else "sim://junior"
        assert run([*arguments, extra]) == 4
        assert "none.toml" in capsys.readouterr().err


# --- param -----------------------------------------------------------------------------------------------------------


def test_all_parameters_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["param", "sim://junior"]) == 0
    said = capsys.readouterr().out
    for parameter in JUNIOR_PARAMETERS:
        assert parameter.name in said
    assert run(["param", "sim://junior", "--json"]) == 0
    assert list(json.loads(capsys.readouterr().out)) == [parameter.name for parameter in JUNIOR_PARAMETERS]


def test_a_parameter_is_read_set_saved_and_loaded(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    assert run(["param", "sim://junior", "SPD_SLOW"]) == 0
    assert capsys.readouterr().out == "0.4\n"
    assert run(["param", "sim://junior", "SPD_SLOW", "0.3"]) == 0
    assert capsys.readouterr().out == "0.3\n"
    assert run(["param", "sim://junior", "--save", "robot.toml", "--quiet"]) == 0
    saved = tomllib.loads((folder / "robot.toml").read_text())
    assert set(saved) == {parameter.name for parameter in JUNIOR_PARAMETERS}
    assert {"SPD_SLOW = 0.4", "SPD_MODERATE = 0.7", "EYE_L_ON = 250"} <= set((folder / "robot.toml").read_text().splitlines())
    (folder / "mine.toml").write_text("SPD_SLOW = 0.25\nMEM_SLOTS = 32\n")
    assert run(["param", "sim://junior", "--load", "mine.toml", "--json"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["SPD_SLOW"] == 0.25
    assert "changed: SPD_SLOW 0.4 -> 0.25" in captured.err
    assert run(["param", "sim://junior", "--load", "robot.toml", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_the_id_of_another_robot_is_loaded_only_when_asked_for(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    (folder / "other.toml").write_text("SYS_ID = 9\nSPD_SLOW = 0.3\n")
    assert run(["param", "sim://junior", "--load", "other.toml", "--json"]) == 0
    captured = capsys.readouterr()
    assert (json.loads(captured.out)["SYS_ID"], json.loads(captured.out)["SPD_SLOW"]) == (1, 0.3)
    assert "left out: SYS_ID" in captured.err
    assert run(["param", "sim://junior", "--load", "other.toml", "--all", "--json"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["SYS_ID"] == 9
    assert "changed: SYS_ID 1 -> 9" in captured.err


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["NOPE"], "no such entry"),
        (["SPD_FAST", "9"], "keeps 1"),
        (["MEM_SLOTS", "9"], "keeps 32"),
        (["SPD_FAST", "fast"], "VALUE"),
        (["SPD_FAST", "--save", "x.toml"], "not both"),
        (["--load", "bad.toml"], "bad.toml, line 1: SPD_FAST must be a number"),
        (["--load", "range.toml"], "range.toml, line 2: SPD_FAST must be 0 to 1, not 9"),
        (["--load", "unknown.toml"], "unknown.toml, line 1: the robot has no parameter SPD_FASTER. Did you mean SPD_FAST?"),
        (["--all"], "--load"),
        (["--save", "/dev/null/x.toml"], "/dev/null/x.toml"),
    ],
)
def test_wrong_usage_of_param(capsys: pytest.CaptureFixture[str], folder: Path, arguments: list[str], named: str) -> None:
    (folder / "bad.toml").write_text("SPD_FAST = true\n")
    (folder / "range.toml").write_text("SPD_SLOW = 0.3\nSPD_FAST = 9\n")
    (folder / "unknown.toml").write_text("SPD_FASTER = 0.9\n")
    assert run(["param", "sim://junior", *arguments]) == 2
    said = capsys.readouterr().err
    assert named in said
    assert "Traceback" not in said


# --- monitor, report -------------------------------------------------------------------------------------------------


def test_a_robot_is_watched_for_a_while(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["monitor", "--duration", "2.5", "--log", "watch.mcap"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3
    assert all("disarmed" in line and "battery 7." in line for line in lines)
    assert run(["monitor", "--duration", "0.5", "--no-log", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["system"], document["armed"], document["state"]) == (1, False, "disarmed")
    assert document["link"]["lost"] == 0
    assert list(LogReader(Path("watch.mcap")).entries({"/junior/wheels", "/junior/maneuver"})) == []


def test_a_log_is_reported_on(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*CHASE, "--log", "play.mcap", "--quiet"]) == 0
    capsys.readouterr()
    assert run(["report", "play.mcap", "--json", "--out", "pages"]) == 0
    document = json.loads(capsys.readouterr().out)
    page = Path(document["page"])
    assert page.parent == Path("pages")
    assert "<html" in page.read_text(encoding="utf-8")
    assert document["pictures"]
    for picture in document["pictures"]:
        assert Path(picture).read_text(encoding="utf-8").startswith("<svg ")
    assert run(["report", "play.mcap", "--json", "--out", "pages", "--overwrite", "--png"]) == 0
    pictures = json.loads(capsys.readouterr().out)["pictures"]
    assert {Path(picture).suffix for picture in pictures} == {".svg", ".png"}


@pytest.mark.parametrize("there", [True, False])
def test_a_report_is_opened_where_there_is_a_desktop(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, *, there: bool
) -> None:
    shown: list[str] = []

    def show(url: str) -> bool:
        shown.append(url)
        return True

    monkeypatch.setattr("hil.cli.browsing.has_a_screen", lambda: there)
    monkeypatch.setattr("webbrowser.open", show)
    assert run([*CHASE, "--quiet"]) == 0
    capsys.readouterr()
    assert run(["report", "--open"]) == 0
    (page,) = Path("runs").resolve().glob("*/report/report.html")
    assert shown == ([page.as_uri()] if there else [])
    assert ("there is no desktop here" in capsys.readouterr().err) is not there
    assert run(["report", "--open"]) == 0, "it is there already, and shown again"
    assert len(shown) == 2 * there


def test_somebody_else_s_log_is_told_of_and_not_reported_on(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    with (folder / "foreign.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/imu", "json", 0)
        writer.add_message(channel, log_time=0, publish_time=0, data=b"{}")
        writer.finish()  # type: ignore[no-untyped-call]
    assert run(["report", "foreign.mcap"]) == 4
    assert "It holds /imu (1 entry)" in capsys.readouterr().err.replace("\n", " ")
    assert not (folder / "foreign-report").exists()


@pytest.mark.parametrize("content", [None, b"", b"no log at all", b"\x89MCAP0\r\n\xff\xff"])
def test_what_is_no_log_is_not_reported_on(capsys: pytest.CaptureFixture[str], folder: Path, content: bytes | None) -> None:
    if content is not None:
        (folder / "x.mcap").write_bytes(content)
    status = run(["report", "x.mcap"])
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    if content is None or content == b"no log at all":
        assert status == 2
        assert "x.mcap" in said.err


# --- terminals that know few letters -------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="paths of bytes are a matter of POSIX")
def test_a_path_that_is_no_text_is_written_to_and_told_as_well_as_can_be(folder: Path) -> None:
    name = os.fsdecode("pl\u00e4y\u00ff".encode() + b"\xff.mcap")
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    program = "from hil.cli import main; main()"
    done = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, "-c", program, *CHASE, "--log", name], cwd=folder, env=environment, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert b"Log: pl\\xe4y" in done.stdout
    reader = LogReader(folder / name)
    assert sum(1 for _ in reader.entries({"/events"})) > 5
    assert "\u00e4" in reader.metadata["run"]["log"]


# --- no robot --------------------------------------------------------------------------------------------------------


def unused_port() -> str:
    """A TCP port that nobody listens at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp://127.0.0.1:{probe.getsockname()[1]}"


def test_a_port_nobody_listens_at(capsys: pytest.CaptureFixture[str]) -> None:
    url = unused_port()
    for verb in (["coach"], ["monitor"], ["param"], ["bout", "--controller", "chase"]):
        assert run([*verb, url, *([] if verb == ["param"] else ["--no-log"])]) == 3
        assert f"hil: {url}: nothing listens" in capsys.readouterr().err


def test_a_port_that_is_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["coach", "serial:///dev/ttyNobody:115200", "--no-log"]) == 3
    said = capsys.readouterr().err
    assert "there is no port /dev/ttyNobody" in said
    assert "hil ports" in said or "Present are" in said or "plugged in" in said


def test_a_port_at_which_nobody_answers(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil.jobs.session.connect_as", partial(connect_as, timeout=0.3))
    endpoint = PtyEndpoint()
    try:
        assert run(["coach", endpoint.url, "--no-log"]) == 3
    finally:
        endpoint.close()
    said = capsys.readouterr().err
    assert f"{endpoint.url}: no robot answered within 0.3 s" in said
    assert "switched on" in said


# --- width -----------------------------------------------------------------------------------------------------------


def test_what_is_piped_has_a_check_a_line_and_its_name_whole(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS")
    assert run(["check", "--list"]) == 0
    head, *lines = capsys.readouterr().out.splitlines()
    assert head.split()[0] == "check"
    assert [line.split()[0] for line in lines] == [check.name for check in CHECKS]
    assert all(check.demands in line for check, line in zip(CHECKS, lines, strict=True))


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_on_a_narrow_terminal_each_check_has_lines_of_its_own(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, columns: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    assert run(["check", "--list"]) == 0
    said = capsys.readouterr().out
    assert max(map(len, said.splitlines())) <= columns
    words = " ".join(said.split())
    assert all(f"{check.name} (" in words and check.demands in words for check in CHECKS)


def test_no_number_of_a_log_s_table_is_cut(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert run([*CHASE, "--log", "chase.mcap"]) == 0
    capsys.readouterr()
    monkeypatch.setenv("COLUMNS", "60")
    assert run(["log", "info", "chase.mcap"]) == 0
    said = capsys.readouterr().out
    assert "\u2026" not in said
    assert "entries" in said
