"""The five names: what winners of real coaching runs have earned, and what by a hair they have not."""

from __future__ import annotations

import pytest

from firmware_protocol.vocabulary import Action, ActionTally, Maneuver
from pal_advisor.maneuvers import describe
from pal_advisor.maneuvers.names import Engagement, Succession, names, shortfalls, succession

NOTHING = ActionTally(50, (0, 0), (0, 0), (0.0, 0.0), 0.0)
PUSH = ActionTally(50, (50, 50), (0, 0), (0.25, 0.25), 0.04)
HIT = ActionTally(50, (50, 50), (1, 1), (0.25, 0.25), 0.04)
LEFT_ARM = ActionTally(50, (1, 1), (1, 0), (0.05, 0.0), 0.0)
RIGHT_ARM = ActionTally(50, (1, 1), (0, 1), (0.0, 0.05), 0.0)


def actions(spelled: str) -> tuple[Action, ...]:
    return tuple(Action[name] for name in spelled.split())


@pytest.mark.parametrize(
    ("spelled", "tallies", "name"),
    [
        ("FF FF MF FF", (PUSH, PUSH, PUSH, NOTHING), "straight push"),
        ("FF S MF FF", (PUSH, PUSH, PUSH, NOTHING), "straight push"),
        ("FF FB FF FB", (HIT, NOTHING, HIT, NOTHING), "intermittent impact"),
        ("LSRF LSRF LFRS FF", (PUSH, PUSH, PUSH, NOTHING), "stall turning"),
        ("LBRF FF FF FF", (LEFT_ARM, HIT, NOTHING, NOTHING), "corner-to-edge alignment"),
        ("LSRF LFRS LSRF LFRS", (LEFT_ARM, RIGHT_ARM), "alternating twist"),
    ],
)
def test_what_was_learnt_gets_its_name(spelled: str, tallies: tuple[ActionTally, ...], name: str) -> None:
    maneuver = Maneuver(actions(spelled))
    assert name in describe(maneuver, [tallies])
    assert describe(maneuver, [(NOTHING, NOTHING, NOTHING, NOTHING)]) == []
    assert describe(maneuver, []) == []


@pytest.mark.parametrize(
    ("spelled", "engagement", "earned"),
    [  # what coaching runs elected with both eyes: sums over all performances of it, those that came from afar too
        ("FF MF SB FF", (208, 777, 710, 326, 203, 22934, 11, 0), ["intermittent impact"]),  # rams flat-heavy, .98 of its bouts
        ("MF FF SB FF", (103, 399, 366, 162, 101, 11693, 7, 0), ["intermittent impact"]),
        ("FF FF FF FF", (74, 220, 170, 93, 33, 5917, 5, 0), ["straight push"]),  # against flat-light
        ("MF FF MF SF", (75, 208, 173, 118, 28, 5564, 7, 0), ["straight push"]),
        ("FF FF FF LSRF", (101, 287, 231, 92, 77, 7680, 11, 0), []),
        ("S FF LBRF FF", (82, 300, 157, 0, 63, 8728, 2, 25), []),  # against the point
    ],
)
def test_winners_of_coaching_runs_earn_what_they_do(spelled: str, engagement: tuple[int, ...], earned: list[str]) -> None:
    assert names(actions(spelled), Engagement(*engagement)) == earned


def test_what_is_missed_is_told() -> None:
    push = Engagement(75, 208, 173, 86, 28, 5564, 7, 0)
    missing = shortfalls(actions("MF FF MF SB"), push)
    assert missing["straight push"] == (
        "forward actions and stops only",
        "held by both arms in most of the actions that touch",
    )
    assert missing["intermittent impact"] == ("a press edge for each whole performance",)
    assert set(shortfalls(actions("FF"), Engagement()).values()) == {("a performance",)}


def test_a_twist_may_be_the_work_of_two_maneuvers_by_turns() -> None:
    left, right = actions("LSRF FF"), actions("LFRS FF")
    bout = [(left, (RIGHT_ARM, RIGHT_ARM)), (right, (LEFT_ARM, LEFT_ARM))] * 3
    found = succession(bout)
    assert found == {left: Succession(3, 2, 2), right: Succession(3, 3, 3)}
    alone = Engagement.of((RIGHT_ARM, RIGHT_ARM))
    assert "alternating twist" not in names(left, alone)
    assert "alternating twist" in names(left, alone, found[left])
    same = succession([(left, (RIGHT_ARM, RIGHT_ARM))] * 3)
    assert same == {left: Succession(3, 0, 0)}
    assert "alternating twist" not in names(left, alone, same[left])


def test_what_was_not_performed_does_not_turn() -> None:
    cut_short = succession([(actions("LSRF LFRS"), (LEFT_ARM,))])
    assert cut_short == {actions("LSRF LFRS"): Succession(1, 0, 0)}
