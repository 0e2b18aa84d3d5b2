"""Draws an animation with Pillow, in the page's own colours, on a light ground of its own."""

from __future__ import annotations

import io
import re
import textwrap
from functools import cache
from importlib.resources import files
from math import cos, degrees, sin
from typing import TYPE_CHECKING, Final

from PIL import Image, ImageChops, ImageDraw, ImageFont

from hil.look.film.course import CONTACTS, CROWD, twin_of
from hil.look.scene import Ground

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.look.film.course import Film, FilmBody
    from hil.look.scene import Terrain

    Pixel = tuple[float, float]
    Color = tuple[int, int, int, int]

WIDTH: Final = 480
"""Of a picture, in pixels."""
MOST_HEIGHT: Final = 480
"""Of the arena in it, in pixels."""
FINER: Final = 2
"""It is drawn so many times larger, so that edges are smooth."""
COLORS: Final = 64
"""All pictures share so many."""
SAMPLED: Final = (0.0, 0.25, 0.5, 0.75, 0.9, 1.0)
"""They are those of the pictures at these shares of the animation."""
LAST: Final = 2.5
"""The last picture stays for so long, in s."""
RING_MARGIN: Final = 0.06
"""Drawn beyond a ring, in m."""
TABLE_MARGIN: Final = 0.04
"""Drawn beyond a table, as a share of its width."""
STRIP: Final = 28
"""Above the arena, in pixels."""
LINE: Final = 18
"""Height of a line below it."""
LETTERS: Final = 66
"""Of such a line."""
LINES: Final = 3
"""There are no more."""
KINDS: Final = {
    "goal": "goal", "box": "box", "robot": "robot", "wild": "opponent", "ranger": "junior", "opponent": "opponent",
    "junior": "junior",
}  # fmt: skip
"""The colour of each kind of body, as the page calls it, in the order in which they are drawn."""
NAMES: Final = {"junior": "Junior", "ranger": "RANGER", "wild": "WILD"}
VERDICTS: Final = {"won": "good", "lost": "bad", "drawn": "drawn", "broken off": "quiet"}


def gif_of(film: Film) -> bytes:
    """An animation as a GIF that plays again and again; its comment is the `twin_of` it.

    Args:
        film: The animation.
    """
    painter = _Painter(film)
    last = len(film.times) - 1
    palette = _palette([painter.picture(round(share * last)) for share in SAMPLED])
    flat = [painter.picture(number).quantize(palette=palette, dither=Image.Dither.NONE) for number in range(last + 1)]
    each = round(1e3 * film.interval)
    durations = [each] * (len(flat) - 1) + [round(1e3 * LAST)]
    out = io.BytesIO()
    flat[0].save(
        out,
        "GIF",
        save_all=True,
        append_images=flat[1:],
        duration=durations,
        loop=0,
        optimize=True,
        comment=twin_of(film).encode(errors="replace"),
    )
    return out.getvalue()


def _palette(pictures: Sequence[Image.Image]) -> Image.Image:
    """The colours that some pictures have in common."""
    width, height = pictures[0].size
    sheet = Image.new("RGB", (width, height * len(pictures)))
    for number, one in enumerate(pictures):
        sheet.paste(one, (0, number * height))
    return sheet.quantize(COLORS, method=Image.Quantize.MEDIANCUT)


@cache
def color(name: str, share: float = 1.0) -> Color:
    """A colour of the page's style sheet, in light surroundings.

    Args:
        name: As there, without its dashes.
        share: How opaque, 0..1, where the style sheet does not say.
    """
    sheet = files("hil.look").joinpath("page", "view.css").read_text("utf-8")
    told = re.search(rf"--{name}: ([^;]+);", sheet)
    assert told is not None, name
    if told[1].startswith("#"):
        red, green, blue = bytes.fromhex(told[1][1:])
        return red, green, blue, round(255 * share)
    numbers = [float(one) for one in re.findall(r"[\d.]+", told[1])]
    return int(numbers[0]), int(numbers[1]), int(numbers[2]), round(255 * numbers[3])


class _Painter:
    """The arena to scale, and pictures of it.

    Args:
        film: The animation.
    """

    def __init__(self, film: Film) -> None:
        self._film = film
        place = film.terrain
        margin = RING_MARGIN if place.ground is Ground.RING else TABLE_MARGIN * place.width
        self._scale = FINER * min(WIDTH / (place.width + 2 * margin), MOST_HEIGHT / (place.height + 2 * margin))
        high = int(self._scale * (place.height + 2 * margin)) // FINER * FINER
        self._lines = [textwrap.wrap(one, LETTERS, max_lines=LINES, placeholder=" …") for one in film.captions]
        self._foot = FINER * (12 + LINE * max(1, *map(len, self._lines)))
        self._size = (FINER * WIDTH, high + FINER * STRIP + self._foot)
        self._middle = (FINER * WIDTH / 2, FINER * STRIP + high / 2)
        order = list(KINDS)
        self._bodies = sorted(film.bodies, key=lambda body: order.index(_kind(body)))
        self._font = ImageFont.load_default(FINER * 14)
        self._large = ImageFont.load_default(FINER * 22)
        self._ground = self._drawn_ground(place)

    def picture(self, number: int) -> Image.Image:
        """One picture.

        Args:
            number: Which.
        """
        image = self._ground.copy()
        draw = ImageDraw.Draw(image, "RGBA")
        if len(self._bodies) <= CROWD:
            for body in self._bodies:
                self._trail(draw, body, number)
        for body in self._bodies:
            self._beams(draw, body, number)
        for body in self._bodies:
            self._body(draw, body, number)
        wide, high = self._size
        for edge in ((0, 0, wide, FINER * STRIP), (0, high - self._foot, wide, high)):  # a beam may reach over it
            image.paste(self._ground.crop(edge), edge)
        self._words(draw, number)
        return image.resize((WIDTH, self._size[1] // FINER), Image.Resampling.BOX)

    def _at(self, x: float, y: float) -> Pixel:
        return self._middle[0] + self._scale * x, self._middle[1] - self._scale * y

    def _placed(self, body: FilmBody, number: int, points: Sequence[Pixel]) -> list[Pixel]:
        """Points of a body's own frame, in m, on the picture."""
        x, y, heading = (float(one[number]) for one in (body.x, body.y, body.heading))
        c, s = cos(heading), sin(heading)
        return [self._at(x + c * ahead - s * left, y + s * ahead + c * left) for ahead, left in points]

    def _drawn_ground(self, place: Terrain) -> Image.Image:
        image = Image.new("RGB", self._size, color("beyond")[:3])
        draw = ImageDraw.Draw(image, "RGBA")
        sides = (*self._at(-place.width / 2, place.height / 2), *self._at(place.width / 2, -place.height / 2))
        draw.rectangle(sides, color("ground"))
        if place.obstacles:
            mask = Image.new("1", self._size)
            for outline in place.obstacles:  # one within another is a hole in it
                one = Image.new("1", self._size)
                ImageDraw.Draw(one).polygon([self._at(x, y) for x, y in outline], 1)
                mask = ImageChops.logical_xor(mask, one)
            draw.bitmap((0, 0), mask, color("obstacle"))
        heavy = place.ground is Ground.RING or place.wall
        draw.rectangle(sides, outline=color("edge"), width=FINER * (4 if heavy else 1))
        draw.rectangle((0, 0, self._size[0], FINER * STRIP), color("card"))
        draw.rectangle((0, self._size[1] - self._foot, *self._size), color("card"))
        at = float(FINER * 12)
        for kind in reversed(KINDS):
            count = sum(_kind(body) == kind for body in self._bodies)
            if not count or kind == "goal":
                continue
            tall = FINER * STRIP / 2
            mark = (at, tall - FINER * 6, at + FINER * 12, tall + FINER * 6)
            (draw.rectangle if kind in {"wild", "box", "opponent"} else draw.ellipse)(mark, color(KINDS[kind]))
            name = self._film.title.rpartition(" against ")[2] if kind == "opponent" else NAMES.get(kind, kind)
            text = f"{count} {name}s" if count > 1 else name
            draw.text((at + FINER * 18, tall), text, color("ink"), self._font, "lm")
            at += FINER * 40 + draw.textlength(text, self._font)
        return image

    def _trail(self, draw: ImageDraw.ImageDraw, body: FilmBody, number: int) -> None:
        way = [self._at(float(x), float(y)) for x, y in zip(body.x[: number + 1], body.y[: number + 1], strict=True)]
        if len(way) > 1:
            draw.line(way, color(KINDS[_kind(body)], 0.45), FINER * 2, "curve")

    def _beams(self, draw: ImageDraw.ImageDraw, body: FilmBody, number: int) -> None:
        flags = int(body.flags[number])
        heading = float(body.heading[number])
        for beam in body.track.shape.beams:
            lit = bool(flags & beam.bit)
            ((x, y),) = self._placed(body, number, [(beam.x, beam.y)])
            far = beam.reach * self._scale
            first, last = (degrees(-heading - beam.angle + side * beam.half_cone) for side in (-1, 1))
            edge = color("beam-edge") if lit else None
            draw.pieslice((x - far, y - far, x + far, y + far), first, last, color("beam-lit" if lit else "beam"), edge, FINER)

    def _body(self, draw: ImageDraw.ImageDraw, body: FilmBody, number: int) -> None:
        kind, shape, flags = _kind(body), body.track.shape, int(body.flags[number])
        fill = color(KINDS[kind], 0.3 if kind == "goal" else 1.0)
        ((x, y),) = self._placed(body, number, [(0.0, 0.0)])
        radius = max(shape.radius * self._scale, FINER * 2.5)
        if shape.outline:
            draw.polygon(self._placed(body, number, shape.outline), fill)
        elif kind == "wild":
            draw.rectangle((x - 0.9 * radius, y - 0.9 * radius, x + 0.9 * radius, y + 0.9 * radius), fill)
        else:
            draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill)
        if kind == "junior":
            draw.polygon(self._placed(body, number, [(0.05, 0.0), (0.03, 0.014), (0.03, -0.014)]), color("nose"))
        elif kind in {"ranger", "wild", "robot"}:
            reach = 1.4 * radius / self._scale
            draw.line(self._placed(body, number, [(0.0, 0.0), (reach, 0.0)]), color("nose"), FINER)
            if flags & CONTACTS:
                touch = radius + FINER * 2
                draw.ellipse((x - touch, y - touch, x + touch, y + touch), outline=color("touch"), width=FINER)
        for spot in shape.spots:
            lit = bool(flags & spot.bit)
            points = self._placed(body, number, spot.points)
            if len(points) > 1:
                draw.line(points, color("touch" if lit else "nose"), FINER * (6 if lit else 2))
            elif lit:
                dot = FINER * 5
                draw.ellipse((points[0][0] - dot, points[0][1] - dot, points[0][0] + dot, points[0][1] + dot), color("touch"))

    def _words(self, draw: ImageDraw.ImageDraw, number: int) -> None:
        film = self._film
        wide, high = self._size
        faster = f"{film.speed} times as fast    " if film.speed > 1 else ""
        clock = f"{faster}{film.times[number]:.1f} s"
        draw.text((wide - FINER * 12, FINER * STRIP / 2), clock, color("ink"), self._font, "rm")
        for row, line in enumerate(self._lines[number]):
            middle = high - self._foot + FINER * (6 + LINE / 2 + LINE * row)
            draw.text((FINER * 12, middle), line, color("ink"), self._font, "lm")
        if film.verdict and number == len(film.times) - 1:
            half = draw.textlength(film.verdict, self._large) / 2 + FINER * 16
            x, y = self._middle[0], FINER * (STRIP + 34)
            draw.rectangle((x - half, y - FINER * 20, x + half, y + FINER * 20), color(VERDICTS.get(film.verdict, "quiet")))
            draw.text((x, y), film.verdict, color("on-tone"), self._large, "mm")


def _kind(body: FilmBody) -> str:
    return body.track.kind if body.track.kind in KINDS else "robot"
