"""Rooms with obstacles, read from images: what is dark stands in the way."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import resources
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pymunk
from PIL import Image, UnidentifiedImageError
from pymunk import autogeometry

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from simdevice.swarm.bodies import Segment

NAMES: Final = ("default", "narrow", "mixed")
"""The rooms that come with the program, by their numbers from 1."""
GRID: Final = 0.01
"""Side of a pixel on the table, in m."""
MOST_PIXELS: Final = 1024
"""Longest side of an image."""
_DARK: Final = 128
"""What is darker is an obstacle, of 0..255."""
_STRAIGHT: Final = 0.4
"""Outlines become straight within this, in pixels."""


@dataclass(frozen=True)
class Room:
    """A room on the table; its middle is the table's.

    Pixel (column, row), counted from the lowest left one, is the point grid (column - columns / 2), grid (row - rows / 2).

    Attributes:
        name: What it is called.
        free: Where nothing stands, shape (rows, columns); row 0 is the image's lowest.
        grid: Side of a pixel, in m.
        walls: Outlines of what stands in it: x, y of one end and x, y of the other, in m.
    """

    name: str
    free: NDArray[np.bool_]
    grid: float = GRID
    walls: tuple[Segment, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "walls", tuple(_trace(self.free, self.grid)))

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, in m."""
        rows, columns = self.free.shape
        return columns * self.grid, rows * self.grid

    def is_free(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which points of the table are no obstacle.

        Args:
            points: In m, shape (n, 2).

        Returns:
            Shape (n,); what is outside of the image is free.
        """
        rows, columns = self.free.shape
        column, row = np.rint(points / self.grid + (columns / 2, rows / 2)).astype(int).T
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        free = np.ones(len(points), bool)
        free[inside] = self.free[row[inside], column[inside]]
        return free


def built_in(name: str) -> Room:
    """A room that comes with the program.

    Args:
        name: One of `NAMES`.

    Raises:
        ValueError: There is none of this name.
    """
    if name not in NAMES:
        raise ValueError(f"there is no room {name!r}: the rooms are {', '.join(NAMES)}, or give an image")
    with resources.as_file(resources.files("simdevice.swarm") / "images" / f"{name}.png") as path:
        return Room(name, _read(path))


def from_image(path: Path, *, grid: float = GRID) -> Room:
    """Read a room from an image of any kind that Pillow reads; dark pixels are obstacles.

    Args:
        path: The image.
        grid: Side of a pixel, in m.

    Raises:
        ValueError: It can't be read, is too large, or nothing in it is free.
    """
    free = _read(path)
    if not free.any():
        raise ValueError(f"{path} is all obstacle: leave free what robots may drive on (light pixels)")
    return Room(path.stem, free, grid)


def _read(path: Path) -> NDArray[np.bool_]:
    """Which pixels of an image are light, its lowest row first.

    Raises:
        ValueError: It can't be read, or is too large.
    """
    try:
        with Image.open(path) as image:
            if max(image.size) > MOST_PIXELS:
                width, height = image.size
                raise ValueError(f"{path} has {width} x {height} pixels: at most {MOST_PIXELS} x {MOST_PIXELS} are read")
            picture = image.convert("RGBA")
    except (OSError, UnidentifiedImageError, Image.DecompressionBombError, SyntaxError) as error:
        raise ValueError(f"{path} can't be read as an image ({error}): give a PNG or a BMP") from error
    paper = Image.new("RGBA", picture.size, "white")  # what is transparent is free
    grey: NDArray[Any] = np.asarray(Image.alpha_composite(paper, picture).convert("L"))
    return grey[::-1] >= _DARK


def _trace(free: NDArray[np.bool_], grid: float) -> list[Segment]:
    """Segments around all that is not free, in m."""
    rows, columns = free.shape
    if free.all():
        return []
    solid = np.pad(~free, 1).astype(float)  # an obstacle at the border is closed there

    def sample(point: tuple[float, float]) -> float:
        return float(solid[round(point[1]) + 1, round(point[0]) + 1])

    box = pymunk.BB(-1.0, -1.0, columns, rows)
    outlines = autogeometry.march_soft(box, columns + 2, rows + 2, 0.5, sample)
    walls: list[Segment] = []
    for outline in outlines:
        points = (np.array(autogeometry.simplify_curves(outline, _STRAIGHT)) - (columns / 2, rows / 2)) * grid
        walls += [(*start, *end) for start, end in zip(points[:-1].tolist(), points[1:].tolist(), strict=True)]
    return walls
