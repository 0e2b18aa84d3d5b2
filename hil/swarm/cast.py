"""Who plays in a mission: the robots with the lowest addresses, and those that stand by for them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from firmware_protocol.errors import HilError
from firmware_protocol.vocabulary import RobotClass

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray


class CastError(HilError):
    """A mission asks for robots that are not there; the text says who is."""


@dataclass(frozen=True)
class Cast:
    """Who plays.

    Attributes:
        players: Rows of the robots that play, by class, lowest first: a robot's place here is its row at the adviser.
        spares: Rows of those that stand by, by class, lowest first.
    """

    players: Mapping[RobotClass, NDArray[np.int64]]
    spares: Mapping[RobotClass, NDArray[np.int64]]

    def count(self, kind: RobotClass) -> int:
        """How many of a class play.

        Args:
            kind: The class.
        """
        return len(self.players[kind])


def cast(kinds: NDArray[np.int64], wanted: Mapping[RobotClass, int], *, spares: bool) -> Cast:
    """Choose who plays.

    Args:
        kinds: Class of each robot, by row; -1: it has none.
        wanted: How many of a class are to play; of one that is left out, all that are there.
        spares: Those that are left over stand by; else they are left alone.

    Raises:
        CastError: There are not so many.
    """
    rows = {kind: np.flatnonzero(kinds == kind) for kind in RobotClass}
    if any(count > len(rows[kind]) for kind, count in wanted.items()):
        asked = " and ".join(f"{count} {kind.name}{'' if count == 1 else 's'}" for kind, count in wanted.items())
        there = " and ".join(f"{len(rows[kind])} {kind.name}{'' if len(rows[kind]) == 1 else 's'}" for kind in RobotClass)
        silent = int((kinds < 0).sum())
        more = f", and {silent} that have not said their class" if silent else ""
        raise CastError(
            f"the mission asks for {asked}; there are {there}{more}. Leave the number out to take who is there, or set the "
            "class of more robots (hil param LINK CLASS 0 or 1)"
        )
    counts = {kind: wanted.get(kind, len(rows[kind])) for kind in RobotClass}
    return Cast(
        {kind: rows[kind][: counts[kind]] for kind in RobotClass},
        {kind: rows[kind][counts[kind] :] if spares else rows[kind][:0] for kind in RobotClass},
    )
