"""How the pictures look, once: colours that colour-blind people tell apart (Okabe & Ito 2008), sizes, line styles.

matplotlib draws them, and is loaded when it does: a report can be made without it, and has no pictures then.
"""

from __future__ import annotations

import math
import re
import warnings
from contextlib import contextmanager
from importlib.util import find_spec
from io import BytesIO, StringIO
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

BLUE: Final = "#0072B2"
VERMILLION: Final = "#D55E00"
GREEN: Final = "#009E73"
PURPLE: Final = "#AA4499"
SKY: Final = "#56B4E9"
AMBER: Final = "#E69F00"
INK: Final = "#222222"
GREY: Final = "#8A8A8A"
PALE: Final = "#EDEDED"

EYE_STYLES: Final[dict[int, dict[str, Any]]] = {
    0: {"color": GREY, "linestyle": "-", "linewidth": 1.0, "marker": "", "label": "none"},
    1: {"color": BLUE, "linestyle": ":", "linewidth": 1.8, "marker": "o", "markersize": 4, "label": "left"},
    2: {"color": VERMILLION, "linestyle": "--", "linewidth": 1.6, "marker": "*", "markersize": 6.5, "label": "right"},
    3: {"color": INK, "linestyle": "-", "linewidth": 2.0, "marker": "", "label": "both"},
}
"""Line styles by what the eyes see, as in Fig. 10.7 of Liu & Wu 2001: left dotted with circles, right dashed with stars, both
solid; none is thin and grey."""

_RC: Final[dict[Any, Any]] = {
    "text.parse_math": False,  # a dollar sign in a name is one
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 8.0,
    "text.color": INK,
    "axes.labelsize": 9.0,
    "axes.labelcolor": INK,
    "axes.edgecolor": "#B5B5B5",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": PALE,
    "grid.linewidth": 0.8,
    "xtick.color": "#555555",
    "ytick.color": "#555555",
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "figure.dpi": 100,
    "svg.fonttype": "none",  # words stay words: sharp, found by a search, and a tenth of what outlines take
}
DPI: Final = 160
COMPRESSION: Final = 3
"""How hard zlib tries: a tenth more bytes than with its usual 6, in two thirds of the time."""
INSTALL: Final = "pip install 'matplotlib>=3.9'"
"""The command that installs what draws: of the extra `report`, and good for a clone as well."""
LARGEST: Final = 1e9
"""No number farther from 0 is drawn."""

_NOT_DRAWN: Final = re.compile(r"<\?xml.*?\?>|<!DOCTYPE.*?>|<metadata>.*?</metadata>|<!--.*?-->|\n\s*(?=<)", re.DOTALL)
_TAG: Final = re.compile(r"<[^>]+>")
_GROUP: Final = re.compile(r'^<g id="[^"]*"')
_PLACE: Final = re.compile(r"(\.\d\d)\d+")
_FONT: Final = re.compile(r"'DejaVu Sans'[^;\"]*")
_NAMESPACE: Final = re.compile(r' xmlns(?::xlink)?="[^"]*"')
_COLOR: Final = re.compile(r"#([0-9a-f]{6})\b")


def can_draw() -> bool:
    """What draws is installed."""
    return find_spec("matplotlib") is not None


@contextmanager
def styled() -> Iterator[None]:
    """Settings of matplotlib for the time of drawing, those of the caller left alone.

    What a log holds may be odd, and matplotlib warns of much that a reader of the report can see for himself.
    """
    import matplotlib as mpl  # noqa: PLC0415 - it takes half a second to load, and may not be installed

    with mpl.rc_context(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mpl.rcdefaults()
        mpl.rcParams.update(_RC)
        yield


def drawable(values: Iterable[float]) -> list[float]:
    """Numbers that an axis can hold; the others are left out of a line.

    Args:
        values: Numbers, whatever they are.
    """
    return [value if -LARGEST <= value <= LARGEST else math.nan for value in values]


def whole_numbers(axis: Axis) -> None:
    """Ticks at whole numbers only."""
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415 - as above

    axis.set_major_locator(MaxNLocator("auto", integer=True))


def figure(width: float, height: float) -> Figure:
    """A picture.

    Args:
        width: In inches.
        height: In inches.
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 - as above

    return Figure(figsize=(width, height), dpi=DPI, layout="constrained")


def png(drawn: Figure) -> bytes:
    """The picture as a PNG file; the same picture gives the same bytes.

    Args:
        drawn: The picture.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415 - as above

    buffer = BytesIO()
    # `savefig` would draw everything twice: once to lay it out, though drawing does that itself.
    write: Callable[..., None] = FigureCanvasAgg(drawn).print_png
    write(buffer, metadata={"Software": None}, pil_kwargs={"compress_level": COMPRESSION})
    return buffer.getvalue()


def svg(drawn: Figure, name: str) -> str:
    """The picture as an SVG drawing; the same picture gives the same text.

    Its words are text in the reader's own fonts: none is part of it.

    Args:
        drawn: The picture.
        name: Name of the picture, by which what it refers to is told apart from that of others on one page.
    """
    import matplotlib as mpl  # noqa: PLC0415 - as above
    from matplotlib.backends.backend_svg import FigureCanvasSVG  # noqa: PLC0415 - likewise

    buffer = StringIO()
    write: Callable[..., None] = FigureCanvasSVG(drawn).print_svg
    dpi = drawn.dpi
    with mpl.rc_context({"svg.hashsalt": name}):
        write(buffer, metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    drawn.dpi = dpi  # which `print_svg` leaves at 72
    return _TAG.sub(_tidied, _NOT_DRAWN.sub("", buffer.getvalue()))


def _tidied(tag: re.Match[str]) -> str:
    """A tag with numbers no finer than a hundredth of a point, and no name that nothing refers to."""
    return _FONT.sub("system-ui, sans-serif", _PLACE.sub(r"\1", _GROUP.sub("<g", tag[0])))


def with_variables(picture: str) -> str:
    """An SVG drawing whose colours a page can change: each is the CSS variable `--c-` and its six digits, else itself.

    Args:
        picture: The drawing, as `svg` gives it.
    """
    plain = _NAMESPACE.sub("", picture, count=2)  # a page knows them
    return _TAG.sub(lambda tag: _COLOR.sub(r"var(--c-\1,#\1)", tag[0]).replace("xlink:href", "href"), plain)


def bare(axes: Axes) -> None:
    """Take everything but the drawing away."""
    axes.set_xticks([])
    axes.set_yticks([])
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)
