"""Who plays in tests of tournaments, duels and coachings against robots: one that charges by advice, and one of a policy."""

from __future__ import annotations

from typing import Final

import numpy as np

from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from hil.policies import Policy
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings

CHARGE: Final = Advice(
    PalSettings(actions=2, period=0.1),
    (AdviceEntry(ANY_STIMULUS, 0, (Action.L, Action.L), 1.0, 5), AdviceEntry(ANY_STIMULUS, 3, (Action.FF, Action.FF), 1.0, 5)),
)
"""Advice that turns left where nothing is seen, and goes ahead where both eyes see something."""
DRIVEN: Final = Policy(np.random.default_rng(1).standard_normal(Policy.size(3)), 3)
"""A policy drawn by chance."""
