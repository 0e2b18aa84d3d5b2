"""Left and right exchanged: what is learnt on one side of a symmetric robot holds on the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.vocabulary import ACTIONS, ANY_STIMULUS, BASIC_ACTIONS, FINE_ACTIONS, Action, Family
from pal_advisor.maneuvers.advice import EYES

if TYPE_CHECKING:
    from pal_advisor.maneuvers.population import Category, Genome


def _mirror_image(action: Action) -> Action:
    """The action of the same alphabet whose wheels are exchanged."""
    spec = ACTIONS[action]
    alphabet = BASIC_ACTIONS if action in BASIC_ACTIONS else FINE_ACTIONS
    wanted = spec.speed, spec.right, spec.left
    return next(other for other in alphabet if (other.spec.speed, other.spec.left, other.spec.right) == wanted)


_IMAGES: Final = tuple(int(_mirror_image(action)) for action in Action)
_TURNS: Final = {int(action): action.family for action in Action if action.family in {Family.LEFT, Family.RIGHT}}


def reflected(genome: Genome) -> Genome:
    """A maneuver with left and right exchanged.

    Args:
        genome: Its action codes.
    """
    return tuple([_IMAGES[gene] for gene in genome])


def reflected_stimulus(code: int) -> int:
    """A stimulus with left and right exchanged.

    Args:
        code: Its wire code; `ANY_STIMULUS` is its own mirror image.
    """
    if code == ANY_STIMULUS:
        return code
    return (code & 0b0101) << 1 | (code & 0b1010) >> 1


def reflected_category(category: Category) -> Category:
    """A situation with left and right exchanged.

    Args:
        category: The situation.
    """
    previous, current = category
    return reflected_stimulus(previous), reflected_stimulus(current)


def home_of(category: Category) -> tuple[Category, bool]:
    """The one of a situation and its mirror image that experience of both is kept under, and whether it is the image.

    It is the one that senses on the left: `left` stands for `right` too.

    Args:
        category: The situation.
    """
    image = reflected_category(category)
    return (image, True) if _order(image) < _order(category) else (category, False)


def _order(category: Category) -> tuple[int, int, int]:
    """What the eyes see now, then what the arms feel, then what was sensed before: left comes before right."""
    previous, current = category
    return current & EYES, current, previous


def is_symmetric(category: Category) -> bool:
    """Whether a situation is its own mirror image.

    Args:
        category: The situation.
    """
    return reflected_category(category) == category


def one_of_two(genome: Genome) -> Genome:
    """Of a maneuver and its mirror image the one that turns left first.

    In a symmetric situation the two are worth the same.

    Args:
        genome: Its action codes.
    """
    for gene in genome:
        if gene in _TURNS:
            return genome if _TURNS[gene] is Family.LEFT else reflected(genome)
    return genome
