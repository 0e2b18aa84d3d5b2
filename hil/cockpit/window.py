"""The cockpit from outside: a thread of its own draws pictures, and whoever makes them never waits for it."""

from __future__ import annotations

import asyncio
import os
import sys
import threading
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Final, Self

from hil.terminal.screen import Screen
from hil.terminal.suspending import around_stop

try:
    import termios
except ImportError:  # Windows
    termios = None  # type: ignore[assignment]

if TYPE_CHECKING:
    from contextlib import AbstractContextManager
    from types import TracebackType

    from hil.cockpit.app import Cockpit
    from hil.cockpit.snapshot import Snapshot

KEPT: Final = 500
"""So much of what was said can be scrolled back to, in lines."""
VIEW_KEYS: Final = {"?": "question_mark", "\t": "tab", "pageup": "pageup", "pagedown": "pagedown", "home": "home", "end": "end"}
"""Keys that robots do not care for, and what Textual calls them."""
_LEAVING: Final = 1.0
"""The thread is given so long to end, in s."""


def can_show() -> bool:
    """Standard input and output are a terminal that a cockpit can be drawn on."""
    streams = (sys.stdin, sys.stdout)
    if termios is None or os.environ.get("TERM", "dumb") in {"", "dumb", "unknown"}:
        return False
    return all(stream is not None and not stream.closed and stream.isatty() for stream in streams)


class CockpitWindow:
    """Shows pictures on the terminal, from the beginning of its `with` block to the end.

    Args:
        title: Whom or what is looked at, before there is a picture.

    Attributes:
        failure: Why it is not there any more; None where it is, or was left.
    """

    def __init__(self, title: str) -> None:
        self.failure: BaseException | None = None
        self._title = title
        self._picture: Snapshot | None = None
        self._said: deque[str] = deque(maxlen=KEPT)
        self._wanting = True
        self._leaving = False
        self._app: Cockpit | None = None
        self._thread = threading.Thread(target=self._run, name="cockpit", daemon=True)
        self._streams = (sys.stdout, sys.stderr)
        self._screen = Screen(sys.stdout.fileno())
        self._around: AbstractContextManager[None] = around_stop(self._screen.give_back, self._screen.take_again)

    def __enter__(self) -> Self:
        self._around.__enter__()
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._leaving = True
        if (app := self._app) is not None:
            with suppress(RuntimeError):  # it has ended by itself
                app.call_later(app.exit)
        self._screen.close()
        self._thread.join(_LEAVING)
        sys.stdout, sys.stderr = self._streams
        self._around.__exit__(kind, error, trace)

    # --- for whoever makes pictures ----------------------------------------------------------------------------------

    @property
    def there(self) -> bool:
        """It is open."""
        return self.failure is None and not self._leaving

    @property
    def wanting(self) -> bool:
        """It has shown the last picture, and time for the next one has come."""
        return self._wanting

    def show(self, picture: Snapshot) -> None:
        """Show a picture.

        Args:
            picture: What there is to see.
        """
        self._wanting = False
        self._picture = picture

    def say(self, text: str) -> None:
        """Say something, as of now.

        Args:
            text: What.
        """
        now = "" if self._picture is None else f"{self._picture.now:8.2f} s  "
        self._said += [f"{now}{line}" for line in text.splitlines()]

    def takes(self, key: str) -> bool:
        """Whether a key is for the window; then it is obeyed.

        Args:
            key: As `hil.terminal.key_codes` calls it.
        """
        name = VIEW_KEYS.get(key)
        if name is None:
            return False
        if (app := self._app) is not None:
            from textual import events  # noqa: PLC0415 - loaded by the thread that draws, while a robot is connected

            app.post_message(events.Key(name, None))
        return True

    # --- the thread that draws ---------------------------------------------------------------------------------------

    def _shown(self) -> None:
        self._wanting = True

    def _run(self) -> None:
        try:
            from hil.cockpit.app import Cockpit  # noqa: PLC0415 - takes a while, and a robot can be connected meanwhile

            encoding = self._streams[0].encoding or ""
            app = Cockpit(
                self._title,
                latest=lambda: self._picture,
                said=lambda: list(self._said),
                shown=self._shown,
                say=self.say,
                terminal=self._screen,
                braille=encoding.lower().startswith("utf"),
            )
            self._app = app
            if not self._leaving:
                asyncio.run(app.run_async(mouse=False))
            if not self._leaving:
                raise RuntimeError("the display has ended")  # noqa: TRY301 - told as any other failure
        except BaseException as error:  # noqa: BLE001 - a display that fails must not end what drives a robot
            self.failure = error
            self._screen.give_back()
