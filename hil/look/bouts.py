"""Bouts as chapters of a scene, each with how it ended in words."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import BoutOutcome, OpponentCode, Phase
from firmware_protocol.messages.junior import SensorFlag
from hil.look.scene import Chapter
from hil.recording.scene import ring_size

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from firmware_protocol.messages import RefereeState
    from hil.look.scene import Lane
    from hil.mcaplog.records import EventRecord

OUTCOMES: Final = {
    BoutOutcome.WIN: "won",
    BoutOutcome.LOSS: "lost",
    BoutOutcome.DRAW: "drawn",
    BoutOutcome.UNDECIDED: "broken off",
}
BROKEN_OFF: Final = OUTCOMES[BoutOutcome.UNDECIDED]
BY_WORD: Final = {outcome.name.lower(): word for outcome, word in OUTCOMES.items()}
"""Likewise, by what the event that ends a bout says of it."""
LATELY: Final = 0.5
"""What happened within so long before the end of a bout, in s, led to it."""
LONGEST: Final = 1e6
"""No bout lasts longer, in s."""
UNNAMED: Final = "an opponent that nobody has named"
ARMS: Final = int(SensorFlag.ARM_LEFT | SensorFlag.ARM_RIGHT)

Told = list[tuple[float, "RefereeState"]]


class Bouts:
    """Tells bouts apart.

    Args:
        told: What the referee saw, with log times.
        series: When each series of bouts began, and its title.
        senses: What Junior sensed: columns `t` and `flags`.
        maneuvers: What it performed; None where that is not known.
    """

    def __init__(
        self,
        told: Told,
        series: list[tuple[float, str]],
        senses: dict[str, NDArray[np.float64]],
        maneuvers: Lane | None,
    ) -> None:
        self._told = told
        self._series = series
        self._senses = senses
        self._maneuvers = maneuvers

    def chapters(self) -> list[Chapter]:
        """The bouts, in order, numbered from 1 in each series."""
        found: list[Chapter] = []
        bout: Told = []
        for time, state in self._told:
            if bout and (state.bout != bout[-1][1].bout or state.elapsed < bout[-1][1].elapsed):
                self._end(bout, found)
                bout = []
            if state.phase == Phase.IDLE or (state.phase == Phase.OVER and not bout):
                continue
            bout.append((time, state))
            if state.phase == Phase.OVER:
                self._end(bout, found)
                bout = []
        self._end(bout, found)
        return found

    def _end(self, bout: Told, found: list[Chapter]) -> None:
        if not bout:
            return
        (begin, _), (end, last) = bout[0], bout[-1]
        outcome = BoutOutcome(last.outcome) if last.outcome in set(BoutOutcome) else BoutOutcome.UNDECIDED
        code = last.opponent_code
        against = OpponentCode(code).label if code in set(OpponentCode) else f"opponent {code}"
        series = _series_at(begin, self._series)
        story = self._story(outcome, bout)
        found.append(Chapter(next_name(found, series), series, begin, end, OUTCOMES[outcome], against, story))

    def _story(self, outcome: BoutOutcome, bout: Told) -> str:
        end, last = bout[-1]
        after = f" after {last.elapsed:.1f} s"
        touched = self._touched(end)
        if outcome is BoutOutcome.DRAW:
            return f"Drawn: the time was over{after}, and both were in the ring."
        if outcome is BoutOutcome.WIN:
            how = {True: "pushed by Junior", False: "with nothing touching Junior’s arms", None: ""}[touched]
            return f"Won{after}: the opponent left the ring {_side(last.opponent)}{', ' if how else ''}{how}."
        if outcome is BoutOutcome.LOSS:
            parts = [f"Lost{after}: Junior left the ring {_side(last.junior)}, {_driving(bout)}"]
            parts += {True: [", an arm touching the opponent"], False: [", its arms touching nothing"], None: []}[touched]
            doing = self._performing(end)
            return "".join(parts) + (f". It was performing: {doing}." if doing else ".")
        return f"Broken off{after}."

    def _touched(self, end: float) -> bool | None:
        """Whether an arm touched something just before; None where nobody knows."""
        times = self._senses.get("t")
        if times is None or not len(times) or times[0] > end:
            return None
        flags = self._senses["flags"].astype(np.int64)
        first = max(0, int(np.searchsorted(times, end - LATELY, side="right")) - 1)
        behind = int(np.searchsorted(times, end, side="right"))
        return bool((flags[first:behind] & ARMS).any())

    def _performing(self, end: float) -> str:
        lane = self._maneuvers
        if lane is None:
            return ""
        at = int(np.searchsorted(lane.begin, end - 0.05)) - 1
        return lane.meanings[int(lane.code[at])].partition(" (")[0] if at >= 0 and lane.end[at] >= end - LATELY else ""


def next_name(found: Iterable[Chapter], series: str) -> str:
    """What the next bout of a series is called: they are numbered from 1 in each.

    Args:
        found: The bouts so far.
        series: Title of the series.
    """
    return f"Bout {1 + sum(chapter.series == series for chapter in found)}"


def judged(told: list[tuple[float, EventRecord]], series: list[tuple[float, str]]) -> list[Chapter]:
    """Bouts of which no referee has seen anything: as a person has judged them.

    Args:
        told: The events that end bouts, with log times.
        series: When each series of bouts began, and its title.

    Returns:
        The bouts, in order, numbered from 1 in each series.
    """
    found: list[Chapter] = []
    for end, event in told:
        try:
            fields = json.loads(event.fields)
        except ValueError:
            continue
        said = fields if isinstance(fields, dict) else {}
        word, lasted = BY_WORD.get(str(said.get("outcome")), BROKEN_OFF), said.get("time")
        if word == BROKEN_OFF or not isinstance(lasted, int | float) or not 0.0 <= lasted <= LONGEST:
            continue
        title = _series_at(end, series)
        story = f"{word.capitalize()} after {lasted:.1f} s, by the word of the person who judged."
        found.append(Chapter(next_name(found, title), title, end - lasted, end, word, UNNAMED, story))
    return found


def _series_at(time: float, series: list[tuple[float, str]]) -> str:
    """Title of the series that was going on; empty before the first."""
    return next((title for begun, title in reversed(series) if begun <= time), "")


def _side(place: tuple[float, ...]) -> str:
    """Which border is nearest."""
    width, height = ring_size()
    x, y = place
    if abs(x) / width > abs(y) / height:
        return "on the right" if x > 0 else "on the left"
    return "at the top" if y > 0 else "at the bottom"


def _driving(bout: Told) -> str:
    """How Junior moved just before the end."""
    end, last = bout[-1]
    before = next((state for time, state in reversed(bout) if time <= end - LATELY / 2), bout[0][1])
    way = np.subtract(last.junior, before.junior)
    if float(np.hypot(*way)) < 0.005:
        return "hardly moving"
    along = float(way @ (np.cos(last.junior_heading), np.sin(last.junior_heading))) / float(np.hypot(*way))
    return "driving forward" if along > 0.7 else "driving backward" if along < -0.7 else "moving sideways"
