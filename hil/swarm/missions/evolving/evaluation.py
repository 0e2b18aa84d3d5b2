"""An evaluation: a run of the surround task on an emulated table of its own, of which the fitness is wanted.

What comes out is a function of the task alone, whichever process or machine does it, and when.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from firmware_protocol.errors import HilError
from hil.swarm.missions.surround_run import play
from hil.working import WorkerError

if TYPE_CHECKING:
    from hil.swarm.missions.surround_settings import SurroundSettings
    from pal_advisor.surround import Case
    from pal_advisor.surround.measures import Fitness


@dataclass(frozen=True)
class EvaluationTask:
    """A run that is wanted.

    Attributes:
        settings: How it goes.
        case: Its conditions.
        seed: Its seed.
    """

    settings: SurroundSettings
    case: Case
    seed: int


@dataclass(frozen=True)
class EvaluationResult:
    """What came of it.

    Attributes:
        contact: Fitness CONTACT (Eq. 9.3); None where it can't be told, as that of a run without a step.
        surround: Fitness SURROUND (Eq. 9.5), likewise.
        chase: Fitness CHASE (Eq. 9.7), likewise.
        focus: Fitness FOCUS (Eq. 9.8), likewise.
        distance: Mean distance from a RANGER to the nearest WILD at the end, in the book's units; None where there is none.
        share_surrounded: Share of WILDs surrounded at the end; None where there is none.
        seconds: Robot time that it took, in s.
    """

    contact: float | None
    surround: float | None
    chase: float | None
    focus: float | None
    distance: float | None
    share_surrounded: float | None
    seconds: float

    def score(self, fitness: Fitness) -> float:
        """The fitness as a search takes it: what can't be told is worth nothing.

        Args:
            fitness: Which.
        """
        value: float | None = getattr(self, fitness.value)
        return value or 0.0


def evaluate(task: EvaluationTask) -> EvaluationResult:
    """Play a run, and see how fit the group was.

    Args:
        task: The run.

    Raises:
        WorkerError: It could not be played; in words, since it is told in another process.
    """
    try:
        states, outcome = play(task.settings, task.case, task.seed)
    except (HilError, OSError) as error:
        raise WorkerError(f"{task.case} with seed {task.seed} could not be played: {error}") from error
    last = states[-1]
    values = {fitness.value: value for fitness, value in outcome.history.fitness.values.items()}
    return EvaluationResult(
        **values, distance=last.distance, share_surrounded=last.share_surrounded, seconds=outcome.history.seconds
    )
