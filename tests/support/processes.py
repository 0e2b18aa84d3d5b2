"""Programs in processes of their own: their output line by line, every wait bounded."""

from __future__ import annotations

import os
import queue
import subprocess
import sys
import threading
from typing import TYPE_CHECKING, Final, Self

if TYPE_CHECKING:
    import signal
    from pathlib import Path
    from types import TracebackType

PATIENCE: Final = 60.0
"""Longest wait for a line or for the end, in s: a machine under load is slow, but not that slow."""


class Program:
    """A program in a process of its own, killed at the end of its `with` block.

    Args:
        folder: Its working directory.
        *command: The program and its arguments.
        stdin: Where it reads from; a pipe stays open and silent.
        own_group: In a process group of its own, as a shell starts it: so Ctrl-Z can stop it, as SIGTSTP does.

    Attributes:
        lines: What it has printed so far, errors among it.
    """

    def __init__(self, folder: Path, *command: str, own_group: bool = False, stdin: int = subprocess.DEVNULL) -> None:
        environment = {**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "200"}
        self._process = subprocess.Popen(  # noqa: S603 - our own programs
            command,
            cwd=folder,
            env=environment,
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            process_group=0 if own_group else None,
        )
        self.lines: list[str] = []
        self._arrived: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        assert self._process.stdout is not None
        self._process.stdout.close()
        if self._process.stdin is not None:
            self._process.stdin.close()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._arrived.put(line)
        self._arrived.put(None)

    @property
    def text(self) -> str:
        """What it has printed so far."""
        return "".join(self.lines)

    def until(self, text: str) -> str:
        """Wait for a line that holds a text, and return it."""
        while (line := self._arrived.get(timeout=PATIENCE)) is not None:
            self.lines.append(line)
            if text in line:
                return line
        raise AssertionError(f"it ended without {text!r}:\n{self.text}")

    def end(self) -> int:
        """Wait for its end, and return its exit status."""
        while (line := self._arrived.get(timeout=PATIENCE)) is not None:
            self.lines.append(line)
        return self._process.wait(PATIENCE)

    @property
    def is_stopped(self) -> bool:
        """It was stopped by a signal, and has not gone on."""
        options = os.WSTOPPED | os.WNOHANG | os.WNOWAIT
        return os.waitid(os.P_PID, self._process.pid, options) is not None

    def send(self, number: signal.Signals) -> None:
        """Send it a signal."""
        self._process.send_signal(number)


class Hil(Program):
    """The command `hil` in a process of its own.

    Args:
        folder: Its working directory.
        *arguments: Its command line.
        own_group: As for any program.
        stdin: Likewise.
    """

    def __init__(self, folder: Path, *arguments: str, own_group: bool = False, stdin: int = subprocess.DEVNULL) -> None:
        command = [sys.executable, "-c", "from hil.cli import main; main()", *arguments]
        super().__init__(folder, *command, own_group=own_group, stdin=stdin)
