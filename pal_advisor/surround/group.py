"""One class of robots, which share what they have learnt: it is asked for moves and told what became of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import SwarmOutcome
from pal_advisor.fields import MOST
from pal_advisor.surround.experience import INCREMENTS, Experience
from pal_advisor.surround.rounds import Lesson, Moves
from pal_advisor.surround.selection import NONE, at_random, by_maximum, by_probability
from pal_advisor.surround.settings import GroupSettings, Motion, Sensing
from pal_advisor.surround.stimuli import stimuli_of
from pal_advisor.surround.tables import numbers, read_weights

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pal_advisor.fields import Fields
    from pal_advisor.surround.rounds import Results, Sights

LEARNT_FROM: Final = (SwarmOutcome.ARRIVED, SwarmOutcome.BLOCKED, SwarmOutcome.TIMED_OUT)
"""Moves that end otherwise are not learnt from."""
_ROW_STATE: Final = ("stimulus", "version", "still")


class RobotGroup:
    """One class of robots.

    Args:
        settings: How they sense, move and learn.

    Attributes:
        settings: As given.
        experience: What they have learnt.
        met: How often each stimulus was met, shape (stimuli,).
    """

    def __init__(self, settings: GroupSettings) -> None:
        self.settings = settings
        self.experience = Experience(settings.mask, smoothing=settings.smoothing)
        self._stimuli = stimuli_of(settings.sectors)
        self.met = np.zeros(len(self._stimuli), dtype=np.int64)
        self._select = by_maximum if settings.by_maximum else by_probability
        self._given = np.full(len(self._stimuli) + 1, NONE, dtype=np.int64)
        for stimulus, behaviour in settings.conditional.items():
            self._given[stimulus] = behaviour
        rows = settings.robots
        # How often the weights of each stimulus have changed, and since how many rounds each robot has seen no change.
        self._versions = np.zeros(len(self._stimuli) + 1, dtype=np.int64)
        self._stimulus, self._version, self._still = (np.zeros(rows, dtype=np.int64) for _ in range(3))
        # Moves that are under way.
        self._moves = self._nobody()
        self._frame, self._count = (np.zeros(rows, dtype=np.int64) for _ in range(2))
        self._radius = np.zeros(rows)
        self._redrawn = np.zeros(rows, dtype=np.bool_)

    def _nobody(self) -> Moves:
        rows = self.settings.robots
        stimulus, behaviour, sector = (np.zeros(rows, dtype=np.int64) for _ in range(3))
        return Moves(stimulus, behaviour, sector, np.zeros(rows, dtype=np.bool_))

    def ask(self, sights: Sights, rng: np.random.Generator) -> Moves:
        """The next moves. Moves that were asked for before, and not told of, are forgotten.

        Whoever is there draws one number, in the order of rows, if the class moves at all; whoever is not draws none.

        Args:
            sights: What they see.
            rng: Source of chance.

        Raises:
            ValueError: An array has another shape than the class, or a pattern more sectors.
        """
        self._check(sights)
        pattern, frame = self._patterns(sights)
        stimulus = np.where(sights.there, self._stimuli.number[pattern], 0)
        np.add.at(self.met, stimulus[sights.there] - 1, 1)
        behaviour = np.zeros_like(stimulus)
        mutated = np.zeros_like(sights.there)
        if self.settings.motion != Motion.STATIONARY and self.settings.mask.any():
            mutated = self._stuck(stimulus, sights.there)
            rows = np.flatnonzero(sights.there)
            behaviour[rows] = self._chosen(stimulus[rows], mutated[rows], rng.random(len(rows)))
        self._frame, self._count, self._radius = frame, sights.count.copy(), sights.radius.copy()
        self._redrawn = np.zeros_like(sights.there)
        self._moves = Moves(stimulus, behaviour, self._sectors(behaviour), mutated)
        return self._moves

    def _check(self, sights: Sights) -> None:
        rows = (self.settings.robots,)
        for name in ("there", "near", "seen", "count", "radius"):
            if getattr(sights, name).shape != rows:
                raise ValueError(f"{name} has shape {getattr(sights, name).shape}; there are {rows[0]} robots of the class")
        patterns = (sights.near | sights.seen)[sights.there]
        if ((patterns < 0) | (patterns >> self.settings.sectors > 0)).any():
            raise ValueError(f"a pattern of {self.settings.sectors} sectors has no more bits")

    def _patterns(self, sights: Sights) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The patterns that make the stimuli, and those that give the canonical frames."""
        near, seen = (np.where(sights.there, pattern, 0) for pattern in (sights.near, sights.seen))
        match self.settings.sensing:
            case Sensing.HYBRID:
                return near, np.where(near > 0, near, seen)
            case Sensing.ADJUSTABLE:
                return seen, seen
            case Sensing.FIXED:
                return near, near

    def _stuck(self, stimulus: NDArray[np.int64], there: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Who is to perform a random behaviour (rule RC1, Eq. 7.8)."""
        if not self.settings.mutate_after:
            return np.zeros_like(there)
        version = self._versions[stimulus]
        unchanged = (stimulus == self._stimulus) & (version == self._version)
        self._still = np.where(there, np.where(unchanged, self._still + 1, 0), self._still)
        self._stimulus = np.where(there, stimulus, self._stimulus)
        self._version = np.where(there, version, self._version)
        stuck = there & (self._still >= self.settings.mutate_after)
        self._still[stuck] = 0
        return stuck

    def _chosen(self, stimulus: NDArray[np.int64], mutated: NDArray[np.bool_], draws: NDArray[np.float64]) -> NDArray[np.int64]:
        """Behaviours of robots that are there, by the motion mechanism (6.1.7)."""
        weights = self.experience.weights[stimulus - 1]
        if self.settings.motion == Motion.RANDOM:
            return at_random(weights, draws)
        selected = self._select(weights, draws)
        given = self._given[stimulus]
        return np.where(mutated, at_random(weights, draws), np.where(given > NONE, given, selected))

    def _sectors(self, behaviour: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.where(behaviour > NONE, self._stimuli.to_sector(self._frame, behaviour), 0)

    def redraw(self, refused: NDArray[np.bool_], rng: np.random.Generator) -> Moves:
        """Other moves for those that were refused: drawn among the rest, as if what was refused were not feasible.

        Only once: who is refused again stays, and learns nothing; so does who can do nothing else.

        Args:
            refused: Whose move was refused, shape (robots,).
            rng: Source of chance; whoever gets another move draws one number.

        Returns:
            What all now do; those who were refused have sector 0 where they stay.
        """
        refused = refused & (self._moves.behaviour > NONE)
        rows = np.flatnonzero(refused & ~self._redrawn & (np.count_nonzero(self.settings.mask) > 1))
        behaviour = np.where(refused, NONE, self._moves.behaviour)
        mutated = self._moves.mutated & ~refused
        if len(rows):
            weights = self.experience.weights[self._moves.stimulus[rows] - 1]
            weights[np.arange(len(rows)), self._moves.behaviour[rows] - 1] = -1.0
            select = at_random if self.settings.motion == Motion.RANDOM else self._select
            draws = rng.random(len(rows))
            again = self._moves.mutated[rows]
            behaviour[rows] = np.where(again, at_random(weights, draws), select(weights, draws))
            mutated[rows] = again
        self._redrawn = self._redrawn | refused
        self._moves = Moves(self._moves.stimulus, behaviour, self._sectors(behaviour), mutated)
        return self._moves

    def tell(self, results: Results) -> Lesson:
        """Take in what became of the moves, one robot after the other in the order of rows (Eq. 6.12).

        Learnt from are moves that arrived, were blocked or timed out, and whose count is of the radius that was decided by.

        Args:
            results: What became of them.

        Raises:
            ValueError: An array has another shape than the class.
        """
        for name in ("outcome", "count_before", "radius_before"):
            if getattr(results, name).shape != (self.settings.robots,):
                raise ValueError(f"{name} has shape {getattr(results, name).shape}, the class {self.settings.robots} robots")
        learnt = np.isin(results.outcome, LEARNT_FROM) & (self._moves.behaviour > NONE)
        learnt &= results.radius_before == self._radius
        if not self.settings.learns:
            learnt[:] = False
        change = self.settings.sign * (results.count_before - self._count)
        delta = np.where(learnt, INCREMENTS[self.settings.increment](change, self.settings.gain), 0.0)
        rows = np.flatnonzero(learnt)
        changed = self.experience.learn(self._moves.stimulus[rows], self._moves.behaviour[rows], delta[rows])
        self._versions[changed] += 1
        self._moves = self._nobody()
        return Lesson(learnt, delta, changed)

    def to_dict(self) -> dict[str, Any]:
        """State as plain values; moves that are under way are no part of it."""
        return {
            "settings": self.settings.to_dict(),
            "weights": self.experience.weights.tolist(),
            "met": self.met.tolist(),
            "versions": self._versions[1:].tolist(),
            **{name: getattr(self, f"_{name}").tolist() for name in _ROW_STATE},
        }

    @classmethod
    def from_fields(cls, fields: Fields) -> RobotGroup:
        """The inverse of `to_dict`.

        Args:
            fields: What it gave.

        Raises:
            FieldError: A field is missing, unknown or wrong; of the kind that the fields raise.
        """
        group = cls(GroupSettings.from_fields(fields.table("settings")))
        stimuli, rows = len(group.met), group.settings.robots
        weights = fields.elements("weights")
        if len(weights.names) != stimuli:
            raise fields.wrong("weights", f"expected {stimuli} lists, not {len(weights.names)}")
        for index, path in enumerate(weights.names):
            group.experience.weights[index] = read_weights(weights, path, group.settings.mask)
        group.met[:] = numbers(fields, "met", stimuli, MOST)
        group._versions[1:] = numbers(fields, "versions", stimuli, MOST)
        group._stimulus[:] = numbers(fields, "stimulus", rows, stimuli)
        group._version[:] = numbers(fields, "version", rows, MOST)
        group._still[:] = numbers(fields, "still", rows, MOST)
        fields.done()
        return group
