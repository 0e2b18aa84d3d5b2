"""What a swarm's run has to say for its log: its rounds. Moves and observations are there as the messages that they are."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from hil.mcaplog.records import SwarmRoundRecord

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.swarm.rounds import Round


class SwarmLog(ABC):
    """Puts what is told of a run into the entries of a log, which whoever derives from it as from `WireLog` writes.

    Attributes:
        now: Log time of what is told, in s.
    """

    now: float

    @abstractmethod
    def record(self, topic: str, record: object, time: float, kind: type | None = None) -> None:
        """See `WireLog.record`."""

    def round(self, took_place: Round, labels: Sequence[str], order: str, step: int = -1) -> None:
        """A round is over.

        Args:
            took_place: The round.
            labels: What each robot is called, by row: `Swarm.labels`.
            order: What it was for, as `observe rangers`.
            step: Step of the mission, from 0; -1: none.
        """
        missing = took_place.asked & ~took_place.there & ~took_place.turned_down
        entry = SwarmRoundRecord(
            step=step,
            order=order,
            asked=tuple(labels[row] for row in np.flatnonzero(took_place.asked).tolist()),
            missing=tuple(labels[row] for row in np.flatnonzero(missing).tolist()),
            refused=tuple(labels[took_place.addresses.index(address)] for address in took_place.refused),
            reasons=tuple(reason.name.lower() for reason in took_place.refused.values()),
            seconds=took_place.seconds,
        )
        self.record("/swarm/round", entry, self.now)
