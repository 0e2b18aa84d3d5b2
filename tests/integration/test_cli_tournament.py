"""`hil tournament` from beginning to end."""

from __future__ import annotations

import contextlib
import json
import os
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from as_json import as_json
from known_players import CHARGE, DRIVEN
from processes import Hil

import hil.cli.tournament
from hil.cli import tournament
from hil.cli.app import run
from hil.files.outputs import replace_file
from hil.look.reading import read_scene
from hil.mcaplog.checking import check_log
from hil.policies import save_policy
from hil.replaying.host import replay
from hil.sumo.advice_file import save_advice
from hil.sumo.tournament.checkpoint import load_checkpoint

if TYPE_CHECKING:
    from collections.abc import Callable

FIELD = ["tournament", "chase", "hobby", "random", "--bouts", "4", "--seed", "3"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """A tournament that one worker has played to its end: its folder, which nobody changes, and the result."""
    folder = tmp_path_factory.mktemp("whole")
    with contextlib.chdir(folder):
        return folder / "one", as_json(*FIELD, "--workers", "1", "--out", "one")


def without_places(document: dict[str, Any]) -> dict[str, Any]:
    kept = {key: value for key, value in document.items() if key not in {"run", "picture", "checkpoint", "upsets"}}
    return {**kept, "upsets": [{key: value for key, value in upset.items() if key != "log"} for upset in document["upsets"]]}


@pytest.mark.slow
def test_the_result_is_the_same_for_any_number_of_workers(whole: tuple[Path, dict[str, Any]]) -> None:
    folder, one = whole
    two = as_json(*FIELD, "--workers", "2", "--out", "two")
    assert without_places(one) == without_places(two)
    assert one["bouts"] == 12
    assert (folder / "checkpoint.json").read_bytes() == Path("two/checkpoint.json").read_bytes()
    assert (folder / "tournament.svg").read_text().startswith("<svg")
    record = json.loads((folder / "run.json").read_text())
    assert record["state"] == "done"
    assert record["result"]["summary"].endswith("is the strongest of 3")


@pytest.mark.slow
def test_an_upset_is_recorded_as_it_was_played_and_can_be_replayed_and_looked_at(capsys: pytest.CaptureFixture[str]) -> None:
    document = as_json("tournament", "chase", "chase2", "hobby", "--bouts", "20", "--workers", "2", "--upsets", "2")
    assert len(document["upsets"]) == 2
    for upset in document["upsets"]:
        log = Path(upset["log"])
        report = replay(log, strict=True)
        assert report.same
        assert check_log(log).passed
        scene = read_scene(log)
        assert [track.key for track in scene.tracks] == ["opponent", "junior"]
        (chapter,) = scene.chapters
        assert chapter.outcome == ("won" if upset["winner_seat"] == "home" else "lost")
        assert chapter.against == "junior"
        assert upset["winner"] in chapter.series
    assert run(["view", document["run"]]) == 2
    assert f"name one of them, as {document['upsets'][0]['log']}" in capsys.readouterr().err


def cut(after: int) -> Callable[[Path, bytes], None]:
    """Writes so many checkpoints, then the operator presses Ctrl-C."""
    written = 0

    def replace(path: Path, data: bytes) -> None:
        nonlocal written
        replace_file(path, data)
        written += path.name == "checkpoint.json"
        if written == after:
            raise KeyboardInterrupt

    return replace


@pytest.mark.slow
def test_one_that_was_cut_goes_on_and_comes_to_the_same(
    whole: tuple[Path, dict[str, Any]], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(hil.cli.run_files, "replace_file", cut(3))
        assert run([*FIELD, "--workers", "2", "--out", "runs/cut"]) == 130
    told = capsys.readouterr().out
    assert "The 8 bouts that were played are in runs/cut/checkpoint.json" in told
    assert "hil tournament --resume-from runs/cut" in told
    assert len(load_checkpoint(Path("runs/cut/checkpoint.json")).bouts) == 8
    again = as_json("tournament", "--resume", "--workers", "1")
    assert without_places(again) == without_places(whole[1])
    assert run(["tournament", "--resume"]) == 2
    assert "that did not finish" in capsys.readouterr().err


@pytest.mark.slow
def test_learnt_advice_enters_by_a_host_and_from_memory() -> None:
    save_advice(CHARGE, Path("charge.advice.toml"))
    save_policy(DRIVEN, Path("driver.json"))
    field = ["charge.advice.toml", "memory:charge.advice.toml", "random", "driver.json"]
    document = as_json("tournament", *field, "--bouts", "4", "--workers", "2", "--upsets", "30")
    kinds = {row["name"]: row["kind"] for row in document["table"]}
    assert kinds == {"charge": "advice", "charge+memory": "memory", "random": "random", "driver": "policy"}
    assert all(row["won"] + row["drawn"] + row["lost"] == 12 for row in document["table"])
    for upset in document["upsets"]:
        assert replay(Path(upset["log"]), strict=True).same


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["chase"], "2 to 64 entrants, not 1"),
        ([], "2 to 64 entrants, not 0"),
        (["chase", "chase"], "two entrants are called chase"),
        (["chase", "hobby", "--bouts", "5"], "even number of bouts"),
        (["chase", "hobbi"], "there is no entrant 'hobbi'"),
        (["chase", "hobbi"], "Did you mean hobby?"),
        (["chase", "--resume"], "did not finish"),
    ],
)
def test_a_mistake_is_said_in_words(arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["tournament", *arguments]) == 2
    assert told in capsys.readouterr().err
    assert not Path("runs").exists()


@pytest.mark.slow
def test_what_a_resumed_one_was_begun_with_can_not_be_changed(
    whole: tuple[Path, dict[str, Any]], capsys: pytest.CaptureFixture[str]
) -> None:
    first = str(whole[0])
    assert run(["tournament", "--resume-from", first, "chase", "random"]) == 2
    assert "leave them out" in capsys.readouterr().err
    assert run(["tournament", "--resume-from", first, "--bouts", "6"]) == 2
    assert "begun with bouts 4, not 6" in capsys.readouterr().err


def test_an_interrupt_between_bouts_and_their_checkpoint_loses_none(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    save, interrupts = tournament._Playing._save, [KeyboardInterrupt]

    def interrupted(playing: tournament._Playing) -> None:
        if playing.bouts and interrupts:
            raise interrupts.pop()
        save(playing)

    monkeypatch.setattr(tournament._Playing, "_save", interrupted)
    assert run(["tournament", "chase", "random", "--bouts", "20", "--workers", "1", "--out", "cut"]) == 130
    kept = len(load_checkpoint(folder / "cut" / "checkpoint.json").bouts)
    assert kept
    assert f"The {kept} bouts that were played are in cut/checkpoint.json" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_stops_all_processes_and_says_how_to_go_on(folder: Path) -> None:
    asked = ("chase", "chase2", "hobby", "random", "--bouts", "200", "--workers", "2", "--out", "cut")
    with Hil(folder, "tournament", *asked) as program:
        program.until("/1200 bouts")
        program.send(signal.SIGINT)
        assert program.end() == 130  # and no worker holds its output
    saved = load_checkpoint(folder / "cut" / "checkpoint.json")
    assert 120 <= len(saved.bouts) < 1200
    assert f"The {len(saved.bouts)} bouts that were played are in cut/checkpoint.json" in program.text
    assert json.loads((folder / "cut" / "run.json").read_text())["state"] == "interrupted"
