"""A challenge on paper: who plays from which poses, what a checkpoint keeps of it, and what is said."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from paper_ring import PaperRing, encounter

from firmware_protocol.errors import PeerLostError
from firmware_protocol.messages import BoutOutcome
from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from hil.seeds import Branch, bout_seed
from hil.sumo.challenging import (
    ChallengeStanding,
    beginning_in_words,
    challenge_in_words,
    facts,
    fitting,
    hold,
    pair_in_words,
)
from hil.sumo.coaching import CheckpointError, Coaching, checkpoint_of, load_checkpoint, new_pal
from pal_advisor.maneuvers import Advice, AdviceEntry, Challenge, PalSettings

if TYPE_CHECKING:
    from pathlib import Path

    from hil.sumo.bouts import Bout
    from pal_advisor.maneuvers import ChallengeVerdict

SETTINGS = PalSettings(budget=20, population=4, elite=1, actions=1)
WIN, LOSS, DRAW = BoutOutcome.WIN, BoutOutcome.LOSS, BoutOutcome.DRAW


def advice(action: Action) -> Advice:
    return Advice(SETTINGS, (AdviceEntry(ANY_STIMULUS, 1, (action,), 1.0, 1),), "flat-light", 1)


GIVEN, LEARNT = advice(Action.FF), advice(Action.FB)


class Notes:
    """An observer that keeps everything."""

    def __init__(self) -> None:
        self.titles: list[str] = []
        self.bouts: list[Bout] = []
        self.verdicts: list[ChallengeVerdict] = []
        self.saved: list[int] = []

    def series(self, title: str) -> None:
        self.titles.append(title.rpartition(" by ")[2])

    def bout(self, bout: Bout) -> None:
        self.bouts.append(bout)

    def verdict(self, verdict: ChallengeVerdict) -> None:
        self.verdicts.append(verdict)

    def save(self) -> None:
        self.saved.append(len(self.bouts))


def test_the_two_play_in_turn_twice_from_each_pose_until_it_is_decided() -> None:
    ring, standing, notes = PaperRing(*[encounter(WIN), encounter(DRAW)] * 6), ChallengeStanding(GIVEN), Notes()
    hold(ring, standing, LEARNT, 7, notes)
    assert standing.beaten
    assert [maneuver.actions for maneuver in ring.performed] == [(Action.FB,), (Action.FF,)] * 6
    assert ring.begun == [bout_seed(7, Branch.CHALLENGE, pair) for pair in range(1, 7) for _ in range(2)]
    assert notes.titles == ["what was learnt", "the given advice"] * 6
    assert [bout.number for bout in notes.bouts] == notes.saved == list(range(1, 13))
    assert [verdict.pair for verdict in notes.verdicts] == [1, 2, 3, 4, 5, 6]
    assert standing.bouts == notes.bouts


def test_it_goes_on_where_it_was_and_a_bout_in_which_the_robot_is_lost_counts_once() -> None:
    before = ChallengeStanding(GIVEN)
    with pytest.raises(KeyboardInterrupt):
        hold(PaperRing(encounter(LOSS), encounter(WIN), encounter(LOSS), KeyboardInterrupt()), before, LEARNT, 7, Notes())
    assert not before.challenge.finished
    again = ChallengeStanding(GIVEN, before.bouts)
    ring, notes = PaperRing(PeerLostError("gone"), encounter(WIN), encounter(LOSS), encounter(WIN), encounter(LOSS)), Notes()
    hold(ring, again, LEARNT, 7, notes)
    assert ring.recovered == 1
    assert ring.performed[0].actions == (Action.FF,)
    assert [bout.number for bout in notes.bouts] == [4, 5, 6, 7, 8, 9, 10]
    assert (again.challenge.winner, again.beaten) == ("champion", False)


def run_to_the_end(path: Path, standing: ChallengeStanding, kept: list[Advice]) -> Coaching:
    run = Coaching(
        PaperRing(encounter(WIN)), new_pal(SETTINGS, 1), seed=1, checkpoint=path, keep=kept.append, standing=standing
    )
    run.run()
    return run


def test_a_checkpoint_keeps_the_given_advice_and_every_bout_and_the_best_so_far_is_the_given_one(tmp_path: Path) -> None:
    path, kept = tmp_path / "x.json", list[Advice]()
    standing = ChallengeStanding(GIVEN)
    run = run_to_the_end(path, standing, kept)
    assert kept
    assert {id(one) for one in kept} == {id(GIVEN)}
    with pytest.raises(KeyboardInterrupt):
        hold(PaperRing(encounter(WIN), encounter(LOSS), encounter(DRAW), KeyboardInterrupt()), standing, LEARNT, 1, Notes())
    run.save()
    saved = load_checkpoint(path).standing
    assert saved is not None
    assert (saved.given, saved.bouts) == (GIVEN, standing.bouts)
    assert saved.next(1) == standing.next(1)
    hold(PaperRing(*[encounter(LOSS), encounter(WIN)] * 6), saved, LEARNT, 1, Notes())
    assert saved.beaten
    assert Coaching(PaperRing(encounter()), run.pal, seed=1, standing=saved).best().entries == run.advice().entries


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        ({"given": {}}, "given"),
        ({"bouts": [[1, 1.0, 1]] * 41}, "decided after"),
        ({"bouts": [[0, 1.0, 1]]}, "outcome"),
        ({"bouts": [[1, 1.0]]}, "list of 3"),
        ({"more": 1}, "more"),
    ],
)
def test_a_damaged_challenge_is_refused(tmp_path: Path, damage: dict[str, object], words: str) -> None:
    data = json.loads(run_to_the_end(tmp_path / "x.json", ChallengeStanding(GIVEN), []).checkpoint())
    data["challenge"].update(damage)
    with pytest.raises(CheckpointError, match=words):
        checkpoint_of(json.dumps(data).encode())


def test_what_is_said_of_it() -> None:
    new, open_, stays, taken = Challenge(), Challenge([True, False] * 4), Challenge([True] * 18), Challenge([True, False] * 6)
    assert challenge_in_words(new) == "The given advice stays: no bout has been played against it."
    assert "10 to 40 in all." in beginning_in_words(new)
    assert "8 of them played already" in beginning_in_words(open_)
    assert "nothing is decided: the given advice stays so far" in challenge_in_words(open_)
    assert challenge_in_words(stays).endswith("won 9 of 9; no pair of bouts was won by one of them alone.")
    assert challenge_in_words(taken) == (
        "What was learnt takes the place of the given advice. In 12 bouts in turn what was learnt won 6 of 6 and the given "
        "advice won 0 of 6; of the pairs that only one of them won, 6 went to what was learnt and 0 to the other (chance of "
        "that or more, were both as good: 0.016)."
    )
    assert pair_in_words(open_.verdicts[-1]).startswith("Challenge, 8 bouts played: of the pairs that only one of them won, 4")
    wins = {"challenger": 6, "champion": 0}
    assert facts(taken) == {"winner": "challenger", "bouts": 12, "wins": wins, "ahead": 6, "behind": 0, "chance": 1 / 64}
    assert (facts(new)["winner"], facts(new)["chance"]) == (None, None)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, ""),
        ({"actions": 6}, "have 1 actions, and this coaching's have 6"),
        ({"pairs": True}, "leave --pairs out"),
        ({"arms_in_stimulus": True}, "without the arms, and this coaching's with"),
    ],
)
def test_an_advice_that_a_coaching_cannot_begin_from_is_told(changes: dict[str, object], words: str) -> None:
    found = fitting(GIVEN, PalSettings.from_dict({**SETTINGS.to_dict(), **changes}))
    assert words in found
    assert bool(found) == bool(words)
