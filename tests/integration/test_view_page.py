"""The page in a browser: it loads, plays, seeks and picks, asks nobody for anything, and takes every text for a text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import pytest
from chromium import Chromium
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from report_logs import bout_log, coaching_log, driving_log
from scenes import HOSTILE, hostile_log, scene_of

from firmware_protocol.messages import BoutOutcome
from hil.cli.app import run
from hil.look.pages import page_of
from hil.look.writing import write_view

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from chromium import Page

pytestmark = [pytest.mark.browser, pytest.mark.slow]

READY: Final = "globalThis.hilView || !document.getElementById('trouble').hidden"
SIZES: Final = {"phone": (390, 844), "laptop": (1280, 800), "wide": (1920, 1080)}
NOW: Final = "hilView.player.time"
TWO_FRAMES: Final = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


FINGERPRINT: Final = """() => {
  const canvas = document.getElementById("arena");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const sums = [0, 0, 0];
  for (let at = 0; at < data.length; at++) sums[at % 3] += data[at] * (at % 1009);
  return sums;
}"""
CHANGE: Final = """((one, value) => {{
  one.value = value;
  one.dispatchEvent(new Event("{}"));
}})(document.getElementById("{}"), "{}")"""
COUNT: Final = """hilView.drawn = 0, hilView.player.onTime = ((tell) => (time) => {
  hilView.drawn++;
  tell(time);
})(hilView.player.onTime)"""
FIRST_BODY: Final = """(() => {
  const { pose } = hilView.arena.bodies[0];
  const { left, top } = document.getElementById("arena").getBoundingClientRect();
  const [x, y] = hilView.arena.at(pose.x, pose.y);
  return [left + x, top + y];
})()"""
IN_A_TRACE: Final = """(() => {
  const box = document.querySelector(".u-over");
  box.scrollIntoView();
  const { left, top, width, height } = box.getBoundingClientRect();
  return [left + 0.75 * width, top + height / 2];
})()"""
LAID_OUT: Final = """(() => {
  const { top, height } = document.getElementById("arena").getBoundingClientRect();
  const player = document.getElementById("play").getBoundingClientRect().top;
  const small = [...document.querySelectorAll(".player button")].filter((one) => one.offsetWidth && one.offsetHeight < 32);
  const level = getComputedStyle(document.body).backgroundColor.match(/\\d+/g)[0];
  return [top, height, player, small.length, Number(level)];
})()"""
LETTERS: Final = "<>&\"'/=\\`{}!-; \u2028\u2029\x00aimgonerrscpt()"


@pytest.fixture(scope="module")
def browser() -> Iterator[Chromium]:
    with Chromium() as started:
        yield started


@pytest.fixture
def page(browser: Chromium) -> Iterator[Page]:
    opened = browser.page()
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def bouts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of three bouts of 2, 3 and 4 s."""
    folder = tmp_path_factory.mktemp("bouts")
    bout_log(folder / "b.mcap", [(BoutOutcome.WIN, 2.0), (BoutOutcome.LOSS, 3.0), (BoutOutcome.DRAW, 4.0)])
    return write_view(folder / "b.mcap")[0]


@pytest.fixture(scope="module")
def coached(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of a coaching."""
    folder = tmp_path_factory.mktemp("coached")
    coaching_log(folder / "c.mcap", budget=120)
    return write_view(folder / "c.mcap")[0]


@pytest.fixture(scope="module")
def swarm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of a surround mission of 33 robots."""
    folder = tmp_path_factory.mktemp("swarm") / "run"
    arguments = ["swarm", "surround", "--steps", "4", "--no-report", "--quiet", "--out", str(folder)]
    assert run(arguments) == 0
    return write_view(folder / "log.mcap")[0]


def text(page: Page, element: str) -> str:
    return str(page.ask(f"document.getElementById('{element}').textContent"))


def pixels(page: Page) -> list[int]:
    """The picture of the arena, as a few numbers that are others when it is another one."""
    found: list[int] = page.ask(f"{TWO_FRAMES}.then({FINGERPRINT})")
    return found


def test_it_loads_and_asks_nobody_for_anything(page: Page, coached: Path) -> None:
    page.open(coached, READY)
    page.ask(TWO_FRAMES)
    assert text(page, "title") == "Pal coached Junior against flat-light"
    assert page.ask("document.getElementById('trouble').hidden")
    assert page.ask("document.querySelectorAll('#traces .uplot').length") >= 4
    assert page.ask("document.querySelectorAll('.lesson').length") == 4
    assert page.ask("document.querySelectorAll('#curve-list .uplot').length") == 2
    assert page.ask("document.querySelectorAll('#event-list li').length") > 3
    assert page.seen.quiet, page.seen


def test_what_was_learnt_unfolds_to_why(page: Page, coached: Path) -> None:
    page.open(coached, READY)
    assert page.ask("document.querySelectorAll('.lesson details').length") == 4
    assert not page.ask("document.querySelector('.lesson details').open")
    page.ask("document.querySelector('.lesson summary').click()")
    page.wait("document.querySelector('.lesson details p').offsetHeight > 0")
    assert page.ask("document.querySelector('.lesson details p').textContent").startswith("Performed ")
    assert page.seen.quiet, page.seen


def test_it_plays_on_from_bout_to_bout_and_stops_at_the_end(page: Page, bouts: Path) -> None:
    page.open(bouts, READY)
    begin, before = page.ask(NOW), pixels(page)
    page.ask(CHANGE.format("change", "speed", 16))
    page.ask("document.getElementById('toggle').click()")
    page.wait(f"{NOW} > {begin} + 0.2")
    assert page.ask("document.getElementById('toggle').getAttribute('aria-label')") == "Pause"
    assert pixels(page) != before
    page.wait("hilView.model.chapterAt(hilView.player.time) === 1")
    page.wait("!hilView.player.playing")
    assert page.ask(NOW) == page.ask("hilView.model.end")
    assert text(page, "where") == "Bout 3"
    assert page.seen.quiet, page.seen


def test_the_keys_do_what_the_page_says(page: Page, bouts: Path) -> None:
    page.open(bouts, READY)
    begin = page.ask(NOW)
    page.press("ArrowRight")
    page.press("ArrowRight", shift=True)
    assert page.ask(NOW) == pytest.approx(begin + 1.05)
    page.press("ArrowLeft")
    assert page.ask(NOW) == pytest.approx(begin + 1.0)
    page.press("Home")
    assert page.ask(NOW) == pytest.approx(begin)
    page.press("]")
    assert text(page, "where") == "Bout 2"
    page.press("[")
    assert text(page, "where") == "Bout 1"
    page.press("+")
    assert page.ask("[hilView.player.speed, document.getElementById('speed').value]") == [2, "2"]
    page.press("w")
    assert page.ask("[hilView.player.from, hilView.player.to]") == page.ask("[hilView.model.begin, hilView.model.end]")
    page.press(" ")
    assert page.ask("hilView.player.playing")
    page.press(" ")
    assert not page.ask("hilView.player.playing")


def test_from_event_to_event(page: Page, coached: Path) -> None:
    page.open(coached, READY)
    later = page.ask(f"hilView.events.shown.find((mark) => mark.time > {NOW} + 0.001).time")
    page.press(".")
    assert page.ask(NOW) == later
    page.press(".")
    page.press(",")
    assert page.ask(NOW) == later


def test_slider_chips_traces_and_events_go_there(page: Page, bouts: Path) -> None:
    page.open(bouts, READY)
    page.ask(CHANGE.format("input", "slider", 0.5))
    assert page.ask(NOW) == pytest.approx(page.ask("(hilView.player.from + hilView.player.to) / 2"), abs=0.02)
    page.ask("[...document.querySelectorAll('.chip')][1].click(), document.getElementById('toggle').click()")
    assert text(page, "where") == "Bout 2"
    assert page.ask("document.querySelector('.chip[aria-current=true]').textContent") == "✗ 2"
    assert "lost" in text(page, "story").lower()
    page.click(*page.ask(IN_A_TRACE))
    share = page.ask("(hilView.player.time - hilView.player.from) / (hilView.player.to - hilView.player.from)")
    assert share == pytest.approx(0.75, abs=0.01)
    page.ask("document.querySelector('#event-list button').click()")
    assert page.ask(NOW) == page.ask("hilView.model.marks[0].time")


def test_after_a_click_the_keys_are_the_player_s(page: Page, bouts: Path) -> None:
    page.open(bouts, READY)
    place = "(({ left, top }) => [left + 8, top + 8])(document.querySelectorAll('.chip')[1].getBoundingClientRect())"
    page.click(*page.ask(place))
    assert page.ask("hilView.player.playing")
    page.press(" ")
    assert not page.ask("hilView.player.playing")
    assert text(page, "where") == "Bout 2"


def test_how_a_bout_ended_is_said_in_words_and_by_a_sign(page: Page, bouts: Path) -> None:
    page.open(bouts, READY)
    assert [page.ask(f"document.querySelectorAll('.chip')[{index}].textContent[0]") for index in range(3)] == ["✓", "✗", "="]
    assert text(page, "story").startswith("Won after 2.0 s: the opponent left the ring on the right")
    assert "✓ 1 won" in text(page, "bout-key")


def test_a_robot_is_picked_out_of_a_swarm(page: Page, swarm: Path) -> None:
    page.open(swarm, READY)
    before = pixels(page)
    page.click(*page.ask(FIRST_BODY))
    key = page.ask("hilView.arena.bodies[0].track.key")
    assert page.ask("hilView.arena.picked") == key == page.ask("document.getElementById('pick').value")
    assert pixels(page) != before
    assert "its sectors" in text(page, "now-list")
    page.press("n")
    assert page.ask("hilView.arena.picked") != key
    assert text(page, "legend").count("RANGER") == text(page, "legend").count("WILD") == 1
    assert page.seen.quiet, page.seen


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("size", SIZES)
def test_it_fits_into_every_window_light_and_dark(browser: Chromium, coached: Path, size: str, *, dark: bool) -> None:
    width, height = SIZES[size]
    page = browser.page(width=width, height=height, dark=dark)
    page.open(coached, READY)
    page.ask(TWO_FRAMES)
    assert page.ask("document.documentElement.scrollWidth") <= width
    top, tall, player, small, level = page.ask(LAID_OUT)
    assert tall > 150
    assert top + tall <= player  # seen whole, above the player
    assert small == 0
    assert (level < 64) is dark
    assert page.seen.quiet, page.seen
    page.close()


def test_it_changes_with_the_system_s_colours(page: Page, bouts: Path) -> None:
    page.open(bouts, READY)
    light = pixels(page)
    page.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    page.wait("getComputedStyle(document.body).backgroundColor !== 'rgb(247, 247, 245)'")
    assert pixels(page) != light


def test_with_reduced_motion_it_moves_in_few_pictures(browser: Chromium, bouts: Path) -> None:
    page = browser.page(still=True)
    page.open(bouts, READY)
    page.ask(COUNT)
    page.press(" ")
    page.wait("hilView.player.time > hilView.model.begin + 1")
    assert page.ask("hilView.drawn") < 12
    page.close()


def test_of_a_log_that_is_cut_it_plays_what_there_is(page: Page, tmp_path: Path) -> None:
    log = tmp_path / "cut.mcap"
    coaching_log(log, budget=60)
    log.write_bytes(log.read_bytes()[: log.stat().st_size * 2 // 3])
    page.open(write_view(log)[0], READY)
    assert "Everything here is of the part that could be read" in text(page, "notes")
    assert page.ask("hilView.model.chapters.length") >= 1
    page.press(" ")
    page.wait("hilView.player.time > hilView.model.begin + 0.3")
    assert page.seen.quiet, page.seen


def test_where_nobody_knows_the_place_the_robot_is_drawn_by_itself(page: Page, tmp_path: Path) -> None:
    driving_log(tmp_path / "d.mcap", 5.0)
    page.open(write_view(tmp_path / "d.mcap")[0], READY)
    assert page.ask("hilView.model.terrain.ground") == "none"
    assert page.ask("[now.hidden, document.getElementById('arena-box').hidden]") == [False, False]
    assert page.ask("document.querySelectorAll('#traces .uplot').length") >= 4
    assert page.seen.quiet, page.seen


def test_a_run_of_which_only_events_are_known_is_a_page_too(page: Page, tmp_path: Path) -> None:
    path = tmp_path / "e.html"
    scene = scene_of("plain")
    scene.terrain = None
    for name in ("tracks", "traces", "lanes", "chapters", "curves", "lessons"):
        setattr(scene, name, [])
    path.write_bytes(page_of(scene))
    page.open(path, READY)
    page.press(" ")
    page.wait("hilView.player.time > 0")
    assert page.ask("document.querySelectorAll('#event-list li').length") == 2
    assert page.ask("[now.hidden, document.getElementById('arena-box').hidden]") == [True, True]
    assert page.seen.quiet, page.seen


def test_the_same_page_takes_a_run_part_by_part(page: Page, bouts: Path) -> None:
    page.open(bouts, READY)
    page.ask(
        "(async () => { const part = JSON.parse(document.getElementById('scene').textContent);"
        " globalThis.rows = hilView.model.tracks.get('junior').poses.t.length; await hilView.model.take(part); })()"
    )
    assert page.ask("hilView.model.tracks.get('junior').poses.t.length === 2 * rows")
    assert page.ask("hilView.model.chapters.length") == 3  # told once more, not once again
    assert page.ask("[...hilView.model.traces.values()][0].t.length === [...hilView.model.traces.values()][0].values[0].length")


# --- a log is not trusted --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("hostile", HOSTILE)
def test_a_hostile_log_is_shown_as_the_text_that_it_is(page: Page, tmp_path: Path, hostile: str) -> None:
    log = tmp_path / "h.mcap"
    hostile_log(log, hostile.encode(errors="replace").decode())
    page.open(write_view(log)[0], READY)
    page.press("w")
    page.press(" ")
    page.wait("hilView.player.time > hilView.model.begin")
    assert page.ask("document.querySelectorAll('script').length") == 3
    assert page.ask("document.querySelectorAll('main img, main svg, main link, main style, main a, main i i').length") == 0
    assert page.seen.quiet, page.seen


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=st.text(st.sampled_from(LETTERS), max_size=60) | st.sampled_from(HOSTILE))
def test_no_text_in_any_field_does_anything(page: Page, tmp_path: Path, text: str) -> None:
    path = tmp_path / "t.html"
    path.write_bytes(page_of(scene_of(text)))
    page.open(path, READY)
    shown = page.ask("[document.getElementById('title').textContent, hilView.model.chapters[0].story, document.scripts.length]")
    assert shown == [text, text, 3]
    assert page.seen.quiet, page.seen
