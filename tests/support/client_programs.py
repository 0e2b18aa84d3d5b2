"""Other people's programs in processes of their own: what they print, what they are told, every wait bounded."""

from __future__ import annotations

import os
import subprocess
import threading
from typing import TYPE_CHECKING, Final, Self

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path
    from types import TracebackType

PATIENCE: Final = 30.0
"""Longest wait for a text or for the end, in s."""
_TRIES: Final = 60


class Program:
    """A program that is talked to by its standard input, killed at the end of its `with` block.

    Args:
        command: Its command line.
        folder: Its working directory and its home.

    Attributes:
        text: What it has printed so far, errors among it.
    """

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        self.text = ""
        self._seen = 0
        self._changed = threading.Condition()
        self._ended = False
        self._process = subprocess.Popen(  # noqa: S603 - a program that the test names
            command,
            cwd=folder,
            env={**os.environ, "HOME": str(folder), "PYTHONUNBUFFERED": "1", "PYTHONPATH": ""},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()

    def _read(self) -> None:
        assert self._process.stdout is not None
        while data := os.read(self._process.stdout.fileno(), 4096):
            with self._changed:
                self.text += data.decode("utf-8", "replace")
                self._changed.notify_all()
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def say(self, line: str) -> None:
        """Type a line."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{line}\n".encode())
        self._process.stdin.flush()

    def until(self, text: str) -> None:
        """Wait until it has printed a text, after the last one that was waited for."""
        with self._changed:
            found = self._changed.wait_for(lambda: text in self.text[self._seen :] or self._ended, PATIENCE)
            at = self.text.find(text, self._seen)
            assert found, f"it did not say {text!r}:\n{self.text}"
            assert at >= 0, f"it ended without {text!r}:\n{self.text}"
            self._seen = at + len(text)

    def ask(self, line: str, text: str) -> None:
        """Type a line, again and again, until it prints a text: what was done before may take a moment to show."""
        with self._changed:
            for _ in range(_TRIES):
                self.say(line)
                if self._changed.wait_for(lambda: text in self.text[self._seen :] or self._ended, PATIENCE / _TRIES):
                    break
        self.until(text)

    def end(self) -> int:
        """Close its input, wait for its end, and return its exit status."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        status = self._process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        return status
