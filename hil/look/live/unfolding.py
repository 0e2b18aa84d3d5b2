"""A run that goes on as parts of a page: each replaces what was told before from a moment on, and tells what came since.

What is gathered of a log is gathered of a whole; so the entries of the last stretch of the run are gathered anew every time,
with a few seconds of what was before, and what is left of the scene is what belongs to that stretch. A stretch ends with a
bout, or after some time where there are none. So a part costs the same however long the run has lasted.
"""

from __future__ import annotations

import json
import math
import shlex
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import ParamValue, Phase, RobotSession, SwarmSense
from firmware_protocol.messages.table import TableReset
from hil.look import lessons, micro, sumo, timeline, words
from hil.look.bouts import BROKEN_OFF, BY_WORD, next_name
from hil.look.document import TimeScale, document_of
from hil.look.lessons import LearningPart
from hil.look.micro import MicroPart
from hil.look.scene import Chapter, Ground, Scene, Terrain
from hil.look.sumo import SumoPart
from hil.look.timeline import Timeline
from hil.mcaplog.records import SERIES, BridgeOpening, EventRecord, SurroundStateRecord
from hil.questions import ASKED

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from hil.look.live.overhearing import Overheard
    from hil.look.scene import Array, Lane, TimeCurves, Track
    from hil.mcaplog.reading.reader import LogEntry

TOPICS: Final = frozenset((*timeline.TOPICS, *sumo.TOPICS, *micro.TOPICS, *lessons.TOPICS))
LONGEST: Final = 10.0
"""A stretch that no bout ends is over after so long, in s."""
LONGEST_BOUT: Final = 120.0
"""Likewise one in which bouts are played: where nobody tells that one is over, a stretch ends between two."""
LEAD: Final = 3.0
"""So much of what was before is gathered with a stretch, in s: a state counts for so long after the last word of it."""
MOST_ENTRIES: Final = 40_000
"""A stretch of more entries is over, however short it is."""
MOST_KEPT: Final = 5_000
"""Entries that tell who the robots are, and where."""
STEP: Final = 1e-3
"""What times are rounded to, in s."""
BOUT: Final = "bout"
"""Kind of the event that ends a bout."""
_LEARNER: Final = frozenset(lessons.TOPICS)
_SETTING: Final = frozenset((
    "/events", "/mavlink/param_value", "/robot/session", "/mavlink/table_reset", "/swarm/sense", "/bridge/open",
    "/surround/state",
))  # fmt: skip
"""Topics of which every stretch has to know something."""


@dataclass
class Episode:
    """The entries of a part of the run.

    Attributes:
        since: When it begins, log time in s.
        until: Its last entry's time.
        entries: The entries, with those of the time before that are gathered with them.
        bout: It ends with a bout.
        series: What the last bout that is over by then belongs to; empty where there is none.
    """

    since: float
    until: float
    entries: list[Overheard]
    bout: bool = False
    series: str = ""


class Unfolding:
    """Takes what is overheard of a run, and gives the parts of its page.

    Attributes:
        ended: The last stretch that is over; None where none is.
        going: The one that goes on; None before the first entry.
        version: Grows with what there is to tell.
    """

    def __init__(self) -> None:
        self.ended: Episode | None = None
        self.going: Episode | None = None
        self.version = 0
        self._zero = math.nan
        self._last = -math.inf
        self._kept: list[LogEntry] = []
        self._networks: set[str] = set()
        self._step: Overheard | None = None
        self._kept_of = ""
        self._questioned = False
        self._surround: SurroundStateRecord | None = None
        self._learner = LearningPart()
        self._learnt: tuple[int, Scene] = (-1, Scene())
        self._told_learner = 0
        self._series: list[tuple[float, str]] = []
        self._played: list[Chapter] = []
        self._refereed = False
        self._due = False
        self._chapters: dict[float, Chapter] = {}
        self._terrain: Terrain | None = None
        self._metadata: Mapping[str, Mapping[str, str]] = {}

    def hear(self, overheard: Iterable[Overheard]) -> list[Episode]:
        """Take what was overheard.

        Args:
            overheard: Entries, in order.

        Returns:
            The stretches that are over by it, in order.
        """
        over: list[Episode] = []
        for one in overheard:
            self.version += 1
            # What a step has received is older than the step, and stands behind it.
            if self._due and one.topic == "/bridge/step" and one.time >= self._last + STEP:
                over.append(self._begin_anew())
            if self.going is None:
                self._zero = self._last = one.time
                self.going = Episode(one.time, one.time, [])
            self._last = max(self._last, one.time)
            stretch = self.going
            if one.topic in _LEARNER and one.topic != "/surround/state":
                self._learner.take(one.entry())
                self._told_learner += 1
                continue
            stretch.entries.append(one)
            stretch.until = self._last
            if one.topic in _SETTING:
                stretch.bout = self._set(one.entry()) or stretch.bout
            elif one.topic == "/bridge/step":
                self._step = one
            lasted = self._last - stretch.since
            if one.topic == "/referee/state" and lasted > LONGEST:
                stretch.bout = stretch.bout or one.entry().value.phase != Phase.RUNNING
            elif one.topic == "/referee/state":
                self._refereed = True
            longest = LONGEST_BOUT if self._refereed else LONGEST
            self._due = stretch.bout or lasted > longest or len(stretch.entries) > MOST_ENTRIES
        return over

    def _begin_anew(self) -> Episode:
        """The stretch that goes on is over; the next one knows what was just before."""
        stretch = self.going
        assert stretch is not None, "an entry begins the first"
        since = round(self._last - self._zero, 3) + STEP + self._zero
        stretch.series = self._played[-1].series if self._played else ""
        self._due = False
        context = [one for one in stretch.entries if one.time >= since - LEAD][-MOST_ENTRIES // 2 :]
        first = next((at for at, one in enumerate(context) if one.topic == "/bridge/step"), 0)
        self.ended, self.going = stretch, Episode(since, since, context[first:])
        return stretch

    def _set(self, entry: LogEntry) -> bool:
        """Keep what every stretch has to know; whether a bout is over by it."""
        value = entry.value
        kept = isinstance(value, RobotSession | SwarmSense | TableReset)
        match value:
            case EventRecord(kind=kind, text=text):
                if kind == ASKED and not self._questioned:
                    self._questioned = True
                    self._keep(entry)
                if kind == SERIES:
                    self._series.append((entry.time, text))
                return kind == BOUT and self._bout(entry.time, value)
            case SurroundStateRecord():
                kept = self._surround is None or self._surround.seed != value.seed or value.step <= self._surround.step
                self._surround = value
                self._learner.take(entry)
                self._told_learner += 1
            case BridgeOpening():
                self._networks.add(value.network)
                kept = True
            case ParamValue():
                kept = value.param_id in {"EYE_L_ON", "CLASS"}
        if kept and len(self._kept) < MOST_KEPT:
            self._keep(entry)
        return False

    def _keep(self, entry: LogEntry) -> None:
        """Keep an entry; of several networks behind a step of the one that it came on: it does not say so itself."""
        if isinstance(entry.value, BridgeOpening):
            self._kept_of = entry.value.network
        elif len(self._networks) > 1 and self._step is not None:
            step = self._step.entry()
            if step.value.network != self._kept_of:
                self._kept_of = step.value.network
                self._kept.append(step)
        self._kept.append(entry)

    def _bout(self, time: float, event: EventRecord) -> bool:
        """Note a bout that is over, as the one who plays tells of it; whether it is."""
        told = json.loads(event.fields)
        outcome = BY_WORD.get(told.get("outcome", ""))
        if outcome is None:
            return False
        series = self._series[-1][1] if self._series else ""
        begin = time - float(told.get("time", 0.0))
        self._played.append(Chapter(next_name(self._played, series), series, begin, time, outcome))
        return True

    # --- what is told of it ------------------------------------------------------------------------------------------

    def about(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Take the metadata records of the log.

        Args:
            metadata: The records so far, by name.
        """
        self._metadata = metadata

    def part(self, stretch: Episode, *, unfinished: bool = False) -> str:
        """A stretch, with all that is told of the whole run: a document as JSON.

        Args:
            stretch: Of this run.
            unfinished: It goes on, and so does a bout that it ends with.
        """
        scene = Scene(begin=self._zero, end=max(stretch.until, stretch.since))
        run, junior, swarm = Timeline(), SumoPart(), MicroPart()
        gatherers = (run, junior, swarm)
        first = stretch.entries[0].time if stretch.entries else stretch.since
        for time, title in self._series:
            junior.series(time, title)
        for entry in takewhile(lambda kept: kept.time < first, self._kept):
            for part in gatherers:
                part.take(entry)
        for one in stretch.entries:
            entry = one.entry()
            for part in gatherers:
                part.take(entry)
        for part in (junior, swarm, run):
            part.put(scene)
        if unfinished and scene.chapters and scene.chapters[-1].outcome == BROKEN_OFF:
            scene.chapters[-1] = replace(scene.chapters[-1], outcome="", story="")
        return self._told(scene, stretch, swarm.classes)

    def _told(self, scene: Scene, stretch: Episode, classes: Mapping[str, int]) -> str:
        since = stretch.since
        first = since - STEP / 2  # what is rounded to it, or later
        chapters = self._numbered([one for one in scene.chapters if one.end > since + STEP], since)
        self._chapters.update((one.begin, one) for one in chapters)
        learnt = self._learning()
        whole = replace(
            scene,
            end=self._last,
            chapters=self._all_chapters(),
            curves=learnt.curves,
            lessons=learnt.lessons,
            notes=[*scene.notes, *learnt.notes],
        )
        words.tell(whole, self._metadata, classes, self._learner.trials)
        part = replace(
            whole,
            end=scene.end,
            chapters=chapters,
            terrain=self._ground(scene.terrain),
            tracks=[_since_track(track, first) for track in scene.tracks],
            traces=[_since_curves(trace, first) for trace in scene.traces],
            lanes=[_since_lane(lane, since) for lane in scene.lanes],
            marks=[mark for mark in scene.marks if mark.time >= first],
        )
        document = document_of(part, TimeScale(self._zero, STEP), since)
        log = self._metadata.get("run", {}).get("log", "")
        document |= {"played": len(self._played), "all": f"hil view {shlex.quote(log)}" if log else ""}
        return json.dumps(document, allow_nan=False, separators=(",", ":"))

    def _all_chapters(self) -> list[Chapter]:
        """Every chapter so far; of bouts that nobody was shown no more than how they ended."""
        if not self._played:
            return list(self._chapters.values())
        known = {(one.series, one.name): one for one in self._chapters.values()}
        against = next((one.against for one in reversed(known.values()) if one.against), "")
        return [known.get((one.series, one.name)) or replace(one, against=against) for one in self._played]

    def _learning(self) -> Scene:
        """What was learnt so far: gathered anew where there is more."""
        if self._learnt[0] != self._told_learner:
            scene = Scene()
            self._learner.put(scene)
            self._learnt = self._told_learner, scene
        return self._learnt[1]

    def _numbered(self, chapters: list[Chapter], since: float) -> list[Chapter]:
        """Bouts by their numbers in their series, as those are counted that were told of, or shown; others have their names."""
        found: list[Chapter] = []
        for one in chapters:
            told = sum(other.series == one.series and other.end < one.end - 2 * STEP for other in self._played)
            shown = sum(other.series == one.series and other.end <= since for other in self._chapters.values())
            here = sum(other.series == one.series for other in found)
            found.append(replace(one, name=f"Bout {1 + max(told, shown + here)}") if one.name.startswith("Bout ") else one)
        return found

    def _ground(self, terrain: Terrain | None) -> Terrain | None:
        """The arena; one whose size nobody tells does not shrink again."""
        before = self._terrain
        if terrain is not None and before is not None and terrain.ground is Ground.TABLE:
            terrain = replace(terrain, width=max(terrain.width, before.width), height=max(terrain.height, before.height))
        self._terrain = terrain or before
        return self._terrain


def _since_track(track: Track, since: float) -> Track:
    tables: dict[str, dict[str, Array]] = {}
    for name in ("poses", "senses", "rays"):
        table = getattr(track, name)
        if table:
            rows = table["t"] >= since
            tables[name] = {column: values[rows] for column, values in table.items()}
    return replace(track, poses=tables.get("poses", {}), senses=tables.get("senses", {}), rays=tables.get("rays", {}))


def _since_curves(trace: TimeCurves, since: float) -> TimeCurves:
    rows = trace.times >= since
    return replace(trace, times=trace.times[rows], values=tuple(values[rows] for values in trace.values))


def _since_lane(lane: Lane, since: float) -> Lane:
    rows = lane.end > since
    codes, used = np.unique(lane.code[rows].astype(np.int64), return_inverse=True)
    return replace(
        lane,
        begin=np.maximum(lane.begin[rows], since),
        end=lane.end[rows],
        code=used.astype(np.float64),
        words=tuple(lane.words[code] for code in codes),
        meanings=tuple(lane.meanings[code] for code in codes),
        tones=tuple(lane.tones[code] for code in codes),
    )
