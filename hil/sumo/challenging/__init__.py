"""The challenge at the end of a coaching that began from an advice: whether what was learnt takes that advice's place."""

from hil.sumo.challenging.holding import hold
from hil.sumo.challenging.standing import ChallengeStanding
from hil.sumo.challenging.words import beginning_in_words, challenge_in_words, facts, fitting, pair_in_words

__all__ = [
    "ChallengeStanding",
    "beginning_in_words",
    "challenge_in_words",
    "facts",
    "fitting",
    "hold",
    "pair_in_words",
]
