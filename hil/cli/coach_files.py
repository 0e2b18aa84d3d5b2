"""Where a coaching leaves what, of one robot or of several."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from hil import runs
from hil.cli import common
from hil.cli.coach_from import beside
from hil.cli.coach_worker import SentRun
from hil.cli.run_files import RunFiles
from hil.files.outputs import replace_file
from hil.sumo.advice_file import AdviceFileError, advice_text, save_advice

if TYPE_CHECKING:
    from rich.console import Console

    from hil.cli.running import ActiveRun
    from hil.sumo.coaching import Coaching
    from hil.sumo.team import CoachedRun
    from pal_advisor.maneuvers import Advice


class AdviceFiles(RunFiles):
    """Where a run that makes an advice leaves what.

    Args:
        run: The run.
        advice: Advice file, instead of the one in the run's folder.
        checkpoint: Checkpoint, likewise.
        console: Where to say so.
        report: A report is wanted.

    Attributes:
        advice: Advice file.
        learnt: Beside it, what was learnt where the advice stays that was begun from.
        unsaved: No file holds the advice.
    """

    def __init__(self, run: ActiveRun, advice: Path | None, checkpoint: Path | None, console: Console, *, report: bool) -> None:
        super().__init__(run, checkpoint, console, report=report)
        self.advice = run.place(advice, runs.ADVICE)
        self.learnt = beside(self.advice)
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
        self.unsaved = not self._saved(advice, self.advice, overwrite=self._run.overwrite or self._kept)

    def save_learnt(self, advice: Advice) -> None:
        """Write what was learnt beside the advice that stays; where that fails, say what it is."""
        self._saved(advice, self.learnt, overwrite=self._run.overwrite)

    def _saved(self, advice: Advice, path: Path, *, overwrite: bool) -> bool:
        """Write an advice; where that fails, say what it is, and False."""
        try:
            save_advice(advice, path, overwrite=overwrite)
        except AdviceFileError as error:
            self._run.failed(str(error))
            common.complain("what was learnt, for no file to hold:")
            common.complain(advice_text(advice), program=False)
            return False
        return True

    def _made(self) -> dict[str, object]:
        """The run's folder and its files of advice, by name."""
        return {
            "run": self._run.folder,
            "advice": None if self.unsaved else str(self.advice),
            "learnt": str(self.learnt) if self.learnt.is_file() else None,
        }


class CoachingFiles(AdviceFiles):
    """Where a coaching run leaves what."""

    def document(self, coaching: Coaching) -> dict[str, object]:
        """The files, by name.

        Args:
            coaching: The run, which is over.
        """
        checkpoint = None if coaching.unsaved else str(self.checkpoint)
        return {**self._made(), "checkpoint": checkpoint, "log": self._run.log_file, "report": None}

    def tell_how_to_resume(self, coaching: Coaching, words: list[str], signing_key: Path | None) -> None:
        """Say where the work is, and how to go on, by these words; where no file holds it, say what it is."""
        if coaching.standing is not None and not self._kept:
            self.keep_advice(coaching.best())
        if not self.checkpoint.is_file() or coaching.unsaved:
            if coaching.pal.used:
                common.complain("no file holds what was learnt so far. It is:")
                common.complain(advice_text(coaching.advice()), program=False)
            return
        if self._kept:
            self._console.print(f"The best advice so far: {self.advice}", markup=False)
        self.tell_where("What was learnt so far is", ["hil", "coach", *words], signing_key)


class TeamFiles(AdviceFiles):
    """Where several runs, of which one advice is made, leave what.

    Args:
        run: The run.
        advice: Advice file, instead of the one in the run's folder.
        console: Where to say so.
        report: A report is wanted.
    """

    def __init__(self, run: ActiveRun, advice: Path | None, console: Console, *, report: bool) -> None:
        super().__init__(run, advice, None if run.run is not None else Path(runs.TEAM), console, report=report)

    def document(self, number: int) -> dict[str, object]:
        """The files, by name.

        Args:
            number: How many runs there were.
        """
        return {
            **self._made(),
            "log": self._run.log_file,
            "logs": [str(log) for log in map(self.log_of, range(1, number + 1)) if log is not None],
            "report": None,
        }

    def log_of(self, number: int) -> Path | None:
        """The log of a run; None where there is none.

        Args:
            number: Its number, from 1.
        """
        log = None if self._run.run is None else self._run.run.folder / f"run-{number}.mcap"
        return log if log is not None and log.is_file() else None

    def take(self, run: CoachedRun) -> CoachedRun:
        """Keep the files that a worker has sent back.

        Args:
            run: What came of a coaching.

        Returns:
            The same without files.
        """
        if not isinstance(run, SentRun):
            return run
        assert self._run.run is not None, "a run that has files sent has a folder for them"
        for name, data in run.files.items():
            path = self._run.run.folder / Path(name).name
            try:
                replace_file(path, data)
            except OSError as error:
                self._failed(path, f"cannot write {path}: {error.strerror}")
        return run.alone

    def tell_how_to_go_on(self, given: Advice | None, scheduler: str | None) -> None:
        """Say where what was learnt so far is, and how to go on.

        Args:
            given: The advice that was begun from, which is the best so far unless one was written already; None: there is none.
            scheduler: Address of the Dask scheduler whose workers coached; None: workers of our own.
        """
        if given is not None and not self.advice.exists():
            self.save_advice(given)
            self._console.print(f"The best advice so far: {self.advice}", markup=False)
        if self._run.run is not None:
            folder = self._run.run.folder
            where = [] if scheduler is None else ["--scheduler", scheduler]
            again = shlex.join(["hil", "coach", *where, "--resume-from", str(folder)])
            self._console.print(f"What was learnt so far is in {folder}. To go on: {again}", markup=False)
