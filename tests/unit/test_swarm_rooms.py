"""Rooms: images become walls that rays and robots meet where the image is dark."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from simdevice.swarm.profile import PROFILES
from simdevice.swarm.rooms import NAMES, Room, built_in, from_image
from simdevice.swarm.table import SwarmTable

if TYPE_CHECKING:
    from pathlib import Path


def picture(path: Path, dark: list[tuple[int, int]], size: tuple[int, int] = (40, 20)) -> Path:
    image = Image.new("L", size, 255)
    for pixel in dark:
        image.putpixel(pixel, 0)
    image.save(path)
    return path


@pytest.mark.parametrize("kind", ["png", "bmp"])
def test_the_lowest_row_of_an_image_is_the_lowest_of_the_room(tmp_path: Path, kind: str) -> None:
    room = from_image(picture(tmp_path / f"corner.{kind}", [(x, y) for x in range(5) for y in range(17, 20)]))
    assert (room.name, room.size) == ("corner", (0.4, 0.2))
    assert not room.free[:3, :5].any()
    assert room.free.sum() == 40 * 20 - 15
    points = np.array([[-0.2, -0.1], [-0.16, -0.08], [-0.15, -0.08], [-0.16, -0.07], [3.0, 3.0]])
    assert room.is_free(points).tolist() == [False, False, True, True, True]


def test_walls_lie_half_way_between_dark_and_light(tmp_path: Path) -> None:
    room = from_image(picture(tmp_path / "block.png", [(x, y) for x in range(10, 20) for y in range(5, 10)]))
    ends = np.array(room.walls).reshape(-1, 2)
    assert ends[:, 0].min() == pytest.approx(0.01 * (9.5 - 20))
    assert ends[:, 0].max() == pytest.approx(0.01 * (19.5 - 20))
    assert ends[:, 1].min() == pytest.approx(0.01 * (9.5 - 10))
    assert ends[:, 1].max() == pytest.approx(0.01 * (14.5 - 10))
    assert len(room.walls) <= 8


def test_what_is_transparent_is_free(tmp_path: Path) -> None:
    image = Image.new("RGBA", (8, 8), (0, 0, 0, 0))
    image.putpixel((3, 3), (0, 0, 0, 255))
    image.save(tmp_path / "clear.png")
    assert from_image(tmp_path / "clear.png").free.sum() == 63


@pytest.mark.parametrize("name", NAMES)
def test_the_rooms_of_the_program_hold_robots_outside_of_obstacles(name: str) -> None:
    room = built_in(name)
    assert room.free.shape == (204, 204)
    table = SwarmTable([0] * 10, profile=PROFILES["none"])
    table.reset(1, wall=True, room=room)
    places = np.stack((table.arrays.x, table.arrays.y), axis=1)
    assert room.is_free(places).all()
    assert not table.contacts().any()
    ranges, robots = table.ranges(0, 32, 2.5)
    assert np.isfinite(ranges).all()  # a room is closed
    for ray in np.flatnonzero(~robots):
        way = np.linspace(0.03, ranges[ray] - 0.008, 50)[:, None]
        bearing = ray * math.tau / 32
        assert room.is_free(places[0] + way * (math.cos(bearing), math.sin(bearing))).all()


def test_nobody_drives_through_a_wall() -> None:
    table = SwarmTable([0] * 30, profile=PROFILES["none"])
    room = built_in("narrow")
    table.reset(1, wall=True, room=room)
    chance = np.random.default_rng(1)
    for _ in range(20):
        table.arrays.command[:] = np.repeat(chance.uniform(-0.4, 0.4, 30), 2) + chance.uniform(-0.1, 0.1, 60)
        table.run(100)
    assert room.is_free(np.stack((table.arrays.x, table.arrays.y), axis=1)).all()
    assert np.abs(table.arrays.x).max() < 1.01


def test_what_is_no_room_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"dark\.png is all obstacle"):
        from_image(picture(tmp_path / "dark.png", [(x, y) for x in range(4) for y in range(4)], (4, 4)))
    with pytest.raises(ValueError, match=r"wide\.png has 1025 x 2 pixels: at most 1024 x 1024"):
        from_image(picture(tmp_path / "wide.png", [], (1025, 2)))
    (tmp_path / "text.png").write_text("no image", encoding="utf-8")
    for name in ("text.png", "missing.png"):
        with pytest.raises(ValueError, match=rf"{name} can't be read as an image .*: give a PNG or a BMP"):
            from_image(tmp_path / name)
    with pytest.raises(ValueError, match="no room 'cellar': the rooms are default, narrow, mixed"):
        built_in("cellar")


def test_an_empty_room_has_no_walls() -> None:
    assert Room("empty", np.ones((3, 4), bool)).walls == ()
