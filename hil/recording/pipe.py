"""The recorder's process as the control process has it: started, written to, listened to.

It runs our own module with this process's interpreter and search path; nothing is forked, and no script of a user's runs
again. It has a session of its own (a process group on Windows), so that Ctrl-C, Ctrl-Z and a terminal that is closed leave it
alone: it ends when what it reads ends.
"""

from __future__ import annotations

import contextlib
import re
import subprocess
import sys
from io import BufferedWriter
from pathlib import Path
from queue import SimpleQueue
from struct import Struct
from threading import Thread
from typing import IO, TYPE_CHECKING, Any, Final, cast

from hil.recording.handover import pack, unpack

if sys.platform == "win32":
    fcntl = None
else:
    import fcntl

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from io import RawIOBase

FRAME: Final = Struct("<I")
"""What stands before each batch and answer: its length."""
FOXGLOVE: Final = "foxglove"
"""What a run is shown by that is somebody else's."""
_ROOM: Final = 1 << 20
"""A batch is sent in halves if it has more bytes than this."""
_START: Final = "import gc, sys; gc.disable(); sys.path[:] = sys.argv[1:]; from hil.recording.helper import main; main()"
_FLAGS: Final = ("-I", "-S", "-B") if sys.dont_write_bytecode else ("-I", "-S")
"""Nothing of the environment, and no start-up of `site`'s: modules are found where this process finds them, and sooner."""
_ROOT: Final = Path(__file__).parents[2]
_PIPE_SIZE: Final = 8192
"""Bytes that a pipe holds at first, where that can be chosen: little of a lock-step run is under way when one is killed."""
_MOST_PIPE: Final = 1 << 20
"""Bytes that it holds at most: a batch, so that the next one is made while this one is taken."""
_PYTHON: Final = re.compile(r"python|pypy", re.IGNORECASE)

Answer = tuple[Any, ...]
"""What the recorder's process says: a word, and what belongs to it."""


def can_start() -> bool:
    """Whether this is a Python that can be started once more: not one built into another program."""
    return bool(sys.executable) and not getattr(sys, "frozen", False) and _PYTHON.search(Path(sys.executable).name) is not None


def read_frame(file: IO[bytes]) -> Any | None:  # noqa: ANN401 - what was written
    """One batch or answer.

    Args:
        file: The end of a pipe.

    Returns:
        It; None where the pipe ends, be it in the middle.
    """
    head = file.read(FRAME.size)
    if len(head) < FRAME.size:
        return None
    (size,) = FRAME.unpack(head)
    data = file.read(size)
    return unpack(data) if len(data) == size else None


def frame(content: Any) -> bytes:  # noqa: ANN401 - plain values
    """What `read_frame` reads.

    Args:
        content: Plain values.
    """
    data = pack(content)
    return FRAME.pack(len(data)) + data


class HelperPipe:
    """A helper process, and the pipes to and from it.

    Args:
        settings: What it begins with.
        lockstep: Time stands still while it is waited for.
        asked: Is told, by a thread, what somebody who looks on asks for, and of which robot (empty: of all).

    Raises:
        OSError: It can't be started.
    """

    def __init__(
        self, settings: Mapping[str, object], *, lockstep: bool, asked: Callable[[str, str], None] = lambda *_: None
    ) -> None:
        self._asked = asked
        flags = getattr(subprocess, "CREATE_NO_WINDOW", 0) | getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
        self._process = subprocess.Popen(  # noqa: S603 - ourselves
            [sys.executable, *_FLAGS, "-c", _START, str(_ROOT), *(one for one in sys.path if isinstance(one, str))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            start_new_session=True,
            creationflags=flags,
        )
        stdin = cast("RawIOBase", self._process.stdin)
        self._pipe_size = _MOST_PIPE
        if lockstep:
            self._set_pipe_size(stdin.fileno(), _PIPE_SIZE)
        # Its flush goes on where an interrupt has cut it off, since it counts what was written in C.
        self._file = BufferedWriter(stdin, _ROOM + FRAME.size)
        self._answers: SimpleQueue[Answer | None] = SimpleQueue()
        self.news: Answer | None = None
        """`failed` with what belongs to it, or `died` with the exit status, once that is so."""
        self.refusal: Answer | None = None
        """Why the log was not opened: name of the error, and its text."""
        self._write(frame(settings))
        self._listener = Thread(target=self._listen, name="recorder's answers", daemon=True)
        self._listener.start()

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def send(self, number: int, packed: Sequence[bytes], first: int = 0) -> None:
        """Hand over a batch; blocks while the pipe is full. One that nobody takes any more is dropped.

        Args:
            number: Of the batch; one that is sent again, with more in it, has the number that it had.
            packed: What is in it.
            first: Number of the first of these in the batch.
        """
        if len(packed) > 1 and sum(map(len, packed)) > _ROOM // 2:
            half = len(packed) // 2
            self.send(number, packed[:half], first)
            self.send(number, packed[half:], first + half)
        else:
            data = frame((number, first, packed))
            if self._pipe_size < len(data) and self._pipe_size < _MOST_PIPE:
                with contextlib.suppress(ValueError):  # it has been closed
                    self._set_pipe_size(self._file.fileno(), min(_MOST_PIPE, 1 << (len(data) - 1).bit_length()))
            self._write(data)

    def _set_pipe_size(self, pipe: int, size: int) -> None:
        self._pipe_size = size
        if fcntl is not None and hasattr(fcntl, "F_SETPIPE_SZ"):
            with contextlib.suppress(OSError):  # one that a user has no more room for stays as it is
                fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, size)

    def wait_for(self, word: str) -> Answer | None:
        """Wait for an answer.

        Args:
            word: Which.

        Returns:
            It; None where the process ended without one.
        """
        while (answer := self._answers.get()) is not None:
            if answer[0] == word:
                return answer
        self._answers.put(None)
        return None

    def end(self) -> None:
        """Say no more, and wait until the process has ended. Repeating it does nothing."""
        with contextlib.suppress(OSError):
            self._file.close()
        self._listener.join()
        self._process.wait()

    def kill(self) -> None:
        """See that the process ends now; one that has ended is left in peace."""
        with contextlib.suppress(OSError):
            self._process.kill()
        self.end()

    def _write(self, data: bytes) -> None:
        with contextlib.suppress(OSError, ValueError):  # the listener tells of it
            self._file.flush()
            self._file.write(data)
            self._file.flush()

    def _listen(self) -> None:
        closed = False
        with cast("IO[bytes]", self._process.stdout) as stdout:
            while (answer := read_frame(stdout)) is not None:
                if answer[0] == "asked":
                    self._asked(*answer[1:])
                    continue
                if answer[0] == "failed":
                    self.news = answer
                elif answer[0] == "refused":
                    self.refusal = answer[1:]
                closed = closed or answer[0] == "closed"
                self._answers.put(answer)
        if not closed:
            self.news = self.news or ("died", self._process.wait())
        self._answers.put(None)
