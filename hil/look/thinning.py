"""Leaves out of a scene what a page has no room for: never a bout's end, an event, or an extreme of a curve."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from hil.look.scene import DECISION

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from hil.look.scene import Mark, Scene, TimeCurves, Track

    Array = NDArray[np.float64]

INTERVALS: Final = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 300.0)
"""Of two poses, or of two pairs of extremes, in s: tried in turn until the scene fits."""
LEAST_MARKS: Final = 2_000


def thinned(scene: Scene, text_of: Callable[[Scene], str], room: int) -> str:
    """The scene's document, made to fit.

    Args:
        scene: The scene.
        text_of: Makes its document.
        room: Bytes that the document may have.

    Returns:
        The document of the scene, or of one with less in it, which says what is missing.
    """
    text = text_of(scene)
    fits = _rows_of(scene) * room / len(text)  # so many rows, by and large: what has many more is not tried
    sparse = scene
    for interval in INTERVALS:
        if len(text) <= room:
            return text
        sparse = _sparser(scene, interval)
        if _rows_of(sparse) <= 1.2 * fits or interval == INTERVALS[-1]:
            text = text_of(sparse)
    return text if len(text) <= room else text_of(_few(sparse))


def _rows_of(scene: Scene) -> int:
    """Numbers of a scene's bodies and curves."""
    tables = (table for track in scene.tracks for table in (track.poses, track.senses, track.rays))
    bodies = sum(len(values) for table in tables for values in table.values())
    return bodies + sum(len(trace.times) * (1 + len(trace.values)) for trace in scene.traces)


def _sparser(scene: Scene, interval: float) -> Scene:
    ends = np.array([time for chapter in scene.chapters for time in (chapter.begin, chapter.end)] or [scene.begin, scene.end])
    marks = [mark for mark in scene.marks if mark.kind != DECISION]
    but = ", but for the learner’s decisions" if len(marks) < len(scene.marks) else ""
    note = (
        f"The log is long: places are shown every {interval:g} s, and curves by the least and the greatest value of every "
        f"{interval:g} s. Beginnings and ends of bouts, and all events, are kept{but}."
    )
    return replace(
        scene,
        notes=[*scene.notes, note],
        marks=marks,
        tracks=[_track(track, ends, interval) for track in scene.tracks],
        traces=[_trace(trace, interval) for trace in scene.traces],
    )


def _track(track: Track, ends: Array, interval: float) -> Track:
    return replace(
        track,
        poses=_rows(track.poses, ends, interval),
        senses=_rows(track.senses, ends, interval),
        rays=_rows(track.rays, ends, interval),
    )


def _rows(table: dict[str, Array], ends: Array, interval: float) -> dict[str, Array]:
    """Of each stretch of time the first row; and those at and just before the ends of bouts, where they begin anew."""
    if not table:
        return table
    times = table["t"]
    keep = np.diff(np.floor(times / interval), prepend=-1.0) != 0
    at = np.searchsorted(times, ends)
    for near in (at - 1, at):
        keep[near[(near >= 0) & (near < len(times))]] = True
    if "gap" in table:
        begins = np.flatnonzero(table["gap"] > 0)
        keep[begins] = True
        keep[begins[begins > 0] - 1] = True
    keep[-1] = True
    return {name: values[keep] for name, values in table.items()}


def _trace(trace: TimeCurves, interval: float) -> TimeCurves:
    """Of each stretch of time the rows in which a curve has its least and its greatest value."""
    kept = extremes(trace.times, trace.values, interval)
    return replace(trace, times=trace.times[kept], values=tuple(values[kept] for values in trace.values))


def extremes(times: Array, values: tuple[Array, ...], interval: float) -> NDArray[np.int64]:
    """Rows that keep the shape of curves: in every stretch of time, where each is least and greatest; holes and ends.

    Args:
        times: In s, ascending; shape (n,).
        values: Of each curve, shape (n,).
        interval: Length of a stretch, in s.

    Returns:
        The rows, ascending.
    """
    if len(times) < 3:
        return np.arange(len(times))
    starts = np.flatnonzero(np.diff(np.floor(times / interval), prepend=-np.inf) != 0)
    keep = np.zeros(len(times), np.bool_)
    keep[[0, -1]] = True
    behind = np.append(starts[1:], len(times))
    stretch = np.repeat(np.arange(len(starts)), behind - starts)
    for one in values:
        holes = np.isnan(one)
        for sign in (1.0, -1.0):
            ranked = np.where(holes, np.inf, sign * one)
            least = np.minimum.reduceat(ranked, starts)
            rows = np.flatnonzero((ranked == least[stretch]) & ~holes)
            first = rows[np.diff(stretch[rows], prepend=-1) != 0]
            keep[first] = True
        keep[np.flatnonzero(np.diff(holes.astype(np.int8), prepend=np.int8(0)))] = True
    return np.flatnonzero(keep)


def _few(scene: Scene) -> Scene:
    """What is left where even that is too much: a log of events without end."""
    marks = scene.marks
    kinds: dict[str, int] = {}
    kept: list[Mark] = []
    for mark in marks:
        kinds[mark.kind] = kinds.get(mark.kind, 0) + 1
        if kinds[mark.kind] <= LEAST_MARKS and len(kept) < 2 * LEAST_MARKS:
            kept.append(mark)
    note = f"There are {len(marks):,} events, more than a page has room for: {len(kept):,} are shown."
    return replace(
        scene,
        notes=[*scene.notes, note],
        marks=kept,
        lanes=[
            replace(lane, begin=lane.begin[:LEAST_MARKS], end=lane.end[:LEAST_MARKS], code=lane.code[:LEAST_MARKS])
            for lane in scene.lanes
            if len(lane.words) < LEAST_MARKS
        ],
        chapters=scene.chapters[:LEAST_MARKS],
    )
