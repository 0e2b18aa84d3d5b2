"""The team exam: the best of several advices, with the champions of others where whole bouts show them to be better."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings, TeamExam, TeamScore
from pal_advisor.maneuvers.team import BETTER, BOUTS, TIME_COST

if TYPE_CHECKING:
    from collections.abc import Callable

LETTERS = {"F": Action.FF, "B": Action.FB, "L": Action.LSRF, "R": Action.LFRS, "S": Action.S}
MIRRORED = {"L": "R", "R": "L"}
SETTINGS = PalSettings(actions=1)


def advice(none: str, left: str, both: str, *, mirror: bool = True) -> Advice:
    """An advice of one action for each situation; on the right the mirror image of the left."""
    settings = PalSettings.from_dict({**SETTINGS.to_dict(), "mirror": mirror})
    letters = {0: none, 1: left, 2: MIRRORED.get(left, left), 3: both}
    entries = tuple(AdviceEntry(ANY_STIMULUS, code, (LETTERS[letter],), 1.0, 1) for code, letter in letters.items() if letter)
    return Advice(settings, entries, "flat-light", 1)


def said(one: Advice) -> str:
    """What it does for none, left, right and both."""
    names = {action: letter for letter, action in LETTERS.items()}
    return "".join(names[entry.actions[0]] for entry in one.entries)


def held(exam: TeamExam, wins: Callable[[str], float]) -> list[list[str]]:
    """Hold an exam.

    Args:
        exam: The exam.
        wins: Share of bouts that an advice wins.

    Returns:
        What was tried, a list for each turn.
    """
    tried = []
    while not exam.finished:
        tried.append([said(one) for one in exam.wanted])
        exam.tell([TeamScore(round(wins(said(one)) * BOUTS), BOUTS, 3.0 * BOUTS) for one in exam.wanted])
    return tried


def by_letters(wanted: str) -> Callable[[str], float]:
    return lambda said: sum(a == b for a, b in zip(said, wanted, strict=True)) / len(wanted)


def test_the_best_of_all_is_put_together_from_all() -> None:
    exam = TeamExam([advice("L", "B", "B"), advice("B", "L", "B"), advice("B", "B", "F")])
    tried = held(exam, by_letters("LLRF"))
    assert said(exam.best) == "LLRF"
    assert exam.score == TeamScore(BOUTS, BOUTS, 3.0 * BOUTS)
    assert tried[0] == ["LBBB", "BLRB", "BBBF"]
    assert tried[1] == ["LLRB"], "the second run is the best, and the third has the same maneuver there"
    kept = [(verdict.run, verdict.category) for verdict in exam.verdicts if verdict.kept]
    assert kept == [(2, None), (1, (ANY_STIMULUS, 0)), (3, (ANY_STIMULUS, 3))]


def test_a_side_and_its_mirror_image_change_together_where_one_stands_for_the_other() -> None:
    both = held(TeamExam([advice("L", "L", "F"), advice("L", "B", "F")]), lambda said: said.count("L") / 4)
    assert both == [["LLRF", "LBBF"], ["LBBF"]]
    apart = held(
        TeamExam([advice("L", "L", "F", mirror=False), advice("L", "B", "F", mirror=False)]), lambda said: said.count("L") / 4
    )
    assert apart == [["LLRF", "LBBF"], ["LBRF"], ["LLBF"]]


def test_a_champion_stays_unless_the_challenger_is_better_by_more_than_chance_would_have_it_so_often() -> None:
    first, second = advice("L", "L", "F"), advice("S", "L", "F")
    for gain, wanted in ((BETTER / 2, "LLRF"), (2 * BETTER, "SLRF")):
        exam = TeamExam([first, second])
        exam.tell([TeamScore(1000, 2000, 0.0), TeamScore(999, 2000, 0.0)])
        exam.tell([TeamScore(1000 + round(2000 * gain), 2000, 0.0)])
        assert exam.finished
        assert said(exam.best) == wanted


def test_time_counts() -> None:
    exam = TeamExam([advice("L", "L", "F"), advice("L", "L", "F")])
    exam.tell([TeamScore(60, 60, 600.0), TeamScore(60, 60, 300.0)])
    assert exam.finished, "they have the same maneuvers"
    assert [verdict.kept for verdict in exam.verdicts] == [False, True]
    assert exam.verdicts[0].score.value == pytest.approx(1.0 - 10.0 * TIME_COST)


def test_what_a_run_never_met_is_not_tried() -> None:
    exam = TeamExam([advice("L", "L", "F"), advice("", "L", "F")])
    assert held(exam, lambda said: len(said) / 4) == [["LLRF", "LRF"]]
    exam = TeamExam([advice("", "L", "F"), advice("L", "B", "B")])
    assert held(exam, lambda said: {"LRF": 0.5, "LLRF": 0.9}.get(said, 0.1))[1] == ["LLRF"]
    assert said(exam.best) == "LLRF"


def test_one_run_is_its_own_team() -> None:
    exam = TeamExam([advice("L", "L", "F")])
    assert held(exam, lambda _: 0.5) == [["LLRF"]]
    with pytest.raises(ValueError, match="no advice"):
        TeamExam([])


def test_as_many_scores_as_are_wanted() -> None:
    with pytest.raises(ValueError, match="shorter"):
        TeamExam([advice("L", "L", "F"), advice("B", "L", "F")]).tell([TeamScore(1, 1, 1.0)])


def test_a_champion_is_played_at_the_pace_it_was_learnt_at() -> None:
    slow, fast = advice("L", "L", "F"), advice("L", "L", "F")
    fast = replace(fast, settings=replace(fast.settings, period=0.08))
    exam = TeamExam([slow, fast])
    exam.tell([TeamScore(40, BOUTS, 0.0), TeamScore(30, BOUTS, 0.0)])
    while not exam.finished:  # only where nothing is seen the faster one does better
        (tried,) = exam.wanted
        faster = [entry.current for entry in tried.entries if tried.maneuver(entry).period == 0.08]
        exam.tell([TeamScore(50 if faster == [0] else 20, BOUTS, 0.0)])
    best = exam.best
    assert [best.maneuver(entry).period for entry in best.entries] == [0.08, 0.15, 0.15, 0.15]
    assert [entry.period for entry in best.entries] == [0.08, None, None, None], "none where the settings say the same"
    assert Advice.from_dict(best.to_dict()) == best
