"""Runs `hil` where every clock, source of chance, file, socket, process and signal that our own code asks for is noted down.

    python guarded.py NOTES.json ARGUMENTS...

`NOTES.json` then has the exit status, and of each thing that was asked for what it was and which of our modules asked.

A module asks for something where its frame is the nearest of ours above the call: so what the standard library or another
package does on a module's behalf is that module's. `hil.bridge.clock` asks on its caller's behalf. What the display
on the terminal asks for (its refresh rate), what importing a module opens, and what the interpreter and pytest do, is nobody's.
"""

from __future__ import annotations

import datetime as dt
import functools
import json
import os
import random
import secrets
import signal
import sys
import time
import uuid
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType, ModuleType

OURS: Final = frozenset({"firmware_protocol", "hil", "pal_advisor", "simdevice"})
"""Our packages."""
THROUGH: Final = frozenset({"hil.bridge.clock"})
"""Modules that ask on their callers' behalf."""
DISPLAYS: Final = frozenset({"rich", "typer", "click"})
"""Packages that draw on the terminal, and decide nothing."""
CLOCK: Final = "clock"
CHANCE: Final = "chance"
FILE: Final = "file"
SOCKET: Final = "socket"
PROCESS: Final = "process"
SIGNAL: Final = "signal"
_EVENTS: Final = {
    "open": FILE, "os.listdir": FILE, "os.scandir": FILE, "os.mkdir": FILE, "os.rename": FILE, "os.remove": FILE,
    "os.truncate": FILE, "os.link": FILE, "os.symlink": FILE, "os.chmod": FILE, "shutil.copyfile": FILE, "shutil.move": FILE,
    "socket.__new__": SOCKET, "socket.connect": SOCKET, "socket.bind": SOCKET, "socket.getaddrinfo": SOCKET,
    "subprocess.Popen": PROCESS, "os.system": PROCESS, "os.fork": PROCESS, "os.posix_spawn": PROCESS, "os.exec": PROCESS,
    "os.kill": SIGNAL,
}  # fmt: skip
"""Audit events (PEP 578), and what they are."""


class Asked(NamedTuple):
    """Something that one of our modules asked for.

    Attributes:
        kind: `clock`, `chance`, `file`, `socket`, `process` or `signal`.
        what: The function, or the event with its subject.
        module: Who asked.
    """

    kind: str
    what: str
    module: str


NOTES: Final[dict[Asked, None]] = {}
"""What was asked for, each once, in order."""


def asker(frame: FrameType | None) -> str:
    """Our module on whose behalf something is asked for; empty where it is none of ours.

    Args:
        frame: Where it is asked for.
    """
    while frame is not None:
        name = str(frame.f_globals.get("__name__", ""))
        package = name.partition(".")[0]
        if package in DISPLAYS or name.startswith("importlib._bootstrap"):
            return ""
        if package in OURS and name not in THROUGH:
            return name
        frame = frame.f_back
    return ""


def note(kind: str, what: str, frame: FrameType | None) -> None:
    """Note down what one of our modules asks for.

    Args:
        kind: As in `Asked`.
        what: Likewise.
        frame: Where it is asked for.
    """
    module = asker(frame)
    if module:
        NOTES[Asked(kind, what, module)] = None


def _watched(kind: str, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(function)
    def watched(*args: Any, **keywords: Any) -> Any:  # noqa: ANN401 - whatever that function takes and gives
        note(kind, name, sys._getframe(1))
        return function(*args, **keywords)

    return watched


def _watch(kind: str, module: ModuleType, *names: str) -> None:
    for name in names:
        if hasattr(module, name):
            setattr(module, name, _watched(kind, f"{module.__name__}.{name}", getattr(module, name)))


def _watch_chance() -> None:
    """Chance that no seed decides: what draws from a generator that was given a seed is not noted."""
    import numpy as np  # noqa: PLC0415 - it takes a moment

    _watch(CHANCE, os, "urandom", "getrandom")
    _watch(CHANCE, secrets, "randbelow", "token_bytes", "token_hex", "token_urlsafe", "choice", "randbits")
    _watch(CHANCE, uuid, "uuid1", "uuid4")
    _watch(CHANCE, random, *(name for name in dir(random) if name[0].islower()))
    legacy = [name for name in dir(np.random) if name[0].islower() and callable(getattr(np.random, name))]
    _watch(CHANCE, np.random, *(name for name in legacy if name not in {"default_rng", "test"}))

    def unseeded(args: tuple[Any, ...], keywords: dict[str, Any]) -> bool:
        return all(value is None for value in (*args, *keywords.values()))

    make, sequence = np.random.default_rng, np.random.SeedSequence

    def default_rng(*args: Any, **keywords: Any) -> Any:  # noqa: ANN401 - as numpy's
        if unseeded(args, keywords):
            note(CHANCE, "numpy.random.default_rng()", sys._getframe(1))
        return make(*args, **keywords)

    class SeedSequence(sequence):  # type: ignore[misc, valid-type]
        def __init__(self, *args: Any, **keywords: Any) -> None:  # noqa: ANN401 - likewise
            if unseeded(args, keywords):
                note(CHANCE, "numpy.random.SeedSequence()", sys._getframe(1))
            super().__init__(*args, **keywords)

    class Random(random.Random):
        def __init__(self, *args: Any) -> None:  # noqa: ANN401 - as that of random
            if unseeded(args, {}):
                note(CHANCE, "random.Random()", sys._getframe(1))
            super().__init__(*args)

    np.random.default_rng = default_rng
    np.random.SeedSequence = SeedSequence  # type: ignore[misc]
    random.Random = Random  # type: ignore[misc, assignment]


def _watch_calendar() -> None:
    class Date(dt.datetime):
        @classmethod
        def now(cls, tz: dt.tzinfo | None = None) -> Date:
            note(CLOCK, "datetime.now", sys._getframe(1))
            return super().now(tz)

        @classmethod
        def utcnow(cls) -> Date:
            note(CLOCK, "datetime.utcnow", sys._getframe(1))
            return cls.now(dt.UTC).replace(tzinfo=None)

    dt.datetime = Date  # type: ignore[misc]


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    kind = _EVENTS.get(event)
    if kind is not None:
        subject = arguments[0] if arguments and isinstance(arguments[0], str | bytes | os.PathLike) else ""
        note(kind, f"{event} {os.fsdecode(subject)}".strip(), sys._getframe(1))


def install() -> None:
    """Watch, from now on, for as long as the process lives; before any of our packages is loaded."""
    assert not any(name.partition(".")[0] in OURS for name in sys.modules), "they have bound what they call already"
    names = [name for name in dir(time) if name[0].islower() and callable(getattr(time, name)) and name != "struct_time"]
    _watch(CLOCK, time, *names)
    _watch_calendar()
    _watch_chance()
    _watch(SIGNAL, signal, "signal", "setitimer", "alarm", "set_wakeup_fd")
    sys.addaudithook(_audit)


def main() -> None:
    """See the module."""
    notes, arguments = Path(sys.argv[1]), sys.argv[2:]
    install()
    from hil.cli.app import run  # noqa: PLC0415 - under watch from its first line

    status = run(arguments)
    notes.write_text(json.dumps({"status": status, "asked": list(NOTES)}), encoding="utf-8")
    sys.exit(status)


if __name__ == "__main__":
    main()
