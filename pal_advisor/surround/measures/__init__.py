"""What is measured of a run: of a step, and of whole histories."""

from pal_advisor.surround.measures.fitness import Fitness, FitnessSums, nearest_distance
from pal_advisor.surround.measures.histories import macro_stable, periodic, pushed
from pal_advisor.surround.measures.steps import (
    behaviour_frequency,
    between,
    dominance,
    mean_distance,
    ranger_distance,
    settle_step,
    share_outside,
    share_surrounded,
    stimuli_met,
    stimulus_frequency,
    way,
)

__all__ = [
    "Fitness",
    "FitnessSums",
    "behaviour_frequency",
    "between",
    "dominance",
    "macro_stable",
    "mean_distance",
    "nearest_distance",
    "periodic",
    "pushed",
    "ranger_distance",
    "settle_step",
    "share_outside",
    "share_surrounded",
    "stimuli_met",
    "stimulus_frequency",
    "way",
]
