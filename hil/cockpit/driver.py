"""Textual's way to the terminal. Keys do not come by it: those for robots never pass through what draws."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual import events
from textual.driver import Driver
from textual.geometry import Size

if TYPE_CHECKING:
    from textual.app import App

    from hil.terminal.screen import Screen


class ScreenDriver(Driver):
    """Draws on a screen that may be given back at any time; handles no signal, and reads nothing."""

    def __init__(
        self, app: App[object], *, debug: bool = False, mouse: bool = True, size: tuple[int, int] | None = None
    ) -> None:
        super().__init__(app, debug=debug, mouse=mouse, size=size)
        terminal: Screen | None = getattr(app, "terminal", None)
        if terminal is None:
            raise ValueError("there is no terminal to draw on")
        self._terminal = terminal
        self._known = (0, 0)

    def attend(self) -> None:
        """See whether the screen is ours, and how large; called often, by the thread that draws."""
        size = self._terminal.size()
        anew = self._terminal.attend()
        if anew or size != self._known:
            self._known = size
            self._size = size
            self.send_message(events.Resize(Size(*size), Size(*size)))
            if anew:
                self._app.refresh()

    def write(self, data: str) -> None:
        """Draw; for Textual."""
        self._terminal.write(data.encode("utf-8", "replace"))

    def start_application_mode(self) -> None:
        """Take the screen; for Textual."""
        self.attend()

    def disable_input(self) -> None:
        """There is none; for Textual."""

    def stop_application_mode(self) -> None:
        """Whoever opened the screen gives it back; for Textual."""
