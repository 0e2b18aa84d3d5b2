"""Which conditions suit a group best: searches among the 96 of chapter 9, by ask and tell (Liu & Wu 2001, ch. 9)."""

from pal_advisor.surround.search.conditions import (
    BOOK_WINNERS,
    CHROMOSOME,
    CONDITIONS,
    SEARCHED,
    Condition,
    condition_of,
    random_chromosome,
    repaired,
)
from pal_advisor.surround.search.found import ConditionResult, summary_of
from pal_advisor.surround.search.searches import (
    Evaluation,
    ExhaustiveSearch,
    Generation,
    GeneticSearch,
    RandomSearch,
    Search,
    SearchName,
    SearchSettings,
    mutation_rate,
    new_search,
)

__all__ = [
    "BOOK_WINNERS",
    "CHROMOSOME",
    "CONDITIONS",
    "SEARCHED",
    "Condition",
    "ConditionResult",
    "Evaluation",
    "ExhaustiveSearch",
    "Generation",
    "GeneticSearch",
    "RandomSearch",
    "Search",
    "SearchName",
    "SearchSettings",
    "condition_of",
    "mutation_rate",
    "new_search",
    "random_chromosome",
    "repaired",
    "summary_of",
]
