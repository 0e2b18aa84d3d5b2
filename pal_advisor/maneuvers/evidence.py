"""What performances tell of maneuvers, pooled by what was really performed.

A performance that was cut short after two actions (the border, the end of the bout, a changed stimulus) is a performance
of every maneuver that begins with these two. So performances are kept in a tree of performed beginnings, and a maneuver is
estimated along its own path, each level leaning on the one above in proportion to how little it has been tried.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.vocabulary import ACTIONS, MAX_ACTIONS, Action
from pal_advisor.fields import HUGE, MOST, FieldError, Fields, shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

LEAN: Final = 2.0
"""A beginning leans on the mean of its parent as if that were this many performances."""
UNKNOWN: Final = 0.1
"""Evidence of what was never performed: little, but not nothing, so that what hardly ever matters hardly matters."""
ENOUGH: Final = 5
"""Repetitions needed to tell the spread of repetitions from that of all performances."""
LEAST_SPREAD: Final = 1e-6
SUM: Final = HUGE * MOST
"""No sum of fitness is greater, and below no sum of squares."""
SQUARES: Final = HUGE * HUGE * MOST

_MOTIONS = {(spec.speed, spec.left, spec.right): action for action, spec in ACTIONS.items()}
SAME_MOTION: Final = tuple(int(_MOTIONS[spec.speed, spec.left, spec.right]) for spec in (ACTIONS[action] for action in Action))
"""For every action code, the code of the last action that turns the wheels in the same way: F and MF are one motion."""


@dataclass(frozen=True)
class Estimate:
    """What is known of a maneuver.

    Attributes:
        value: Expected fitness.
        error: Standard error of it.
        evidence: Performances that this knowledge is worth.
    """

    value: float
    error: float
    evidence: float


@dataclass(frozen=True)
class OwnMean:
    """What a maneuver's own performances gave, nothing foretold and nothing leant on.

    Attributes:
        count: Performances that have been rated, at least one.
        mean: Their mean fitness.
        error: Standard error of it.
    """

    count: int
    mean: float
    error: float


@dataclass
class _Node:
    """Performances that began in one way.

    Attributes:
        ended: How many ended here.
        total: Sum of their fitness.
        squares: Sum of the squares of their fitness.
        gone_on: How many went on to a further action.
        sum_all: Sum of the fitness of all of them.
    """

    ended: int = 0
    total: float = 0.0
    squares: float = 0.0
    gone_on: int = 0
    sum_all: float = 0.0


class Evidence:
    """All performances in one situation."""

    def __init__(self) -> None:
        self.count = 0
        self._total = 0.0
        self._squares = 0.0
        self._nodes: dict[tuple[int, ...], _Node] = {}

    def add(self, performed: Sequence[int], fitness: float) -> None:
        """Take in a performance.

        Args:
            performed: Codes of the actions begun, at least one.
            fitness: How well it did.
        """
        path = path_of(performed)
        self.count += 1
        self._total += fitness
        self._squares += fitness * fitness
        for depth in range(1, len(path) + 1):
            node = self._nodes.setdefault(path[:depth], _Node())
            node.sum_all += fitness
            if depth < len(path):
                node.gone_on += 1
            else:
                node.ended += 1
                node.total += fitness
                node.squares += fitness * fitness

    def estimates(self, genomes: Iterable[Sequence[int]]) -> list[Estimate]:
        """What is known of each of some maneuvers.

        Args:
            genomes: Codes of their actions.
        """
        mean = self._total / self.count if self.count else 0.0
        variance = max(self._spread(), LEAST_SPREAD) ** 2
        found = []
        for genome in genomes:
            path = path_of(genome)
            value, doubt = self._descend(path, 1, mean, variance)
            found.append(Estimate(value, math.sqrt(doubt), self._evidence(path, 1)))
        return found

    def of(self, genome: Sequence[int]) -> float:
        """Performances that the knowledge of a maneuver is worth.

        Args:
            genome: Codes of its actions.
        """
        return self._evidence(path_of(genome), 1)

    def own_mean(self, genome: Sequence[int]) -> OwnMean | None:
        """What came of what turned the wheels like a maneuver, to its end; None where nothing did.

        Args:
            genome: Codes of its actions.
        """
        node = self._nodes.get(path_of(genome))
        if node is None or not node.ended:
            return None
        return OwnMean(node.ended, node.total / node.ended, max(self._spread(), LEAST_SPREAD) / math.sqrt(node.ended))

    def _spread(self) -> float:
        """Standard deviation between performances of the same actions."""
        if not self.count:
            return 0.0
        repeated = [node for node in self._nodes.values() if node.ended > 1]
        freedom = sum(node.ended - 1 for node in repeated)
        if freedom >= ENOUGH:
            return math.sqrt(max(0.0, sum(node.squares - node.total**2 / node.ended for node in repeated)) / freedom)
        return math.sqrt(max(0.0, self._squares / self.count - (self._total / self.count) ** 2))

    def _descend(self, path: tuple[int, ...], depth: int, prior: float, variance: float) -> tuple[float, float]:
        """Expected fitness, and the variance of this expectation, of what begins like the path.

        Args:
            path: A whole maneuver.
            depth: How many of its actions the beginning has.
            prior: Mean fitness of what its parent did.
            variance: Of a single performance.
        """
        node = self._nodes.get(path[:depth])
        if node is None:
            return prior, variance / LEAN
        weight = node.ended + node.gone_on + LEAN
        if not node.gone_on or depth == len(path):
            weight = node.ended + LEAN
            return (node.total + LEAN * prior) / weight, variance / weight
        mean = (node.sum_all + LEAN * prior) / weight
        value, doubt = self._descend(path, depth + 1, mean, variance)
        return (
            (node.total + node.gone_on * value + LEAN * prior) / weight,
            ((node.ended + LEAN) * variance + node.gone_on**2 * doubt) / weight**2,
        )

    def _evidence(self, path: tuple[int, ...], depth: int) -> float:
        """Performances that the knowledge of what begins like the path is worth, the leaning left aside.

        Where some ended at the beginning and others went on, the variance of the mean is (E + M^2 / e) / (E + M)^2 of that
        of a single performance, e being the evidence of how it goes on; this is its inverse.
        """
        node = self._nodes.get(path[:depth])
        if node is None:
            return UNKNOWN
        if not node.gone_on or depth == len(path):
            return node.ended or UNKNOWN
        further = self._evidence(path, depth + 1)
        return float((node.ended + node.gone_on) ** 2 / (node.ended + node.gone_on**2 / further))

    def to_list(self) -> list[Any]:
        """State as plain values."""
        nodes = [[list(path), n.ended, n.total, n.squares, n.gone_on, n.sum_all] for path, n in self._nodes.items()]
        return [self.count, self._total, self._squares, nodes]

    @classmethod
    def from_list(
        cls, data: object, path: str = "evidence", error: type[FieldError] = FieldError, actions: int = MAX_ACTIONS
    ) -> Evidence:
        """The inverse of `to_list`.

        Args:
            data: Plain values.
            path: What they are within the whole.
            error: The error of a field.
            actions: Actions a maneuver has.

        Raises:
            FieldError: A field is missing or wrong; of the kind given.
        """
        fields = Fields.row(data, ("count", "total", "squares", "nodes"), path, error)
        evidence = cls()
        evidence.count = fields.integer("count")
        evidence._total, evidence._squares = fields.number("total", -SUM, SUM), fields.number("squares", 0.0, SQUARES)
        for at, item in fields.items("nodes"):
            node = Fields.row(item, ("path", "ended", "total", "squares", "gone_on", "sum_all"), at, error)
            codes = read_codes(node, "path", 1, actions)
            if codes != path_of(codes):
                raise node.wrong("path", f"no motion has these codes: {list(codes)}")
            evidence._nodes[codes] = _Node(
                ended=node.integer("ended"),
                total=node.number("total", -SUM, SUM),
                squares=node.number("squares", 0.0, SQUARES),
                gone_on=node.integer("gone_on"),
                sum_all=node.number("sum_all", -SUM, SUM),
            )
        return evidence


def read_codes(fields: Fields, name: str, least: int, most: int) -> tuple[int, ...]:
    """Action codes from a list.

    Args:
        fields: The table that they are a field of.
        name: The field.
        least: How many there are at least.
        most: How many at most.

    Raises:
        FieldError: They are no such list; of the fields' kind.
    """
    codes = fields.take(name)
    if not isinstance(codes, list) or not least <= len(codes) <= most:
        count = f"{least}" if least == most else f"{least} to {most}"
        raise fields.wrong(name, f"expected a list of {count} action codes, not {shown(codes)}")
    for index, code in enumerate(codes):
        if type(code) is not int or not 0 <= code < len(SAME_MOTION):
            raise fields.wrong(f"{name}[{index}]", f"expected an action code, 0 to {len(SAME_MOTION) - 1}, not {shown(code)}")
    return tuple(codes)


def path_of(codes: Sequence[int]) -> tuple[int, ...]:
    """Actions by their motion: codes of the actions that stand for it.

    Args:
        codes: Codes of the actions.
    """
    return tuple([SAME_MOTION[code] for code in codes])
