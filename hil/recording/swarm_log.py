"""What a swarm's run has to say for its log: its rounds, and what a mission has come to with each of its steps.

Moves and observations are there as the messages that they are.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from hil.mcaplog.records import (
    SurroundConditionRecord,
    SurroundEvaluationRecord,
    SurroundGenerationRecord,
    SurroundStateRecord,
    SwarmRoundRecord,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.swarm.missions.evolving.evolution import Evolution
    from hil.swarm.missions.surround import SurroundState
    from hil.swarm.rounds import Round
    from pal_advisor.surround.search import Generation


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

    def surround_state(self, state: SurroundState) -> None:
        """A step of the surround task is over, or its first is about to begin.

        Args:
            state: How it stands.
        """
        record = SurroundStateRecord(
            seed=state.seed,
            case=state.case,
            area=state.area,
            body=state.body,
            step=state.step,
            steps=state.steps,
            distance=state.distance,
            ranger_distance=state.ranger_distance,
            share_surrounded=state.share_surrounded,
            outside=state.outside,
            ranger_stimuli=state.stimuli[0],
            ranger_behaviours=state.behaviours[0],
            wild_stimuli=state.stimuli[1],
            wild_behaviours=state.behaviours[1],
            ranger_positions=tuple(state.positions[0].ravel().tolist()),
            wild_positions=tuple(state.positions[1].ravel().tolist()),
            tables="" if state.tables is None else json.dumps(state.tables, sort_keys=True),
            measures="" if state.measures is None else json.dumps(state.measures, sort_keys=True),
            digest=state.digest,
        )
        self.record("/surround/state", record, self.now)

    def evaluated(self, evolution: Evolution) -> None:
        """An evaluation has been made for a search, the last one that it has done.

        Args:
            evolution: The search.
        """
        done = evolution.done[-1]
        record = SurroundEvaluationRecord(
            search_seed=evolution.seed,
            number=len(evolution.done),
            generation=done.generation,
            case=str(evolution.case_of(done.evaluation.condition)),
            seed=done.evaluation.seed,
            **vars(done.result),
        )
        self.record("/surround/evaluation", record, self.now)

    def search_generation(self, evolution: Evolution, generation: Generation) -> None:
        """A generation of a search is over.

        Args:
            evolution: The search.
            generation: The generation.
        """
        record = SurroundGenerationRecord(
            search_seed=evolution.seed,
            number=generation.number,
            best=generation.best,
            mean=generation.mean,
            elite=str(evolution.case_of(generation.elite)),
            cases=tuple(str(evolution.case_of(condition)) for condition in generation.conditions),
        )
        self.record("/surround/generation", record, self.now)

    def search_over(self, evolution: Evolution) -> None:
        """A search is over: what the runs with the same seeds say.

        Args:
            evolution: The search.
        """
        for found in evolution.means.values():
            case = str(evolution.case_of(found.condition))
            record = SurroundConditionRecord(evolution.seed, case, found.mean, found.sd, found.n)
            self.record("/surround/condition", record, self.now)
