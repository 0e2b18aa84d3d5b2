"""Bouts that several processes play side by side."""

from __future__ import annotations

import signal
import threading
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from firmware_protocol.address import parse_address
from firmware_protocol.errors import HilError
from hil.cli import common
from hil.cli.running import ActiveRun
from hil.cli.stage import LiveStage
from hil.jobs.bout import counting
from hil.sumo.bouts import Tally
from hil.terminal.interrupts import interrupts
from hil.working import WorkerError, interruptible, open_crew

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console

    from hil.jobs.bout import BoutJob
    from hil.recording.recorder import Recorder
    from hil.sumo.bouts import Bout

PART: Final = 10
"""Bouts that are played on one emulated robot, whatever the number of workers."""


@dataclass(frozen=True)
class Part:
    """Bouts for one worker, on an emulated robot that nobody has used before.

    Attributes:
        job: What to play.
        url: Address of the robot.
        log: Where the log goes; None for none.
        signing_key: Key file that robot and host sign with.
        options: Configuration file that options were taken from.
    """

    job: BoutJob
    url: str
    log: Path | None
    signing_key: Path | None
    options: Path | None


@dataclass(frozen=True)
class Played:
    """What came of them.

    Attributes:
        opponent: Name of the opponent.
        bouts: The bouts; empty where it failed.
        log: The log, or what there is of it; None where there is none.
        failures: What could not be written, in words.
        error: What ended it, in words; empty where nothing did.
        status: Exit status of that.
    """

    opponent: str = ""
    bouts: tuple[Bout, ...] = ()
    log: Path | None = None
    failures: tuple[str, ...] = ()
    error: str = ""
    status: int = common.EXIT_DONE


class PartStage(LiveStage):
    """The outside of a part: while its log is begun, nothing interrupts, so that every log that is there is closed."""

    def begin_log(self) -> Recorder | None:
        """See `LiveStage.begin_log`."""
        if threading.current_thread() is not threading.main_thread():  # of a cluster's worker: no signal comes to it
            return super().begin_log()
        asked: list[int] = []
        before = signal.signal(signal.SIGTERM, lambda number, _: asked.append(number))
        try:
            return super().begin_log()
        finally:
            signal.signal(signal.SIGTERM, before)
            if asked:
                signal.raise_signal(signal.SIGTERM)


def play_part(part: Part) -> Played:
    """Play, in a worker's process. Errors come back in words: not every one of them can be pickled.

    Args:
        part: What.
    """
    run = ActiveRun(None, part.log, overwrite=True)  # in the run's own folder: left behind by a worker that has died
    console = common.plain_console(stderr=True, quiet=True)
    try:
        stage = PartStage(
            run,
            part.job,
            part.url,
            console,
            quiet=True,
            signing_key=part.signing_key,
            options=part.options,
            beside=False,  # the workers keep the cores busy, and a part takes little longer than a process to start
        )
        with interruptible(), closing(stage):
            opponent, bouts = part.job.play(stage)
    except (HilError, OSError) as error:
        return Played(log=run.log, failures=tuple(run.failures), error=common.in_words(error), status=common.status_of(error))
    return Played(opponent, tuple(bouts), run.log, tuple(run.failures))


def check_side_by_side(link: str | None, log: Path | None, *, live: bool = False) -> None:
    """See that bouts can be played side by side.

    Args:
        link: Address of the robot as given; None is an emulated robot in this process.
        log: Where a log was asked for.
        live: The run is to be shown while it goes on.

    Raises:
        AddressError: That is no address.
        UsageError: There is but one of that robot, or one log was asked for, or one page.
    """
    if link is not None and parse_address(link).scheme != "sim":
        raise common.UsageError(
            f"--workers plays on several robots at once, and there is one at {link}: leave out --workers, or the link "
            "(emulated robots in these processes are played on then)"
        )
    if log is not None:
        raise common.UsageError("--log names one log, and with --workers ten bouts each have one, in the run's folder")
    if live:
        raise common.UsageError("--live shows one robot, and with --workers there are several: leave out one of the two")


def play_side_by_side(
    job: BoutJob,
    url: str,
    workers: int,
    run: ActiveRun,
    console: Console,
    *,
    quiet: bool,
    signing_key: Path | None = None,
    options: Path | None = None,
) -> tuple[Tally, list[Path]]:
    """Play bouts in several processes, ten at a time on a new emulated robot: the same for any number of processes.

    Args:
        job: The bouts.
        url: Address of the emulated robot.
        workers: Processes.
        run: The run; ten bouts each have a log of their own in its folder, where it has one.
        console: Where the display goes.
        quiet: Nothing but results is wanted.
        signing_key: Key file that robot and host sign with.
        options: Configuration file that options were taken from.

    Returns:
        The bouts, counted, and the logs.

    Raises:
        WorkerError: Bouts could not be played, or a process has ended.
        KeyboardInterrupt: The operator asked for it.
    """
    parts = [Part(one, url, _log_of(one, job.trials, run), signing_key, options) for one in job.parts(PART)]
    run.log = None
    opponent, bouts, logs = "", [], []
    with (
        interrupts(),
        counting(console, job.trials, quiet=quiet) as count,
        open_crew(workers) as crew,
        closing(crew.in_order(play_part, parts)) as results,
    ):
        for played in results:
            run.failures.extend(played.failures)
            logs += [played.log] if played.log is not None else []
            if played.error:
                raise WorkerError(played.error, played.status)
            opponent = played.opponent
            for bout in played.bouts:
                bouts.append(bout)
                count(bout)
    return Tally.of(opponent, bouts), logs


def _log_of(part: BoutJob, trials: int, run: ActiveRun) -> Path | None:
    """The log of a part: `bouts-011-020.mcap` in the run's folder."""
    if run.run is None:
        return None
    width = len(str(trials))
    return run.run.folder / f"bouts-{part.first:0{width}}-{part.first + part.trials - 1:0{width}}.mcap"
