"""Why an advice is as it is: what is told agrees with the log, with the learner's model, and with the mirror."""

from __future__ import annotations

import json
import shutil
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from report_logs import coaching_log, open_recorder

from firmware_protocol.vocabulary import ANY_STIMULUS, Action, ActionTally
from hil import runs
from hil.cli.app import run
from hil.explaining import Explanation, Learning, explain, learning_of
from hil.explaining.team import TeamHistory
from hil.explaining.words import reasons
from hil.look.reading import read_scene
from hil.mcaplog.reading.reader import LogEntry, LogReader
from hil.mcaplog.records import CoachedRunRecord
from hil.sumo.advice_file import advice_of, load_advice, save_advice
from hil.sumo.team import CoachedRun
from pal_advisor.maneuvers import Origin, Pal, PalSettings, Performance, TeamScore, TeamVerdict
from pal_advisor.maneuvers.mirror import reflected

if TYPE_CHECKING:
    from pathlib import Path

BUDGET = 120
RECORD = {
    "verb": "coach", "what": "flat-light", "started": "2026-01-02T03:04:05+00:00", "version": 1, "state": "done",
}  # fmt: skip
TALLY = ActionTally(30, (30, 0), (0, 0), (0.0, 0.0), 0.0)


@pytest.fixture(scope="module")
def coached(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a coaching against a made-up opponent."""
    folder = tmp_path_factory.mktemp("coached") / "run"
    folder.mkdir()
    log = folder / runs.LOG
    coaching_log(log, budget=BUDGET)
    reader = LogReader(log)
    assert list(reader.raw_entries())
    for name in (runs.ADVICE, runs.CHECKPOINT):
        (folder / name).write_bytes(reader.attachments[f"end/{name}"].data)
    (folder / runs.RECORD).write_text(json.dumps(RECORD))
    return folder


@pytest.fixture
def folder(coached: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return shutil.copytree(coached, tmp_path / "run")


def copied(source: Path, target: Path) -> Path:
    shutil.copy(source, target)
    return target


def explained(learning: Learning) -> dict[int, Explanation]:
    found = explain(learning.advice.entries, learning.pal, learning.history)
    return {one.entry.current: one for one in found}


def test_what_is_told_agrees_with_the_log(coached: Path) -> None:
    learning = learning_of(coached)
    assert not learning.unknown
    decisions = [entry.value for entry in LogReader(coached / runs.LOG).entries({"/pal/decision"})]
    for one in explained(learning).values():
        assert one.chosen is not None
        assert one.rivals
        for candidacy in (one.chosen, *one.rivals):
            told = candidacy.history
            if not candidacy.performed:
                assert told is None
                continue
            assert told is not None
            assert told.count == candidacy.performed
            if candidacy.rated == candidacy.performed:
                assert candidacy.mean == pytest.approx(np.mean(told.fitness))
        actions = {
            " ".join(action.name for action in one.entry.actions),
            " ".join(Action(code).name for code in reflected(tuple(map(int, one.entry.actions)))),
        }
        currents = {0: {"none"}, 1: {"left", "right"}, 2: {"left", "right"}, 3: {"both"}}[one.entry.current]
        asked = [each for each in decisions if each.current in currents and each.actions in actions]
        first = next(each for each in asked if each.tried == 0)
        told = one.chosen.history
        assert told is not None
        assert (told.expected, told.error) == (first.expected, first.error)
        assert one.chosen.origin == first.origin


def test_what_is_expected_is_the_mean_and_what_is_foretold_by_their_errors(coached: Path) -> None:
    for one in explained(learning_of(coached)).values():
        chosen = one.chosen
        assert chosen is not None
        assert chosen.mean is not None
        assert chosen.mean_error is not None
        assert chosen.foretold is not None
        assert chosen.foretold_error is not None
        untold, spread = chosen.foretold_error**2, chosen.mean_error**2
        assert chosen.value == pytest.approx((untold * chosen.mean + spread * chosen.foretold) / (untold + spread))
        assert chosen.error == pytest.approx((untold * spread / (untold + spread)) ** 0.5)
        assert chosen.value == one.entry.fitness
        assert chosen.performed == one.entry.evaluations
        scores = [each.value - one.caution * each.error for each in (chosen, *one.rivals)]
        assert scores == sorted(scores, reverse=True)
        assert one.ahead == 0


def test_the_right_is_the_mirror_image_of_the_left(coached: Path) -> None:
    found = explained(learning_of(coached))
    left, right = found[1], found[2]
    assert (left.mirrored, left.shared, right.mirrored, right.shared) == (False, True, True, True)
    assert (found[0].folded, found[3].folded) == (True, True)
    assert left.chosen is not None
    assert right.chosen is not None
    image = tuple(Action(code) for code in reflected(tuple(map(int, left.chosen.actions))))
    assert right.chosen.actions == image
    assert right.chosen.history == left.chosen.history
    assert [rival.value for rival in right.rivals] == [rival.value for rival in left.rivals]


def test_all_the_performances_of_a_log_are_counted(coached: Path) -> None:
    history = learning_of(coached).history
    assert history is not None
    assert history.count == BUDGET


def test_a_log_alone_tells_the_same(coached: Path, tmp_path: Path) -> None:
    alone = copied(coached / runs.LOG, tmp_path / "some.mcap")
    learning = learning_of(alone)
    assert not learning.unknown
    assert explained(learning) == explained(learning_of(coached))


def test_a_file_alone_says_what_it_can(coached: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    alone = copied(coached / runs.ADVICE, tmp_path / "some.toml")
    learning = learning_of(alone)
    (unknown,) = learning.unknown
    assert "name the run's folder" in unknown
    both = explained(learning)[3]
    assert not both.known
    assert f"performed {both.entry.evaluations} times" in reasons(both)[0]


def test_an_advice_that_was_left_elsewhere_is_found_by_its_run(
    coached: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = shutil.copytree(coached, tmp_path / "runs" / "one")
    record = json.loads((folder / runs.RECORD).read_text())
    record["settings"] = {"advice_out": "mine.toml"}
    (folder / runs.RECORD).write_text(json.dumps(record))
    alone = (folder / runs.ADVICE).rename(tmp_path / "mine.toml")
    assert learning_of(alone).run == folder.relative_to(tmp_path)


def test_without_a_log_the_checkpoint_tells(folder: Path) -> None:
    (folder / runs.LOG).unlink()
    learning = learning_of(folder)
    (unknown,) = learning.unknown
    assert "There is no log" in unknown
    both = explained(learning)[3]
    assert both.chosen is not None
    assert both.chosen.history is None
    assert both.chosen.foretold is not None


@pytest.mark.parametrize("damage", ["gone", "broken"])
def test_without_a_checkpoint_the_log_has_it(folder: Path, damage: str) -> None:
    saved = folder / runs.CHECKPOINT
    saved.unlink() if damage == "gone" else saved.write_text("{")
    learning = learning_of(folder)
    assert [text for text in learning.unknown if "can't be read" in text] == learning.unknown
    assert len(learning.unknown) == (damage == "broken")
    assert explained(learning)[3].known


def test_a_log_that_is_none_is_told_of(folder: Path) -> None:
    (folder / runs.LOG).write_bytes(b"no log at all")
    assert any("The log can't be read" in text for text in learning_of(folder).unknown)


def test_a_run_that_was_cut_is_explained_up_to_there(folder: Path) -> None:
    (folder / runs.ADVICE).unlink()
    learning = learning_of(folder)
    assert "--resume-from" in learning.unknown[0]
    assert explained(learning)[3].known


def test_an_advice_of_another_run_is_not_explained_by_this_one(folder: Path) -> None:
    advice = load_advice(folder / runs.ADVICE)
    save_advice(replace(advice, seed=7), folder / runs.ADVICE, overwrite=True)
    learning = learning_of(folder)
    assert any("was not made by the run" in text for text in learning.unknown)
    assert learning.pal is None


def test_a_log_that_breaks_off_says_how_much_it_has(folder: Path) -> None:
    log = folder / runs.LOG
    log.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    learning = learning_of(folder)
    assert learning.history is not None
    assert 0 < learning.history.count < BUDGET
    (unknown,) = learning.unknown
    assert f"The log has {learning.history.count} of the {BUDGET} maneuvers" in unknown
    assert explained(learning)[3].known


def test_an_edited_maneuver_is_known_for_what_it_is(coached: Path) -> None:
    learning = learning_of(coached)
    both = explained(learning)[3]
    worse = replace(both.entry, actions=both.rivals[1].actions)
    (one,) = explain([worse], learning.pal, learning.history)
    assert one.ahead == 2
    assert one.rivals[0] == both.chosen
    assert "2 other maneuvers for better" in " ".join(reasons(one))
    never = replace(both.entry, actions=(Action.SB, Action.S, Action.SB, Action.S))
    (one,) = explain([never], learning.pal, learning.history)
    assert one.chosen is None
    assert "never tried" in reasons(one)[0]


def test_of_a_run_of_before_origins_were_kept_it_says_so(coached: Path) -> None:
    both = explained(learning_of(coached))[3]
    assert both.chosen is not None
    told = reasons(replace(both, chosen=replace(both.chosen, born=None, origin=Origin.UNKNOWN)))
    assert any(text.startswith(f"How it arose in phase {both.chosen.phase} was not kept") for text in told)


def test_what_is_lacking_for_the_nearest_name_is_told_where_none_is_earned(coached: Path) -> None:
    both = explained(learning_of(coached))[3]
    assert both.chosen is not None
    far = dict.fromkeys(both.chosen.lacking, ("this", "that"))
    near = replace(both.chosen, lacking={**far, "stall turning": ("a stall",)})
    assert reasons(replace(both, chosen=near))[-1] == "None of the five names is its own. For stall turning it lacks: a stall."
    earned = replace(both.chosen, lacking={**far, "stall turning": ()})
    assert not any("five names" in text for text in reasons(replace(both, chosen=earned)))
    assert [name for name, parts in both.chosen.lacking.items() if not parts] == list(both.entry.names)


def test_a_situation_that_never_came_up_is_told_by_the_file(coached: Path) -> None:
    learning = learning_of(coached)
    unmet = replace(learning.advice.entries[0], current=7)
    (one,) = explain([unmet], learning.pal, learning.history)
    assert not one.known
    assert reasons(one)


def test_without_a_model_nothing_is_foretold() -> None:
    pal = Pal(PalSettings(budget=120, population=4, surrogate=False, mirror=False), np.random.default_rng(1))
    rng = np.random.default_rng(2)
    while not pal.finished:
        trial = pal.ask(int(rng.integers(4)), None)
        fast = sum(action.spec.left + action.spec.right for action in trial.maneuver.actions)
        pal.tell(trial, Performance((TALLY,) * 4, 4, won=False, lost=False, progress=0.01 * fast, over=True, duration=0.6))
    for one in explain(pal.advice().entries, pal):
        assert one.chosen is not None
        assert one.chosen.foretold is None
        assert one.chosen.mean is not None
        assert "those that begin like it" in " ".join(reasons(one))
        assert not one.shared
        assert one.entry.previous == ANY_STIMULUS


def test_origins_and_parents_are_those_of_the_archive(coached: Path) -> None:
    learning = learning_of(coached)
    origins: Counter[Origin] = Counter()
    for one in explained(learning).values():
        assert one.chosen is not None
        assert {parent.actions for parent in one.parents} == set(one.chosen.parents)
        assert tuple(" ".join(action.name for action in parent) for parent in one.chosen.parents) == one.entry.parents
        origins.update(each.origin for each in (one.chosen, *one.rivals))
    assert Origin.UNKNOWN not in origins


# --- several runs ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def team(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of two coachings: the advice is that of the second, but for what the first does when both eyes see."""
    folder = tmp_path_factory.mktemp("team") / "run"
    folder.mkdir()
    advices = []
    for number in (1, 2):
        log = folder / f"run-{number}.mcap"
        coaching_log(log, budget=60, seed=number)
        reader = LogReader(log)
        assert list(reader.raw_entries())
        (folder / f"run-{number}.json").write_bytes(reader.attachments[f"end/{runs.CHECKPOINT}"].data)
        advices.append(advice_of(reader.attachments[f"end/{runs.ADVICE}"].data))
    first, second = advices
    entries = [one for one in second.entries if one.current != 3] + [one for one in first.entries if one.current == 3]
    save_advice(replace(second, entries=tuple(entries)), folder / runs.ADVICE)
    with open_recorder(folder / runs.LOG) as recorder:
        for number, advice in enumerate(advices, start=1):
            recorder.coached_run(number, CoachedRun(number, 60, 9, 4, 3, 50.0, json.dumps(advice.to_dict()), "0" * 16))
        recorder.advice(load_advice(folder / runs.ADVICE).to_dict())
        recorder.attachment(f"end/{runs.ADVICE}", (folder / runs.ADVICE).read_bytes())
        for run_number, category, wins, kept in (
            (1, None, 40, False), (2, None, 41, True), (1, (ANY_STIMULUS, 1), 12, False), (1, (ANY_STIMULUS, 3), 55, True),
        ):  # fmt: skip
            recorder.team_verdict(TeamVerdict(run_number, category, TeamScore(wins, 60, 100.0), kept))
    (folder / "team.json").write_text("{}")
    (folder / runs.RECORD).write_text(json.dumps(RECORD))
    return folder


def test_an_entry_of_several_runs_is_explained_by_its_own(team: Path) -> None:
    learning = learning_of(team)
    assert not learning.unknown
    found = {one.entry.current: one for one in learning.explained(learning.advice.entries)}
    assert [found[current].run for current in range(4)] == [2, 2, 2, 1]
    for number, current in ((2, 0), (2, 2), (1, 3)):
        alone = explained(learning_of(team / f"run-{number}.mcap"))[current]
        assert replace(found[current], runs=0, run=0, verdicts=()) == alone
    said = {current: reasons(one)[0] for current, one in found.items()}
    assert said[0] == "It comes from run 2, whose advice did best in the team exam: it won 41 of 60 bouts."
    assert said[1] == said[2] == f"{said[0]} Tried in its place, and not kept: what was learnt here by run 1, 12 of 60."
    assert "run 1: with it the advice won 55 of 60 bouts" in said[3]


def test_the_log_of_several_runs_tells_which_it_was_where_the_runs_are_gone(team: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(team, tmp_path / "run")
    for path in folder.glob("run-*"):
        path.unlink()
    learning = learning_of(folder)
    assert [text.rpartition(" tells how ")[2] for text in learning.unknown] == ["run 1 has learnt.", "run 2 has learnt."]
    for one in learning.explained(learning.advice.entries):
        assert not one.known
        assert one.run == (1 if one.entry.current == 3 else 2)
        said = reasons(one)
        assert said[0].startswith(f"It comes from run {one.run}")
        assert said[1].startswith(f"Worth {one.entry.fitness:.1f}")
    alone = learning_of(folder / runs.LOG)
    assert "name the folder" in alone.unknown[0]
    assert alone.explained(alone.advice.entries) == learning.explained(learning.advice.entries)
    scene = read_scene(folder / runs.LOG)
    assert [lesson.why for lesson in scene.lessons] == [
        tuple(reasons(one)) for one in learning.explained(learning.advice.entries)
    ]


@pytest.mark.parametrize("text", ["", "[]", "{", '{"version": 1}', "x" * (1 << 21)])
def test_a_run_of_a_log_that_can_not_be_read_counts_for_none(text: str) -> None:
    told = TeamHistory()
    told.take(LogEntry("/pal/run", 0.0, CoachedRunRecord(1, 1, 60, 9, 4, 3, 50.0, text, "0" * 16, ())))
    assert not told.members


def test_what_is_gone_of_several_runs_is_told_of(team: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(team, tmp_path / "run")
    (folder / runs.LOG).unlink()
    (folder / "run-1.mcap").unlink()
    (folder / "run-1.json").write_text("{")
    learning = learning_of(folder)
    assert ["how the team exam went" in learning.unknown[0], "how run 1 has learnt" in learning.unknown[1]] == [True, True]
    found = {one.entry.current: one for one in learning.explained(learning.advice.entries)}
    assert found[1].run == 2
    assert not found[3].run
    assert reasons(found[3])


# --- the command -----------------------------------------------------------------------------------------------------


def test_the_command_fits_a_narrow_terminal(
    coached: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    assert run(["explain", str(coached), "--quiet"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 60
    assert sum(line.startswith("When ") for line in lines) == 4


def test_the_command_as_json(coached: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["explain", str(coached), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [one["situation"] for one in document["situations"]] == ["none", "left", "right", "both"]
    both = document["situations"][3]
    assert both["chosen"]["maneuver"] == both["maneuver"]
    assert sum(both["chosen"]["motives"].values()) == both["chosen"]["performed"]
    assert document["unknown"] == []


@pytest.mark.parametrize("name", ["left", "EYE_LEFT", "eye_left", "LEFT"])
def test_a_situation_has_several_names(coached: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["explain", str(coached), "--situation", name, "--json"]) == 0
    assert [one["situation"] for one in json.loads(capsys.readouterr().out)["situations"]] == ["left"]


def test_a_situation_that_is_none_is_asked_back_for(coached: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["explain", str(coached), "--situation", "EYE_LEFTY"]) == 2
    assert "choose one of none, left, right, both. Did you mean eye_left?" in capsys.readouterr().err


def test_what_is_not_there_ends_as_everywhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["explain"]) == 2
    assert "there is no run of hil coach with advice.toml" in capsys.readouterr().err
    assert run(["explain", "nowhere.toml"]) == 4
    assert run(["explain", "nowhere.mcap"]) == 2
    (tmp_path / "wrong.toml").write_text("version = 1\n")
    assert run(["explain", "wrong.toml"]) == 2
    assert "wrong.toml" in capsys.readouterr().err
