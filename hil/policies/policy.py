"""A policy: a small recurrent network from observations to wheels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from hil.policies.observing import NAMES
from pal_advisor.fields import FieldError, Fields, shown

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

VERSION: Final = 1
"""Of what a file holds."""
FORMAT: Final = "junior-policy"
MOST_HIDDEN: Final = 64
WHEELS: Final = 2
_LARGEST: Final = 1e6
"""No weight is larger."""


class PolicyError(FieldError):
    """A policy can't be what it is said to be: a field is missing, unknown or wrong."""


@dataclass(frozen=True, eq=False)
class Policy:
    """A recurrent network of one hidden layer: h' = tanh(A (x, h, 1)), wheels = tanh(B (h', 1)); h begins a bout at zero.

    Attributes:
        weights: Those of A, row by row, then those of B; shape (Policy.size(hidden),).
        hidden: Numbers of its memory, h.
        opponent: Whom it was trained against.
        note: How it was made, in words.

    Raises:
        PolicyError: There are not as many weights as it takes, or one is no number.
    """

    weights: NDArray[np.float64]
    hidden: int
    opponent: str = ""
    note: str = ""

    def __post_init__(self) -> None:
        if not 1 <= self.hidden <= MOST_HIDDEN:
            raise PolicyError("hidden", f"expected 1 to {MOST_HIDDEN}, not {self.hidden}")
        if self.weights.shape != (self.size(self.hidden),):
            needed = self.size(self.hidden)
            raise PolicyError("weights", f"expected {needed} numbers, which {self.hidden} hidden take, not {self.weights.size}")
        if not (np.abs(self.weights) <= _LARGEST).all():
            raise PolicyError("weights", f"expected numbers within {-_LARGEST:g} and {_LARGEST:g}")

    @staticmethod
    def size(hidden: int) -> int:
        """How many weights it has."""
        return hidden * (len(NAMES) + hidden + 1) + WHEELS * (hidden + 1)

    def begin(self) -> NDArray[np.float64]:
        """Its memory at the beginning of a bout, shape (hidden,)."""
        return np.zeros(self.hidden)

    def act(
        self, observation: NDArray[np.float32], memory: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What to do.

        Args:
            observation: Shape (len(NAMES),).
            memory: What it remembers, shape (hidden,).

        Returns:
            Left and right wheel, share of full speed; and what it remembers now.
        """
        actions, memories = act(self.weights[None], observation[None], memory[None])
        return actions[0], memories[0]

    def to_dict(self) -> dict[str, Any]:
        """As a file holds it: plain values."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "opponent": self.opponent,
            "note": self.note,
            "inputs": list(NAMES),
            "hidden": self.hidden,
            "weights": [float(weight) for weight in self.weights],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Of plain values.

        Args:
            data: As `to_dict` gave it.

        Raises:
            PolicyError: A field is missing, unknown or wrong, or it is of another version.
        """
        fields = Fields(data, error=PolicyError)
        if (form := fields.take("format")) != FORMAT:
            raise fields.wrong("format", f"expected {FORMAT!r}, not {shown(form)}")
        if (version := fields.take("version")) != VERSION:
            raise fields.wrong("version", f"expected {VERSION}, not {shown(version)}: it is of another version of this program")
        opponent, note, inputs = fields.text("opponent"), fields.text("note"), fields.texts("inputs")
        if inputs != NAMES:
            raise fields.wrong("inputs", f"expected those that JUNIOR_SENSORS gives: {', '.join(NAMES)}")
        hidden = fields.integer("hidden", 1, MOST_HIDDEN)
        numbers = fields.elements("weights")
        weights = [numbers.number(name, -_LARGEST, _LARGEST) for name in numbers.names]
        fields.done()
        return cls(np.array(weights), hidden, opponent, note)


def act(
    weights: NDArray[np.float64], observations: NDArray[np.float32], memories: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What several networks do, each in a situation of its own.

    Args:
        weights: Of each, as `Policy` has them; shape (n, size).
        observations: Of each, shape (n, len(NAMES)).
        memories: Of each, shape (n, hidden).

    Returns:
        Left and right wheels, shape (n, 2), share of full speed; and memories, shape (n, hidden).
    """
    count, hidden = memories.shape
    inputs = np.concatenate([observations, memories, np.ones((count, 1))], axis=1)
    split = hidden * inputs.shape[1]
    first = weights[:, :split].reshape(count, hidden, -1)
    second = weights[:, split:].reshape(count, WHEELS, -1)
    memories = np.tanh((first @ inputs[:, :, None])[:, :, 0])
    outputs = np.concatenate([memories, np.ones((count, 1))], axis=1)
    return np.tanh((second @ outputs[:, :, None])[:, :, 0]), memories
