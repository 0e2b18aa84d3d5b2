"""Group reinforcement learning: robots that learn to surround others, who learn to get away (Liu & Wu 2001, ch. 6 to 8)."""

from pal_advisor.surround.adviser import StateError, Surround
from pal_advisor.surround.case import Case, CaseError, WildMotion, letters
from pal_advisor.surround.conditional import ConditionalError, read_conditional
from pal_advisor.surround.experience import INCREMENTS, Experience
from pal_advisor.surround.group import Group
from pal_advisor.surround.places import PlacesError, start_places
from pal_advisor.surround.rounds import Learnt, Moves, Results, Sights
from pal_advisor.surround.rules import BOOK_RULES, BookRule, Rule, rules
from pal_advisor.surround.settings import GroupSettings, Motion, Sensing, SettingsError, case_settings
from pal_advisor.surround.stimuli import Stimuli, stimuli_of
from pal_advisor.surround.tables import Tables, TablesError, Vector

__all__ = [
    "BOOK_RULES",
    "INCREMENTS",
    "BookRule",
    "Case",
    "CaseError",
    "ConditionalError",
    "Experience",
    "Group",
    "GroupSettings",
    "Learnt",
    "Motion",
    "Moves",
    "PlacesError",
    "Results",
    "Rule",
    "Sensing",
    "SettingsError",
    "Sights",
    "StateError",
    "Stimuli",
    "Surround",
    "Tables",
    "TablesError",
    "Vector",
    "WildMotion",
    "case_settings",
    "letters",
    "read_conditional",
    "rules",
    "start_places",
    "stimuli_of",
]
