"""Names for what was learnt: the five specialised maneuvers of Liu & Wu 2001, Fig. 10.6, as criteria on what happened."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from firmware_protocol.vocabulary import Action, ActionTally, Family, Maneuver

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from pal_advisor.fields import Fields

CONTROL_PERIOD: Final = 0.005
"""Time between two samples of the firmware, in s."""
HOLD_TIME: Final = 0.1
"""An arm pressed this long in an action holds, in s."""
STRAIGHT_PUSH: Final = "straight push"
INTERMITTENT_IMPACT: Final = "intermittent impact"
STALL_TURNING: Final = "stall turning"
CORNER_TO_EDGE: Final = "corner-to-edge alignment"
ALTERNATING_TWIST: Final = "alternating twist"

Touch = tuple[bool, bool]
"""Whether the left, right arm touched."""

_TURNS: Final = frozenset({Family.LEFT, Family.RIGHT})


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
        touches = _touches(tallies)
        aligned = any(sum(touch) == 1 and (True, True) in touches[index + 1 :] for index, touch in enumerate(touches))
        return cls(
            performances=1,
            actions=len(tallies),
            touched=sum(any(touch) for touch in touches),
            held_by_both=sum(min(tally.longest_press) >= HOLD_TIME for tally in tallies),
            edges=max((sum(tally.edges[arm] for tally in tallies) for arm in (0, 1)), default=0),
            samples=sum(tally.samples for tally in tallies),
            aligned=int(aligned),
            twisted=int(_changes(_single(touches))),
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


@dataclass(frozen=True)
class Succession:
    """Sums over performances of one maneuver: how they go on from what was performed before them in the same bout.

    Attributes:
        performances: Performances summed.
        alternated: Performances whose turns change direction, or turn the other way than the last turn before.
        twisted: Performances in which single arms touch by turns, or another arm than the last that touched alone before.
    """

    performances: int = 0
    alternated: int = 0
    twisted: int = 0

    def __add__(self, other: Succession) -> Succession:
        return Succession(
            self.performances + other.performances, self.alternated + other.alternated, self.twisted + other.twisted
        )


def succession(bout: Iterable[tuple[Sequence[Action], Sequence[ActionTally]]]) -> dict[tuple[Action, ...], Succession]:
    """How the maneuvers of a bout go on from one another.

    Args:
        bout: Actions and tallies of each performance, in order.

    Returns:
        For each maneuver its sums.
    """
    found: dict[tuple[Action, ...], Succession] = {}
    turn: list[Family] = []
    touch: list[Touch] = []
    for actions, tallies in bout:
        performed = actions[: len(tallies)]
        turns = turn + [action.family for action in performed if action.family in _TURNS]
        touches = touch + _single(_touches(tallies))
        here = Succession(1, int(_changes(turns)), int(_changes(touches)))
        found[tuple(actions)] = found.get(tuple(actions), Succession()) + here
        turn, touch = turns[-1:], touches[-1:]
    return found


def shortfalls(
    actions: Sequence[Action], engagement: Engagement, following: Succession | None = None
) -> dict[str, tuple[str, ...]]:
    """What a maneuver lacks for each of the five names, given how it engaged the opponent.

    * *straight push*: forward actions and stops, forward in most; of the actions that touch most are held by both arms;
    * *intermittent impact*: forward and backward, and nothing else but stops; as many press edges as whole performances;
    * *stall turning*: one wheel stalled in more than half of the actions, an arm touching in more than half;
    * *corner-to-edge alignment*: it turns, and in half of the performances both arms touch after one alone did;
    * *alternating twist*: left and right turns by turns, and in half of the performances single arms touch by turns. What was
      performed before in the same bout counts, where it is known: so does a maneuver that turns one way between others that
      turn the other way.

    Args:
        actions: The maneuver's actions.
        engagement: Sums over its performances.
        following: How these went on from what was performed before; None where nobody noted it.

    Returns:
        For each name the parts of its criterion that are not met, in words; none where the name is earned.
    """
    families = [action.family for action in actions]
    stalled = sum((action.spec.left == 0) != (action.spec.right == 0) for action in actions)
    turns = [family for family in families if family in _TURNS]
    performances = engagement.performances
    alternates, twists = _changes(turns), 2 * engagement.twisted >= performances
    if following is not None and following.performances:
        alternates = 2 * following.alternated >= following.performances
        twists = 2 * following.twisted >= following.performances
    parts = {
        STRAIGHT_PUSH: {
            "forward actions and stops only": set(families) <= {Family.FORWARD, Family.STOP},
            "forward in most actions": 2 * families.count(Family.FORWARD) > len(families),
            "held by both arms in most of the actions that touch": 2 * engagement.held_by_both > engagement.touched,
        },
        INTERMITTENT_IMPACT: {
            "forward and backward, and nothing else but stops": _only(families, {Family.FORWARD, Family.BACKWARD}),
            "a press edge for each whole performance": engagement.edges * len(actions) >= engagement.actions,
        },
        STALL_TURNING: {
            "one wheel stalled in most actions": 2 * stalled > len(actions),
            "touching in most actions": 2 * engagement.touched > engagement.actions,
        },
        CORNER_TO_EDGE: {
            "a turn": bool(turns),
            "both arms touch after one alone did, in half of the performances": 2 * engagement.aligned >= performances,
        },
        ALTERNATING_TWIST: {
            "left and right turns by turns": alternates,
            "single arms touch by turns, in half of the performances": twists,
        },
    }
    if not performances:
        return dict.fromkeys(parts, ("a performance",))
    return {name: tuple(part for part, met in criterion.items() if not met) for name, criterion in parts.items()}


def names(actions: Sequence[Action], engagement: Engagement, following: Succession | None = None) -> list[str]:
    """The names that a maneuver has earned (see `shortfalls`); empty when it meets no criterion.

    Args:
        actions: The maneuver's actions.
        engagement: Sums over its performances.
        following: As for `shortfalls`.
    """
    return [name for name, missing in shortfalls(actions, engagement, following).items() if not missing]


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


def _touches(tallies: Sequence[ActionTally]) -> list[Touch]:
    """For each action which of the arms touched."""
    return [(tally.longest_press[0] > 0, tally.longest_press[1] > 0) for tally in tallies]


def _single(touches: Sequence[Touch]) -> list[Touch]:
    """Touches of one arm alone."""
    return [touch for touch in touches if sum(touch) == 1]


def _changes(values: Sequence[object]) -> bool:
    """Two that follow each other differ."""
    return any(first != second for first, second in pairwise(values))


def _only(families: Sequence[Family], wanted: set[Family]) -> bool:
    """All wanted families occur, and nothing else but stops."""
    return wanted <= set(families) <= wanted | {Family.STOP}
