"""The whole screen of a terminal, taken for a display and given back: what fills it is drawn elsewhere.

What draws is a thread of its own, since a terminal may take nothing for as long as it likes (Ctrl-S, a connection that hangs).
Whoever controls robots never writes here, and never waits for who does: to stop a display, it says so.
"""

from __future__ import annotations

import os
import select
import threading
from contextlib import suppress
from typing import Final

from hil.terminal.keys import in_foreground

ENTER: Final = b"\x1b[?1049h\x1b[?25l\x1b[?7l\x1b[H"
"""Another screen than the one with the shell's lines; no cursor, no wrapping."""
LEAVE: Final = b"\x1b[0m\x1b[?7h\x1b[?25h\x1b[?1049l"
_LOOK: Final = 0.1
"""A terminal that takes nothing is asked again so often, in s, whether it does, or whether it is over."""
_QUIET: Final = 0.3
"""Who draws is given so long to leave off when the screen is given back, in s."""
_LEAVING: Final = 1.0
"""Likewise, when it is given back for good."""


class Screen:
    """A terminal's screen.

    Args:
        descriptor: Of the terminal.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._out = _never_waiting(descriptor)
        self._drawing = threading.Lock()
        self._wanted = True
        self._ours = False
        self._whole = True

    def size(self) -> tuple[int, int]:
        """Its columns and rows; 80 and 24 where it does not say."""
        with suppress(OSError):
            columns, rows = os.get_terminal_size(self._descriptor)
            if columns > 0 and rows > 0:
                return columns, rows
        return 80, 24

    # --- by the thread that draws ------------------------------------------------------------------------------------

    def attend(self) -> bool:
        """Take the screen where it is to be ours, and is not; called often.

        Returns:
            All is to be drawn anew.
        """
        if not (self._wanted and in_foreground(self._descriptor)):
            return False
        anew = not (self._ours and self._whole)
        if not self._ours:
            with self._drawing:
                self._ours = self._wanted and self._put(ENTER)
        self._whole = self._ours
        return anew and self._ours

    def write(self, data: bytes) -> None:
        """Draw; nothing where the screen is not ours. Waits as long as the terminal takes nothing.

        Args:
            data: Text and escape sequences.
        """
        with self._drawing:
            if not (self._ours and self._wanted and self._put(data)):
                self._whole = False

    def _put(self, data: bytes) -> bool:
        """Write all of it; False where the screen was wanted back before."""
        left = memoryview(data)
        while left:
            try:
                left = left[os.write(self._out, left) :]
            except BlockingIOError:
                while not select.select([], [self._out], [], _LOOK)[1]:
                    if not self._wanted:
                        return False
            except OSError:  # it is gone
                return False
        return True

    # --- by whoever is in charge -------------------------------------------------------------------------------------

    def give_back(self, patience: float = _QUIET) -> None:
        """Have the screen be as it was before.

        Args:
            patience: How long the terminal, and who draws, are waited for, in s.
        """
        self._wanted = False
        quiet = self._drawing.acquire(timeout=patience)
        try:
            if self._ours and in_foreground(self._descriptor):
                self._ours = False
                select.select([], [self._out], [], patience)
                with suppress(OSError):
                    os.write(self._out, LEAVE)
        finally:
            if quiet:
                self._drawing.release()

    def take_again(self) -> None:
        """Have it be taken again by who draws; fit for signal handlers."""
        self._ours = False  # whoever had it meanwhile has left it otherwise
        self._wanted = True

    def close(self) -> None:
        """Give it back for good."""
        self.give_back(_LEAVING)
        if self._out != self._descriptor:
            os.close(self._out)
            self._out = self._descriptor


def _never_waiting(descriptor: int) -> int:
    """The same terminal, opened once more: whoever writes there never waits, and nobody else's descriptor is changed by it."""
    try:
        return os.open(os.ttyname(descriptor), os.O_WRONLY | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError:
        return descriptor
