"""An advice that was put together from several coachings: which run each entry comes from, and how that was decided."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from firmware_protocol.vocabulary import ANY_STIMULUS, Stimulus
from hil.explaining.explanation import Explanation, explain
from pal_advisor.maneuvers import ANY
from pal_advisor.maneuvers.mirror import home_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from hil.explaining.history import LearningHistory
    from hil.mcaplog.records import TeamVerdictRecord
    from pal_advisor.maneuvers import AdviceEntry, Pal


@dataclass(frozen=True)
class TeamMember:
    """One of the runs.

    Attributes:
        number: Its number, from 1.
        pal: Its learner, as it was at the end.
        history: What its log tells; None where there is none.
    """

    number: int
    pal: Pal
    history: LearningHistory | None


def explain_team(
    entries: Iterable[AdviceEntry], members: Sequence[TeamMember], verdicts: Sequence[TeamVerdictRecord]
) -> list[Explanation]:
    """Say why the maneuvers of an advice of several runs are there, each by the run that it comes from.

    Args:
        entries: The entries of the advice.
        members: The runs.
        verdicts: What the team exam found out, in order.

    Returns:
        An explanation of each entry, in order; of one that none of the runs has learnt only its file's.
    """
    learnt = [(member, frozenset(member.pal.advice().entries)) for member in members]
    found = []
    for entry in entries:
        member = next((member for member, own in learnt if entry in own), None)
        if member is None:
            found.append(Explanation(entry, runs=len(members)))
            continue
        (one,) = explain([entry], member.pal, member.history)
        category = entry.previous, entry.current
        home = home_of(category)[0] if member.pal.settings.mirror else category
        places = {("", ""), (_label(home[0]), Stimulus(home[1]).label)}
        told = tuple(verdict for verdict in verdicts if (verdict.previous, verdict.current) in places)
        found.append(replace(one, runs=len(members), run=member.number, verdicts=told))
    return found


def _label(code: int) -> str:
    return ANY if code == ANY_STIMULUS else Stimulus(code).label
