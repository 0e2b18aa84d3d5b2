"""Bouts and how they are counted, on paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from paper_ring import PaperRing, encounter

from firmware_protocol.errors import LinkClosedError, PeerGoneError, PeerLostError, RefusedError
from firmware_protocol.messages import BoutOutcome, Reason
from firmware_protocol.vocabulary import Action, Maneuver, Outcome, Stimulus
from hil.sumo.bouts import Bout, Tally, play

if TYPE_CHECKING:
    from hil.sumo.ring import Ring


class Noting:
    """A controller that notes what it was asked."""

    def __init__(self) -> None:
        self.asked: list[tuple[Stimulus, Stimulus | None]] = []

    def choose(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:
        self.asked.append((current, previous))
        return Maneuver((Action.FF,))


def test_a_bout_goes_on_until_it_is_decided() -> None:
    both = Stimulus.EYE_LEFT | Stimulus.EYE_RIGHT
    ring: Ring = PaperRing(
        encounter(after=both),
        encounter(after=Stimulus.NONE),
        encounter(BoutOutcome.WIN, elapsed=2.5),
        encounter(BoutOutcome.DRAW),
    )
    player = Noting()
    bouts = list(play(ring, player, [77, 78]))
    assert bouts == [Bout(1, 77, BoutOutcome.WIN, 2.5, 3), Bout(2, 78, BoutOutcome.DRAW, 1.0, 1)]
    # The controller is told what was sensed before; a new bout remembers nothing.
    assert player.asked == [
        (Stimulus.EYE_LEFT, None),
        (both, Stimulus.EYE_LEFT),
        (Stimulus.NONE, both),
        (Stimulus.EYE_LEFT, None),
    ]


@pytest.mark.parametrize(
    ("ended", "reason", "words"),
    [
        (Outcome.REFUSED, Reason.DISARMED, "disarmed"),
        (Outcome.STOPPED, Reason.EMERGENCY_STOP, "emergency stop"),
    ],
)
def test_a_robot_that_somebody_stopped_ends_the_series(ended: Outcome, reason: Reason, words: str) -> None:
    ring = PaperRing(encounter(), encounter(ended=ended, reason=reason))
    with pytest.raises(RefusedError, match=words):
        list(play(ring, Noting(), [1, 2]))
    assert len(ring.performed) == 2


def test_a_maneuver_that_the_watchdog_cut_short_does_not() -> None:
    ring = PaperRing(encounter(ended=Outcome.STOPPED, reason=Reason.WATCHDOG), encounter(BoutOutcome.LOSS))
    assert [bout.outcome for bout in play(ring, Noting(), [1])] == [BoutOutcome.LOSS]


def test_outcomes_are_counted() -> None:
    outcomes = [(BoutOutcome.WIN, 3.0), (BoutOutcome.LOSS, 1.0), (BoutOutcome.WIN, 5.0), (BoutOutcome.DRAW, 60.0)]
    tally = Tally.of("x", [Bout(number, number, outcome, time, 1) for number, (outcome, time) in enumerate(outcomes)])
    assert (tally.trials, tally.wins, tally.losses, tally.draws) == (4, 2, 1, 1)
    assert tally.median_time_to_win == 4.0
    assert tally.win_rate.value == 0.5
    assert tally.to_dict()["win_rate_ci95"] == list(tally.win_rate.ci95)


def test_who_won_nothing_or_played_nothing_has_no_time() -> None:
    assert Tally.of("x", []).to_dict()["median_time_to_win_s"] is None
    assert Tally.of("x", []).win_rate.value == 0.0
    assert Tally.of("x", [Bout(1, 1, BoutOutcome.LOSS, 1.0, 1)]).median_time_to_win is None


def test_a_bout_in_which_the_robot_was_lost_is_played_again_and_counts_once() -> None:
    lost = PeerLostError("robot 1 has restarted")
    ring = PaperRing(encounter(), lost, encounter(), encounter(), encounter(BoutOutcome.WIN))
    ring.recovers = [lost, None]  # and lost again while it was armed
    bouts = list(play(ring, Noting(), [77, 78]))
    assert [(bout.number, bout.seed, bout.maneuvers) for bout in bouts] == [(1, 77, 3), (2, 78, 1)]
    assert ring.begun == [77, 77, 78]
    assert ring.recovered == 2


def test_a_robot_that_is_lost_again_and_again_or_for_good_ends_the_series() -> None:
    ring = PaperRing(PeerLostError("it has restarted"))
    with pytest.raises(PeerLostError, match="has restarted"):
        list(play(ring, Noting(), [77]))
    assert ring.recovered == 5
    for error in (LinkClosedError("tcp:", "it did not come back"), PeerGoneError("it did not come back")):
        ring = PaperRing(PeerLostError("it has restarted"))
        ring.recovers = [error]
        with pytest.raises(type(error), match="did not come back"):
            list(play(ring, Noting(), [77]))
        assert ring.recovered == 1
