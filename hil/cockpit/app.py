"""The cockpit as a Textual program: pictures in, a screen out. It asks nothing of robots, and takes none of their keys."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING, ClassVar, Final

from rich.cells import cell_len
from rich.text import Text
from textual.app import App
from textual.binding import Binding
from textual.containers import Horizontal
from textual.widget import Widget
from textual.widgets import Static

from hil.cockpit.canvas import drawn
from hil.cockpit.driver import ScreenDriver
from hil.cockpit.listing import Listing
from hil.cockpit.snapshot import Snapshot, Tone

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from textual import events
    from textual.app import ComposeResult

    from hil.cockpit.snapshot import Fact, Row
    from hil.terminal.screen import Screen

TICK: Final = 0.1
"""The screen is looked after so often, in s."""
FEW: Final = 20
CALMLY: Final = 2
"""Of more robots than `FEW` a new picture is drawn at every second tick."""
STYLES: Final = {Tone.CALM: "", Tone.GOOD: "green", Tone.WARNING: "bold yellow", Tone.ALARM: "bold white on red"}
MARKS: Final = {Tone.CALM: " ", Tone.GOOD: " ", Tone.WARNING: "!", Tone.ALARM: "!!"}
INDENT: Final = " " * 12
"""What is said begins behind the time."""
BAR: Final = 10
"""Characters of a bar."""
HELP: Final = """\
Driving ends 0.25 s after the last arrow key: hold it down.
After an emergency stop: d releases it, then a arms.

{keys}

PageUp PageDown Home End   scroll
Tab                        scroll the robots or the events
?                          this help, and back
q                          leave: robots that are ours are stopped
Ctrl-Z                     stop them, and this program; fg goes on
Ctrl-C                     stop them, and end at once"""


class Plan(Widget):
    """Where everybody is, or what the robot senses."""

    picture: Snapshot | None = None
    braille = True

    def render(self) -> Text:
        """Draw it; for Textual."""
        if self.picture is None or self.picture.ground is None:
            return Text("nobody has said yet where anything is", "dim")
        columns, rows = self.content_size
        return Text("\n", no_wrap=True).join(drawn(self.picture.ground, columns, rows, braille=self.braille))


class Cockpit(App[None]):
    """The screen.

    Args:
        title: Whom or what is looked at, before there is a picture.
        latest: Gives the picture to be shown; None: there is none yet.
        said: Gives all that has been said so far, oldest first.
        shown: Called when a picture has been shown, and time for the next one has come.
        say: Told what is printed meanwhile.
        terminal: The terminal; None where a test looks on.
        braille: Characters may be those of Braille; else ASCII.
    """

    ENABLE_COMMAND_PALETTE = False
    CSS: ClassVar[str] = """
    Screen { background: ansi_default; color: ansi_default; }
    #title { height: 1; text-style: bold; }
    #state { height: 1; }
    #middle { height: 3fr; min-height: 6; }
    Plan { width: 1fr; height: 1fr; }
    #facts { width: 36; height: 1fr; padding: 0 0 0 1; }
    #robots { height: 2fr; display: none; }
    #events { height: 1fr; min-height: 3; border-top: ascii ansi_bright_black; }
    #help { height: 1fr; display: none; padding: 0 1; }
    #keys { height: auto; max-height: 2; }
    .many #robots { display: block; }
    .helping #help { display: block; }
    .helping #middle, .helping #robots, .helping #events { display: none; }
    """
    BINDINGS: ClassVar = [
        Binding("question_mark", "help", show=False),
        Binding("tab", "turn", show=False, priority=True),
        Binding("pageup", "scroll('page_up')", show=False, priority=True),
        Binding("pagedown", "scroll('page_down')", show=False, priority=True),
        Binding("home", "scroll('home')", show=False, priority=True),
        Binding("end", "scroll('end')", show=False, priority=True),
    ]

    def __init__(
        self,
        title: str,
        *,
        latest: Callable[[], Snapshot | None],
        said: Callable[[], Sequence[str]],
        shown: Callable[[], object],
        say: Callable[[str], object],
        terminal: Screen | None = None,
        braille: bool = True,
    ) -> None:
        super().__init__(driver_class=ScreenDriver, ansi_color=True)
        self.terminal = terminal
        self._looked_at = title
        self._latest = latest
        self._said = said
        self._shown = shown
        self._say = say
        self._braille = braille
        self._picture: Snapshot | None = None
        self._heard: tuple[Sequence[str], int] = ((), 0)
        self._chosen = 0
        self._ticks = 0
        self._scrolls = "robots"

    def compose(self) -> ComposeResult:
        """What there is on the screen; for Textual."""
        yield Static(id="title", markup=False)
        yield Static(id="state", markup=False)
        with Horizontal(id="middle"):
            yield Plan()
            yield Static(id="facts", markup=False)
        yield Static(id="help", markup=False)
        yield Listing(id="robots")
        yield Listing(id="events", follows=True)
        yield Static(id="keys", markup=False)

    def on_mount(self) -> None:
        """Begin to look; for Textual."""
        self.query_one(Plan).braille = self._braille
        self.query_one("#title", Static).update(Text(self._looked_at))
        self.query_one("#state", Static).update(Text("connecting; Ctrl-C ends"))
        self.begin_capture_print(self)
        self.set_interval(TICK, self.look)
        self.look()

    def on_print(self, event: events.Print) -> None:
        """What is printed meanwhile is an event; for Textual."""
        for line in event.text.splitlines():
            if line.strip():
                self._say(line)

    def on_resize(self) -> None:
        """Fit what is shown into another size; for Textual."""
        if self._picture is not None:
            self.call_after_refresh(self._draw, self._picture)

    # --- what is shown -----------------------------------------------------------------------------------------------

    def look(self) -> None:
        """See whether there is a new picture, or something was said."""
        if not self.query("#events"):  # all is being taken down, and the timer ticks once more
            return
        driver = self._driver
        if isinstance(driver, ScreenDriver):
            driver.attend()
        self._ticks += 1
        picture = self._latest()
        if picture is not None and picture is not self._picture:
            self._draw(picture)
        said = self._said()
        events_list = self.query_one("#events", Listing)
        heard = (said, events_list.size.width)
        if heard != self._heard:
            self._heard = heard
            wrapped = [part for line in said for part in wrap(line, max(20, heard[1]), subsequent_indent=INDENT)]
            events_list.put([Text(line, no_wrap=True) for line in wrapped])
        if picture is None or len(picture.rows) <= FEW or self._ticks % CALMLY == 0:
            self._shown()

    def _draw(self, picture: Snapshot) -> None:
        self._picture = picture
        many = bool(picture.rows)
        self.screen.set_class(many, "many")
        width = self.size.width
        self.query_one("#title", Static).update(_ends(picture.title, f"{picture.now:.1f} s", width))
        self.query_one("#state", Static).update(
            Text(f"{MARKS[picture.tone].strip()} {picture.state}".strip().ljust(width), STYLES[picture.tone], no_wrap=True)
        )
        plan = self.query_one(Plan)
        plan.picture = picture
        plan.refresh()
        facts = self.query_one("#facts", Static)
        facts.update(_facts(picture.facts, max(10, facts.content_size.width), braille=self._braille))
        if many:
            robots = self.query_one("#robots", Listing)
            head, lines = _table(picture, robots.size.width)
            robots.put(lines, head)
            if picture.chosen != self._chosen:
                self._chosen = picture.chosen
                robots.reveal(picture.chosen)
        self.query_one("#keys", Static).update(_keys(picture.keys, width))
        if self.screen.has_class("helping"):
            self.query_one("#help", Static).update(Text(_help(picture.keys)))

    # --- what keys do that robots do not care for --------------------------------------------------------------------

    def action_help(self) -> None:
        """Show what keys do, and no longer."""
        self.screen.toggle_class("helping")
        self.query_one("#help", Static).update(Text(_help(() if self._picture is None else self._picture.keys)))

    def action_turn(self) -> None:
        """Scroll the other list from now on."""
        self._scrolls = "events" if self._scrolls == "robots" else "robots"

    def action_scroll(self, how: str) -> None:
        """Scroll.

        Args:
            how: `page_up`, `page_down`, `home`, or `end`.
        """
        many = self.screen.has_class("many") and not self.screen.has_class("helping")
        which = "robots" if many and self._scrolls != "events" else "events"
        getattr(self.query_one(f"#{which}", Listing), f"scroll_{how}")(animate=False)


def _ends(left: str, right: str, width: int) -> Text:
    """One text at the left, one at the right; the left one gives way."""
    room = max(0, width - len(right) - 1)
    return Text(f"{left[:room].ljust(room)} {right}", no_wrap=True)


def _facts(facts: Sequence[Fact], width: int, *, braille: bool) -> Text:
    """Facts line by line, with bars where there is room."""
    lines = []
    names = max((len(fact.name) for fact in facts), default=0)
    for fact in facts:
        line = Text(no_wrap=True)
        line.append(f"{fact.name:{names}} ", "dim")
        room = width - names - 1
        if fact.share is not None and room >= BAR + 6:
            full = round(min(1.0, max(0.0, fact.share)) * BAR)
            line.append(("█" if braille else "#") * full, "green")
            line.append(("░" if braille else ".") * (BAR - full) + " ", "dim")
            room -= BAR + 1
        parts = wrap(f"{MARKS[fact.tone].strip()} {fact.value}".strip(), max(1, room))
        line.append(f"\n{' ' * (names + 1)}".join(parts), STYLES[fact.tone])
        lines.append(line)
    return Text("\n").join(lines)


def _table(picture: Snapshot, width: int) -> tuple[Text, list[Text]]:
    """All robots, in as many columns as there is room for."""
    rows: Sequence[Row] = picture.rows
    widths = [max(map(cell_len, [head, *(row.cells[at] for row in rows)])) for at, head in enumerate(picture.heads)]
    columns, room = 0, width - 4
    while columns < len(widths) and room >= widths[columns]:
        room -= widths[columns] + 2
        columns += 1

    def line(cells: Sequence[str]) -> str:
        return "  ".join(cell.ljust(widths[at]) for at, cell in enumerate(cells[:columns]))

    lines = []
    for at, row in enumerate(rows):
        mark = ">" if at == picture.chosen else " "
        style = "reverse" if at == picture.chosen else STYLES[row.tone]
        lines.append(Text(f"{mark}{MARKS[row.tone]:2}{line(row.cells)}", style, no_wrap=True))
    return Text(f"   {line(picture.heads)}", "dim", no_wrap=True), lines


def _keys(keys: Sequence[tuple[str, str]], width: int) -> Text:
    """As much as fits into two lines; what leaves, and the help, in any case."""
    always = (("?", "help"), ("q", "leave"))
    lines = [Text(no_wrap=True)]
    left = 2 * width - sum(len(key) + len(what) + 3 for key, what in always)
    shown = []
    for key, what in keys:
        left -= len(key) + len(what) + 3
        if left < width // 6:
            break
        shown.append((key, what))
    for key, what in (*shown, *always):
        if len(lines[-1]) + len(key) + len(what) + 1 > width and len(lines) < 2:
            lines.append(Text(no_wrap=True))
        lines[-1].append(key, "bold")
        lines[-1].append(f" {what}  ", "dim")
    return Text("\n").join(lines)


def _help(keys: Sequence[tuple[str, str]]) -> str:
    """What keys do, in full."""
    return HELP.format(keys="\n".join(f"{key:27}{what}" for key, what in keys))
