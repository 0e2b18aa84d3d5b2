"""`hil coach --from` in the same process: what it leaves whoever wins, cut and gone on with, replayed, and refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import hil
from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.sumo.advice_file import load_advice, save_advice
from hil.sumo.challenging.standing import ChallengeStanding
from hil.sumo.coaching import load_checkpoint
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings

COACH = ("coach", "--runs", "1", "--budget", "12", "--held-out", "0", "--no-report")
AHEAD, TO_LEFT, TO_RIGHT, BACK = Action.FF, Action.LBRF, Action.LFRB, Action.FB


def made(name: str, *actions: Action, **changes: object) -> Path:
    """An advice file: of one action for none, left, right and both."""
    entries = tuple(AdviceEntry(ANY_STIMULUS, code, (action,) * 4, 1.0, 1) for code, action in enumerate(actions))
    save_advice(Advice(PalSettings.from_dict({**PalSettings().to_dict(), **changes}), entries, "flat-light", 1), Path(name))
    return Path(name)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_the_advice_stays_cut_or_not_and_what_was_learnt_is_beside_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    given = made("given.toml", TO_LEFT, TO_LEFT, TO_RIGHT, AHEAD)
    assert run([*COACH, "--from", str(given), "--json", "--out", "whole"]) == 0
    whole: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert whole["challenge"]["winner"] == "champion"
    assert whole["challenge"]["wins"]["champion"] > whole["challenge"]["wins"]["challenger"]
    assert Path("whole/advice.toml").read_bytes() == given.read_bytes()
    assert load_advice(Path(whole["learnt"])).seed == 1
    log = LogReader(Path("whole/log.mcap"))
    events = [entry for entry in log.entries({"/events"}) if entry.value.kind == "challenge"]
    assert len(events) == whole["challenge"]["bouts"] // 2 + 1, "one for each pair, and the end"
    assert log.attachments["begin/given.toml"].data == given.read_bytes()
    assert hil.replay("whole").same

    take, left = ChallengeStanding.take, 4

    def cut(self: ChallengeStanding, bout: Any) -> Any:  # noqa: ANN401 - as it is
        nonlocal left
        left -= 1
        if not left:
            raise KeyboardInterrupt
        return take(self, bout)

    with monkeypatch.context() as patched:
        patched.setattr(ChallengeStanding, "take", cut)
        assert run([*COACH, "--from", str(given), "--out", "cut", "--no-log"]) == 130
    assert "The best advice so far: cut/advice.toml" in capsys.readouterr().out
    assert Path("cut/advice.toml").read_bytes() == given.read_bytes()
    saved = load_checkpoint(Path("cut/checkpoint.json")).standing
    assert saved is not None
    assert saved.challenge.bouts == 3
    resume = ["coach", "--held-out", "0", "--no-log", "--json", "--resume-from", "cut"]
    assert run([*resume, "--from", str(given)]) == 2
    assert "leave one of the two out" in capsys.readouterr().err
    assert run([*resume, "--out", "again"]) == 0
    said = capsys.readouterr()
    assert "3 of them played already" in said.err
    assert json.loads(said.out)["challenge"] == whole["challenge"]
    for name in ("advice.toml", "learnt-advice.toml", "checkpoint.json"):
        assert Path("again", name).read_bytes() == Path("whole", name).read_bytes()
    assert run(["explain", "again"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "The given advice stays" in told
    assert "This advice is the one that the run began from" in told


def test_what_was_learnt_takes_the_place_of_one_that_never_wins(capsys: pytest.CaptureFixture[str]) -> None:
    given = made("given.toml", BACK, BACK, BACK, BACK)
    assert run([*COACH, "--budget", "200", "--from", str(given), "--out", "taken", "--no-log"]) == 0
    assert "What was learnt takes the place of the given advice." in capsys.readouterr().out
    assert load_advice(Path("taken/advice.toml")) != load_advice(given)
    assert not Path("taken/learnt-advice.toml").exists()


@pytest.mark.parametrize(
    ("changes", "arguments", "words"),
    [
        ({"pairs": True}, [], "coach with --pairs"),
        ({}, ["--pairs"], "leave --pairs out"),
        ({"arms_in_stimulus": True}, [], "with the arms"),
        ({}, ["tcp://127.0.0.1:9", "--reset", "auto", "--live"], "nobody does"),
        ({}, ["sim://junior?referee=0"], "--reset ask"),
        ({}, ["--from", "."], "there is no advice.toml in ."),
        ({}, ["--from", "x.json"], "x.json"),
    ],
)
def test_what_can_t_be_begun_from_is_said(
    changes: dict[str, object], arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    made("given.toml", AHEAD, **changes)
    Path("x.json").write_text('{"version": 9}')
    assert run([*COACH, "--from", "given.toml", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said
