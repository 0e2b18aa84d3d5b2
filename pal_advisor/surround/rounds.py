"""What a class of robots reports, is told to do, and what became of it: arrays with a row for each robot.

A robot's row is fixed by its address for the whole run. The other class is the one that a class looks out for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Sights:
    """What the robots of one class see of the other before they move. Rows of who is not there are not looked at.

    Attributes:
        there: Who takes part in the round, shape (robots,).
        near: Sectors in which somebody is within R0, sector 1 the most significant of N bits, same shape.
        seen: Sectors in which somebody is within the radius now used, same shape.
        count: How many are within that radius, same shape.
        radius: That radius, same shape; in any unit, for it is only compared with `Results.radius_before`.
    """

    there: NDArray[np.bool_]
    near: NDArray[np.int64]
    seen: NDArray[np.int64]
    count: NDArray[np.int64]
    radius: NDArray[np.float64]


@dataclass(frozen=True)
class Moves:
    """What the robots of one class shall do.

    Attributes:
        stimulus: Number of the stimulus each meets, shape (robots,); 0 for who is not there.
        behaviour: Behaviour 1..N each performs, same shape; 0 for who stays.
        sector: Sector 1..N of its body along whose bisector each moves, same shape; 0 for who stays.
        mutated: The behaviour is a random one (rule RC1), same shape.
    """

    stimulus: NDArray[np.int64]
    behaviour: NDArray[np.int64]
    sector: NDArray[np.int64]
    mutated: NDArray[np.bool_]


@dataclass(frozen=True)
class Results:
    """What became of the moves of one class.

    Attributes:
        outcome: How each move ended (`SwarmOutcome`), shape (robots,); `SwarmOutcome.NONE` where no observation came, and for
            who did not move.
        count_before: How many of the other class are inside the radius used before the move, after it, same shape.
        radius_before: The radius that count_before used, same shape.
    """

    outcome: NDArray[np.int64]
    count_before: NDArray[np.int64]
    radius_before: NDArray[np.float64]


@dataclass(frozen=True)
class Lesson:
    """What a class learnt from a round.

    Attributes:
        learnt: Whose move was learnt from, shape (robots,).
        delta: Increment of the behaviour that each performed, same shape; 0 where nothing was learnt.
        changed: Numbers of the stimuli whose weights are others than before, ascending.
    """

    learnt: NDArray[np.bool_]
    delta: NDArray[np.float64]
    changed: NDArray[np.int64]
