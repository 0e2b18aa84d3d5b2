"""The cockpit's screen, by Textual's pilot: what is to be seen at every size, and what keys of its own do."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest
from rich.text import Text
from textual.widgets import Static

from hil.cockpit.app import Cockpit
from hil.cockpit.snapshot import Body, Fact, Figure, PlanView, Row, Snapshot, Tone

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from typing import Any

    from textual.pilot import Pilot

SIZES = [(60, 24), (80, 24), (120, 40)]
KEYS = (("a", "arm"), ("arrows", "drive"), ("space", "stop"), ("e", "emergency stop"), ("d", "disarm"), ("b", "new bout"))
FACTS = (
    Fact("senses", "off ring left, off ring right", tone=Tone.WARNING),
    Fact("eye left", "58", 0.06),
    Fact("battery", "7.49 V"),
)
GROUND = PlanView((Body(Figure.JUNIOR, (0.1, 0.1), 0.0, 0.05, chosen=True),), ring=0.77, caption="bout 1, 0.1 s")
ONE = Snapshot("Junior 1 on sim://junior", 12.3, "READY (armed)", Tone.WARNING, FACTS, GROUND, keys=KEYS)


def many(count: int, chosen: int = 0) -> Snapshot:
    rows = tuple(Row((str(system), "disarmed", "7.40 V", "nothing", "100", "0")) for system in range(1, count + 1))
    heads = ("robot", "state", "battery", "senses", "frames", "lost")
    keys = (("n p", "choose"), *KEYS)
    return Snapshot(f"{count} Juniors", 1.0, "robot 1: disarmed", Tone.CALM, FACTS, GROUND, heads, rows, chosen, keys)


class Shown:
    """A cockpit under a pilot's eyes.

    Attributes:
        picture: What is to be shown.
        said: What was said.
        wanted: Times that another picture was wanted.
    """

    def __init__(self, picture: Snapshot | None = None) -> None:
        self.picture = picture
        self.said: list[str] = []
        self.wanted = 0
        self.app = Cockpit(
            "sim://junior",
            latest=lambda: self.picture,
            said=lambda: list(self.said),
            shown=self._shown,
            say=self.said.append,
        )

    def _shown(self) -> None:
        self.wanted += 1

    def run(self, act: Callable[[Pilot[Any]], Awaitable[None]], size: tuple[int, int] = (80, 24)) -> None:
        async def under_eyes() -> None:
            async with self.app.run_test(size=size) as pilot:
                await self.look(pilot)
                await act(pilot)

        asyncio.run(under_eyes())

    async def look(self, pilot: Pilot[Any]) -> None:
        """Have it see what there is to be shown, and draw it."""
        self.app.look()
        await pilot.pause()

    @property
    def lines(self) -> list[str]:
        """The screen."""
        strips = self.app.screen._compositor.render_strips()
        return ["".join(segment.text for segment in strip) for strip in strips]

    @property
    def text(self) -> str:
        return "\n".join(self.lines)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("count", [1, 3, 200])
def test_what_matters_is_to_be_seen_at_every_size(size: tuple[int, int], count: int) -> None:
    shown = Shown(ONE if count == 1 else many(count))
    shown.said.append("bout 1 is lost after 1.2 s")

    async def look(_: Pilot[Any]) -> None:
        assert len(shown.lines) == size[1]
        assert all(len(line) == size[0] for line in shown.lines)
        for text in ("emergency stop", "? help", "q leave", "a arm", "bout 1 is lost", "bout 1, 0.1 s", "! off ring left", "J"):
            assert text in shown.text, text
        if count == 1:
            assert "! READY (armed)" in shown.text
            assert "12.3 s" in shown.lines[0]
            assert "battery" in shown.text
        else:
            assert ">  1      disarmed" in shown.text
            assert "n p choose" in shown.text

    shown.run(look, size)


def test_before_there_is_a_picture_it_says_what_it_waits_for() -> None:
    shown = Shown()

    async def look(pilot: Pilot[Any]) -> None:
        assert "sim://junior" in shown.lines[0]
        assert "connecting; Ctrl-C ends" in shown.text
        shown.picture = ONE
        await shown.look(pilot)
        assert "READY (armed)" in shown.text
        assert "connecting" not in shown.text

    shown.run(look)


def test_it_fits_itself_into_another_size() -> None:
    shown = Shown(many(3))

    async def look(pilot: Pilot[Any]) -> None:
        await pilot.resize_terminal(60, 24)
        await pilot.pause()
        await shown.look(pilot)
        assert all(len(line) == 60 for line in shown.lines)
        assert "emergency stop" in shown.text
        assert "q leave" in shown.text

    shown.run(look, (120, 40))


def test_help_tells_of_every_key_and_goes_again() -> None:
    shown = Shown(ONE)

    async def look(pilot: Pilot[Any]) -> None:
        await pilot.press("question_mark")
        await pilot.pause()
        for key, what in KEYS:
            assert any(line.strip().startswith(key) and what in line for line in shown.lines), key
        for text in ("0.25 s after the last arrow key", "Ctrl-Z", "PageUp", "d releases it, then a arms"):
            assert text in shown.text
        assert "READY (armed)" in shown.text
        await pilot.press("question_mark")
        await pilot.pause()
        assert "Ctrl-Z" not in shown.text

    shown.run(look, (60, 24))


def test_two_hundred_robots_scroll_and_the_chosen_one_is_in_sight() -> None:
    shown = Shown(many(200))

    def there(system: int) -> bool:
        return any(line[3:].startswith(f"{system} ") for line in shown.lines)

    async def look(pilot: Pilot[Any]) -> None:
        assert there(1)
        assert not there(200)
        await pilot.press("end")
        await pilot.pause()
        assert there(200)
        assert any(line.startswith("   robot  state") for line in shown.lines)
        await pilot.press("home")
        await pilot.pause()
        assert there(1)
        await pilot.press("pagedown")
        await pilot.pause()
        assert not there(1)
        shown.picture = many(200, chosen=119)
        await shown.look(pilot)
        assert there(120)

    shown.run(look)


def test_events_follow_until_somebody_scrolls_back() -> None:
    shown = Shown(many(5))

    async def look(pilot: Pilot[Any]) -> None:
        shown.said += [f"event {number}." for number in range(50)]
        await shown.look(pilot)
        assert "event 49." in shown.text
        await pilot.press("tab", "home")
        await pilot.pause()
        assert "event 0." in shown.text
        shown.said.append("event 50.")
        await shown.look(pilot)
        assert "event 0." in shown.text
        await pilot.press("end")
        await pilot.pause()
        assert "event 50." in shown.text

    shown.run(look)


def test_what_is_printed_meanwhile_becomes_an_event() -> None:
    shown = Shown(ONE)

    async def look(pilot: Pilot[Any]) -> None:
        print("the log can't be written")  # noqa: T201 - as a library might
        await pilot.pause()
        await shown.look(pilot)
        assert shown.said == ["the log can't be written"]
        assert "the log can't be written" in shown.text

    shown.run(look)


def test_markup_in_what_robots_are_called_is_text() -> None:
    picture = Snapshot("[red]x[/red]", 0.0, "[b]", Tone.CALM, (Fact("[i]", "[u]y"),), None, keys=())
    shown = Shown(picture)

    async def look(_: Pilot[Any]) -> None:
        assert "[red]x[/red]" in shown.lines[0]
        assert "[b]" in shown.lines[1]
        assert isinstance(shown.app.query_one("#facts", Static).content, Text)
        assert "[u]y" in shown.text

    shown.run(look)


def test_another_picture_is_wanted_when_one_was_shown_and_of_many_less_often() -> None:
    few, lots = Shown(ONE), Shown(many(200))

    async def look(pilot: Pilot[Any]) -> None:
        for each in (few, lots):
            each.wanted = 0
        for _ in range(4):
            for each in (few, lots):
                each.app._ticks += 1 if each is not watched else 0
            await watched.look(pilot)

    for watched, least in ((few, 4), (lots, 2)):
        watched.run(look)
        assert watched.wanted >= least


def test_the_chosen_robot_stands_out_in_the_table() -> None:
    shown = Shown(many(3, chosen=1))

    async def look(_: Pilot[Any]) -> None:
        strips = shown.app.screen._compositor.render_strips()
        lines = {strip.text[:4]: next(iter(strip)).style for strip in strips}
        chosen, other = lines[">  2"], lines["   3"]
        assert chosen is not None
        assert chosen.reverse
        assert other is None or not other.reverse

    shown.run(look)
