"""The live page in a browser: it follows a run, stops its robots, and says when nobody tells it anything any more."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

import pytest
from chromium import Chromium
from logged import inputs_of
from served_swarm import served_swarm
from serving import served

import hil
from firmware_protocol.errors import NoRobotError
from hil.look.reading import read_scene
from hil.mcaplog.reading.reader import LogReader
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings
from simdevice.swarm.settings import SwarmSettings

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from chromium import Page

pytestmark = [pytest.mark.browser, pytest.mark.slow]

BEGUN: Final = "globalThis.hilView && hilView.model.chapters.length > 0"
WORDS: Final = "document.getElementById('live-words').textContent"
STOPPED: Final = "document.getElementById('stopped').textContent"
PATIENCE: Final = 120.0
COACH: Final = ("coach", "--runs", "1", "--no-report")
SHORT: Final = (*COACH, "--budget", "300", "--held-out", "5")
"""A run of which somebody sees the beginning and the end."""
LONG: Final = (*COACH, "--budget", "1000000")
"""A run that is not over before somebody has looked on, however slow the machine."""


class Run:
    """A run that goes on, and its page's address."""

    def __init__(self, folder: Path, process: subprocess.Popen[str], url: str) -> None:
        self.folder = folder
        self.process = process
        self.url = url

    def end(self) -> str:
        """Wait until it is over; what it said."""
        said, _ = self.process.communicate(timeout=PATIENCE)
        return said


@contextmanager
def running(tmp_path: Path, *words: str) -> Iterator[Run]:
    """A run that is shown while it goes on; `hil view` is nothing else."""
    folder = tmp_path / "run"
    shown = () if words[0] == "view" else ("--live",)
    process = subprocess.Popen(  # noqa: S603 - our own program
        [sys.executable, "-m", "hil", *words, *shown, "--no-open", "--out", str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        assert process.stdout is not None
        said = process.stdout.readline()
        found = re.fullmatch(r"Live: (http://127\.0\.0\.1:\d+/[\w-]{22}/)\n", said)
        assert found, said
        yield Run(folder, process, found[1])
    finally:
        process.kill()
        process.communicate()


@pytest.fixture(scope="module")
def browser() -> Iterator[Chromium]:
    with Chromium() as started:
        yield started


@pytest.fixture
def page(browser: Chromium) -> Iterator[Page]:
    opened = browser.page()
    yield opened
    opened.close()


def test_a_coaching_run_is_followed_to_its_end(page: Page, tmp_path: Path) -> None:
    with running(tmp_path, *SHORT) as run:
        page.visit(run.url, BEGUN)
        first = page.ask("hilView.player.time")
        page.wait(f"hilView.player.time > {first} + 0.5 && hilView.player.following")
        page.wait("hilView.model.curves.size > 0 && document.querySelector('#curve-list canvas')")
        token = run.url.split("/")[3]
        assert token not in commands()
        run.end()
        page.wait(f"/over/.test({WORDS})")
        page.wait("hilView.model.lessons.length > 0 && document.querySelector('#lesson-list canvas')")
        assert page.ask("hilView.model.title") == "Pal coached Junior against flat-light"
        assert page.ask("document.getElementById('stop').disabled")
    assert page.seen.requests == [run.url + "told"]
    assert not page.seen.console
    assert not page.seen.dialogs
    assert token.encode() not in (run.folder / "log.mcap").read_bytes()
    assert token not in (run.folder / "run.json").read_text("utf-8")


@pytest.mark.parametrize("looking_around", [False, True])
def test_at_the_end_what_was_learnt_and_how_it_plays_stand_first(page: Page, tmp_path: Path, *, looking_around: bool) -> None:
    with running(tmp_path, *SHORT) as run:
        page.visit(run.url, BEGUN)
        if looking_around:
            page.ask("hilView.player.chapter(0)")
        assert page.ask("document.getElementById('result').hidden")
        run.end()
        page.wait(f"/over/.test({WORDS}) && !document.getElementById('result').hidden")
    log = run.folder / "log.mcap"
    assert page.ask(WORDS) == f"The run is over. All of it: hil view {log}"
    assert page.ask("document.getElementById('stop').hidden && document.getElementById('follow').hidden")
    result = page.ask("document.getElementById('result').innerText")
    assert re.search(r"Bouts played by the advice, against flat-light: \d of 5 won", result)
    assert "When both eyes see it" in result
    above = "document.getElementById('result').getBoundingClientRect().bottom"
    assert page.ask(f"{above} <= document.getElementById('arena').getBoundingClientRect().top")
    # The bouts that are listed are some of those that were played, and of each kind there is one.
    listed = page.ask("hilView.model.chapters.filter((one) => one.outcome).length")
    assert page.ask("hilView.model.played") == bouts_in(log) > listed
    words = page.ask("document.getElementById('bout-words').innerText")
    assert f"the {listed} bouts that were shown, of {bouts_in(log)}. All: hil view {log}" in words
    assert page.ask("document.querySelectorAll('#bout-list .chip').length") == listed
    shown = "hilView.model.chapters[hilView.model.chapterAt(hilView.player.time)]"
    if looking_around:
        assert page.ask(f"{shown} === hilView.model.chapters[0]")
    else:
        assert page.ask(f"{shown}.series") == "bouts played by the advice"
        assert page.ask("document.getElementById('where').textContent").endswith(", bouts played by the advice")
        assert not page.ask("hilView.player.playing")
    assert not page.seen.console


def bouts_in(log: Path) -> int:
    """How many bouts a log tells of, those not counted that were broken off before they had an outcome."""
    return sum(entry.value.kind == "bout" for entry in LogReader(log).entries(["/events"]))


def commands() -> str:
    """The command lines of all processes of this machine."""
    shown = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True)  # noqa: S607 - of this machine
    return shown.stdout


def test_the_stop_is_confirmed_recorded_and_replayed(page: Page, tmp_path: Path) -> None:
    with running(tmp_path, *LONG) as run:
        page.visit(run.url, BEGUN)
        page.ask("document.getElementById('stop').click()")
        page.wait(f"/stopped|NOT/.test({STOPPED})")
        assert page.ask(STOPPED) == "stopped: the robot says so"
        assert "emergency stop" in run.end()
        assert run.process.returncode == 1
    log = run.folder / "log.mcap"
    assert inputs_of(log)[0] == "stop"
    assert hil.replay(log).difference is None


def test_with_six_tabs_the_stop_goes_through(browser: Chromium, tmp_path: Path) -> None:
    with running(tmp_path, *LONG) as run:
        tabs = [browser.page() for _ in range(6)]
        try:
            for tab in tabs:
                tab.visit(run.url, f"({BEGUN}) || /no room/.test({WORDS})")
            assert sum("no room" in str(tab.ask(WORDS)) for tab in tabs) == 2
            tabs[-1].ask("document.getElementById('stop').click()")
            tabs[-1].wait(f"/stopped|NOT/.test({STOPPED})")
            assert tabs[-1].ask(STOPPED) == "stopped: the robot says so"
            run.end()
            for tab in tabs[:4]:
                tab.wait(f"/over|no room/.test({WORDS})")
        finally:
            for tab in tabs:
                tab.close()


def test_a_program_that_is_killed_is_told_of_and_its_last_state_stays(page: Page, tmp_path: Path) -> None:
    with running(tmp_path, *LONG) as run:
        page.visit(run.url, BEGUN)
        os.kill(run.process.pid, signal.SIGKILL)
        page.wait(f"/has died/.test({WORDS})")
        assert page.ask("document.getElementById('live').classList.contains('bad')")
        assert page.ask("hilView.model.chapters.length") > 0


def test_a_swarm_is_followed(page: Page, tmp_path: Path) -> None:
    with running(tmp_path, "swarm", "surround", "--steps", "120", "--no-report") as run:
        page.visit(run.url, "globalThis.hilView && hilView.model.tracks.size > 20")
        run.end()
        page.wait(f"/over/.test({WORDS})")
        assert page.ask("hilView.model.title") == "RANGERs surround WILDs"
    assert not page.seen.console


def stop(page: Page) -> str:
    """Click the stop until it is confirmed, as who reads that it is not would; a busy machine may be late."""
    said = ""
    for _ in range(20):
        page.ask("document.getElementById('stopped').textContent = ''")
        page.ask("document.getElementById('stop').click()")
        page.wait(f"/stopped:|NOT/.test({STOPPED})")
        said = str(page.ask(STOPPED))
        if said.startswith("stopped"):
            break
    return said


def answer(page: Page, name: str) -> None:
    """Wait until the run asks for it, and click its button."""
    button = f"[...document.querySelectorAll('#choices button')].find((one) => one.textContent === '{name}' && !one.disabled)"
    page.wait(button)
    page.ask(f"{button}.click()")


def test_a_person_judges_on_the_page(page: Page, tmp_path: Path) -> None:
    world = junior_world(WorldSettings(referee=False))
    words = ("bout", "--judge", "--controller", "chase", "--trials", "2")
    with served("tcp://127.0.0.1:0", world) as url, running(tmp_path, *words, url) as run:
        page.visit(run.url, "document.querySelector('#choices button')")
        for name in ("Ring is ready", "Lost", "Ring is ready", "Won"):
            answer(page, name)
        assert "2 bouts against unknown" in run.end()
        page.wait(f"/over/.test({WORDS})")
        assert page.ask("document.getElementById('asked').hidden")
        page.wait("hilView.model.chapters.map((one) => one.outcome).join() === 'lost,won'")
    log = run.folder / "log.mcap"
    assert inputs_of(log) == ["ready", "lost", "ready", "won"]
    assert [(bout.name, bout.outcome) for bout in read_scene(log).chapters] == [("Bout 1", "lost"), ("Bout 2", "won")]
    assert hil.replay(log).difference is None
    assert not page.seen.console


def test_a_coaching_pauses_and_goes_on(page: Page, tmp_path: Path) -> None:
    world = junior_world(WorldSettings(referee=False))
    with served("tcp://127.0.0.1:0", world) as url, running(tmp_path, *LONG, "--no-mirror", url) as run:
        page.visit(run.url, "document.querySelector('#choices button')")
        for name in ("Pause", "Go on"):
            answer(page, name)
        page.wait("document.getElementById('asked-words').textContent.startsWith('A pause begins')")
        run.process.send_signal(signal.SIGINT)
        run.end()
    log = run.folder / "log.mcap"
    assert inputs_of(log) == ["pause", "resume", "interrupt"]
    assert hil.replay(log).difference is None


def test_robots_at_a_link_are_watched_and_stopped_but_not_taken(page: Page, tmp_path: Path) -> None:
    world = junior_world(WorldSettings())
    with served("tcp://127.0.0.1:0", world) as url, running(tmp_path, "view", url) as run:
        page.visit(run.url, "globalThis.hilView && hilView.model.tracks.size > 0 && hilView.model.end > 1")
        assert stop(page) == "stopped: the robot says so"
        run.process.send_signal(signal.SIGINT)
        run.end()
        assert run.process.returncode == 130
        page.wait(f"/over/.test({WORDS})")
    log = run.folder / "log.mcap"
    inputs = inputs_of(log)
    assert (set(inputs[:-1]), inputs[-1]) == ({"stop"}, "interrupt")
    assert not list(LogReader(log).entries(["/robot/session"]))
    assert hil.replay(log).difference is None
    assert not page.seen.console


def test_a_swarm_at_a_link_is_watched(page: Page, tmp_path: Path) -> None:
    with served_swarm(SwarmSettings(4, 2), "tcp://127.0.0.1:0") as swarm, running(tmp_path, "view", swarm.urls[0]) as run:
        page.visit(run.url, "globalThis.hilView && hilView.model.tracks.size === 6")
        assert stop(page) == "stopped: all 6 robots say so"
        assert not swarm.armed
    assert not page.seen.console


def test_emulated_robots_are_shown_from_their_side(page: Page) -> None:
    words = ("emulate", "junior", "--link", "tcp://127.0.0.1:0", "--live", "--no-open", "--quiet")
    process = subprocess.Popen(  # noqa: S603 - our own program
        [sys.executable, "-m", "hil", *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        assert process.stdout is not None
        page.visit(
            process.stdout.readline().removeprefix("Live: ").strip(), "globalThis.hilView && hilView.model.tracks.size > 0"
        )
        url = process.stdout.readline().split()[-1]
        for name in ("Lift", "Put back", "Power off"):
            answer(page, name)
        page.wait("document.getElementById('asked-words').textContent === 'The robot has no power.'")
        assert page.ask("document.getElementById('stop').hidden")
        with pytest.raises(NoRobotError):
            hil.connect(url)
        answer(page, "Power on")
        with hil.connect(url) as junior:
            junior.arm()
        process.send_signal(signal.SIGINT)
        page.wait(f"/over/.test({WORDS})")
        assert process.wait(PATIENCE) == 130
    finally:
        process.kill()
        process.communicate()
    assert not page.seen.console
