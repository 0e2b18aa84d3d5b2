"""A shell on a terminal of its own, as a person has one."""

from __future__ import annotations

import contextlib
import os
import queue
import subprocess
import sys
import threading
import time
from typing import TYPE_CHECKING, Final, Self

from processes import PATIENCE

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType


class Shell:
    """A shell on a terminal of its own, killed at the end of its `with` block.

    Args:
        folder: Its working directory.

    Attributes:
        takes: What is printed is taken off the terminal; cleared, the terminal takes nothing more, as after Ctrl-S.
    """

    LEADER: Final = (
        "import fcntl, os, termios; os.setsid(); fcntl.ioctl(0, termios.TIOCSCTTY, 0); os.execvp('sh', ['sh', '-i'])"
    )

    def __init__(self, folder: Path) -> None:
        self._master, slave = os.openpty()
        environment = {**os.environ, "TERM": "xterm", "LINES": "40", "COLUMNS": "150", "PS1": "ready> ", "ENV": ""}
        self._process = subprocess.Popen(  # noqa: S603 - the system's shell
            [sys.executable, "-c", self.LEADER], cwd=folder, env=environment, stdin=slave, stdout=slave, stderr=slave
        )
        os.close(slave)
        self.takes = threading.Event()
        self.takes.set()
        self._came: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.takes.set()
        self._process.kill()
        self._process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        os.close(self._master)

    def _read(self) -> None:
        with contextlib.suppress(OSError):
            while data := os.read(self._master, 65536):
                self._came.put(data.decode(errors="replace"))
                self.takes.wait()

    def types(self, text: str) -> None:
        os.write(self._master, text.encode())

    def until(self, *texts: str) -> str:
        """Wait until one of the texts is on the screen; what was there before does not count the next time."""
        came, deadline = "", time.monotonic() + PATIENCE
        while not any(text in came for text in texts):
            try:
                came += self._came.get(timeout=max(0.0, deadline - time.monotonic()))
            except queue.Empty:
                raise AssertionError(f"none of {texts} came in:\n{came}") from None
        return came
