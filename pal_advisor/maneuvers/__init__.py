"""Pal, who coaches Junior: multi-phase genetic programming of maneuvers (Liu & Wu 2001, ch. 10)."""

from pal_advisor.fields import SettingsError, StateError
from pal_advisor.maneuvers.advice import Advice, AdviceEntry, AdviceError
from pal_advisor.maneuvers.challenge import Challenge, ChallengeVerdict, Contender
from pal_advisor.maneuvers.coach import Pal, ancestors_of
from pal_advisor.maneuvers.decisions import Credit, GenerationRecord, Motive, Origin, Telling, Trial, state_digest
from pal_advisor.maneuvers.fitness import ObjectiveError, Performance, action_worth, fitness
from pal_advisor.maneuvers.names import describe
from pal_advisor.maneuvers.settings import Objective, PalSettings
from pal_advisor.maneuvers.team import TeamExam, TeamScore, TeamVerdict

__all__ = [
    "Advice",
    "AdviceEntry",
    "AdviceError",
    "Challenge",
    "ChallengeVerdict",
    "Contender",
    "Credit",
    "GenerationRecord",
    "Motive",
    "Objective",
    "ObjectiveError",
    "Origin",
    "Pal",
    "PalSettings",
    "Performance",
    "SettingsError",
    "StateError",
    "TeamExam",
    "TeamScore",
    "TeamVerdict",
    "Telling",
    "Trial",
    "action_worth",
    "ancestors_of",
    "describe",
    "fitness",
    "state_digest",
]
