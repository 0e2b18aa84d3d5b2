"""Group reinforcement learning: robots that learn to surround others, who learn to get away (Liu & Wu 2001, ch. 6 to 8)."""

from pal_advisor.fields import SettingsError, StateError
from pal_advisor.surround.adviser import Surround
from pal_advisor.surround.case import Case, CaseError, WildMotion, letters
from pal_advisor.surround.conditional import ConditionalError, read_conditional
from pal_advisor.surround.experience import INCREMENTS, Experience
from pal_advisor.surround.group import RobotGroup
from pal_advisor.surround.places import PlacesError, start_places
from pal_advisor.surround.rounds import Lesson, Moves, Results, Sights
from pal_advisor.surround.rules import BOOK_RULES, BookRule, Rule, rules
from pal_advisor.surround.settings import GroupSettings, Motion, Sensing, case_settings
from pal_advisor.surround.stimuli import Stimuli, stimuli_of
from pal_advisor.surround.tables import StimulusRecord, Tables, TablesError

__all__ = [
    "BOOK_RULES",
    "INCREMENTS",
    "BookRule",
    "Case",
    "CaseError",
    "ConditionalError",
    "Experience",
    "GroupSettings",
    "Lesson",
    "Motion",
    "Moves",
    "PlacesError",
    "Results",
    "RobotGroup",
    "Rule",
    "Sensing",
    "SettingsError",
    "Sights",
    "StateError",
    "Stimuli",
    "StimulusRecord",
    "Surround",
    "Tables",
    "TablesError",
    "WildMotion",
    "case_settings",
    "letters",
    "read_conditional",
    "rules",
    "start_places",
    "stimuli_of",
]
