"""The cockpit from outside: which keys are its own, and that a display that fails ends nothing else."""

from __future__ import annotations

import os
import select
import sys
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from hil.cockpit.snapshot import Snapshot, Tone
from hil.cockpit.window import CockpitWindow, can_show
from hil.terminal.screen import LEAVE

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs a pseudo-terminal")

NOW = Snapshot("Junior 1", 7.5, "disarmed", Tone.CALM, (), None)


@contextmanager
def terminal() -> Iterator[int]:
    """Inside, standard input and output are a terminal; gives its other end."""
    master, slave = os.openpty()
    path = Path(os.ttyname(slave))
    with (
        path.open("w", encoding="utf-8") as out,
        path.open(encoding="utf-8") as source,
        pytest.MonkeyPatch.context() as patch,
        redirect_stdout(out),
    ):
        patch.setattr(sys, "stdin", source)
        yield master
    os.close(slave)
    os.close(master)


def until(master: int, text: str) -> str:
    """Wait until a text is on the screen."""
    came = ""
    while text not in came:
        assert select.select([master], [], [], 20.0)[0], came
        came += os.read(master, 65536).decode()
    return came


def test_a_cockpit_can_be_shown_where_a_terminal_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    assert not can_show()
    with terminal():
        assert can_show()
        monkeypatch.setenv("TERM", "dumb")
        assert not can_show()


def test_what_is_shown_and_said_is_on_the_screen_and_gone_afterwards() -> None:
    with terminal() as other_end:
        out = sys.stdout
        with CockpitWindow("sim://junior") as window:
            until(other_end, "connecting")
            window.show(NOW)
            window.say("robot 1 is armed")
            until(other_end, "7.50 s  robot 1 is armed")
            assert window.there
        assert sys.stdout is out
        until(other_end, LEAVE.decode())
    assert (window.failure, window.there) == (None, False)


def test_keys_of_its_own_are_taken_and_those_for_robots_are_not() -> None:
    with terminal() as other_end, CockpitWindow("sim://junior") as window:
        until(other_end, "connecting")
        assert not any(window.takes(key) for key in "adeEbnpq ^v<>")
        assert window.takes("?")
        until(other_end, "Driving ends")


def test_a_display_that_fails_ends_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("no such colour")

    monkeypatch.setattr("hil.cockpit.app.Cockpit", broken)
    with terminal(), CockpitWindow("sim://junior") as window:
        window._thread.join(20.0)
        assert not window.there
        window.show(NOW)
        window.say("still there")
    assert str(window.failure) == "no such colour"
