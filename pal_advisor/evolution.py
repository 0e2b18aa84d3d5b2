"""Genetic operators on arrays, shared by all advisers.

A genome is a one-dimensional array of integer genes; a population is an array of shape (individuals, genes). Every
operator draws from the generator it is given and from nothing else, so that a run is a function of its seed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

Genes: TypeAlias = "NDArray[np.int64]"
"""Genes: shape (genes,) for one genome, (individuals, genes) for a population."""


def tournament(scores: NDArray[np.float64], rng: np.random.Generator, size: int) -> int:
    """Select one individual: the best of `size` drawn with replacement.

    Args:
        scores: Fitness of every individual, shape (individuals,).
        rng: Source of chance.
        size: How many compete.

    Returns:
        Index of the winner; the first drawn of equals.
    """
    drawn = rng.integers(len(scores), size=size)
    return int(drawn[np.argmax(scores[drawn])])


def roulette(scores: NDArray[np.float64], rng: np.random.Generator) -> int:
    """Select one individual with a probability in proportion to its fitness.

    Args:
        scores: Fitness of every individual, none negative, shape (individuals,).
        rng: Source of chance.

    Returns:
        Index of the one selected; where all are 0, any with the same probability.
    """
    sums = np.cumsum(scores)
    if sums[-1] <= 0.0:
        return int(rng.integers(len(scores)))
    return int(np.searchsorted(sums, rng.random() * sums[-1], side="right"))


def one_point_crossover(first: Genes, second: Genes, rng: np.random.Generator) -> Genes:
    """Join the head of one genome to the tail of another, cut at one place inside.

    Args:
        first: Genome that gives the head, shape (genes,).
        second: Genome that gives the tail, same shape.
        rng: Source of chance.

    Returns:
        The child; a copy of `first` where there is but one gene.
    """
    if len(first) < 2:
        return first.copy()
    cut = int(rng.integers(1, len(first)))
    return np.concatenate((first[:cut], second[cut:]))


def mutate(
    genome: Genes,
    rng: np.random.Generator,
    *,
    rate: float,
    alphabet: Genes,
    families: Mapping[int, Genes] | None = None,
    in_family: float = 0.0,
) -> Genes:
    """Replace each gene, with a probability, by one drawn from the alphabet or from the gene's own family.

    Args:
        genome: Genome to change, shape (genes,); left as it is.
        rng: Source of chance.
        rate: Probability that a gene is replaced.
        alphabet: Values a gene may have.
        families: For every value, the values of its family (subsets of the alphabet); None for no families.
        in_family: Share of replacements drawn from the family.

    Returns:
        The mutant.
    """
    mutant = genome.copy()
    for place in np.flatnonzero(rng.random(len(genome)) < rate):
        choices = alphabet
        if families is not None and rng.random() < in_family:
            choices = families[int(genome[place])]
        mutant[place] = rng.choice(choices)
    return mutant


def flip(genome: Genes, rng: np.random.Generator, rate: float) -> Genes:
    """Turn each bit over, with a probability.

    Args:
        genome: Genome of bits, shape (genes,); left as it is.
        rng: Source of chance.
        rate: Probability that a bit is turned over.

    Returns:
        The mutant.
    """
    return np.where(rng.random(len(genome)) < rate, 1 - genome, genome)


def breed(
    population: Genes,
    scores: NDArray[np.float64],
    rng: np.random.Generator,
    *,
    elite: int,
    select: Callable[[NDArray[np.float64], np.random.Generator], int],
    crossover: float,
    vary: Callable[[Genes, np.random.Generator], Genes],
    brood: int = 1,
    choose: Callable[[Sequence[Genes], Sequence[Genes]], int] | None = None,
) -> tuple[Genes, NDArray[np.int64]]:
    """Make the next generation: the elite unchanged, the rest by selection, one-point crossover and mutation.

    Args:
        population: Genomes, shape (individuals, genes).
        scores: Their fitness, shape (individuals,).
        rng: Source of chance.
        elite: How many of the best survive unchanged; they come first, best first.
        select: Selects a parent by the scores, as `tournament` and `roulette` do.
        crossover: Probability that a child has two parents.
        vary: Makes of a child its mutant, as `mutate` and `flip` do.
        brood: Children bred for each place.
        choose: Of those bred before and the brood says which of the brood gets the place; None: the first.

    Returns:
        The new population, same shape, and the two parents of each of its individuals, shape (individuals, 2):
        twice the same index for a child of one parent, and for an elite its own old index.
    """
    order = np.argsort(-scores, kind="stable")[:elite]
    children = [population[index] for index in order]
    parents = [(int(index), int(index)) for index in order]
    while len(children) < len(population):
        litter, descents = [], []
        for _ in range(brood):
            mother = father = select(scores, rng)
            child = population[mother]
            if rng.random() < crossover:
                father = select(scores, rng)
                child = one_point_crossover(child, population[father], rng)
            litter.append(vary(child, rng))
            descents.append((mother, father))
        chosen = 0 if choose is None else choose(children, litter)
        children.append(litter[chosen])
        parents.append(descents[chosen])
    return np.stack(children), np.array(parents, dtype=np.int64)
