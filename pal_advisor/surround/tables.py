"""Tables of experience as plain values, to be kept in a file that people read and edit; the first wrong field is named."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import fsum
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.fields import MOST, FieldError, Fields, shown
from pal_advisor.surround.experience import INFEASIBLE
from pal_advisor.surround.stimuli import MOST_SECTORS, Stimuli, stimuli_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

TABLES_VERSION: Final = 1
TOLERANCE: Final = 1e-6
"""The weights of a vector may miss the sum of 1 by so much: they are written by people, too."""


class TablesError(FieldError):
    """Tables can't be gone on from: a field is missing, unknown or wrong."""


@dataclass(frozen=True)
class StimulusRecord:
    """What is known of one stimulus.

    Attributes:
        met: How often it was met.
        weights: Weights of B1 to BN; -1 where a behaviour is not feasible (Eq. 6.9).
    """

    met: int
    weights: tuple[float, ...]

    @property
    def best(self) -> tuple[int, ...]:
        """Behaviours of the largest weight, ascending; several where they are equal, none where none is feasible."""
        most = max(self.weights)
        return tuple(index + 1 for index, weight in enumerate(self.weights) if weight == most >= 0.0)


@dataclass(frozen=True)
class Tables:
    """What both classes have learnt.

    Attributes:
        sectors: N.
        case: Name of the case in which it was learnt, for the record; empty where nobody knows.
        rangers: What RANGERs know, by number of the stimulus; what is left out is uniform.
        wilds: What WILDs know, likewise.
    """

    sectors: int
    case: str = ""
    rangers: Mapping[int, StimulusRecord] = field(default_factory=dict)
    wilds: Mapping[int, StimulusRecord] = field(default_factory=dict)

    def of(self, kind: RobotClass) -> Mapping[int, StimulusRecord]:
        """What one class knows.

        Args:
            kind: The class.
        """
        return self.rangers if kind == RobotClass.RANGER else self.wilds

    def to_dict(self) -> dict[str, Any]:
        """Tables as plain values: one entry for each stimulus, with its pattern and what the robots most likely do."""
        stimuli = stimuli_of(self.sectors)
        return {
            "version": TABLES_VERSION,
            "case": self.case,
            "sectors": self.sectors,
            "ranger": [_entry(stimuli, number, vector) for number, vector in sorted(self.rangers.items())],
            "wild": [_entry(stimuli, number, vector) for number, vector in sorted(self.wilds.items())],
        }

    @classmethod
    def from_dict(cls, data: object) -> Tables:
        """The inverse of `to_dict`.

        `case`, `met` and `behaviour` are for people, and may be left out, as may a class.

        Raises:
            TablesError: A field is missing, unknown or wrong; it says which.
        """
        fields = Fields(data, "", TablesError)
        version = fields.take("version")
        if version != TABLES_VERSION or type(version) is not int:
            raise fields.wrong("version", f"{shown(version)} is not known; this program reads {TABLES_VERSION}")
        sectors = fields.integer("sectors", 1, MOST_SECTORS)
        case = fields.text("case") if fields.has("case") else ""
        rangers, wilds = (_read_class(fields, kind, stimuli_of(sectors)) for kind in RobotClass)
        fields.done()
        return cls(sectors, case, rangers, wilds)


def _entry(stimuli: Stimuli, number: int, vector: StimulusRecord) -> dict[str, Any]:
    return {
        "stimulus": number,
        "pattern": stimuli.text(number),
        "met": vector.met,
        "behaviour": behaviour_names(vector.best),
        "weights": list(vector.weights),
    }


def behaviour_names(behaviours: tuple[int, ...]) -> str:
    """Behaviours as the book names them, coupled ones as `B1 x B8`.

    Args:
        behaviours: 1..N.
    """
    return " x ".join(f"B{behaviour}" for behaviour in behaviours)


def _read_class(fields: Fields, kind: RobotClass, stimuli: Stimuli) -> dict[int, StimulusRecord]:
    name = kind.name.lower()
    found: dict[int, StimulusRecord] = {}
    for path, data in fields.items(name) if fields.has(name) else ():
        entry = Fields(data, path, TablesError)
        number = entry.integer("stimulus", 1, len(stimuli))
        if number in found:
            raise entry.wrong("stimulus", f"STIMULUS{number} is there twice")
        pattern = entry.text("pattern")
        if pattern != stimuli.text(number):
            raise entry.wrong("pattern", f"STIMULUS{number} is {stimuli.text(number)}, not {shown(pattern)}")
        met = entry.integer("met") if entry.has("met") else 0
        if entry.has("behaviour"):
            entry.text("behaviour")
        found[number] = StimulusRecord(met, tuple(read_weights(entry, "weights", None, stimuli.sectors).tolist()))
        entry.done()
    return found


def read_weights(fields: Fields, name: str, mask: NDArray[np.bool_] | None, sectors: int | None = None) -> NDArray[np.float64]:
    """A weight vector: what is feasible is a distribution, the rest -1 (Eq. 6.9).

    Args:
        fields: Fields that it is one of.
        name: Which.
        mask: Which behaviours are feasible, shape (N,); None for those that are not -1.
        sectors: N, where there is no mask.

    Raises:
        FieldError: It is none; of the kind that the fields raise.
    """
    count = sectors if mask is None else len(mask)
    items = list(fields.items(name))
    if len(items) != count:
        raise fields.wrong(name, f"expected {count} weights, B1 first, not {len(items)}")
    row = Fields(dict(items), "", type(fields.wrong(name, "")))
    weights = np.array([row.number(path, INFEASIBLE, 1.0) for path, _ in items])
    wanted = weights != INFEASIBLE if mask is None else mask
    for (path, _), weight, feasible in zip(items, weights.tolist(), wanted.tolist(), strict=True):
        if (weight < 0.0) is feasible or (not feasible and weight != INFEASIBLE):
            expected = "0 to 1" if feasible else "-1, for it is not feasible"
            raise row.wrong(path, f"expected a weight, {expected}, not {weight:g}")
    if wanted.any() and abs(fsum(weights[wanted].tolist()) - 1.0) > TOLERANCE:
        raise fields.wrong(name, f"the sum of the weights is {fsum(weights[wanted].tolist()):g}, not 1")
    return weights


def numbers(fields: Fields, name: str, count: int, most: int = MOST) -> NDArray[np.int64]:
    """A list of so many whole numbers, from 0.

    Args:
        fields: Fields that it is one of.
        name: Which.
        count: How many.
        most: None is greater.

    Raises:
        FieldError: It is none; of the kind that the fields raise.
    """
    row = fields.elements(name)
    if len(row.names) != count:
        raise fields.wrong(name, f"expected {count} numbers, not {len(row.names)}")
    return np.array([row.integer(path, 0, most) for path in row.names], dtype=np.int64)
