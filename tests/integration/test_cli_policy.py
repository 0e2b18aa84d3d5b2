"""A policy file plays bouts by `hil bout --controller FILE`, over the wire, and its log replays."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hil
from firmware_protocol.errors import RefusedError
from hil.cli.app import run
from hil.policies import NAMES, Policy, PolicyDriver, save_policy
from hil.sumo.bouts import play
from hil.sumo.ring import OpenRing, RingError, open_ring
from hil.sumo.tournament.entrants import Entrant, EntrantKind
from pal_advisor.fields import FieldError, Fields


def chasing() -> Policy:
    """By hand: it turns to the side that sees, and on the spot where none does."""
    hidden = 2
    into, out = np.zeros((hidden, len(NAMES) + hidden + 1)), np.zeros((2, hidden + 1))
    for side in range(2):
        into[side, NAMES.index("flags.eye_left") + side] = 4.0
        into[side, -1] = -2.0
    out[0] = [-0.6, 1.0, 0.3]
    out[1] = [1.0, -0.6, 0.8]
    return Policy(np.concatenate([into.ravel(), out.ravel()]), hidden, "curved-light", "by hand")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    save_policy(chasing(), tmp_path / "chasing.json")
    return tmp_path


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert run(["bout", "--controller", "chasing.json", "--trials", "6", "--json", "--quiet", *arguments]) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    return document


@pytest.mark.slow
def test_it_meets_whom_it_was_trained_against_and_wins(capsys: pytest.CaptureFixture[str]) -> None:
    document = told(capsys, "--no-log")
    assert (document["controller"], document["policy"], document["opponent"]) == ("policy", "chasing.json", "curved-light")
    assert document["wins"] >= 4
    assert told(capsys, "--no-log", "--opponent", "flat-heavy")["opponent"] == "flat-heavy"


@pytest.mark.slow
def test_its_log_holds_the_policy_and_replays(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told(capsys, "--out", "run")
    (folder / "chasing.json").unlink()
    assert run(["replay", "run/log.mcap"]) == 0
    assert "the same" in capsys.readouterr().out


def test_a_bad_line_and_a_robot_that_loses_its_power_end_no_series(capsys: pytest.CaptureFixture[str]) -> None:
    faults = "drop:0.05,delay:0.01,brownout:3+0.4"
    document = told(capsys, "--no-log", f"sim://junior?opponent=curved-light&faults={faults}")
    assert document["wins"] + document["losses"] + document["draws"] == 6


@pytest.mark.parametrize(
    ("controller", "code", "said"),
    [
        ("chese", 2, "'chese' is none: choose one of advice, chase, .* or a policy file"),
        ("nothing.json", 4, "cannot read the policy file nothing.json"),
    ],
)
def test_what_is_no_controller_is_refused(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, controller: str, code: int, said: str
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert run(["bout", "--controller", controller]) == code
    assert re.search(said, capsys.readouterr().err)


def test_a_robot_that_is_stopped_is_refused() -> None:
    with hil.connect("sim://junior?opponent=flat-heavy") as junior:
        ring = open_ring(junior)
        with pytest.raises(RefusedError):
            list(play(ring, PolicyDriver(chasing()), [1]))


def test_without_a_referee_it_does_not_play() -> None:
    with hil.connect("sim://junior?referee=0") as junior:
        junior.arm()
        with pytest.raises(RingError, match="until somebody says"):
            list(play(OpenRing(junior), PolicyDriver(chasing()), [1]))


@pytest.mark.slow
def test_it_enters_a_tournament_whose_logs_replay(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    field = ["chasing.json", "hobby"]
    assert run(["tournament", *field, "--bouts", "12", "--quiet", "--json", "--out", "cup"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [(one["name"], one["kind"]) for one in document["table"]] == [("chasing", "policy"), ("hobby", "hobby")]
    (log,) = (folder / "cup").glob("upset-*.mcap")
    assert run(["replay", str(log)]) == 0
    assert "the same" in capsys.readouterr().out


def test_an_entrant_by_a_policy_is_kept_whole() -> None:
    entrant = Entrant("chasing", EntrantKind.POLICY, policy=chasing())
    again = Entrant.from_fields(Fields(json.loads(json.dumps(entrant.to_dict()))))
    assert again.to_dict() == entrant.to_dict()
    with pytest.raises(ValueError, match="takes a policy, and there is nothing"):
        Entrant("nobody", EntrantKind.POLICY)
    broken = {**entrant.to_dict(), "policy": {"format": "junior-policy", "version": 9}}
    with pytest.raises(FieldError, match=r"policy\.version: expected 1, not 9"):
        Entrant.from_fields(Fields(broken))
