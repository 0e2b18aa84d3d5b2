"""What happened in a run, in words and tables: an emergency stop first."""

from __future__ import annotations

import re
from itertools import groupby
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages.robot import State
from hil.doors import DocumentError, parse_json
from hil.report.report_table import ReportTable, counted, shortened

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.report.happened.course import Stop
    from hil.report.run_data import RunData

MOST_ROWS: Final = 60
"""Happenings in the table."""
MOST_NAMED: Final = 8
"""Checks that are named."""
MOST_STOPS: Final = 3
"""Emergency stops that are told of one by one."""
STATE_WORDS: Final = {
    State.DISARMED: "disarmed", State.READY: "ready", State.DRIVING: "driving", State.PERFORMING: "performing",
    State.COUNTDOWN: "countdown", State.CONTEST: "contest", State.STOPPED: "stopped",
}  # fmt: skip
MEANINGS: Final = {
    State.DISARMED: "its wheels never turn",
    State.READY: "armed, waiting for a command",
    State.DRIVING: "its wheels are told what to do",
    State.PERFORMING: "it performs a maneuver",
    State.COUNTDOWN: "it stands still before a contest",
    State.CONTEST: "it plays by itself",
    State.STOPPED: "the emergency stop is engaged, until it is disarmed and armed again",
}
STOPPING: Final = "emergency stop"
"""Kind of what is told of emergency stops."""
_GRAVE: Final = (STOPPING, "emergency", "error", "fault", "safety", "operator", "warning", "link")
"""Kinds that are kept first where not all can be."""
_ROBOT: Final = re.compile(r"^robot \d+ ")
_UNTOLD: Final = frozenset({"bout", "result"})
"""Kinds of events that a report tells otherwise."""


def state_name(code: int) -> str:
    """A state in a word.

    Args:
        code: As in HEARTBEAT.custom_mode.
    """
    return STATE_WORDS[State(code)] if code in STATE_WORDS else f"state {code}"


def stops_said(data: RunData) -> list[str]:
    """That there was an emergency stop, and what came of it, a paragraph an item; nothing where there was none.

    Args:
        data: The run.
    """
    stops = data.course.stops()
    if not stops:
        return []
    if len(stops) <= MOST_STOPS:
        several = len(data.course.states) > 1
        return [" ".join(_stop_words(stop, several=several) for stop in stops)]
    unconfirmed = sum(stop.confirmed is None for stop in stops)
    text = (
        f"The emergency stop was engaged {len(stops)} times, first at {stops[0].time:.2f} s and last at {stops[-1].time:.2f} s"
    )
    text += f"; {unconfirmed} of them no robot has confirmed." if unconfirmed else ", and confirmed by the robot each time."
    still = stops[-1].confirmed is not None and stops[-1].released is None
    return [text + (" It was still engaged when the log ended." if still else "")]


def _stop_words(stop: Stop, *, several: bool) -> str:
    who = "the robot" if not several else _robots(stop)
    if stop.commanded is None:
        text = f"At {stop.time:.2f} s {who} told of an emergency stop that nobody here had commanded"
    else:
        how = f"by the key {stop.key}" if stop.key else "by command"
        text = f"The emergency stop was engaged at {stop.commanded:.2f} s, {how}"
        if stop.confirmed is None:
            return f"{text}; no robot confirmed it."
        text += f"; {who} confirmed it {(stop.confirmed - stop.commanded) * 1e3:.0f} ms later"
    if stop.released is None:
        return f"{text}. It was still engaged when the log ended."
    return f"{text}. It was released at {stop.released:.2f} s."


def _robots(stop: Stop) -> str:
    named = sorted(stop.robots)
    if len(named) == 1:
        return f"robot {named[0]}"
    return f"{len(named)} robots" if len(named) > 6 else f"robots {', '.join(map(str, named[:-1]))} and {named[-1]}"


def interruptions_said(data: RunData) -> list[str]:
    """That a person or a signal has ended the run, a paragraph an item.

    Args:
        data: The run.
    """
    ends = [one for one in data.course.happenings if one.kind == "operator" and "interrupt" in one.text]
    return [f"At {one.time:.2f} s {one.text}." for one in ends[:1]]


def results_said(data: RunData) -> list[str]:
    """What came of a check of a robot, or of writing an advice into it, a paragraph an item; nothing of other runs.

    Args:
        data: The run.
    """
    fields = next((event.fields for _, event in reversed(data.events) if event.kind == "result"), "")
    try:
        told = parse_json(fields) if fields else None
    except DocumentError:
        return []
    checks, slots = (told.get(name) if isinstance(told, dict) else None for name in ("checks", "slots"))
    if isinstance(checks, list):
        verdicts = [(check.get("passed"), str(check.get("name"))) for check in checks if isinstance(check, dict)]
        failed = [shortened(name, 60) for passed, name in verdicts if passed is False]
        made = sum(passed is not None for passed, _ in verdicts)
        text = f"{made - len(failed):,} of {counted(made, 'check', 'checks')} passed"
        more = ", …" if len(failed) > MOST_NAMED else ""
        return [f"{text}; what failed: {', '.join(failed[:MOST_NAMED])}{more}." if failed else f"{text}."]
    if isinstance(slots, list):
        return [f"The memory of the robot holds what to do in {counted(len(slots), 'situation', 'situations')}, as read back."]
    return []


def states_table(data: RunData) -> ReportTable | None:
    """How long robots were in each state.

    Args:
        data: The run.

    Returns:
        The table; None where nobody said.
    """
    course = data.course
    seconds: dict[int, float] = {}
    times: dict[int, int] = {}
    for system in course.states:
        for start, end, state in course.spans(system, data.end):
            seconds[state] = seconds.get(state, 0.0) + end - start
            times[state] = times.get(state, 0) + 1
    whole = sum(seconds.values())
    if not whole:
        return None
    rows = tuple(
        (
            state_name(state),
            MEANINGS[State(state)] if state in MEANINGS else "this program does not know it",
            f"{seconds[state]:,.1f} s",
            f"{seconds[state] / whole:.1%}",
            f"{times[state]:,}",
        )
        for state in sorted(seconds)
    )
    of = "the robot was" if len(course.states) == 1 else f"the {len(course.states):,} robots were, all together,"
    return ReportTable(
        f"How long {of} in each state", ("State", "Meaning", "Time", "Share", "Times"), rows, frozenset({2, 3, 4})
    )


def happenings_table(data: RunData) -> ReportTable | None:
    """What happened and when: where there is too much of it, what is grave rather than the rest.

    Args:
        data: The run.

    Returns:
        The table; None where nothing did.
    """
    told = _runs(sorted(_happenings(data), key=lambda one: one[0]))
    if not told:
        return None
    kept = told
    if len(told) > MOST_ROWS:
        ranked = sorted(range(len(told)), key=lambda index: (_rank(told[index][1]), index))
        kept = [told[index] for index in sorted(ranked[:MOST_ROWS])]
    left = len(told) - len(kept) + sum(data.course.left_out.values())
    title = f"{MOST_ROWS} of the {len(kept) + left:,} things that happened" if left else "One after the other"
    rows = tuple((f"{time:.2f} s", kind, text) for time, kind, text in kept)
    return ReportTable(title, ("Log time", "Kind", "What happened"), rows)


def _rank(kind: str) -> int:
    return _GRAVE.index(kind) if kind in _GRAVE else len(_GRAVE)


def _happenings(data: RunData) -> list[tuple[float, str, str]]:
    found = [(one.time, one.kind, one.text) for one in data.course.happenings]
    found += [(time, event.kind, event.text) for time, event in data.events if event.kind not in _UNTOLD]
    found += [(time, "series", title) for time, title in data.course.chapters]
    several = len(data.course.states) > 1
    for stop in data.course.stops():
        who = _robots(stop) if several else "the robot"
        if stop.commanded is not None:
            found.append((stop.commanded, STOPPING, f"commanded, {f'by the key {stop.key}' if stop.key else 'by the program'}"))
        if stop.confirmed is not None:
            found.append((stop.confirmed, STOPPING, f"engaged, as {who} said"))
        elif stop.commanded is not None:
            found.append((stop.commanded, STOPPING, "not confirmed by any robot"))
        if stop.released is not None:
            found.append((stop.released, STOPPING, "released"))
    return found


def _runs(told: Sequence[tuple[float, str, str]]) -> list[tuple[float, str, str]]:
    """The same thing several times in a row, as a key that is held down or robots that answer, told once."""
    found = []
    for (kind, text), group in groupby(told, key=lambda one: (one[1], _ROBOT.sub("each robot ", one[2]))):
        same = list(group)
        time, _, first = same[0]
        more = f", {len(same)} times in {same[-1][0] - time:.1f} s" if len(same) > 1 else ""
        found.append((time, kind, f"{first if all(one[2] == first for one in same) else text}{more}"))
    return found
