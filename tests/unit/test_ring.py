"""The ring with a referee, against a dummy or a robot that is played, and without one, over the whole emulation."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest

import hil
from firmware_protocol.messages import BoutOutcome
from firmware_protocol.vocabulary import ANY_STIMULUS, Action, Maneuver, Outcome
from hil.connecting.connecting_all import connect_all_as
from hil.sumo.ring import SETTLE, OpenRing, RefereedRing, RingError, open_ring
from hil.sumo.rivals.pair import Pair
from hil.sumo.rivals.ring import RivalRing
from hil.sumo.rivals.rivals import Rivals
from hil.sumo.tournament.entrants import Entrant, EntrantKind
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

DUMMY, RIVAL = "dummy", "rival"
REFEREED = pytest.mark.parametrize("kind", [DUMMY, RIVAL])
STANDING = Entrant(
    "still", EntrantKind.ADVICE, Advice(PalSettings(actions=1), (AdviceEntry(ANY_STIMULUS, 0, (Action.S,), 1.0, 5),))
)

STILL = Maneuver((Action.S,), period=0.1, floor_reflex=False)
AHEAD = Maneuver((Action.FF,) * 8, period=1.0, floor_reflex=False)


def armed(url: str = "sim://junior?seed=2") -> hil.Junior:
    junior = hil.connect(url)
    junior.arm()
    return junior


@contextmanager
def refereed(kind: str) -> Iterator[tuple[hil.Junior, RefereedRing]]:
    """A ring against a dummy, or against a robot that is played and stands still."""
    if kind == DUMMY:
        with armed() as junior:
            ring = open_ring(junior, "point-light")
            assert isinstance(ring, RefereedRing)
            yield junior, ring
    else:
        with connect_all_as(Pair, "sim://junior?networks=2&seed=2") as pair:
            pair.home.arm()
            yield pair.home, RivalRing(pair, Rivals((STANDING,)))


@REFEREED
def test_a_bout_begins_where_its_seed_says(kind: str) -> None:
    with refereed(kind) as (junior, ring):
        assert junior.referee is not None
        poses = []
        for seed in (5, 6, 5):
            before = junior.now()
            stimulus = ring.begin(seed)
            assert junior.now() - before >= SETTLE
            assert stimulus == junior.stimulus
            poses.append((junior.referee.latest.junior, junior.referee.latest.opponent))
        assert poses[0] == poses[2] != poses[1]


@REFEREED
def test_what_a_maneuver_did_is_told(kind: str) -> None:
    with refereed(kind) as (_, ring):
        ring.begin(5)
        done = ring.engage(STILL)
        assert (done.outcome, done.report.outcome, done.report.done) == (BoutOutcome.UNDECIDED, Outcome.COMPLETED, 1)
        assert done.duration == pytest.approx(0.1, abs=0.03)
        assert done.elapsed == pytest.approx(SETTLE + 0.1, abs=0.06)
        assert done.progress == pytest.approx(0.0, abs=1e-3)
        assert done.stimulus == done.report.after


@REFEREED
def test_who_runs_over_the_border_loses_and_the_maneuver_ends_there(kind: str) -> None:
    with refereed(kind) as (junior, ring):
        assert ring.opponent == {DUMMY: "point-light", RIVAL: "advice:still"}[kind]
        ring.begin(1)
        done = ring.engage(AHEAD)
        assert done.outcome in {BoutOutcome.WIN, BoutOutcome.LOSS}
        assert done.report.outcome is Outcome.REPLACED  # by standing still
        assert done.duration < 4.0
        junior.wait(0.1)
        # The next bout does not remember that the last one is over.
        ring.begin(2)
        assert ring.engage(STILL).outcome is BoutOutcome.UNDECIDED


def test_the_opponent_that_is_there_is_kept_and_named() -> None:
    with armed("sim://junior?opponent=corner-light") as junior:
        ring = open_ring(junior)
        assert ring.opponent == "corner-light"  # before anything has begun
        ring.begin(1)
        assert ring.opponent == "corner-light"
        with pytest.raises(RingError, match="choose one of flat-light"):
            open_ring(junior, "keep")


def test_without_a_referee_nobody_says_where_the_opponent_is() -> None:
    with armed("sim://junior?referee=0") as junior:
        ring = open_ring(junior, "my friend's robot")
        assert isinstance(ring, OpenRing)
        assert (ring.refereed, ring.opponent) == (False, "my friend's robot")
        assert open_ring(junior).opponent == "unknown"
        before = junior.now()
        assert ring.begin(1) == junior.stimulus
        assert junior.now() - before < SETTLE
        done = ring.engage(STILL)
        assert (done.outcome, done.elapsed, done.progress) == (BoutOutcome.UNDECIDED, None, None)
        assert done.duration == pytest.approx(0.1, abs=0.03)
