"""Puts words, tables and pictures on one page that needs nothing else: no network, no other file."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass, field, replace
from functools import cache
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Final

from hil.report.report_table import shortened
from hil.report.style import can_draw, png, svg, with_variables

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.figure import Figure

    from hil.report.report_table import ReportTable

UNDRAWABLE: Final = (ArithmeticError, AttributeError, LookupError, MemoryError, RuntimeError, TypeError, ValueError)
"""What matplotlib raises on numbers that make no picture."""


MOST_SVG: Final = 300_000
"""Letters of a drawing: one that takes more, of a thousand robots for example, is on the page as pixels."""


@dataclass(frozen=True)
class Picture:
    """A picture: a drawing, or pixels where a drawing would be huge.

    Attributes:
        name: Name of its file, without the suffix.
        caption: What there is to see.
        svg: The drawing; empty where it would be huge.
        png: Pixels, where they were asked for, or there is no drawing.
    """

    name: str
    caption: str
    svg: str = ""
    png: bytes = b""

    def files(self) -> dict[str, bytes]:
        """Name and content of each of its files."""
        named = {f"{self.name}.svg": self.svg.encode(), f"{self.name}.png": self.png}
        return {name: data for name, data in named.items() if data}


@dataclass(frozen=True)
class Pictures:
    """How pictures come about.

    Attributes:
        drawn: Those that are drawn already, by name.
        png: Each is wanted as pixels as well.
    """

    drawn: Mapping[str, Picture] = field(default_factory=dict)
    png: bool = False

    def drawing(self, name: str, draw: Callable[[], Figure | None], caption: str) -> Picture | None:
        """Draw one, unless it is there.

        Args:
            name: Its name.
            draw: Draws it; None where there is nothing to draw.
            caption: What there is to see.
        """
        there = self.drawn.get(name)
        if there is not None and (there.png or not self.png):
            return replace(there, caption=caption)
        made = draw()
        if made is None:
            return None
        text = svg(made, name)
        return Picture(name, caption, "" if (huge := len(text) > MOST_SVG) else text, png(made) if huge or self.png else b"")


@dataclass
class Section:
    """A part of the page.

    Attributes:
        title: Headline.
        text: Paragraphs.
        pictures: Pictures, after the text.
        tables: Tables, after the pictures.
        folded: Tables to be unfolded by the reader.
    """

    title: str
    text: list[str] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)
    tables: list[ReportTable] = field(default_factory=list)
    folded: list[ReportTable] = field(default_factory=list)

    @property
    def empty(self) -> bool:
        """Nothing to show."""
        return not (self.text or self.pictures or self.tables or self.folded)


def add_picture(
    section: Section,
    name: str,
    draw: Callable[[], Figure | None],
    caption: str,
    pictures: Pictures = Pictures(),
) -> None:
    """Add a picture, or say why there is none: what a log holds never costs the report. Where nothing draws none is added.

    Args:
        section: What it is added to.
        name: Its name.
        draw: Draws it; None where there is nothing to draw.
        caption: What there is to see.
        pictures: How it comes about.
    """
    if not can_draw():
        return
    try:
        picture = pictures.drawing(name, draw, caption)
    except UNDRAWABLE as error:
        section.text.append(f"The picture “{name}” can’t be drawn from what the log holds: {shortened(str(error), 200)}.")
    else:
        section.pictures += [picture] if picture else []


def render(
    title: str,
    subtitle: str,
    said: Sequence[str],
    *,
    numbers: Sequence[tuple[str, str]],
    sections: Sequence[Section],
    footer: str,
) -> str:
    """The page.

    Args:
        title: Headline.
        subtitle: Below it.
        said: Paragraphs of the summary.
        numbers: Figures that matter most: (value, what it is).
        sections: The parts; empty ones are left out.
        footer: Last line.

    Returns:
        HTML.
    """
    boxes = "".join(f"<li><b>{escape(value)}</b><span>{escape(text)}</span></li>" for value, text in numbers)
    body = "".join(_section(section) for section in sections if not section.empty)
    summary = "".join(f"<p>{escape(text)}</p>" for text in said)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title>\n<style>\n{_style()}</style></head>\n<body><main>\n"
        f'<h1>{escape(title)}</h1>\n<p class="sub">{escape(subtitle)}</p>\n{summary}\n'
        f'<ul class="numbers">{boxes}</ul>\n{body}<footer>{escape(footer)}</footer>\n</main></body></html>\n'
    )


@cache
def _style() -> str:
    return files(__package__).joinpath("page.css").read_text("utf-8")


def _section(section: Section) -> str:
    text = "".join(f"<p>{escape(paragraph)}</p>" for paragraph in section.text)
    pictures = "".join(_picture(picture) for picture in section.pictures)
    tables = "".join(_table(table, titled=table.title != section.title) for table in section.tables)
    folded = "".join(
        f"<details><summary>{escape(table.title)}</summary>{_table(table, titled=False)}</details>" for table in section.folded
    )
    return f"<section><h2>{escape(section.title)}</h2>{text}{pictures}{tables}{folded}</section>\n"


def _picture(picture: Picture) -> str:
    words = escape(picture.caption)
    if picture.svg:
        shown = with_variables(picture.svg).replace("<svg ", f'<svg role="img" aria-label="{words}" ', 1)
    else:
        shown = f'<img alt="{words}" src="data:image/png;base64,{b64encode(picture.png).decode("ascii")}">'
    return f'<figure><div class="scroll">{shown}</div><figcaption>{words}</figcaption></figure>\n'


def _table(table: ReportTable, *, titled: bool = True) -> str:
    def cell(tag: str, column: int, text: str) -> str:
        kind = ' class="n"' if column in table.numbers else ""
        return f"<{tag}{kind}>{escape(text)}</{tag}>"

    head = "".join(cell("th", column, text) for column, text in enumerate(table.head))
    rows = "".join(
        "<tr>" + "".join(cell("td", column, text) for column, text in enumerate(row)) + "</tr>" for row in table.rows
    )
    caption = f"<caption>{escape(table.title)}</caption>" if titled else ""
    return f'<div class="scroll"><table>{caption}<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>\n'
