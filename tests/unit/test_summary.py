"""What a coaching run came to, in words."""

from __future__ import annotations

import pytest
from paper_ring import PaperRing, encounter

from firmware_protocol.messages import BoutOutcome
from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from hil.sumo.bouts import Tally
from hil.sumo.coaching import Coaching, new_pal
from hil.sumo.summary import coaching_summary, in_words, label, per_stimulus
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings

FILES: dict[str, object] = {"advice": "a.toml", "report": None, "log": "l.mcap", "checkpoint": "c.json"}


def finished() -> Coaching:
    """A run on paper, of 20 maneuvers, all of which won."""
    run = Coaching(PaperRing(encounter(BoutOutcome.WIN)), new_pal(PalSettings(budget=20, population=4, elite=1), 1), seed=1)
    run.run()
    return run


@pytest.mark.parametrize(
    ("stimulus", "words"),
    [
        (0, "no eye sees it"),
        (1, "the left eye sees it"),
        (2, "the right eye sees it"),
        (3, "both eyes see it"),
        (4, "no eye sees it, the left arm touches"),
        (11, "both eyes see it, the right arm touches"),
        (15, "both eyes see it, both arms touch"),
    ],
)
def test_situations_in_words(stimulus: int, words: str) -> None:
    assert in_words(stimulus) == words


def test_what_was_learnt_by_the_name_of_the_situation() -> None:
    entries = (
        AdviceEntry(ANY_STIMULUS, 3, (Action.FF, Action.S), 1.23456, 9, names=("a push",)),
        AdviceEntry(1, 3, (Action.L, Action.S), -1.0, 1),
    )
    assert [label(entry) for entry in entries] == ["both", "left>both"]
    assert per_stimulus(Advice(PalSettings(actions=2), entries)) == {
        "both": {"maneuver": ["FF", "S"], "fitness": 1.235, "evaluations": 9, "names": ["a push"]},
        "left>both": {"maneuver": ["L", "S"], "fitness": -1.0, "evaluations": 1, "names": []},
    }


def test_the_summary_says_what_how_and_where() -> None:
    won, random = Tally("flat-light", 50, 40, 4, 6, 2.25), Tally("flat-light", 20, 3, 9, 8, 9.0)
    lines = coaching_summary(finished(), won, random, opponent="flat-light", files=FILES, wall_seconds=71.6)
    text = "\n".join(lines)
    assert "Pal coached Junior against flat-light: 20 maneuvers in 20 bouts, 0.1 robot minutes, in 72 s." in text
    assert "When the left eye sees it: " in text
    assert "won 40 of 50 bouts from fresh poses (95 % interval 0.67 to 0.89), in 2.2 s by the median" in text
    assert text.count("random maneuvers won 3 of 20.") == 1
    assert "Advice:     a.toml" in lines
    assert "Report:" not in text
    assert "hil bout --advice a.toml --opponent flat-light" in text
    assert " 1 times" not in text


def test_who_played_no_bout_is_told_so() -> None:
    text = "\n".join(coaching_summary(finished(), None, None, opponent="unknown", files=FILES, wall_seconds=1.0))
    assert "was not tried" in text
    assert "Play it" not in text


def test_who_never_won_has_no_time() -> None:
    never = Tally("x", 10, 0, 10, 0, None)
    text = "\n".join(coaching_summary(finished(), never, None, opponent="x", files=FILES, wall_seconds=1.0))
    assert "won 0 of 10 bouts from fresh poses (95 % interval 0.00 to 0.28)." in text
