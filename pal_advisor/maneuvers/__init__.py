"""Pal, who coaches Junior: multi-phase genetic programming of maneuvers (Liu & Wu 2001, ch. 10)."""

from pal_advisor.maneuvers.advice import ANY, Advice, AdviceEntry, AdviceError
from pal_advisor.maneuvers.coach import GenerationRecord, Pal, StateError, Trial
from pal_advisor.maneuvers.fitness import ObjectiveError, Performance, action_worth, fitness
from pal_advisor.maneuvers.names import describe
from pal_advisor.maneuvers.settings import Objective, PalSettings, SettingsError

__all__ = [
    "ANY",
    "Advice",
    "AdviceEntry",
    "AdviceError",
    "GenerationRecord",
    "Objective",
    "ObjectiveError",
    "Pal",
    "PalSettings",
    "Performance",
    "SettingsError",
    "StateError",
    "Trial",
    "action_worth",
    "describe",
    "fitness",
]
