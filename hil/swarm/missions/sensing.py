"""Whom a robot senses: what its own ring has read, or what the host reckons from where all robots say that they are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from firmware_protocol.vocabulary import MoveOption
from pal_advisor.ring import count_within, readings
from pal_advisor.surround import Results, Sights

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from firmware_protocol.vocabulary import RobotClass
    from hil.swarm.host import SwarmHost
    from hil.swarm.rounds import Round
    from pal_advisor.ring import SensorRing

    Rows = NDArray[np.int64]
    Which = NDArray[np.bool_]


class SightSource(Protocol):
    """Where sights come from.

    Attributes:
        options: Options of every move.
    """

    options: MoveOption

    def to_ask(self, which: Which) -> Which:
        """Who has to be asked, by row, so that some robots are known to see what.

        Args:
            which: Those, by row.
        """
        ...

    def sights(self, found: Round, rows: Rows, kind: RobotClass, there: Which) -> Sights:
        """What robots of a class see of the other.

        Args:
            found: The round in which they were asked.
            rows: Their rows.
            kind: The class.
            there: Whose sights are wanted, shape (rows,).
        """
        ...

    def counts_after(self, found: Round, rows: Rows, kind: RobotClass, sights: Sights) -> tuple[Rows, NDArray[np.float64]]:
        """How many of the other class are, after the moves, within the radius used before.

        Args:
            found: The round in which they moved.
            rows: Their rows.
            kind: The class.
            sights: What they saw before.

        Returns:
            The counts, and the radius that each is of, in m.
        """
        ...


class OwnRings:
    """The robots have rings of sensors."""

    options = MoveOption.STOP_ON_CONTACT | MoveOption.SENSE

    def to_ask(self, which: Which) -> Which:
        """Themselves."""
        return which

    def sights(self, found: Round, rows: Rows, kind: RobotClass, there: Which) -> Sights:
        """What they report; see `SightSource.sights`."""
        other = kind.other
        return Sights(
            there & found.there[rows],
            found.near[rows, other],
            found.seen[rows, other],
            found.count[rows, other],
            found.radius[rows],
        )

    def counts_after(self, found: Round, rows: Rows, kind: RobotClass, sights: Sights) -> tuple[Rows, NDArray[np.float64]]:  # noqa: ARG002 - as `SightSource` has it
        """What they report; see `SightSource.counts_after`."""
        return found.count_before[rows, kind.other], found.radius_before[rows]


class ReckonedRings:
    """The robots know where they are; the host reckons what rings would read.

    Args:
        host: Knows where they all say that they are.
        ring: The ring that is reckoned, in m.
    """

    options = MoveOption.STOP_ON_CONTACT

    def __init__(self, host: SwarmHost, ring: SensorRing) -> None:
        self._host = host
        self._ring = ring
        self._kinds = np.where(host.swarm.kinds < 0, 0, host.swarm.kinds)

    def to_ask(self, which: Which) -> Which:
        """Everybody: whom they see depends on where all are."""
        return self._host.everybody_there if which.any() else which

    def sights(self, found: Round, rows: Rows, kind: RobotClass, there: Which) -> Sights:
        """What rings would read; see `SightSource.sights`."""
        read, other = readings(self._host.poses, self._kinds, self._ring), kind.other
        return Sights(
            there & found.there[rows],
            read.near[rows, other],
            read.seen[rows, other],
            read.count[rows, other],
            read.radius[rows],
        )

    def counts_after(self, found: Round, rows: Rows, kind: RobotClass, sights: Sights) -> tuple[Rows, NDArray[np.float64]]:
        """Who is within the radius now; see `SightSource.counts_after`."""
        radius = np.zeros(len(self._host.poses))
        radius[rows] = sights.radius
        counts = count_within(self._host.poses, self._kinds, radius)
        return counts[rows, kind.other], np.where(found.there[rows], sights.radius, np.nan)


def results_of(found: Round, rows: Rows, counts: tuple[Rows, NDArray[np.float64]]) -> Results:
    """What became of the moves of a class.

    Args:
        found: The round in which they moved.
        rows: Their rows.
        counts: What `SightSource.counts_after` gave.
    """
    return Results(found.outcome[rows], *counts)
