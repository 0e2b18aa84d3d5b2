"""Single keys from a terminal, without waiting for the return key. On systems without termios there are none.

While the program is stopped (Ctrl-Z), the terminal is as it was before.
"""

from __future__ import annotations

import os
import select
import sys
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from hil.terminal.key_codes import KeyDecoder
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
"""What was pressed since the last look, a character for each key: see `hil.terminal.key_codes`."""
_LOOK: Final = 0.1
"""Whoever waits for keys looks up so often, in s: whether that is over, and whether the terminal is ours again."""


def _terminal() -> bool:
    """Standard input is there, and is a terminal."""
    return sys.stdin is not None and not sys.stdin.closed and sys.stdin.isatty()


def in_foreground(descriptor: int) -> bool:
    """A terminal is ours, and not that of a shell which has us in the background: to touch it would stop us.

    Args:
        descriptor: Of the terminal.
    """
    try:
        return os.tcgetpgrp(descriptor) == os.getpgrp()
    except OSError:  # it is not the one that controls us, or is gone
        return True


@contextmanager
def pressed_keys(
    taken: Callable[[str], bool] | None = None, came: Callable[[], None] | None = None
) -> Iterator[Callable[[], Keys]]:
    """Switch the terminal to single keys, and back on the way out.

    Args:
        taken: Is given each key first, and says whether it is somebody else's; None: none is. Keys with a name of several
            letters are nobody's else.
        came: Called by another thread as soon as there are keys to be read; None: whoever reads them looks often enough.

    Yields:
        A function that returns what was pressed since it was last called, and never waits.
    """
    if not (_POSIX and _terminal()):
        yield lambda: ""
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    decoder = KeyDecoder()
    looked = threading.Event()

    def give_back() -> None:
        if in_foreground(descriptor):
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)

    def take() -> None:
        if in_foreground(descriptor):
            tty.setcbreak(descriptor)

    def read() -> Keys:
        keys: list[str] = []
        while in_foreground(descriptor) and select.select([descriptor], [], [], 0)[0]:
            data = os.read(descriptor, 64)
            if not data:
                break
            keys += decoder.feed(data)
        if came is not None:
            looked.set()
        return "".join(key for key in keys if not (taken is not None and taken(key)) and len(key) == 1)

    try:
        take()
        with around_stop(give_back, take), _watched(descriptor, came, looked):
            yield read
    finally:
        give_back()


@contextmanager
def _watched(descriptor: int, came: Callable[[], None] | None, looked: threading.Event) -> Iterator[None]:
    """Inside, another thread tells that there is something to be read, once until somebody has looked."""
    if came is None:
        yield
        return
    over = threading.Event()

    def watch() -> None:
        while not over.is_set():
            if select.select([descriptor], [], [], _LOOK)[0]:
                looked.clear()
                came()
                looked.wait(_LOOK)

    watcher = threading.Thread(target=watch, name="keys", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        looked.set()
        watcher.join()
