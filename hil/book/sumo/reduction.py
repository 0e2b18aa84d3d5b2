"""What is kept of coaching runs: one list a column, one value a seed, and the fitness curves."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import ANY_STIMULUS, Action, ActionTally
from hil.book.sumo.methods import Cell
from pal_advisor.maneuvers.names import (
    ALTERNATING_TWIST,
    CORNER_TO_EDGE,
    INTERMITTENT_IMPACT,
    STALL_TURNING,
    STRAIGHT_PUSH,
    Engagement,
    Succession,
    shortfalls,
    succession,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

Plain = dict[str, Any]

MODES: Final = {"none": 0, "left": 1, "right": 2, "both": 3}
"""Sensing modes: what the eyes see, as the bits of a stimulus."""
SIGHTED: Final = ("left", "right", "both")
"""Those that the book has curves of."""
SINGLE: Final = (MODES["left"], MODES["right"])
NAMES: Final = (STRAIGHT_PUSH, INTERMITTENT_IMPACT, STALL_TURNING, CORNER_TO_EDGE, ALTERNATING_TWIST)
NEAR: Final = 0.1
"""A curve that stays within this share of its last value has settled."""
SMOOTH: Final = 3
"""Steps over which a curve is averaged before it is asked whether it has settled."""
OFTEN: Final = 0.1
"""Share of what is performed with the opponent in sight from which on a maneuver is one of those that the play consists of."""
DIGITS: Final = 3


def learning(row: Plain) -> list[list[Any]]:
    """Performances while learning, the exam left out: previous eyes, eyes, rating by Eq. 10.1.

    Args:
        row: What happened in a cell.
    """
    settings = Cell(**row["cell"]).settings
    found: list[list[Any]] = row["learning"]
    return found[: settings.budget - round(settings.exam_share * settings.budget)]


def mean_curve(row: Plain, mode: int) -> list[float]:
    """Mean rating of each step's worth of performances: as many as a population has maneuvers.

    Args:
        row: What happened in a cell.
        mode: What the eyes see.
    """
    size = Cell(**row["cell"]).settings.population
    ratings = [rating for _, eyes, rating in learning(row) if eyes == mode]
    return [float(np.mean(ratings[at : at + size])) for at in range(0, len(ratings) - size + 1, size)]


def best_curve(row: Plain, mode: int) -> list[float | None]:
    """Best fitness after each step's worth of performances.

    It is what the best of the latest generation is expected to be worth. Where a mode has several situations (phase 2 tells
    them apart by what was seen before) it is the mean over those that have had a GP step in this phase, by how often each
    came up.

    Args:
        row: What happened in a cell.
        mode: What the eyes see.

    Returns:
        A value for each step; None before the first GP step.
    """
    settings = Cell(**row["cell"]).settings
    steps: dict[int, list[tuple[int, int, float]]] = {}
    for previous, current, phase, used, best, _ in row["steps"]:
        if current == mode:
            steps.setdefault(used, []).append((previous, phase, best))
    found: list[float | None] = []
    came: Counter[int] = Counter()
    latest: dict[int, float] = {}
    phase, performed = 0, 0
    value: float | None = None
    for used, (previous, eyes, _) in enumerate(learning(row), start=1):
        now = 1 if settings.phases == "multi" and used <= settings.phase_share * len(learning(row)) else 2
        if now != phase:
            phase, came, latest = now, Counter(), {}
        if eyes == mode:
            came[previous if settings.pairs and phase == 2 else ANY_STIMULUS] += 1
            performed += 1
        for of, in_phase, best in steps.get(used, ()):
            if in_phase == phase:
                latest[of] = best
        if latest and sum(came[of] for of in latest):
            value = float(np.average(list(latest.values()), weights=[came[of] for of in latest]))
        if eyes == mode and performed % settings.population == 0:
            found.append(value)
    return found


def settled(curve: Sequence[float]) -> int | None:
    """The step from which on a curve stays near its last value, from 1; None where there are too few.

    Args:
        curve: A value for each step.
    """
    if len(curve) < SMOOTH:
        return None
    smooth = np.convolve(curve, np.full(SMOOTH, 1.0 / SMOOTH), mode="valid")
    far = np.flatnonzero(np.abs(smooth - smooth[-1]) > NEAR * abs(smooth[-1]))
    return int(far[-1]) + 2 if len(far) else 1


def tallies_of(marks: Sequence[Sequence[int]]) -> list[ActionTally]:
    """What a robot counted, from what is kept of it.

    Args:
        marks: For each action: samples, eyes, edges, and longest presses in ms; of both sides each.
    """
    return [
        ActionTally(samples, (left, right), (edges, others), (press / 1000.0, other / 1000.0), None)
        for samples, left, right, edges, others, press, other in marks
    ]


class Play:
    """What an advice did in held-out bouts.

    Args:
        bouts: Of each bout what was performed: eyes, maneuver, marks, rating.
    """

    def __init__(self, bouts: Sequence[Sequence[Sequence[Any]]]) -> None:
        self._bouts = [
            [(eyes, _actions(spelled), tallies_of(marks), rating) for eyes, spelled, marks, rating in bout] for bout in bouts
        ]
        self._engaged: dict[tuple[int, tuple[Action, ...]], Engagement] = {}
        following: dict[tuple[Action, ...], Succession] = {}
        for bout in self._bouts:
            for eyes, actions, tallies, _ in bout:
                key = eyes, actions
                self._engaged[key] = self._engaged.get(key, Engagement()) + Engagement.of(tallies)
            for actions, sums in succession([(actions, tallies) for _, actions, tallies, _ in bout]).items():
                following[actions] = following.get(actions, Succession()) + sums
        self._following = following

    def rating(self, modes: Sequence[int]) -> float | None:
        """Mean rating by Eq. 10.1 of what is performed in some modes; None where they never come up.

        Args:
            modes: What the eyes see.
        """
        ratings = [rating for bout in self._bouts for eyes, _, _, rating in bout if eyes in modes]
        return float(np.mean(ratings)) if ratings else None

    def share(self, mode: int) -> float:
        """Share of the performances that begin in a mode.

        Args:
            mode: What the eyes see.
        """
        return float(np.mean([eyes == mode for bout in self._bouts for eyes, *_ in bout]))

    def transitions(self) -> float:
        """How often in a bout a single eye's seeing becomes both eyes'."""
        both = MODES["both"]
        return float(np.mean([sum(a[0] in SINGLE and b[0] == both for a, b in pairwise(bout)) for bout in self._bouts]))

    def often(self) -> list[tuple[int, tuple[Action, ...]]]:
        """The maneuvers that the play consists of, where the opponent is in sight: with the eyes, most performed first."""
        sighted = {key: one.performances for key, one in self._engaged.items() if key[0]}
        all_ = sum(sighted.values())
        return sorted((key for key, count in sighted.items() if count >= OFTEN * all_), key=lambda key: -sighted[key])

    def lacks(self, name: str) -> tuple[str, ...]:
        """What those maneuvers lack for a name: of the one that comes nearest; nothing where one has earned it.

        Args:
            name: The name.
        """
        each = [shortfalls(key[1], self._engaged[key], self._following[key[1]])[name] for key in self.often()]
        return min(each, key=len, default=("the opponent in sight",))


def reduced(rows: Sequence[Plain]) -> Plain:
    """What is kept of the cells of one method and opponent.

    Args:
        rows: What happened in each, by seed.

    Returns:
        `settings`, `columns` (one value a seed), `winners` (of each seed the maneuvers that the play consists of, their
        names, and what is lacking for each of the five), and `curves` (of each mode and seed).
    """
    plays = [Play(row["play"]) for row in rows]
    columns: Plain = {
        "seed": [row["cell"]["seed"] for row in rows],
        "wins": [row["wins"] for row in rows],
        "bouts": [len(row["play"]) for row in rows],
        "losses": [row["losses"] for row in rows],
        "time": [row["time"] for row in rows],
        "late": [_rounded(_late(row)) for row in rows],
        "transitions": [_rounded(play.transitions()) for play in plays],
        "rating": [_rounded(play.rating(tuple(MODES.values()))) for play in plays],
        "rating_single": [_rounded(play.rating(SINGLE)) for play in plays],
    }
    for name, mode in MODES.items():
        curves = [mean_curve(row, mode) for row in rows]
        columns[f"length_{name}"] = [_length(row, mode) for row in rows]
        columns[f"steps_{name}"] = [sum(step[1] == mode for step in row["steps"]) for row in rows]
        columns[f"settled_{name}"] = [settled(curve) for curve in curves]
        columns[f"rating_{name}"] = [_rounded(play.rating((mode,))) for play in plays]
        columns[f"share_{name}"] = [_rounded(play.share(mode)) for play in plays]
        columns[f"last_{name}"] = [_rounded(_fifth(row, mode, 4)) for row in rows]
        columns[f"before_{name}"] = [_rounded(_fifth(row, mode, 3)) for row in rows]
    lacking = {name: [play.lacks(name) for play in plays] for name in NAMES}
    return {
        "settings": Cell(**rows[0]["cell"]).settings.to_saved(),
        "columns": columns,
        "winners": [
            [f"{_label(eyes)}: {' '.join(action.name for action in actions)}" for eyes, actions in play.often()]
            for play in plays
        ],
        "lacking": {name: [list(parts) for parts in each] for name, each in lacking.items()},
        "curves": {
            name: [[_rounded(value) for value in best_curve(row, mode)] for row in rows] for name, mode in MODES.items()
        },
    }


def _length(row: Plain, mode: int) -> float:
    """Length of a curve while learning, in steps."""
    return float(sum(eyes == mode for _, eyes, _ in learning(row)) / Cell(**row["cell"]).settings.population)


def _late(row: Plain) -> float:
    """Mean rating in the last quarter of learning."""
    ratings = [rating for *_, rating in learning(row)]
    return float(np.mean(ratings[-len(ratings) // 4 :]))


def _fifth(row: Plain, mode: int, number: int) -> float | None:
    """Mean rating in a fifth of what was performed in a mode while learning; 4 is the last."""
    ratings = [rating for _, eyes, rating in learning(row) if eyes == mode]
    part = ratings[len(ratings) * number // 5 : len(ratings) * (number + 1) // 5]
    return float(np.mean(part)) if part else None


def _actions(spelled: str) -> tuple[Action, ...]:
    return tuple(Action[name] for name in spelled.split())


def _label(eyes: int) -> str:
    return next(name for name, mode in MODES.items() if mode == eyes)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, DIGITS)
