"""Where a run that can be gone on with leaves what: checkpoint and report."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Any

from hil import runs
from hil.files.outputs import free_folder, replace_file
from hil.mcaplog.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from rich.console import Console

    from hil.cli.running import ActiveRun
    from hil.cli.stage import LiveStage


class RunFiles:
    """Where a run leaves what.

    Args:
        run: The run.
        checkpoint: Checkpoint, instead of the one in the run's folder.
        console: Where to say so.
        report: A report is wanted.

    Attributes:
        checkpoint: Checkpoint.
        report: Folder of the report; None where there is none.
    """

    def __init__(self, run: ActiveRun, checkpoint: Path | None, console: Console, *, report: bool) -> None:
        self._run = run
        self.checkpoint = run.place(checkpoint, runs.CHECKPOINT)
        self._console = console
        self._unsaved: set[Path] = set()
        self.report: Path | None = None
        if report and run.log is not None:
            self.report = run.run.report if run.run is not None else free_folder(run.log.with_name(f"{run.log.stem}-report"))

    def save_checkpoint(self, data: bytes) -> None:
        """Write the checkpoint, whole or not at all; where that fails, say so once."""
        try:
            replace_file(self.checkpoint, data)
            self._unsaved.discard(self.checkpoint)
        except OSError as error:
            self._failed(self.checkpoint, f"cannot write the checkpoint {self.checkpoint}: {error.strerror}")

    def _failed(self, path: Path, text: str) -> None:
        if path not in self._unsaved:
            self._unsaved.add(path)
            self._run.failed(text)

    def tell_where(self, what: str, command: Sequence[str], key: Path | None = None) -> None:
        """Say where what was done before a run was cut is, and how to go on.

        Args:
            what: That, in words, as "what was learnt is".
            command: The command that begins such a run.
            key: Key file that it was begun with.
        """
        if not self.checkpoint.is_file() or self.checkpoint in self._unsaved:
            return
        run = self._run.run
        source = run.folder if run is not None and self.checkpoint == run.checkpoint else self.checkpoint
        words = [*command, "--resume-from", str(source)]
        if key is not None:
            words += ["--signing-key", str(key)]
        self._console.print(f"{what} in {self.checkpoint}. To go on: {shlex.join(words)}", markup=False)

    def draw(self, stage: LiveStage, document: dict[str, Any], *, announce: bool) -> None:
        """Draw the report, if there is to be one, and say where it is."""
        log = self._run.log
        if self.report is None or log is None or not log.is_file():
            return
        try:
            document["report"] = str(stage.report(log, self.report))
        except LogError as error:
            self._run.failed(str(error))
            return
        if announce:
            self._console.print(f"{'Report:':12}{document['report']}", markup=False)
