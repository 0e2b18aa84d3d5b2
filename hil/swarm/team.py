"""Who plays in a mission that needs fewer robots than there are; others are spares, and take the place of who is missing."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from firmware_protocol.vocabulary import RobotClass


class Substitution(NamedTuple):
    """A spare has taken somebody's place.

    Attributes:
        place: The place.
        before: Row of who had it.
        after: Row of who has it.
    """

    place: int
    before: int
    after: int


class Team:
    """Places of a mission, and the robots that have them: the lowest rows of each class at first.

    Args:
        kinds: Class of each robot, by row.
        needed: How many places there are for each class; in this order.

    Attributes:
        rows: Row of the robot that has each place, shape (places,).

    Raises:
        ValueError: There are fewer robots of a class than places.
    """

    def __init__(self, kinds: NDArray[np.int64], needed: Mapping[RobotClass, int]) -> None:
        self._kinds = kinds
        parts = []
        for kind, count in needed.items():
            rows = np.flatnonzero(kinds == kind)
            if len(rows) < count:
                raise ValueError(f"{count} {kind.name}s are needed, and there are {len(rows)}")
            parts.append(rows[:count])
        self.rows = np.concatenate(parts) if parts else np.zeros(0, np.int64)

    def substitute(self, there: NDArray[np.bool_]) -> list[Substitution]:
        """Give the places of who is missing to spares of the same class, the lowest rows first.

        Args:
            there: Who is there, by row.

        Returns:
            What has changed. Who comes back is a spare from then on; a place that no spare is there for stays as it is.
        """
        free = there.copy()
        free[self.rows] = False
        found = []
        for place, row in enumerate(self.rows.tolist()):
            if there[row]:
                continue
            spares = np.flatnonzero(free & (self._kinds == self._kinds[row]))
            if spares.size:
                after = int(spares[0])
                free[after] = False
                self.rows[place] = after
                found.append(Substitution(place, row, after))
        return found
