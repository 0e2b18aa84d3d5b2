"""Lines of which only those in sight are drawn: two hundred robots cost no more than those that fit."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from rich.segment import Segment
from textual.geometry import Region, Size
from textual.scroll_view import ScrollView
from textual.strip import Strip

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.text import Text


class Listing(ScrollView):
    """Lines, a head above them that stays, and a scroll bar where they do not fit."""

    DEFAULT_CSS: ClassVar[str] = """
    Listing { scrollbar-size-vertical: 1; overflow-x: hidden; background: ansi_default; }
    Listing:focus { background: ansi_default; }
    """
    can_focus = True

    def __init__(self, *, id: str, follows: bool = False) -> None:  # noqa: A002 - as Textual calls it
        super().__init__(id=id)
        self._lines: Sequence[Text] = ()
        self._head: Text | None = None
        self._follows = follows
        self._at_end = follows

    def put(self, lines: Sequence[Text], head: Text | None = None) -> None:
        """Show these lines; one that follows stays at the end, where it is there.

        Args:
            lines: The lines.
            head: What stays above them.
        """
        self._at_end = self._at_end or self.scroll_offset.y >= self.max_scroll_y
        self._lines, self._head = lines, head
        self.virtual_size = Size(0, len(lines) + (head is not None))
        if self._follows and self._at_end:
            self.call_after_refresh(self._to_end)
        self.refresh()

    def _to_end(self) -> None:
        """Scroll to the end, which is known when the lines have been laid out."""
        self._at_end = False
        self.scroll_to(y=self.max_scroll_y, animate=False, immediate=True)

    def reveal(self, index: int) -> None:
        """Scroll as far as needed to see a line.

        Args:
            index: Which.
        """
        room = self.size.height - (self._head is not None)
        first = self.scroll_offset.y
        if room > 0 and not first <= index < first + room:
            self.scroll_to(y=index if index < first else index - room + 1, animate=False, immediate=True)

    def render_line(self, y: int) -> Strip:
        """A line in sight; for Textual."""
        width = self.size.width
        first = self.scroll_offset.y
        if self._head is not None:
            if y == 0:
                return self._strip(self._head, width)
            first -= 1
        index = first + y
        return self._strip(self._lines[index], width) if index < len(self._lines) else Strip.blank(width)

    def _strip(self, text: Text, width: int) -> Strip:
        console = self.app.console
        segments = Segment.apply_style(text.render(console, end=""), console.get_style(text.style))
        return Strip(segments).adjust_cell_length(width)

    def watch_scroll_y(self, old_value: float, new_value: float) -> None:
        """Draw all of it anew when it was scrolled; for Textual."""
        super().watch_scroll_y(old_value, new_value)
        self.refresh(Region(0, 0, *self.size))
