"""Why an advice is as it is: what was tried, how it was bred, what was foretold of it, what came of it, what it beat."""

from hil.explaining.explanation import Candidacy, Explanation, explain
from hil.explaining.history import LearningHistory, Performed
from hil.explaining.sources import ExplainError, Learning, learning_of, pal_of

__all__ = [
    "Candidacy", "ExplainError", "Explanation", "Learning", "LearningHistory", "Performed", "explain", "learning_of", "pal_of",
]  # fmt: skip
