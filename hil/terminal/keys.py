"""Single keys from a terminal, without waiting for the return key. On systems without termios there are none.

While the program is stopped (Ctrl-Z), the terminal is as it was before.
"""

from __future__ import annotations

import os
import select
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

from hil.terminal.suspending import around_stop

try:
    import termios
    import tty
except ImportError:  # Windows
    _POSIX = False
else:
    _POSIX = True

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

Keys = str
"""What was pressed since the last look; an arrow is one of `ARROWS`."""

ARROWS = {"\x1b[A": "^", "\x1b[B": "v", "\x1b[C": ">", "\x1b[D": "<"}


def _terminal() -> bool:
    """Standard input is there, and is a terminal."""
    return sys.stdin is not None and not sys.stdin.closed and sys.stdin.isatty()


@contextmanager
def pressed_keys() -> Iterator[Callable[[], Keys]]:
    """Switch the terminal to single keys, and back on the way out.

    Yields:
        A function that returns what was pressed since it was last called, and never waits.
    """
    if not (_POSIX and _terminal()):
        yield lambda: ""
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)

    def ours() -> bool:
        """The terminal is ours, and not that of a shell which has us in the background: to touch it would stop us."""
        try:
            return os.tcgetpgrp(descriptor) == os.getpgrp()
        except OSError:  # it is not the one that controls us, or is gone
            return True

    def give_back() -> None:
        if ours():
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)

    def take() -> None:
        if ours():
            tty.setcbreak(descriptor)

    def read() -> Keys:
        text = ""
        while ours() and select.select([descriptor], [], [], 0)[0]:
            data = os.read(descriptor, 64)
            if not data:
                break
            text += data.decode(errors="ignore")
        for code, arrow in ARROWS.items():
            text = text.replace(code, arrow)
        return text

    try:
        take()
        with around_stop(give_back, take):
            yield read
    finally:
        give_back()
