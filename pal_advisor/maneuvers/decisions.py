"""What Pal decides, told so that it can be followed: what is asked for and why, what is credited to which, and a digest.

The digest chains: each covers the one before, the decision, and the state of the source of chance after it. So two runs
whose digests are equal have decided the same up to there, and the first digest that differs is where they part. What is
digested is packed in a fixed layout, little-endian, floats by their bits: the digest is the same on every machine.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import StrEnum
from hashlib import blake2b
from struct import Struct, pack
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    from firmware_protocol.vocabulary import Maneuver
    from pal_advisor.maneuvers.population import Category, Genome

DIGEST_BYTES: Final = 8
START: Final = "0" * (2 * DIGEST_BYTES)
"""The digest before anything was decided."""
GENERATOR_BYTES: Final = 16
"""Each whole number in the state of a generator is digested as this many; PCG64 has numbers of 128 bits."""

_ASKED: Final = Struct(f"<{DIGEST_BYTES}scQBBB?Q")
_TOLD: Final = Struct(f"<{DIGEST_BYTES}scQII")


class Motive(StrEnum):
    """Why a maneuver is asked for."""

    UNTRIED = "untried"
    """A member of the generation of which next to nothing is known."""
    EVIDENCE = "more evidence"
    """One of the better of the generation, to be known as well as its round asks for."""
    BEST = "best known"
    """The best of all maneuvers known in this situation, performed in its share of the learning."""
    AGAIN = "again in this bout"
    """What was performed when the situation came up before in the same bout: it is rated in its own company."""
    EXAM = "exam of the promising"
    """Of the best, the one that may be best of all; where the settings say so, kept for the whole bout."""
    DONE = "generation done"
    """No member is due, and the next generation comes with what Pal is told next: the member performed least."""


class Origin(StrEnum):
    """How a maneuver arose."""

    RANDOM = "random"
    REFINED = "refinement"
    """Every action of a winner of phase 1 replaced by a member of its family."""
    CROSSOVER = "crossover"
    MUTATION = "mutation"
    CROSSED_MUTANT = "crossover and mutation"
    UNKNOWN = "not known"
    """It comes from a state that was saved before origins were kept."""


class Telling(StrEnum):
    """What Pal was told when it credited something."""

    PERFORMED = "performed"
    DISCARDED = "discarded"
    INTERRUPTED = "bout interrupted"


@dataclass(frozen=True)
class Trial:
    """A maneuver to be performed, and what for.

    Attributes:
        id: Number of the trial, from 1.
        category: Situation it is meant for: (previous stimulus or ANY_STIMULUS, current stimulus).
        maneuver: What the robot shall do.
        phase: Phase of learning, 1 or 2.
        exam: One of the last tests of the best, not of a generation.
        generation: GP steps made before in this situation and phase.
        motive: Why this maneuver.
        origin: How it arose in this situation.
        parents: Names of the actions of each maneuver that it descends from.
        tried: How often it was performed before in this situation.
        expected: Fitness that the model expects of it; None without a model.
        error: Standard error of that; None likewise.
        mirrored: It is the mirror image of what is known of the mirror image of the situation.
        digest: Of all decisions up to this one, 16 hexadecimal digits.
    """

    id: int
    category: Category
    maneuver: Maneuver
    phase: int
    exam: bool
    generation: int
    motive: Motive
    origin: Origin
    parents: tuple[str, ...]
    tried: int
    expected: float | None
    error: float | None
    mirrored: bool
    digest: str


@dataclass(frozen=True)
class Credit:
    """What was credited to which trials when Pal was told something.

    Attributes:
        telling: What Pal was told.
        trial: Number of the trial that it was told of; 0 where a bout was interrupted.
        trials: Trials that were credited, oldest first; after a bout won each is there a second time, for what would have
            followed. 0 stands for a trial before a state that kept no numbers.
        credits: What each of them was credited with.
        rated: Trials whose fitness is final now, oldest first.
        fitness: The final fitness of each of them.
        digest: Of all decisions up to this one, 16 hexadecimal digits.
    """

    telling: Telling
    trial: int
    trials: tuple[int, ...]
    credits: tuple[float, ...]
    rated: tuple[int, ...]
    fitness: tuple[float, ...]
    digest: str


@dataclass(frozen=True)
class GenerationRecord:
    """A GP step of one category: a point of its fitness curve.

    Attributes:
        category: (previous stimulus or ANY_STIMULUS, current stimulus).
        phase: Phase of learning, 1 or 2.
        generation: Number of the generation that has just been rated, from 0 in each phase.
        used: Maneuvers performed by then, all categories together.
        evaluations: Performances rated by then in this category.
        best: Highest fitness expected of one of the generation.
        mean: Mean of the fitness expected of each of the generation.
        maneuver: Names of the actions of the best.
    """

    category: Category
    phase: int
    generation: int
    used: int
    evaluations: int
    best: float
    mean: float
    maneuver: str


def asked_digest(
    before: str,
    rng: np.random.Generator,
    *,
    trial: int,
    category: Category,
    genome: Genome,
    phase: int,
    exam: bool,
    generation: int,
    motive: Motive,
) -> str:
    """The digest after a maneuver was asked for.

    Args:
        before: The digest before.
        rng: Source of chance, as it stands then.
        trial: Number of the trial.
        category: Its situation.
        genome: The maneuver, as action codes.
        phase: Phase of learning.
        exam: It is one of the last tests.
        generation: GP steps made before.
        motive: Why this maneuver.
    """
    head = _ASKED.pack(bytes.fromhex(before), b"a", trial, *category, phase, exam, generation)
    return _digest(head, _counted(bytes(genome)), _counted(motive.encode()), generator_bytes(rng))


def told_digest(
    before: str,
    rng: np.random.Generator,
    *,
    telling: Telling,
    trial: int,
    trials: tuple[int, ...],
    credits: tuple[float, ...],  # noqa: A002 - the name of the field
    rated: tuple[int, ...],
    fitness: tuple[float, ...],
) -> str:
    """The digest after Pal was told something.

    Args:
        before: The digest before; after a performance that of the trial.
        rng: Source of chance, as it stands then.
        telling: See `Credit`, as the following.
        trial: Number of the trial.
        trials: Trials credited.
        credits: With what.
        rated: Trials whose fitness is final.
        fitness: Their fitness.
    """
    head = _TOLD.pack(bytes.fromhex(before), b"t", trial, len(trials), len(rated))
    body = pack(f"<{len(trials)}Q{len(credits)}d{len(rated)}Q{len(fitness)}d", *trials, *credits, *rated, *fitness)
    return _digest(head, body, _counted(telling.encode()), generator_bytes(rng))


def state_digest(state: Mapping[str, Any]) -> str:
    """Digest of a whole state, as 16 hexadecimal digits: takes milliseconds.

    Args:
        state: What `Pal.state_dict` gave.
    """
    return _digest(json.dumps(state, sort_keys=True, separators=(",", ":")).encode())


def generator_bytes(rng: np.random.Generator) -> bytes:
    """The state of a source of chance as bytes, the same on every machine.

    Args:
        rng: Any generator of numpy.
    """
    return _flat(rng.bit_generator.state)


def _flat(value: Any) -> bytes:  # noqa: ANN401 - what generators keep: tables of whole numbers, arrays of them, and a name
    if isinstance(value, dict):
        return b"".join([_flat(value[key]) for key in sorted(value)])
    if isinstance(value, int):
        return value.to_bytes(GENERATOR_BYTES, "little")
    if isinstance(value, str):
        return _counted(value.encode())
    array: bytes = value.astype("<u8").tobytes()
    return array


def _counted(data: bytes) -> bytes:
    """A short text or genome that can't be taken for the beginning of another."""
    return bytes((len(data),)) + data


def _digest(*parts: bytes) -> str:
    return blake2b(b"".join(parts), digest_size=DIGEST_BYTES).hexdigest()
