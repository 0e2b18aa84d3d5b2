"""An advice that was put together from several coachings: which run each entry comes from, and how that was decided."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from firmware_protocol.vocabulary import stimulus_label
from hil.doors import DocumentError, parse_json
from hil.explaining.explanation import Explanation, explain
from hil.mcaplog.records import EVENTS, CoachedRunRecord, EventRecord, TeamVerdictRecord
from pal_advisor.maneuvers import Advice, AdviceError
from pal_advisor.maneuvers.mirror import home_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hil.explaining.history import LearningHistory
    from hil.mcaplog.reading.reader import LogEntry
    from pal_advisor.maneuvers import AdviceEntry, Pal

TOPICS: Final = ("/pal/run", "/pal/verdict", EVENTS)
LONGEST: Final = 1 << 20
"""No advice has more letters."""
CHALLENGE: Final = "challenge"
"""Kind of the events that tell how a challenge stands; the last one tells how it has ended."""
LONGEST_WORDS: Final = 600
MOST_VERDICTS: Final = 10_000
MOST_MEMBERS: Final = 1000


@dataclass(frozen=True)
class TeamMember:
    """One of the runs.

    Attributes:
        advice: What it has learnt.
        pal: Its learner, as it was at the end; None where that is not known.
        history: What its log tells; None where there is none.
    """

    advice: Advice
    pal: Pal | None = None
    history: LearningHistory | None = None

    def has_learnt(self, entry: AdviceEntry) -> bool:
        """It has learnt what an advice of several runs has for a situation, at the pace that it has there.

        Args:
            entry: Of the advice of several.
        """
        return entry.period in {None, self.advice.settings.period} and replace(entry, period=None) in self.advice.entries


class TeamHistory:
    """Takes what the log of several runs tells of them.

    Attributes:
        members: The runs by their numbers; whoever knows more of one puts that in its place.
        verdicts: What the team exam found out, in order.
        challenge: What came of the challenge of the advice that they began from, in words; empty where there was none.
    """

    def __init__(self) -> None:
        self.challenge = ""
        self.members: dict[int, TeamMember] = {}
        self.verdicts: list[TeamVerdictRecord] = []

    def take(self, entry: LogEntry) -> None:
        """Take an entry."""
        value = entry.value
        if isinstance(value, TeamVerdictRecord) and len(self.verdicts) < MOST_VERDICTS:
            self.verdicts.append(value)
        elif isinstance(value, EventRecord) and value.kind == CHALLENGE:
            self.challenge = value.text[:LONGEST_WORDS]
        elif isinstance(value, CoachedRunRecord) and len(value.json) <= LONGEST and len(self.members) < MOST_MEMBERS:
            try:
                data = parse_json(value.json)
                if isinstance(data, dict):
                    self.members[value.number] = TeamMember(Advice.from_dict(data))
            except (DocumentError, AdviceError):
                return

    def explain(self, entries: Iterable[AdviceEntry]) -> list[Explanation]:
        """Say why the maneuvers of the advice of them all are there, each by the run that it comes from.

        Args:
            entries: The entries of the advice.

        Returns:
            An explanation of each entry, in order.
        """
        return [self._explain(entry) for entry in entries]

    def _explain(self, entry: AdviceEntry) -> Explanation:
        """Why an entry is there, by the first run that has learnt it."""
        number = next((number for number, member in sorted(self.members.items()) if member.has_learnt(entry)), 0)
        if not number:
            return Explanation(entry, runs=len(self.members))
        member = self.members[number]
        (one,) = explain([entry], member.pal, member.history)
        category = entry.previous, entry.current
        home = home_of(category)[0] if member.advice.settings.mirror else category
        places = {("", ""), (stimulus_label(home[0]), stimulus_label(home[1]))}
        verdicts = tuple(verdict for verdict in self.verdicts if (verdict.previous, verdict.current) in places)
        return replace(one, runs=len(self.members), run=number, verdicts=verdicts)
