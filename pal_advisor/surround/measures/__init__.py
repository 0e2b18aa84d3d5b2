"""What is measured of a run: of a step, and of whole histories."""

from pal_advisor.surround.measures.fitness import Fitness, FitnessSums, nearest_distance
from pal_advisor.surround.measures.histories import macro_stable, periodic, pushed, turns
from pal_advisor.surround.measures.run import RunMeasures, measures_of
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
from pal_advisor.surround.measures.tracker import RunTracker

__all__ = [
    "Fitness",
    "FitnessSums",
    "RunMeasures",
    "RunTracker",
    "behaviour_frequency",
    "between",
    "dominance",
    "macro_stable",
    "mean_distance",
    "measures_of",
    "nearest_distance",
    "periodic",
    "pushed",
    "ranger_distance",
    "settle_step",
    "share_outside",
    "share_surrounded",
    "stimuli_met",
    "stimulus_frequency",
    "turns",
    "way",
]
