"""The whole screen of a terminal: taken, drawn on, given back; nobody who is in charge waits for it."""

from __future__ import annotations

import os
import select
import threading
from typing import TYPE_CHECKING

import pytest

from hil.terminal.screen import ENTER, LEAVE, Screen

if TYPE_CHECKING:
    from collections.abc import Iterator

fcntl = pytest.importorskip("fcntl")
termios = pytest.importorskip("termios")

FLOOD = b"x" * 1_000_000
"""More than any terminal holds."""


class Terminal:
    """A pseudo-terminal, whose other end is read when a test asks for it."""

    def __init__(self) -> None:
        self.master, self.slave = os.openpty()
        attributes = termios.tcgetattr(self.slave)
        attributes[1] &= ~termios.OPOST
        termios.tcsetattr(self.slave, termios.TCSANOW, attributes)
        self.screen = Screen(self.slave)

    def close(self) -> None:
        self.screen.close()
        os.close(self.slave)
        os.close(self.master)

    @property
    def came(self) -> bytes:
        """What has come since the last look."""
        found = b""
        while select.select([self.master], [], [], 0)[0]:
            found += os.read(self.master, 65536)
        return found


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    made = Terminal()
    yield made
    made.close()


def test_it_is_taken_once_and_drawn_on(terminal: Terminal) -> None:
    terminal.screen.write(b"too early")
    assert terminal.came == b""
    assert terminal.screen.attend()
    assert terminal.came == ENTER
    assert not terminal.screen.attend()
    terminal.screen.write(b"a picture")
    assert terminal.came == b"a picture"


def test_it_is_given_back_and_taken_again_with_everything_to_be_drawn_anew(terminal: Terminal) -> None:
    terminal.screen.attend()
    assert terminal.came == ENTER
    terminal.screen.give_back()
    assert terminal.came == LEAVE
    assert not terminal.screen.attend()
    terminal.screen.write(b"late")
    assert terminal.came == b""
    terminal.screen.take_again()
    assert terminal.screen.attend()
    assert terminal.came == ENTER


def test_who_gives_it_back_does_not_wait_for_a_terminal_that_takes_nothing(terminal: Terminal) -> None:
    terminal.screen.attend()
    drawing = threading.Thread(target=terminal.screen.write, args=[FLOOD])
    drawing.start()
    terminal.screen.give_back(0.01)
    drawing.join(5.0)
    assert not drawing.is_alive()
    assert len(terminal.came) < len(FLOOD)
    terminal.screen.take_again()
    assert terminal.screen.attend()


def test_a_terminal_that_takes_again_gets_all(terminal: Terminal) -> None:
    terminal.screen.attend()
    drawing = threading.Thread(target=terminal.screen.write, args=[FLOOD])
    drawing.start()
    came = b""
    while len(came) < len(ENTER) + len(FLOOD):
        came += os.read(terminal.master, 65536)
    drawing.join(5.0)
    assert came == ENTER + FLOOD
    assert not terminal.screen.attend()


def test_it_knows_its_size(terminal: Terminal) -> None:
    assert terminal.screen.size() == (80, 24)
    termios.tcsetwinsize(terminal.slave, (40, 120))
    assert terminal.screen.size() == (120, 40)
