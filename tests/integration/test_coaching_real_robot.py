"""Coaching a robot that nobody referees, rehearsed: a robot on a pty, and a person at a terminal of their own."""

from __future__ import annotations

import re
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest
from logged import inputs_of
from serving import Stepped, in_thread
from shell import Shell

import hil
from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from hil.cli.app import run
from hil.mcaplog.reading.reader import LogReader
from hil.sumo.advice_file import load_advice, save_advice
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings
from simdevice.junior.profile import JuniorProfile
from simdevice.serving.endpoints import PtyEndpoint
from simdevice.sumo.settings import WorldSettings
from simdevice.sumo.world import World

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

LOW = 7.2
"""What the robot warns of, in V: its battery is full at 7.5 V."""


class Handled(Stepped):
    """A robot and its ring, in which hands do something between two control periods.

    Args:
        gain: Share of its effort that the left wheel gives.

    Attributes:
        world: The ring.
        touched: Whether the wheels turned whenever somebody's hands were in the ring.
    """

    def __init__(self, gain: float) -> None:
        profile = JuniorProfile(wheel_gain=(gain, 1.0), command_noise=0.01)
        self.world = World(WorldSettings(seed=5, referee=False, profile=profile))
        super().__init__(self.world)
        self.touched: list[bool] = []
        self._hands: list[Callable[[], object]] = []
        self._away = False

    def step(self, inbound: bytes) -> bytes:
        while self._hands:
            self._hands.pop(0)()
        if self._away:
            self.world.match.robot.body.place(0.0, 0.5, 1.57)
        return super().step(inbound)

    def do(self, *hands: Callable[[], object]) -> None:
        """Do these things, and wait until they are done."""
        self._hands += hands
        self.until(lambda: not self._hands)

    def reach_in(self, *hands: Callable[[], object]) -> None:
        """Likewise, with hands in the ring."""
        self.do(lambda: self.touched.append(self.world.device.wheels != (0.0, 0.0)), *hands)

    def set_up(self, seed: int) -> None:
        """Put both robots on to the ring."""
        self._away = False
        self.reach_in(lambda: self.world.match.reset(seed))

    def make_room(self) -> None:
        """Put our robot into the middle of the ring, and the other one far off."""
        match = self.world.match
        self.reach_in(lambda: match.robot.body.place(0.0, 0.0, 0.0), lambda: match.opponent.place(0.0, 0.6, 0.0))

    def take_off(self) -> None:
        """Hold our robot far off the ring."""
        self._away = True


@contextmanager
def handled(gain: float = 1.0) -> Iterator[tuple[Handled, str]]:
    """A robot that hands can reach, on a pty, whose left wheel gives a share of its effort."""
    robot, endpoint = Handled(gain), PtyEndpoint()
    with in_thread(robot, endpoint):
        yield robot, endpoint.url


def hil_on(*words: str) -> str:
    """A command line of ours."""
    return f"{sys.executable} -m hil {' '.join(words)}\n"


@pytest.mark.slow
def test_a_person_sets_up_judges_and_changes_the_battery(tmp_path: Path) -> None:
    with handled(0.85) as (robot, url), Shell(tmp_path) as shell:
        with hil.connect(url) as junior:
            junior.set_parameter("BATT_LOW", LOW * 1e3)
        words = ("--reset", "ask", "--budget", "100000", "--held-out", "0", "--no-report", "--out", "run")
        shell.types(hil_on("coach", url, *words))
        shell.until("The wheels are measured first")
        robot.make_room()
        shell.types("\n")
        told = " ".join(shell.until("Bout 1: set up both robots").split())
        assert "The wheels are not even (5 % are allowed)" in told
        assert "Left and right are learnt apart. They would be about even with TRIM_RIGHT 0.8" in told
        robot.set_up(1)
        shell.types("\n")
        shell.until("Bout 1: how does it end?")
        robot.until(lambda: robot.world.device.wheels != (0.0, 0.0))
        shell.types("w")
        shell.until("Bout 2: set up both robots")
        robot.take_off()
        shell.types("\n")
        shell.until("Bout 2: the floor sensors see no ring")
        robot.set_up(2)
        shell.types("\n")
        shell.until("Bout 2: how does it end?")
        robot.until(lambda: robot.world.device.wheels != (0.0, 0.0))
        robot.do(lambda: robot.world.match.robot.motors.feed(6.5))
        end = robot.world.now() + 1.5
        robot.until(lambda: robot.world.now() >= end)
        robot.take_off()  # the floor sensors say that it is lost
        shell.until("The battery is low, 6.")
        saved = load_advice(tmp_path / "run" / "advice.toml")
        assert saved.entries
        shell.types("\n")
        shell.until("The battery is low, 6.")  # nobody has changed it
        robot.reach_in(robot.world.switch_off)
        shell.until("is lost")
        robot.do(lambda: robot.world.match.robot.motors.feed(None), robot.world.switch_on)
        shell.until("is back, restarted")
        shell.types("\n")
        shell.until("Bout 3: set up both robots")
        robot.set_up(3)
        shell.types("\n")
        shell.until("Bout 3: how does it end?")
        shell.types("d")
        shell.until("Bout 4: set up both robots")
        shell.types("\x03")
        told = shell.until("Interrupted.")
    assert "The best advice so far: run/advice.toml" in told
    assert "--reset ask --resume-from run" in re.sub(r"\s+", " ", told)
    assert robot.touched == [False] * 5
    log = tmp_path / "run" / "log.mcap"
    events = [entry.value for entry in LogReader(log).entries(["/events"])]
    assert [event.kind for event in events if event.kind in {"wheels", "bout"}] == ["wheels", "bout", "bout", "bout"]
    assert [what.removeprefix("key ") for what in inputs_of(log)][-1:] == ["interrupt"]
    assert hil.replay(log).difference is None


@pytest.mark.nightly
def test_a_person_judges_a_challenge_which_is_gone_on_with_where_it_was_cut(tmp_path: Path) -> None:
    given = Advice(PalSettings(mirror=False), (AdviceEntry(ANY_STIMULUS, 0, (Action.FF,) * 4, 1.0, 1),), "flat-light", 1)
    save_advice(given, tmp_path / "given.toml")
    bouts = 0
    with handled() as (robot, url), Shell(tmp_path) as shell:

        def judge(key: str, placed: str = "") -> None:
            nonlocal bouts
            bouts += 1
            shell.until(f"Bout {bouts}: set up both robots{placed}, and say")
            robot.set_up(bouts)
            shell.types("\n")
            shell.until(f"Bout {bouts}: how does it end?")
            robot.until(lambda: robot.world.device.wheels != (0.0, 0.0))
            shell.types(key)

        words = ("--reset", "ask", "--held-out", "0", "--no-report")
        shell.types(hil_on("coach", url, *words, "--budget", "1", "--from", "given.toml", "--out", "run"))
        judge("d")
        shell.until("Challenge: what was learnt and the given advice play bouts in turn")
        judge("l")
        judge("w", " as for the bout before")
        shell.until("2 bouts played: of the pairs that only one of them won, 0 went to what was learnt and 1 to the other")
        judge("l")
        shell.until("set up both robots as for the bout before")
        shell.types("\x03")
        assert "The best advice so far: run/advice.toml" in shell.until("Interrupted.")
        bouts = 0
        shell.types(hil_on("coach", url, *words, "--resume-from", "run", "--out", "again"))
        shell.until("3 of them played already")
        judge("w")
        for _ in range(3):
            judge("l")
            judge("l", " as for the bout before")
        told = shell.until("Learnt:")
    assert "The given advice stays" in told
    assert load_advice(tmp_path / "run" / "advice.toml") == load_advice(tmp_path / "again" / "advice.toml") == given
    assert load_advice(tmp_path / "again" / "learnt-advice.toml").opponent == "unknown"
    for name in ("run", "again"):
        assert hil.replay(tmp_path / name / "log.mcap").difference is None


@pytest.mark.slow
def test_a_robot_sets_itself_up_and_asks_where_it_cannot(tmp_path: Path) -> None:
    with handled() as (robot, url), Shell(tmp_path) as shell:
        shell.types(hil_on("coach", url, "--reset", "auto", "--budget", "100000", "--no-report", "--out", "run"))
        assert "The battery is not watched" in shell.until("A pause begins before the next maneuver")
        told = " ".join(shell.until("maneuvers").split())
        assert "The wheels are even (5 % are allowed)" in told
        assert "Left and right are learnt as one." in told
        robot.until(lambda: robot.world.device.wheels != (0.0, 0.0))
        robot.take_off()
        shell.until("The floor sensors see no ring: put both robots back")
        robot.set_up(2)
        shell.types("\n")
        shell.until("A pause begins before the next maneuver")
        robot.until(lambda: robot.world.device.wheels != (0.0, 0.0))
        shell.types("p")
        shell.until("Pause: the robot is disarmed.")
        robot.reach_in()
        shell.types("r")
        shell.until("A pause begins before the next maneuver")
        shell.types("\x03")
        shell.until("Interrupted.")
    assert robot.touched == [False] * 2
    log = tmp_path / "run" / "log.mcap"
    assert [what for what in inputs_of(log) if what != "interrupt"] == ["key \n", "key p", "key r"]
    assert hil.replay(log).difference is None


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--reset", "ask"], "a robot that is emulated in this process has a referee: leave --reset out"),
        (["--judge"], "leave --judge out"),
        (["tcp://127.0.0.1:9", "--reset", "ask"], "--reset asks a person, and nobody can be asked here"),
        (["tcp://127.0.0.1:9", "--reset", "auto", "--judge"], "leave --reset auto out"),
    ],
)
def test_a_person_is_asked_only_where_one_can_be(
    words: list[str], text: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", None)
    assert run(["coach", *words, "--no-log", "--budget", "1"]) == 2
    assert text in capsys.readouterr().err
