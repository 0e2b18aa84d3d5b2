"""Names for what was learnt: the five specialised maneuvers of Liu & Wu 2001, Fig. 10.6, as criteria on what happened."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from firmware_protocol.vocabulary import Action, ActionTally, Family, Maneuver

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pal_advisor.fields import Fields

CONTROL_PERIOD: Final = 0.005
"""Time between two samples of the firmware, in s."""
HOLD_TIME: Final = 0.1
"""An arm pressed this long in an action holds, in s."""
EDGES_A_SECOND: Final = 2.0
"""Press edges a second that make an impact intermittent."""


@dataclass(frozen=True)
class Engagement:
    """Sums over performances of one maneuver: how it engaged the opponent.

    Attributes:
        performances: Performances summed.
        actions: Actions performed.
        touched: Actions in which an arm was pressed.
        held_by_both: Actions in which both arms held.
        edges: Press edges, of the arm that had more of them in each performance.
        samples: Control periods performed.
        aligned: Performances in which both arms touched after one alone did.
        twisted: Performances in which single arms touched by turns.
    """

    performances: int = 0
    actions: int = 0
    touched: int = 0
    held_by_both: int = 0
    edges: int = 0
    samples: int = 0
    aligned: int = 0
    twisted: int = 0

    @classmethod
    def of(cls, tallies: Sequence[ActionTally]) -> Engagement:
        """What one performance looked like."""
        touches = [tuple(press > 0 for press in tally.longest_press) for tally in tallies]
        single = [touch for touch in touches if sum(touch) == 1]
        aligned = any(sum(touch) == 1 and (True, True) in touches[index + 1 :] for index, touch in enumerate(touches))
        return cls(
            performances=1,
            actions=len(tallies),
            touched=sum(any(touch) for touch in touches),
            held_by_both=sum(min(tally.longest_press) >= HOLD_TIME for tally in tallies),
            edges=max((sum(tally.edges[arm] for tally in tallies) for arm in (0, 1)), default=0),
            samples=sum(tally.samples for tally in tallies),
            aligned=int(aligned),
            twisted=int(any(first != second for first, second in pairwise(single))),
        )

    def __add__(self, other: Engagement) -> Engagement:
        return Engagement(*(a + b for a, b in zip(self.to_list(), other.to_list(), strict=True)))

    def to_list(self) -> list[int]:
        """The sums, in the order of the attributes."""
        return [
            self.performances, self.actions, self.touched, self.held_by_both, self.edges, self.samples, self.aligned,
            self.twisted,
        ]  # fmt: skip

    @classmethod
    def from_fields(cls, fields: Fields) -> Engagement:
        """The inverse of `to_list`, from its elements by the names of the attributes."""
        return cls(*(fields.integer(name) for name in SUMS))


SUMS: Final = tuple(field.name for field in dataclasses.fields(Engagement))
"""The names of the sums, in order."""


def names(actions: Sequence[Action], engagement: Engagement) -> list[str]:
    """The names that a maneuver has earned, given how it engaged the opponent; empty when it meets no criterion.

    * *straight push*: forward actions only, both arms holding in more than half of the actions;
    * *intermittent impact*: forward and backward in alternation, two press edges a second or more;
    * *stall turning*: one wheel stalled in more than half of the actions, an arm touching in more than half;
    * *corner-to-edge alignment*: it turns, and in half of the performances both arms touch after one alone did;
    * *alternating twist*: left and right turns in alternation, and in half of the performances the arms touch by turns.

    Args:
        actions: The maneuver's actions.
        engagement: Sums over its performances.
    """
    if not engagement.performances:
        return []
    families = [action.family for action in actions]
    stalled = sum((action.spec.left == 0) != (action.spec.right == 0) for action in actions)
    touching = 2 * engagement.touched > engagement.actions
    turns = [family for family in families if family in {Family.LEFT, Family.RIGHT}]
    earned = {
        "straight push": set(families) == {Family.FORWARD} and 2 * engagement.held_by_both > engagement.actions,
        "intermittent impact": _alternates(families, {Family.FORWARD, Family.BACKWARD})
        and engagement.edges >= EDGES_A_SECOND * CONTROL_PERIOD * max(1, engagement.samples),
        "stall turning": 2 * stalled > len(actions) and touching,
        "corner-to-edge alignment": bool(turns) and 2 * engagement.aligned >= engagement.performances,
        "alternating twist": _alternates(families, {Family.LEFT, Family.RIGHT})
        and 2 * engagement.twisted >= engagement.performances,
    }
    return [name for name, met in earned.items() if met]


def describe(maneuver: Maneuver, evaluations: Sequence[Sequence[ActionTally]]) -> list[str]:
    """Like `names`, from the tallies of each performance.

    Args:
        maneuver: What was performed.
        evaluations: Tallies of each performance.
    """
    engagement = Engagement()
    for tallies in evaluations:
        engagement += Engagement.of(tallies)
    return names(maneuver.actions, engagement)


def _alternates(families: Sequence[Family], wanted: set[Family]) -> bool:
    """Whether both wanted families occur, and nothing else but stops."""
    return wanted <= set(families) <= wanted | {Family.STOP}
