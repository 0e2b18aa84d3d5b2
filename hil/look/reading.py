"""A log as a scene."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from hil.explaining import history, team
from hil.explaining.sources import pal_of
from hil.look import lessons, micro, sumo, timeline, words
from hil.look.lessons import LearningPart
from hil.look.micro import MicroPart
from hil.look.scene import Scene
from hil.look.sumo import SumoPart
from hil.look.timeline import Timeline
from hil.mcaplog.errors import LogError, UnreadableLogError
from hil.mcaplog.limits import ReadLimits
from hil.mcaplog.reading.reader import LogReader
from hil.mcaplog.records import SERIES, EventRecord
from hil.runs import LOG

if TYPE_CHECKING:
    from pathlib import Path

TOPICS: Final = frozenset((*timeline.TOPICS, *sumo.TOPICS, *micro.TOPICS, *lessons.TOPICS, *history.TOPICS, *team.TOPICS))
MOST_TOPICS: Final = 12
"""Of what a foreign log holds instead, so many are named."""


def read_scene(path: Path, limits: ReadLimits = ReadLimits(), robot: int | None = None) -> Scene:  # noqa: B008 - frozen
    """Gather what a log shows.

    Args:
        path: The log.
        limits: What it may unpack to.
        robot: System id of the sumo robot to show, of several; None: the one that was taken first.

    Returns:
        The scene, up to damage.

    Raises:
        LogError: It cannot be opened, is not a log, nothing of it could be read, or it has no such robot.
        UnreadableLogError: It holds nothing of ours; the text says what it holds instead.
    """
    reader = LogReader(path, limits)
    run, junior, swarm, learner = Timeline(), SumoPart(robot), MicroPart(), LearningPart()
    scene = Scene(source=f"{path.absolute().parent.name}/{path.name}" if path.name == LOG else path.name)
    first, last = math.inf, -math.inf
    for entry in reader.entries(TOPICS):
        first, last = min(first, entry.time), max(last, entry.time)
        value = entry.value
        if isinstance(value, EventRecord) and value.kind == SERIES:
            junior.series(entry.time, value.text)
        for part in (run, junior, swarm, learner):
            part.take(entry)
    if first > last:
        _refuse(path, limits)
    if robot is not None and robot not in junior.robots:
        there = ", ".join(map(str, junior.robots)) or "none at all"
        raise LogError(f"there is no sumo robot {robot} in {path}: there is {there}")
    scene.begin, scene.end = first, last
    if not reader.whole:
        scene.notes.append(f"The log is {reader.health()}. Everything here is of the part that could be read.")
    junior.put(scene)
    swarm.put(scene)
    learner.put(scene, pal_of(reader.attachments))
    run.put(scene)
    words.tell(scene, reader.metadata, swarm.classes, learner.trials, learner.coached)
    return scene


def _refuse(path: Path, limits: ReadLimits) -> None:
    """Say what a log holds that has nothing of ours."""
    reader = LogReader(path, limits)
    counts: dict[str, int] = {}
    for entry in reader.raw_entries():
        counts[entry.topic] = counts.get(entry.topic, 0) + 1
    reader.require_something()
    named = [f"{topic!r} ({count:,})" for topic, count in sorted(counts.items(), key=lambda one: -one[1])[:MOST_TOPICS]]
    more = f", and {len(counts) - MOST_TOPICS:,} more" if len(counts) > MOST_TOPICS else ""
    held = f"it holds {', '.join(named)}{more}" if named else "it holds no entry at all"
    raise UnreadableLogError(f"{path} has nothing that hil can show: {held} (hil log info {path} tells more)")
