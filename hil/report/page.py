"""Puts words, tables and pictures on one page that needs nothing else: no network, no other file."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass, field
from functools import cache
from html import escape
from importlib.resources import files
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from hil.report.report_table import shortened
from hil.report.style import can_draw, png

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.figure import Figure

    from hil.report.report_table import ReportTable

UNDRAWABLE: Final = (ArithmeticError, AttributeError, LookupError, MemoryError, RuntimeError, TypeError, ValueError)
"""What matplotlib raises on numbers that make no picture."""


@dataclass(frozen=True)
class Picture:
    """A picture.

    Attributes:
        name: Name of its file, without the suffix.
        data: PNG.
        caption: What there is to see.
        alternative: The same for who can't see it; the caption where it is empty.
    """

    name: str
    data: bytes
    caption: str
    alternative: str = ""


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
    drawn: Mapping[str, bytes] = MappingProxyType({}),
) -> None:
    """Add a picture, or say why there is none: what a log holds never costs the report. Where nothing draws none is added.

    Args:
        section: What it is added to.
        name: Its name.
        draw: Draws it; None where there is nothing to draw.
        caption: What there is to see.
        drawn: Pictures that are drawn already, by name.
    """
    if not can_draw():
        return
    if name in drawn:
        section.pictures.append(Picture(name, drawn[name], caption))
        return
    try:
        made = draw()
        picture = None if made is None else Picture(name, png(made), caption)
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
    source = b64encode(picture.data).decode("ascii")
    return (
        f'<figure><img alt="{escape(picture.alternative or picture.caption)}" src="data:image/png;base64,{source}">'
        f"<figcaption>{escape(picture.caption)}</figcaption></figure>\n"
    )


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
