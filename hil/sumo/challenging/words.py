"""What a challenge came to, in words and as plain values; and whether an advice can be begun from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from pal_advisor.maneuvers import Contender
from pal_advisor.maneuvers.challenge import FEWEST_PAIRS, MOST_PAIRS

if TYPE_CHECKING:
    from pal_advisor.maneuvers import Advice, Challenge, ChallengeVerdict, PalSettings

_SIDES: Final = {Contender.CHALLENGER: "what was learnt", Contender.CHAMPION: "the given advice"}


def beginning_in_words(challenge: Challenge) -> str:
    """What is about to happen.

    Args:
        challenge: It, which may have been begun before.
    """
    already = f", {challenge.bouts} of them played already" if challenge.bouts else ""
    return (
        f"Challenge: what was learnt and the given advice play bouts in turn, {2 * FEWEST_PAIRS} to {2 * MOST_PAIRS} in all"
        f"{already}."
    )


def pair_in_words(verdict: ChallengeVerdict) -> str:
    """How it stands after a pair.

    Args:
        verdict: How it stands.
    """
    return f"Challenge, {2 * verdict.pair} bouts played: {count_in_words(verdict)}."


def challenge_in_words(challenge: Challenge) -> str:
    """Who holds the place, and why: a sentence or two.

    Args:
        challenge: It.
    """
    if not challenge.bouts:
        return "The given advice stays: no bout has been played against it."
    won = " and ".join(f"{_SIDES[one]} won {challenge.wins(one)} of {challenge.played(one)}" for one in Contender)
    standing = f"In {challenge.bouts} bouts in turn {won}"
    if not challenge.finished:
        return f"{standing}, and nothing is decided: the given advice stays so far."
    verdict = challenge.verdicts[-1]
    clear = count_in_words(verdict)
    if verdict.ahead + verdict.behind:
        clear += f" (chance of that or more, were both as good: {verdict.chance:.3f})"
    if challenge.winner is Contender.CHALLENGER:
        return f"What was learnt takes the place of the given advice. {standing}; {clear}."
    return f"The given advice stays: that what was learnt is better is not clear. {standing}; {clear}."


def count_in_words(verdict: ChallengeVerdict) -> str:
    """How many pairs tell something, and for whom.

    Args:
        verdict: How the challenge stands.
    """
    if not verdict.ahead + verdict.behind:
        return "no pair of bouts was won by one of them alone"
    return f"of the pairs that only one of them won, {verdict.ahead} went to what was learnt and {verdict.behind} to the other"


def facts(challenge: Challenge) -> dict[str, object]:
    """The same as plain values.

    Args:
        challenge: It.
    """
    verdict = challenge.verdicts[-1] if challenge.verdicts else None
    return {
        "winner": None if challenge.winner is None else challenge.winner.value,
        "bouts": challenge.bouts,
        "wins": {one.value: challenge.wins(one) for one in Contender},
        "ahead": 0 if verdict is None else verdict.ahead,
        "behind": 0 if verdict is None else verdict.behind,
        "chance": None if verdict is None else verdict.chance,
    }


def fitting(given: Advice, settings: PalSettings) -> str:
    """What an advice has otherwise than a coaching that is to begin from it, in words; empty where it fits.

    Args:
        given: The advice.
        settings: How Pal is to coach.
    """
    was = given.settings
    if was.actions != settings.actions:
        return f"its maneuvers have {was.actions} actions, and this coaching's have {settings.actions}"
    if was.arms_in_stimulus != settings.arms_in_stimulus:
        told, asked = ("with", "without") if was.arms_in_stimulus else ("without", "with")
        return f"its situations are told apart {told} the arms, and this coaching's {asked}"
    if was.pairs != settings.pairs:
        if was.pairs:
            return "its situations are told apart by the previous stimulus too: coach with --pairs"
        return "its situations are not told apart by the previous stimulus: leave --pairs out"
    return ""
