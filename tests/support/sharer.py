"""A program that drives a robot and shares its link: where others look on, and what it was asked for."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from processes import Hil

import hil
from hil.mcaplog.reading.reader import LogReader

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


class Sharer:
    """The program.

    Args:
        program: It, which has just been started.
        log: What it records.

    Attributes:
        program: It.
        url: Where others look on.
        port: TCP port of that.
    """

    def __init__(self, program: Hil, log: Path) -> None:
        self.program = program
        self._log = log
        self.url = program.until("Shared: ").split()[1]
        self.port = int(self.url.rpartition(":")[2])

    def inputs(self) -> list[tuple[str, str]]:
        """What its bridge was asked for, and of which robot, by the log."""
        steps = [entry.value for entry in LogReader(self._log).entries(["/bridge/step"])]
        return [one for step in steps for one in zip(step.inputs, step.input_robots, strict=True)]

    def check_replay(self) -> None:
        """A replay decides the same."""
        assert hil.replay(self._log).difference is None


@contextmanager
def sharing(folder: Path, *words: str) -> Iterator[Sharer]:
    """A verb that shares its link, and leaves its run in the folder."""
    with Hil(folder, *words, "--share", "tcp://127.0.0.1:0", "--out", str(folder / "run")) as program:
        yield Sharer(program, folder / "run" / "log.mcap")
