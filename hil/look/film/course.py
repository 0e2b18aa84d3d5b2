"""What an animation shows: of one chapter of a scene, where everybody is at every picture, and what is said beneath."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.errors import HilError
from firmware_protocol.vocabulary import ObservationFlag
from hil.look.scene import Chapter, Ground

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.look.scene import Array, Scene, Terrain, Track

INTERVAL: Final = 0.05
"""Between two pictures, in s of the animation; GIF counts in hundredths."""
CROWD: Final = 12
"""With more bodies than that, there are half as many pictures, since all change much, and no trails."""
LONGEST: Final = 16.0
"""An animation lasts no longer, in s: a bout has 15."""
SPEEDS: Final = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)
"""How much faster than it happened; the slowest that fits is taken."""
CONTACTS: Final = int(ObservationFlag.CONTACT_AHEAD | ObservationFlag.CONTACT)
"""Bits of an observation's flags: it touches something."""


class FilmError(HilError):
    """There is nothing to make an animation of, or no such bout; the text says what there is."""


@dataclass(frozen=True)
class FilmBody:
    """A body in all pictures.

    Attributes:
        track: Whose.
        x: In m, shape (n,).
        y: Likewise.
        heading: In rad.
        flags: What it senses, as in its track.
    """

    track: Track
    x: Array
    y: Array
    heading: Array
    flags: NDArray[np.int64]


@dataclass(frozen=True)
class Film:
    """An animation.

    Attributes:
        title: What it is of.
        terrain: The arena.
        times: Since its beginning, of each picture, in s as they passed for the robots; shape (n,).
        speed: How much faster it is shown.
        interval: Between two pictures as shown, in s.
        bodies: Who is in it, those first that are drawn first.
        captions: What is said beneath each picture.
        verdict: How it ended, in a word; empty where it has no outcome.
    """

    title: str
    terrain: Terrain
    times: Array
    speed: int
    interval: float
    bodies: tuple[FilmBody, ...]
    captions: tuple[str, ...]
    verdict: str = ""


def film_of(scene: Scene, chapter: Chapter | None) -> Film:
    """An animation of a chapter of a scene.

    Args:
        scene: The scene.
        chapter: One of its chapters; None: all of it.

    Raises:
        FilmError: Nobody knows where its robots were.
    """
    terrain = scene.terrain
    tracks = [track for track in scene.tracks if len(track.poses["t"])]
    if terrain is None or terrain.ground is Ground.NONE or not tracks:
        raise FilmError("there is nothing to animate: the log does not say where a robot was")
    part = chapter or Chapter(scene.title, "", scene.begin, scene.end)
    length = part.end - part.begin
    speed = next((one for one in SPEEDS if length / one <= LONGEST), SPEEDS[-1])
    interval = INTERVAL * (2 if len(tracks) > CROWD else 1)
    times = np.append(np.arange(0.0, min(length, LONGEST * speed), interval * speed), length)
    bodies = tuple(_body(track, part.begin + times) for track in tracks)
    title = f"Junior against {part.against}" if part.against else " ".join(scene.title.split())
    return Film(title, terrain, times, speed, interval, bodies, _captions(scene, part, times), part.outcome)


def pick(scene: Scene, which: str = "") -> Chapter | None:
    """A chapter of a scene that a person names.

    Args:
        scene: The scene.
        which: Its number, as `3`; where there are several series, after a word of the series' title, as `coaching:3`. Empty:
            the last that was won, or else the last that has an outcome, or else the last.

    Returns:
        It; None where the scene has none and none was named.

    Raises:
        FilmError: There is none such, or several.
    """
    chapters = scene.chapters
    if not which:
        best = [one for one in chapters if one.outcome == "won"] or [one for one in chapters if one.outcome] or chapters
        return best[-1] if best else None
    word, _, number = which.rpartition(":")
    series = [title for title in dict.fromkeys(one.series for one in chapters) if word.lower() in title.lower()]
    of_series = [one for one in chapters if one.series in series]
    if not of_series or len(series) > 1:
        raise FilmError(f"which bout is {which!r}? {_choices(chapters)}")
    found = [one for one in of_series if one.name.partition(",")[0].rpartition(" ")[2] == number]
    if not found:
        raise FilmError(f"there is no bout {which!r}: {_choices(chapters)}")
    return found[0]


def _choices(chapters: list[Chapter]) -> str:
    """What could be named."""
    if not chapters:
        return "the log has no bouts"
    counts = Counter(one.series for one in chapters)
    if len(counts) == 1:
        return f"the log has 1 to {len(chapters)}"
    listed = ", ".join(f"{count} of {title or 'no series'!r}" for title, count in counts.items())
    return f"the log has {listed}: name a word of the series and a number in it, as {next(iter(counts)).split(' ')[-1]}:1"


def _body(track: Track, times: Array) -> FilmBody:
    """A body at some log times: on a straight line between two places that are known, as on the page."""
    told = track.poses["t"]
    at = np.clip(np.searchsorted(told, times, side="right") - 1, 0, len(told) - 1)
    following = np.minimum(at + 1, len(told) - 1)
    apart = told[following] - told[at]
    share = np.divide(times - told[at], apart, out=np.zeros(len(times)), where=apart > 0).clip(0.0, 1.0)
    if "gap" in track.poses:
        share[track.poses["gap"][following] > 0] = 0.0
    x, y, heading = (track.poses[name] for name in ("x", "y", "heading"))
    turn = (heading[following] - heading[at] + np.pi) % (2 * np.pi) - np.pi
    flags = np.zeros(len(times), np.int64)
    table = track.senses if "flags" in track.senses else track.poses
    if "flags" in table:
        felt = np.maximum(times, times[0] + INTERVAL)  # at first it is told what it sensed before it was put there
        row = np.searchsorted(table["t"], felt, side="right") - 1
        flags = np.where(row >= 0, table["flags"][np.maximum(row, 0)], 0).astype(np.int64)
    return FilmBody(
        track,
        x[at] + share * (x[following] - x[at]),
        y[at] + share * (y[following] - y[at]),
        heading[at] + share * turn,
        flags,
    )


def _captions(scene: Scene, part: Chapter, times: Array) -> tuple[str, ...]:
    """What is said beneath each picture: the maneuver, or how far a swarm has come; and in the end how it ended."""
    said = _performed(scene, part.begin + times) if part.series != "surround" else _measured(scene, part.begin + times)
    return (*said[:-1], part.story or said[-1])


def _performed(scene: Scene, times: Array) -> list[str]:
    lane = next((one for one in scene.lanes if one.name == "Maneuver"), None)
    if lane is None or not len(lane.begin):
        return [""] * len(times)
    rows = np.searchsorted(lane.begin, times, side="right") - 1
    on = (rows >= 0) & (times < lane.end[np.maximum(rows, 0)])
    words = [meaning.partition(" (")[0] or word for word, meaning in zip(lane.words, lane.meanings, strict=True)]
    return [words[int(lane.code[row])] if there else "" for row, there in zip(rows, on, strict=True)]


def _measured(scene: Scene, times: Array) -> list[str]:
    found = []
    for time in times:
        parts = []
        for curves in scene.traces:
            row = int(np.searchsorted(curves.times, time, side="right")) - 1
            if curves.name == "Share" and row >= 0 and np.isfinite(curves.values[0][row]):
                parts.append(f"{curves.labels[0]}: {curves.values[0][row]:.0%}")
            elif curves.name == "Mean distance" and row >= 0 and np.isfinite(curves.values[0][row]):
                parts.append(f"step {row}, {curves.labels[0]}: {curves.values[0][row]:.2f} {curves.unit}")
        found.append("; ".join(parts))
    return found


def twin_of(film: Film) -> str:
    """What the animation shows, to be read: where everybody is once a second of it, and in the end.

    Args:
        film: The animation.

    Returns:
        CSV, behind lines that begin with `#`.
    """
    each = round(1.0 / film.interval)
    pictures = sorted({*range(0, len(film.times), each), len(film.times) - 1})
    place = film.terrain
    pace = f"{film.speed} times as fast as it was" if film.speed > 1 else "as fast as it was"
    lines = [
        f"# {film.title}: {len(film.times)} pictures, {pace}",
        f"# {place.ground} of {place.width:g} x {place.height:g} m; {film.captions[-1]}",
        "seconds,body,x_mm,y_mm,heading_deg",
    ]
    for picture in pictures:
        for body in film.bodies:
            x, y = (round(1e3 * float(one[picture])) for one in (body.x, body.y))
            heading = round(np.degrees(float(body.heading[picture]))) % 360
            lines.append(f"{film.times[picture]:.2f},{body.track.key},{x},{y},{heading}")
    return "\n".join(lines) + "\n"
