"""Where a coaching of one robot leaves what."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil import runs
from hil.cli import common
from hil.cli.run_files import RunFiles
from hil.sumo.advice_file import AdviceFileError, advice_text, save_advice

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console

    from hil.cli.running import ActiveRun
    from hil.sumo.coaching import Coaching
    from pal_advisor.maneuvers import Advice


class CoachingFiles(RunFiles):
    """Where a coaching run leaves what.

    Args:
        run: The run.
        advice: Advice file, instead of the one in the run's folder.
        checkpoint: Checkpoint, likewise.
        console: Where to say so.
        report: A report is wanted.

    Attributes:
        advice: Advice file.
        unsaved: No file holds the advice.
    """

    def __init__(self, run: ActiveRun, advice: Path | None, checkpoint: Path | None, console: Console, *, report: bool) -> None:
        super().__init__(run, checkpoint, console, report=report)
        self.advice = run.place(advice, runs.ADVICE)
        self.unsaved = False
        self._kept = False

    def keep_advice(self, advice: Advice) -> None:
        """Write the best advice so far; where that fails, say so once."""
        try:
            save_advice(advice, self.advice, overwrite=self._run.overwrite or self._kept)
            self._kept = True
        except AdviceFileError as error:
            self._failed(self.advice, str(error))

    def save_advice(self, advice: Advice) -> None:
        """Write the advice; where that fails, say what it is."""
        try:
            save_advice(advice, self.advice, overwrite=self._run.overwrite or self._kept)
        except AdviceFileError as error:
            self._run.failed(str(error))
            common.complain("what was learnt, for no file to hold:")
            common.complain(advice_text(advice), program=False)
            self.unsaved = True

    def tell_how_to_resume(self, coaching: Coaching, words: list[str], signing_key: Path | None) -> None:
        """Say where the work is, and how to go on, by these words; where no file holds it, say what it is."""
        if not self.checkpoint.is_file() or coaching.unsaved:
            if coaching.pal.used:
                common.complain("no file holds what was learnt so far. It is:")
                common.complain(advice_text(coaching.advice()), program=False)
            return
        if self._kept:
            self._console.print(f"The best advice so far: {self.advice}", markup=False)
        self.tell_where("What was learnt so far is", ["hil", "coach", *words], signing_key)
