"""A scene as a document: plain values as JSON has them, and all columns in one block.

The page takes documents as *parts*: it puts what a part holds behind what it has, by the keys of tracks and the names of traces
and lanes. A page of a log holds one part; a page that is served while the run goes on is sent one part after the other.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from hil.look.columns import LARGEST, Columns

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hil.look.scene import BodyShape, Lane, LearningCurves, Scene, Terrain, TimeCurves, Track

VERSION: Final = 1
STEPS: Final = {"x": 1e-4, "y": 1e-4, "heading": 1e-3, "radius": 1e-3}
"""What columns are rounded to, by name, in SI units; rays to mm, all others to whole numbers; for times see `TimeScale`."""
DIGITS: Final = 2000
"""Values of a trace are told in so many steps from its least to its greatest."""
LONGEST_TEXT: Final = 400
"""Letters of a text that a log holds; the rest is cut off."""
_ESCAPES: Final = str.maketrans({"<": "\\u003c", ">": "\\u003e", "&": "\\u0026"})
"""What is left to escape of text that has no letter outside ASCII any more: the line separators U+2028 and U+2029 are none."""


@dataclass(frozen=True)
class TimeScale:
    """How times are told: from the beginning of the scene, since a log's own clock may be that of a computer's start.

    Attributes:
        zero: Log time that is told as 0, in s.
        step: What times are rounded to, in s.
    """

    zero: float
    step: float

    @classmethod
    def of(cls, scene: Scene) -> TimeScale:
        """The clock of a scene: to the ms, and coarser where it lasts longer than six days."""
        span = max(scene.end - scene.begin, 1.0)
        return cls(scene.begin, 1e-3 * 10.0 ** max(0, math.ceil(math.log10(span * 1e3 / LARGEST))))

    def add(self, columns: Columns, times: NDArray[np.float64]) -> dict[str, Any]:
        """Take a column of times; shape (n,)."""
        return columns.add(times - self.zero, self.step)

    def tell(self, time: float) -> float | None:
        """A time by itself."""
        return _number(time - self.zero)


def text_of(scene: Scene) -> str:
    """The document as JSON that can stand inside a page's script element: no character in it means anything to HTML.

    Args:
        scene: What is to be shown.
    """
    return json.dumps(document_of(scene), allow_nan=False, ensure_ascii=True, separators=(",", ":")).translate(_ESCAPES)


def document_of(scene: Scene, scale: TimeScale | None = None, since: float | None = None) -> dict[str, Any]:
    """The document.

    Args:
        scene: What is to be shown.
        scale: How times are told; None: from the beginning of the scene. All parts of one run have the same.
        since: Log time from which on this replaces what was told before, in s; None: it replaces nothing.
    """
    columns = Columns()
    shapes: list[BodyShape] = []
    scale = scale or TimeScale.of(scene)
    tracks = [_track(track, shapes, columns, scale) for track in scene.tracks]
    document: dict[str, Any] = {
        "version": VERSION,
        "title": _short(scene.title),
        "source": _short(scene.source),
        "said": [_short(text) for text in scene.said],
        "facts": [[_short(value), _short(text)] for value, text in scene.facts],
        "notes": [_short(text) for text in scene.notes],
        "about": [[_short(name), _short(value)] for name, value in scene.about],
        "begin": scale.tell(scene.begin),
        "end": scale.tell(scene.end),
        "terrain": None if scene.terrain is None else _terrain(scene.terrain),
        "shapes": [_shape(shape) for shape in shapes],
        "tracks": tracks,
        "traces": [_trace(trace, columns, scale) for trace in scene.traces],
        "lanes": [_lane(lane, columns, scale) for lane in scene.lanes],
        "marks": [[scale.tell(mark.time), _short(mark.kind), _short(mark.text)] for mark in scene.marks],
        "chapters": [
            {
                "name": _short(one.name),
                "series": _short(one.series),
                "begin": scale.tell(one.begin),
                "end": scale.tell(one.end),
                "outcome": _short(one.outcome),
                "against": _short(one.against),
                "story": _short(one.story),
            }
            for one in scene.chapters
        ],
        "curves": [_curve(curve, columns) for curve in scene.curves],
        "lessons": [
            {
                "when": _short(one.when),
                "steps": [
                    [_short(step.name), _short(step.meaning), _number(step.left), _number(step.right)] for step in one.steps
                ],
                "does": _short(one.does),
                "worth": _short(one.worth),
                "why": [_short(text) for text in one.why],
            }
            for one in scene.lessons
        ],
    }
    if since is not None:
        document["since"] = scale.tell(since)
    document["columns"] = columns.text()
    return document


def _track(track: Track, shapes: list[BodyShape], columns: Columns, scale: TimeScale) -> dict[str, Any]:
    if track.shape not in shapes:
        shapes.append(track.shape)
    return {
        "key": _short(track.key),
        "label": _short(track.label),
        "kind": _short(track.kind),
        "shape": shapes.index(track.shape),
        **{name: _table(getattr(track, name), columns, scale) for name in ("poses", "senses", "rays") if getattr(track, name)},
    }


def _table(table: dict[str, NDArray[np.float64]], columns: Columns, scale: TimeScale) -> dict[str, Any]:
    return {
        name: scale.add(columns, values)
        if name == "t"
        else columns.add(values, STEPS.get(name, 1e-3 if name[0] == "r" else 1.0))
        for name, values in table.items()
    }


def _terrain(place: Terrain) -> list[object]:
    obstacles = [[[_number(x), _number(y)] for x, y in outline] for outline in place.obstacles]
    return [str(place.ground), _number(place.width), _number(place.height), place.wall, obstacles]


def _shape(shape: BodyShape) -> dict[str, Any]:
    return {
        "outline": shape.outline,
        "radius": shape.radius,
        "sectors": shape.sectors,
        "beams": [[one.x, one.y, one.angle, one.half_cone, one.reach, one.bit] for one in shape.beams],
        "spots": [[_short(one.name), one.points, one.bit] for one in shape.spots],
    }


def _trace(trace: TimeCurves, columns: Columns, scale: TimeScale) -> dict[str, Any]:
    return {
        "name": _short(trace.name),
        "unit": _short(trace.unit),
        "labels": [_short(label) for label in trace.labels],
        "t": scale.add(columns, trace.times),
        "values": [columns.add(values, step_of(values)) for values in trace.values],
        "stepped": trace.stepped,
        "level": None if trace.level is None else _number(trace.level),
        "levelName": _short(trace.level_name),
    }


def step_of(values: NDArray[np.float64]) -> float:
    """A round step that tells a curve's values finely enough to be drawn and read.

    Args:
        values: The values, shape (n,).
    """
    good = values[abs(values) < 1e9]  # NaN is not
    if not len(good):
        return 1.0
    span = float(good.max() - good.min()) or float(abs(good[0]))
    return 1.0 if span > DIGITS or not span else 10.0 ** max(-9, math.floor(math.log10(span / DIGITS)))


def _lane(lane: Lane, columns: Columns, scale: TimeScale) -> dict[str, Any]:
    return {
        "name": _short(lane.name),
        "begin": scale.add(columns, lane.begin),
        "end": scale.add(columns, lane.end),
        "code": columns.add(lane.code, 1.0),
        "words": [_short(word) for word in lane.words],
        "meanings": [_short(word) for word in lane.meanings],
        "tones": [_short(tone) for tone in lane.tones],
    }


def _curve(curve: LearningCurves, columns: Columns) -> dict[str, Any]:
    return {
        "name": _short(curve.name),
        "unit": _short(curve.unit),
        "along": _short(curve.along),
        "labels": [_short(label) for label in curve.labels],
        "x": [columns.add(values, step_of(values)) for values in curve.x],
        "y": [columns.add(values, step_of(values)) for values in curve.y],
    }


def _short(text: str) -> str:
    return text if len(text) <= LONGEST_TEXT else text[: LONGEST_TEXT - 1] + "…"


def _number(value: float) -> float | None:
    return round(float(value), 4) if math.isfinite(value) else None
