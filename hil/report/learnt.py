"""What a learner left in a log, as far as it can be understood."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

from hil.doors import DocumentError, parse_json
from pal_advisor.fields import FieldError, shown
from pal_advisor.maneuvers import AdviceEntry, AdviceError, PalSettings

LARGEST: Final = 1 << 20
"""No advice has more letters."""
_PERIOD: Final = PalSettings().period


@dataclass(frozen=True)
class Learnt:
    """The advice of a run.

    Attributes:
        entries: Its entries that can be understood, each situation once.
        objective: What a good maneuver was taken to be; empty where that is not said.
        opponent: Against whom; likewise.
        budget: Maneuvers to be performed; None where that is not said, or robot time counted.
        period: Time an action lasts, in s.
    """

    entries: tuple[AdviceEntry, ...] = ()
    objective: str = ""
    opponent: str = ""
    budget: int | None = None
    period: float = _PERIOD


def read_learnt(text: str) -> tuple[Learnt | None, list[str]]:
    """Read the advice that a log holds, entry by entry.

    Args:
        text: As it was recorded.

    Returns:
        What can be understood of it, None where that is nothing; and what can't, in words.
    """
    if len(text) > LARGEST:
        return None, [f"The advice was left out: it has {len(text):,} letters."]
    try:
        data = parse_json(text)
    except DocumentError as error:
        return None, [f"The advice can't be read: {error}."]
    if not isinstance(data, dict):
        return None, [f"The advice can't be read: expected a table, not {shown(data)}."]
    said: list[str] = []
    settings = data.get("settings")
    settings = settings if isinstance(settings, dict) else {}
    period, budget = settings.get("period", _PERIOD), None if settings.get("robot_time") else settings.get("budget")
    if type(period) not in (int, float) or not 0.0 < period <= 60.0 or not math.isfinite(period):
        said.append(f"In the advice, settings.period is {shown(period)}: {_PERIOD:g} s is drawn instead.")
        period = _PERIOD
    found: dict[tuple[int, int], AdviceEntry] = {}
    entries = data.get("entries", [])
    wrong: list[str] = []
    for index, item in enumerate(entries if isinstance(entries, list) else []):
        try:
            entry = AdviceEntry.from_dict(item, f"entries[{index}]")
            if (entry.previous, entry.current) in found:
                raise AdviceError(f"entries[{index}]", "a second entry for its situation")
        except FieldError as error:
            wrong.append(str(error))
        else:
            found[entry.previous, entry.current] = entry
    if not isinstance(entries, list):
        said.append(f"The advice has no list of entries, but {shown(entries)}.")
    if wrong:
        more = f", and {len(wrong) - 3:,} more" if len(wrong) > 3 else ""
        said.append(f"In the advice can't be read: {'; '.join(wrong[:3])}{more}.")
    learnt = Learnt(
        tuple(found.values()),
        objective=_text(data.get("objective")),
        opponent=_text(data.get("opponent")),
        budget=budget if type(budget) is int and 0 < budget < 10**9 else None,
        period=float(period),
    )
    return learnt, said


def _text(value: Any) -> str:  # noqa: ANN401 - whatever the log holds
    return value[:60] if isinstance(value, str) else ""
