"""`hil swarm surround` in the same process: what it leaves, what it prints, how it goes on, and how its endings are told."""

from __future__ import annotations

import json
from contextlib import chdir, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from as_json import as_json
from report_logs import bout_log

from firmware_protocol.messages import BoutOutcome
from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.mcaplog.making.recovery import copy_log
from hil.replaying.host import replay
from hil.report import write_report
from hil.runs import load_run
from hil.swarm.handle import Swarm
from hil.swarm.missions.surround_checkpoint import load_checkpoint
from hil.swarm.missions.tables_file import load_tables

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hil.report import ReportFiles
    from hil.swarm.rounds import Round, SwarmMoves

pytestmark = pytest.mark.slow
SMALL = ("swarm", "surround", "--case", "B1D3R6W2", "--steps", "4", "--no-report")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    return tmp_path


def outcome(*arguments: str, status: int = 0) -> dict[str, Any]:
    """What a run says as JSON."""
    return as_json(*SMALL, *arguments, status=status)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What a run says that ran to its end; nobody changes what it has left."""
    with chdir(tmp_path_factory.mktemp("whole")):
        found = outcome()
        return {**found, **{name: str(Path(found[name]).absolute()) for name in ("run", "log", "table")}}


def measured(found: dict[str, Any]) -> dict[str, Any]:
    """What is the same for equal runs."""
    return {key: value for key, value in found.items() if key not in {"wall_seconds", "log", "table", "report", "run"}}


def test_a_run_leaves_tables_log_checkpoint_and_says_what_was_learnt(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*SMALL]) == 0
    said = capsys.readouterr().out
    assert "6 RANGERs are to surround 2 WILDs: case B1C1D3L1R6S1W2, 4 steps" in said
    assert "step   0: distance to the nearest WILD " in said
    (made,) = Path("runs").glob("*-surround-B1C1D3L1R6S1W2")
    assert load_tables(made / "tables.toml").case == "B1C1D3L1R6S1W2"
    assert len(load_checkpoint(made / "checkpoint.json").finished) == 1
    topics = {entry.topic for entry in LogReader(made / "log.mcap").entries()}
    assert {"/surround/state", "/swarm/round", "/swarm/observation", "/swarm/move", "/tf", "/arena/scene"} <= topics
    assert load_run(made).state == "done"
    for name in ("tables.toml", "log.mcap"):
        assert f"{made}/{name}" in said


def test_json_says_what_was_measured(whole: dict[str, Any]) -> None:
    found = whole
    assert found["case"] == "B1C1D3L1R6S1W2"
    assert (found["seed"], found["order"], found["steps"], found["unit"]) == (1, "group", 4, "book")
    assert found["robots"] == {"ranger": 6, "wild": 2}
    assert all(len(found[name]) == 5 for name in ("distance", "ranger_distance", "share_surrounded", "outside"))
    assert [sum(row) for row in found["behaviours"]] == [6] * 4
    assert sum(stimulus["met"] for stimulus in found["stimuli"]) == 24
    assert found["missing"] == []
    told = found["measures"]
    assert told["stimuli_met"]["ranger"] == sum(stimulus["met"] > 0 for stimulus in found["stimuli"])
    assert 0.0074 < told["weights"]["ranger"][0] < 0.125 < told["weights"]["ranger"][1] < 0.7311
    assert told["uniform"] == {"ranger": False, "wild": False}
    assert 0.0 < found["path"] < 4 * 0.4 * 1.2
    assert found["report"] is None
    assert Path(found["table"]).is_file()


def test_several_seeds_are_means_with_intervals_and_one_of_them_is_a_run_of_its_own() -> None:
    several = outcome("--seeds", "2")
    assert [one["seed"] for one in several["runs"]] == [1, 2]
    both = np.array([one["distance"] for one in several["runs"]])
    assert several["mean"]["distance"] == pytest.approx(both.mean(axis=0), abs=1e-5)
    assert len(several["ci95"]["share_surrounded"]) == 5
    assert [Path(one["table"]).name for one in several["runs"]] == ["tables-1.toml", "tables-2.toml"]
    alone = outcome("--seed", "2")
    assert measured(alone) == measured(several["runs"][1])


@pytest.mark.parametrize("order", ["group", "all", "sequential"])
def test_a_log_replays_entry_for_entry(order: str) -> None:
    found = outcome("--order", order, "--steps", "2")
    report = replay(found["log"], strict=True)
    assert report.same, str(report)
    assert report.compared > 100


@pytest.mark.parametrize("address", ["wire=can", "networks=3", "networks=2&wire=can"])
def test_the_same_is_decided_over_any_wire_and_number_of_networks(address: str, whole: dict[str, Any]) -> None:
    found = outcome(f"sim://swarm?rangers=6&wilds=2&seed=1&{address}")
    names = ("distance", "behaviours", "stimuli")
    assert {name: found[name] for name in names} == {name: whole[name] for name in names}
    assert replay(found["log"], strict=True).same


def test_what_was_learnt_elsewhere_is_gone_on_from(whole: dict[str, Any]) -> None:
    control = outcome("--no-learning", "--table-in", whole["table"])
    learnt = {one["number"]: one["weights"] for one in whole["stimuli"]}
    assert {one["number"]: one["weights"] for one in control["stimuli"] if one["number"] in learnt} == learnt
    assert replay(control["log"]).same


def test_a_run_cut_and_resumed_equals_the_run_not_cut(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    uncut = outcome("--seeds", "2")
    rounds = 0
    move = Swarm.move

    def cut(self: Swarm, moves: SwarmMoves, *, deadline: float | None = None) -> Round:
        nonlocal rounds
        rounds += 1
        if rounds == 14:
            raise KeyboardInterrupt
        return move(self, moves, deadline=deadline)

    with monkeypatch.context() as patch:
        patch.setattr(Swarm, "move", cut)
        assert run([*SMALL, "--seeds", "2"]) == 130
    said = capsys.readouterr().out
    assert "To go on: hil swarm surround --resume-from runs/" in said
    *_, newest = sorted(Path("runs").iterdir())
    saved = load_checkpoint(newest / "checkpoint.json")
    assert (len(saved.finished), saved.steps) == (1, 6)
    assert load_tables(newest / "tables-2.toml").rangers
    assert load_run(newest).state == "interrupted"
    assert run(["swarm", "surround", "--resume", "--no-report", "--json", "--quiet"]) == 0
    resumed = json.loads(capsys.readouterr().out)
    assert [measured(one) for one in resumed["runs"]] == [measured(one) for one in uncut["runs"]]
    assert Path(resumed["runs"][1]["table"]).read_bytes() == Path(uncut["runs"][1]["table"]).read_bytes()
    assert replay(resumed["log"], strict=True).same


def test_a_checkpoint_of_before_is_refused_by_words_that_say_what_to_do(
    whole: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    saved = json.loads(Path(whole["run"], "checkpoint.json").read_text())
    Path("old.json").write_text(json.dumps({**saved, "version": 1}))
    assert run(["swarm", "surround", "--resume-from", "old.json"]) == 2
    assert "old.json is a checkpoint of version 1" in capsys.readouterr().err


def test_nothing_else_is_asked_of_a_resumed_run(whole: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["swarm", "surround", "--resume-from", whole["run"], "--gain", "0.7"]) == 2
    assert "was begun with gain 0.5, not 0.7" in capsys.readouterr().err


def test_fewer_than_required_is_told_by_the_exit_status(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*SMALL, "--require", "1", "--steps", "1"]) == 1
    assert "Less than the required 1 of the WILDs were surrounded" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--case", "B4"], "B (how WILDs move) is 1 to 3, not 4"),
        (["--case", "R3R4"], "R (RANGERs) is there twice"),
        (["sim://swarm?rangers=6&wilds=1"], "asks for 6 RANGERs and 2 WILDs; there are 6 RANGERs and 1 WILD"),
        (["--feasible", "111"], "--feasible: '111' won't do"),
        (["--seeds", "2", "--table-out", "t.toml"], "each seed has its own"),
        (["--r0", "400"], "can't be sent"),
        (["--case", "D3W200"], "too many robots"),
        (["--resume"], "there is no run of hil swarm surround of an emulated table"),
    ],
)
def test_what_can_not_be_asked_for_is_said(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*SMALL, *arguments]) == 2
    assert said in capsys.readouterr().err


def test_a_wrong_field_of_the_tables_is_named_with_its_line(capsys: pytest.CaptureFixture[str]) -> None:
    Path("bad.toml").write_text('version = 1\nsectors = 8\n[[ranger]]\nstimulus = 2\npattern = "00000011"\n')
    assert run([*SMALL, "--table-in", "bad.toml"]) == 2
    assert "bad.toml, line 5: ranger[0].pattern: STIMULUS2 is 00000001" in capsys.readouterr().err


def test_a_case_without_letters_takes_who_is_there(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["swarm", "surround", "sim://swarm?rangers=3&wilds=1", "--steps", "0", "--no-report", "--json", "-q"]) == 0
    assert json.loads(capsys.readouterr().out)["case"] == "B1C1D3L1R3S1W1"


def test_the_report_shows_distances_and_says_who_was_missing(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["swarm", "surround", "--case", "B2R6W2", "--steps", "6", "--seeds", "2", "--json", "--quiet"]) == 0
    page = Path(json.loads(capsys.readouterr().out)["report"])
    assert {path.name for path in page.parent.glob("*.svg")} == {
        f"{name}.svg" for name in ("behaviours", "course", "distances", "link", "rules", "snapshots", "stimuli", "trajectories")
    }
    text = page.read_text()
    for said in (
        "RANGERs learnt to surround WILDs",
        "Nobody: every robot that was asked has answered.",
        "STIMULUS1",
        "RA1: B1",
    ):
        assert said in text
    again = page.parent.with_name("again")
    assert run(["report", str(page.parent.parent), "--out", str(again)]) == 0
    assert (again / "report.html").read_text() == text


def test_no_picture_comes_from_what_the_table_says_of_itself(whole: dict[str, Any]) -> None:
    """Without TABLE_STATE the same is drawn, and said, of the run; frames of the link are counted, whatever they hold."""
    log = Path(whole["log"])
    topics = {entry.topic for entry in LogReader(log).raw_entries()}
    assert "/mavlink/table_state" in topics
    copy_log(LogReader(log), Path("without.mcap"), topics=lambda topic: topic != "/mavlink/table_state")
    states = [entry.topic for entry in LogReader(log).raw_entries() if entry.topic == "/surround/state"]
    copy_log(LogReader(log), Path("states.mcap"), topics=lambda topic: topic == "/surround/state")
    assert len(states) == 5
    every, without, alone = (write_report(one, Path(one.stem)) for one in (log, Path("without.mcap"), Path("states.mcap")))

    def drawn(report: ReportFiles, *but: str) -> dict[str, bytes]:
        return {path.name: path.read_bytes() for path in report.pictures if path.stem not in but}

    pictures = drawn(every, "link", "course")
    assert len(pictures) == 7
    assert drawn(without, "link", "course") == drawn(alone) == pictures
    assert drawn(without, "link") == drawn(every, "link"), "robots say themselves what state they are in"
    assert every.summary[0] == without.summary[0] == alone.summary[0]


def test_steps_of_a_report_are_chosen(capsys: pytest.CaptureFixture[str]) -> None:
    made = outcome()["run"]
    assert run(["report", made, "--from", "1", "--to", "3", "--json"]) == 0
    page = Path(json.loads(capsys.readouterr().out)["page"])
    assert page.parent == Path(made, "report-1-3")
    assert "Their ways in the steps that were chosen" in page.read_text()
    assert run(["report", made, "--from", "5"]) == 2
    assert "has steps 0 to 4, and none of those that were chosen" in capsys.readouterr().err
    assert not Path(made, "report-5-end").exists()
    assert run(["report", made, "--from", "3", "--to", "1"]) == 2
    assert "--to 1 comes before --from 3" in capsys.readouterr().err


def test_steps_are_chosen_of_the_surround_task_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bout_log(tmp_path / "bout.mcap", [(BoutOutcome.WIN, 1.0)])
    assert run(["report", str(tmp_path / "bout.mcap"), "--to", "3"]) == 2
    assert "has no run of the surround task" in capsys.readouterr().err


def test_long_range_learns_nothing() -> None:
    found = outcome("--case", "B1D3R6W2S2", "--steps", "6")
    assert {weight for one in found["stimuli"] for weight in one["weights"]} == {0.125}
    assert found["measures"]["uniform"] == {"ranger": True, "wild": True}
    assert found["measures"]["dominance"] in {0.25, None}


class Pressed:
    """Keys that are pressed at the terminal, one after so many looks at it."""

    def __init__(self, keys: dict[int, str]) -> None:
        self.looks = 0
        self.keys = keys

    def __call__(self) -> str:
        self.looks += 1
        return self.keys.get(self.looks, "")

    @contextmanager
    def terminal(self) -> Iterator[Pressed]:
        yield self


def test_a_stop_key_stops_all_and_what_was_learnt_is_kept(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hil.cli.stage.pressed_keys", Pressed({400: " "}).terminal)
    assert run([*SMALL]) == 1
    said = capsys.readouterr()
    assert "emergency stop by key: 8 robots have said that they are stopped" in said.err
    assert "To go on: hil swarm surround --resume-from runs/" in said.out
    (made,) = Path("runs").iterdir()
    assert load_checkpoint(made / "checkpoint.json").steps > 0
    assert replay(made, strict=True).same


def test_robots_are_driven_to_their_places() -> None:
    found = outcome("--place", "drive", "--steps", "1")
    put = outcome("--steps", "1")
    assert found["distance"][0] == pytest.approx(put["distance"][0], abs=0.1)
    topics = [entry.topic for entry in LogReader(Path(found["log"])).entries()]
    assert "/mavlink/table_place" not in topics
    assert replay(found["log"], strict=True).same


def test_a_person_who_puts_robots_to_their_places_says_so_by_enter(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hil.cli.stage.pressed_keys", Pressed({300: "\r"}).terminal)
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    assert run([*SMALL, "--place", "ask", "--steps", "1"]) == 0
    said = capsys.readouterr().out
    assert "Put the robots there. Enter goes on." in said
    assert said.count("heading ") == 8
    (made,) = Path("runs").iterdir()
    assert replay(made, strict=True).same


def test_what_would_have_to_be_asked_ends_a_run_that_asks_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*SMALL, "--place", "ask", "--no-input"]) == 1
    assert "whether the robots stand there would have to be asked, and nobody can answer" in capsys.readouterr().err


def test_a_line_that_loses_frames_loses_no_robot() -> None:
    found = outcome("sim://swarm?rangers=6&wilds=2&seed=1&faults=drop:0.05")
    assert found["missing"] == []
    assert [sum(row) for row in found["behaviours"]] == [6] * 4
    assert replay(found["log"], strict=True).same


def test_a_seed_is_the_same_after_others_as_alone(capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing of a run is left on the table or in its robots: else a run of several seeds that was cut could not go on."""
    asked = ("swarm", "surround", "--case", "B1D3", "--no-report", "--no-log", "--json", "--quiet", "--steps", "6")
    assert run([*asked, "--seeds", "3"]) == 0
    row = json.loads(capsys.readouterr().out)["runs"]
    assert run([*asked, "--seed", "3"]) == 0
    alone = json.loads(capsys.readouterr().out)
    assert measured(row[2]) == measured(alone)
