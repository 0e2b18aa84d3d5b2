"""Animations: which bout is meant, where everybody is at each picture, what is drawn, and `hil view --gif`."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image, ImageChops
from report_logs import bout_log, driving_log
from scenes import HOSTILE, scene_of

from firmware_protocol.messages import BoutOutcome
from hil.cli.app import run
from hil.look.film.course import CROWD, INTERVAL, LONGEST, FilmError, film_of, pick, twin_of
from hil.look.film.drawing import LAST, WIDTH, color, gif_of
from hil.look.scene import BodyShape, Chapter, Ground, Lane, Scene, Terrain, Track

if TYPE_CHECKING:
    from pathlib import Path


def ring(*, end: float = 4.0, kind: str = "junior", bodies: int = 1) -> Scene:
    """Bodies that drive along x at 0.05 m/s and turn through half a turn at 2 s."""
    times = np.array([0.0, 1.0, 3.0, end])
    heading = np.array([3.0, 3.0, -3.0, -3.0])
    shape = BodyShape(((0.05, 0.05), (-0.05, 0.05), (-0.05, -0.05), (0.05, -0.05)))
    tracks = [
        Track(str(number), "J", kind, shape, {"t": times, "x": 0.05 * times - 0.1, "y": 0 * times, "heading": heading})
        for number in range(bodies)
    ]
    lane = Lane("Maneuver", times[:1], times[2:3], np.zeros(1), ("FF",), ("fast forward (FF)",), ("even",))
    chapters = [Chapter("Bout 1", "coaching", 0.0, end, "won", "flat-heavy", "Won.")]
    return Scene(
        "Title", begin=0.0, end=end, terrain=Terrain(Ground.RING, 0.65, 0.42), tracks=tracks, lanes=[lane], chapters=chapters
    )


CHAPTERS = [
    Chapter("Bout 1", "coaching", 0, 1, "won"),
    Chapter("Bout 2", "coaching", 1, 2, "lost"),
    Chapter("Bout 1", "bouts played by the advice", 2, 3, "won"),
    Chapter("Bout 2", "bouts played by the advice", 3, 4, "lost"),
]


@pytest.mark.parametrize(("which", "index"), [("coaching:2", 1), ("advice:1", 2), ("Advice:2", 3), ("", 2)])
def test_a_bout_is_named_by_its_number_and_a_word_of_its_series(which: str, index: int) -> None:
    assert pick(Scene(chapters=CHAPTERS), which) is CHAPTERS[index]


def test_the_only_series_needs_no_word() -> None:
    assert pick(Scene(chapters=CHAPTERS[:2]), "2") is CHAPTERS[1]
    assert pick(Scene(chapters=CHAPTERS[1:2])) is CHAPTERS[1], "where none was won, the last that has an outcome"
    assert pick(Scene()) is None


@pytest.mark.parametrize(
    ("which", "said"), [("2", "2 of 'coaching'"), ("nobody:1", "2 of 'coaching'"), ("advice:9", "no bout")]
)
def test_who_names_none_is_told_what_there_is(which: str, said: str) -> None:
    with pytest.raises(FilmError, match=said):
        pick(Scene(chapters=CHAPTERS), which)
    with pytest.raises(FilmError, match="no bouts"):
        pick(Scene(), which)


def test_places_between_two_that_are_known_are_on_a_straight_line_and_the_short_way_round() -> None:
    film = film_of(ring(), ring().chapters[0])
    (body,) = film.bodies
    assert film.speed == 1
    assert np.allclose(np.diff(film.times)[:-1], INTERVAL)
    assert film.times[-1] == 4.0
    assert np.allclose(body.x, 0.05 * film.times - 0.1)
    middle = int(np.searchsorted(film.times, 2.0))
    assert np.cos(body.heading[middle]) == pytest.approx(-1.0)


def test_between_two_bouts_nothing_slides() -> None:
    scene = ring()
    scene.tracks[0].poses["gap"] = np.array([0.0, 0.0, 1.0, 0.0])
    film = film_of(scene, None)
    between = (film.times > 1.0) & (film.times < 3.0)
    assert np.allclose(film.bodies[0].x[between], -0.05)


def test_what_is_performed_stands_beneath_and_in_the_end_how_it_ended() -> None:
    film = film_of(ring(), ring().chapters[0])
    assert film.captions[0] == "fast forward"
    assert film.captions[-2] == ""
    assert film.captions[-1] == "Won."


def test_what_takes_long_is_shown_faster() -> None:
    scene = ring(end=100.0)
    film = film_of(scene, scene.chapters[0])
    assert film.speed == 8
    assert len(film.times) <= LONGEST / INTERVAL + 1
    scene = ring(end=1e6)
    assert len(film_of(scene, scene.chapters[0]).times) <= LONGEST / INTERVAL + 2


def test_where_nobody_knows_where_robots_are_there_is_nothing_to_animate() -> None:
    for terrain in (None, Terrain(Ground.NONE, 1.0, 1.0)):
        with pytest.raises(FilmError, match="does not say where"):
            film_of(replace(ring(), terrain=terrain), None)


def test_the_twin_tells_where_everybody_is_once_a_second() -> None:
    lines = twin_of(film_of(ring(), ring().chapters[0])).splitlines()
    assert lines[0].startswith("# Junior against flat-heavy: 81 pictures")
    assert lines[2:] == [
        "seconds,body,x_mm,y_mm,heading_deg",
        "0.00,0,-100,0,172", "1.00,0,-50,0,172", "2.00,0,0,0,180", "3.00,0,50,0,188", "4.00,0,100,0,188",
    ]  # fmt: skip


def test_the_gif_has_all_pictures_and_its_twin() -> None:
    film = film_of(ring(end=1.0), ring(end=1.0).chapters[0])
    with Image.open(io.BytesIO(gif_of(film))) as image:
        assert image.info["comment"].decode() == twin_of(film)
        assert image.info["loop"] == 0
        assert image.width == WIDTH
        assert getattr(image, "n_frames", 0) == len(film.times) == 21
        first = image.convert("RGB")
        image.seek(20)
        assert image.info["duration"] == 1e3 * LAST
        assert ImageChops.difference(first, image.convert("RGB")).getbbox() is not None


def test_a_crowd_has_half_as_many_pictures_and_every_kind_is_drawn() -> None:
    for kind in ("ranger", "wild", "robot", "box", "goal", "anything"):
        scene = ring(end=1.0, kind=kind, bodies=CROWD + 1)
        film = film_of(scene, scene.chapters[0])
        assert film.interval == 2 * INTERVAL
        assert gif_of(film)


def test_obstacles_are_drawn_and_a_hole_in_one_is_none() -> None:
    square = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
    outlines = tuple(tuple((side * x, side * y) for x, y in square) for side in (0.15, 0.1))
    scene = ring(end=0.0)
    assert scene.terrain is not None
    film = film_of(replace(scene, terrain=replace(scene.terrain, ground=Ground.TABLE, obstacles=outlines)), scene.chapters[0])
    with Image.open(io.BytesIO(gif_of(film))) as image:
        seen = image.convert("RGB")
        middle = image.width // 2, (image.height - 30 + 28) // 2
        scale = image.width / 0.65
        places = [seen.getpixel((round(middle[0] + x * scale), middle[1])) for x in (0.12, 0.05)]
    for place, name in zip(places, ("obstacle", "ground"), strict=True):
        assert isinstance(place, tuple)
        assert np.allclose(place, color(name)[:3], atol=8)


@pytest.mark.parametrize("text", HOSTILE)
def test_texts_that_mean_harm_are_texts(text: str) -> None:
    scene = scene_of(text)
    film = film_of(replace(scene, tracks=scene.tracks[:1]), replace(scene.chapters[0], end=1.0))
    assert gif_of(film)


def test_colours_are_the_page_s_own() -> None:
    assert color("ground") == (0xFD, 0xFD, 0xFB, 255)
    assert color("beam-lit") == (230, 159, 0, 82)


def test_a_verb_draws_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, gif = tmp_path / "log.mcap", tmp_path / "there" / "b.gif"
    bout_log(log, [(BoutOutcome.WIN, 1.0), (BoutOutcome.LOSS, 1.0)])
    command = ["view", str(log), "--gif", str(gif)]
    assert run([*command, "--bout", "2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"picture": str(gif), "title": "Junior against flat-heavy", "notes": []}
    assert gif.read_bytes().startswith(b"GIF89a")
    assert not list(tmp_path.glob("*.html"))
    assert run(command) == 2
    assert "is there already" in capsys.readouterr().err
    assert run([*command, "--overwrite", "--bout", "3"]) == 2
    assert "the log has 1 to 2" in capsys.readouterr().err


def test_what_does_not_go_together_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["view", "x.mcap", "--bout", "2"]) == 2
    assert "--bout goes with --gif" in capsys.readouterr().err
    assert run(["view", "x.mcap", "--gif", "b.gif", "-o", "p.html"]) == 2
    assert "give one of the two" in capsys.readouterr().err
    log = tmp_path / "drive.mcap"
    driving_log(log)
    assert run(["view", str(log), "--gif", str(tmp_path / "d.gif")]) == 2
    assert "does not say where a robot was" in capsys.readouterr().err
