"""The recorded job is performed again, on the recorded input, and what it decides is compared."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.address import parse_address
from firmware_protocol.errors import HilError
from firmware_protocol.faults.spec import FaultSpec
from hil.connecting.network_address import networks_of
from hil.jobs.bout import BoutJob
from hil.jobs.check import CheckJob
from hil.jobs.coach import CoachJob
from hil.jobs.deploy import DeployJob
from hil.jobs.duel import DuelJob
from hil.jobs.monitor import MonitorJob
from hil.jobs.param import ParamJob
from hil.jobs.swarm.evolve import EvolveJob
from hil.jobs.swarm.surround import SurroundJob
from hil.jobs.team import TeamJob
from hil.jobs.watch import WatchJob
from hil.mcaplog.attachments import BEGUN_WITH
from hil.mcaplog.limits import ReadLimits
from hil.replaying.again import why_not_again
from hil.replaying.comparison import Comparison
from hil.replaying.difference import Difference, ReplayDiverged
from hil.replaying.stage import ReplayStage
from hil.replaying.tape import ReplayEndedError, ReplayError, Tape
from hil.runs import LOG, file_of
from hil.versions import versions
from pal_advisor.fields import Fields

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.wire.signing import SigningKey
    from hil.jobs.stage import Job

JOBS: Final[dict[str, type[Job]]] = {
    job.VERB: job
    for job in (
        BoutJob,
        CheckJob,
        CoachJob,
        DeployJob,
        DuelJob,
        EvolveJob,
        MonitorJob,
        ParamJob,
        SurroundJob,
        TeamJob,
        WatchJob,
    )
}
"""Verbs whose logs can be replayed."""
UNLINKED: Final = frozenset((EvolveJob.VERB,))
"""Those that have no link of their own: others do the work, and the log tells what came of it."""
LINKED_LATE: Final = frozenset((TeamJob.VERB,))
"""Those that open their link when others have done their work, or not at all."""


@dataclass(frozen=True)
class ReplayReport:
    """What came of a replay.

    Attributes:
        path: The log.
        verb: The verb that was run.
        strict: Every entry was compared; else what was decided.
        steps: Steps of bridges that were replayed.
        compared: Entries found to be the same.
        duration: Log time that was replayed, in s.
        difference: The first difference; None where there was none.
        ended: How the run ended, in words, where by an error or an interrupt; as it did when it was recorded.
        cut_off: The log was cut off, and was replayed to its end.
        versions: What has another version now: recorded, and now.
        recovered: What was wrong with the log that this one was made from, in words; empty where it is as it was written.
        again: The run itself can be done again, and a new log of it compared (`hil replay --rerecord`).
    """

    path: Path
    verb: str
    strict: bool
    steps: int
    compared: int
    duration: float
    difference: Difference | None
    ended: str
    cut_off: bool
    versions: dict[str, tuple[str, str]]
    recovered: str = ""
    again: bool = False

    @property
    def same(self) -> bool:
        """Nothing differs."""
        return self.difference is None

    def __str__(self) -> str:
        what = f"{self.compared} {'entries' if self.strict else 'decisions and steps'}"
        done = f"hil {self.verb}, {self.steps} steps, {self.duration:.1f} s"
        others = [f"{name} was {then}, and is {now} now" for name, (then, now) in self.versions.items()]
        if self.recovered:
            others.append(f"The log was recovered from one that was {self.recovered}")
        if self.difference is not None:
            head = f"{self.path}: NOT THE SAME: {self.difference.head}"
            what_next = ["What to do: docs/replay.md, When it is not the same"]
            if self.again:
                what_next.append(f"If the change was meant, all that it changes: hil replay {self.path} --rerecord new.mcap")
            return "\n".join([head, f"{done}: {what} before were the same", *others, self.difference.body, *what_next])
        lines = [f"{self.path}: the same. {done}: {what} compared"]
        if self.cut_off:
            lines.append("The log was cut off; it was replayed to its end.")
        if self.ended:
            lines.append(f"The run ended as it did when it was recorded: {self.ended}")
        return "\n".join([*lines, *others])

    def to_dict(self) -> dict[str, object]:
        """As plain values."""
        return {
            "log": str(self.path),
            "verb": self.verb,
            "same": self.same,
            "strict": self.strict,
            "steps": self.steps,
            "compared": self.compared,
            "duration_s": self.duration,
            "ended": self.ended,
            "cut_off": self.cut_off,
            "recovered": self.recovered,
            "versions": {name: {"recorded": then, "now": now} for name, (then, now) in self.versions.items()},
            "difference": None if self.difference is None else self.difference.to_dict(),
        }


def replay(
    log: Path | str,
    *,
    strict: bool = False,
    signing_key: SigningKey | None = None,
    limits: ReadLimits = ReadLimits(),  # noqa: B008 - frozen
    progress: Callable[[float], object] | None = None,
) -> ReplayReport:
    """Perform a recorded run again on what was recorded, and compare what it decides with what was decided then.

    Nothing that the log names is opened, and nothing is written.

    Args:
        log: The log, or the folder of a run.
        strict: Compare every entry; else decisions: what is written, what the learner does, events, the result.
        signing_key: The key of a run whose frames were signed.
        limits: What the log may unpack to.
        progress: Is told what share of the log has been read, 0..1, now and then.

    Returns:
        What came of it.

    Raises:
        LogError: The log can't be read.
        RunError: The folder has none.
        ReplayError: It can't be replayed; the text says why.
    """
    tape = Tape(file_of(Path(log), LOG), limits, compared=True)
    job, url, faults = recorded_job(tape)
    signed = tape.config.get("signed") == "true"
    if signed and signing_key is None:
        raise ReplayError(f"{log} is of a run whose frames were signed: its replay needs the key (--signing-key FILE)")
    wire = _wire_of(tape, url) if _is_linked(job, tape, url) else ""
    comparison = Comparison(tape, wire, strict=strict)
    stage = ReplayStage(url, tape, comparison, key=signing_key if signed else None, faults=faults)
    tape.on_read = progress
    ended = _perform(job, stage, comparison, tape)
    return ReplayReport(
        path=tape.path,
        verb=job.VERB,
        strict=strict,
        steps=comparison.steps,
        compared=comparison.compared,
        duration=_replayed(tape, comparison.difference),
        difference=comparison.difference,
        ended=ended,
        cut_off=tape.ended and tape.cut_off,
        versions=_other_versions(tape),
        recovered=tape.recovered,
        again=bool(url) and not (tape.recovered or why_not_again(tape, url)),
    )


def _is_linked(job: Job, tape: Tape, url: str) -> bool:
    """The run has come to its link."""
    return bool(url) and (job.VERB not in LINKED_LATE or tape.has_step())


def _wire_of(tape: Tape, url: str) -> str:
    """What the link of the robot carries.

    Raises:
        ReplayError: The log has no step of it.
    """
    tape.first_step()
    try:
        return tape.opening(url).wire
    except ReplayEndedError as error:
        raise ReplayError(f"{tape.path} is said to be of {url[:200]}, and has no such network") from error


def _replayed(tape: Tape, difference: Difference | None) -> float:
    """How much log time was replayed, in s: the log may have been read further than to the difference."""
    if tape.span is None:
        return 0.0
    first, last = tape.span
    return max(0.0, (last if difference is None else difference.time) - first)


def _perform(job: Job, stage: ReplayStage, comparison: Comparison, tape: Tape) -> str:
    """Perform the job; how it ended, where it did not come to its own end."""
    ended = ""
    try:
        try:
            job.perform(stage)
        except (ReplayDiverged, ReplayEndedError):
            raise
        except KeyboardInterrupt:
            if not tape.interrupted:
                raise
            ended = "interrupted"
        except (HilError, OSError) as error:
            ended = str(error)
        comparison.end()
    except ReplayEndedError as error:
        if not tape.cut_off:
            comparison.run_on(str(error))
    except ReplayDiverged as error:
        comparison.difference = error.difference
    if comparison.difference is not None:
        tape.read_rest()
        if tape.gaps:
            raise ReplayError(f"{tape.path} is not complete, and can't be replayed: {tape.gaps}")
    return "" if comparison.difference is not None else ended


def why_not(log: Path, limits: ReadLimits = ReadLimits()) -> str:  # noqa: B008 - frozen
    """Why a log can't be replayed, in words; empty where it can.

    Args:
        log: The log.
        limits: What it may unpack to.

    Raises:
        LogError: It can't be read.
    """
    try:
        tape = Tape(log, limits, compared=False)
        job, url, _ = recorded_job(tape)
        if _is_linked(job, tape, url):
            tape.first_step()
    except ReplayError as error:
        return str(error).removeprefix(f"{log}: ").removeprefix(f"{log} ")
    return ""


def recorded_job(tape: Tape) -> tuple[Job, str, FaultSpec | None]:
    """What was asked of the recorded run.

    Args:
        tape: Its log.

    Returns:
        The job, the address of the robot (of a swarm on several networks, of the first), and what went wrong with the line.

    Raises:
        ReplayError: The log does not say so, or it is no verb that can be replayed.
    """
    config = tape.config
    verb, link = config.get("verb", ""), config.get("link", "")
    if not config and tape.reader.truncated:
        raise ReplayError(f"{tape.path} does not say what was asked for: it is {tape.reader.health(1)}")
    if "options" not in config:
        raise ReplayError(
            f"{tape.path} does not say what was asked for: it was recorded by an older version, by a program of your own "
            "(which can open replay://LOG itself), or by another program"
        )
    if verb not in JOBS:
        raise ReplayError(f"{tape.path} is of {verb[:40]!r}: only {', '.join(sorted(JOBS))} can be replayed")
    files = {name.removeprefix(BEGUN_WITH): data for name, data in tape.files.items() if name.startswith(BEGUN_WITH)}
    try:
        options = Fields(json.loads(config["options"]))
        job = JOBS[verb].of_log(options, files)
        options.done()
        url = networks_of(parse_address(link))[0].url if link or job.VERB not in UNLINKED else ""
        faults = FaultSpec.parse(config["faults"]) if "faults" in config else None
    except (HilError, ValueError, RecursionError) as error:
        text = str(error)[:300]
        raise ReplayError(f"{tape.path} does not say properly what was asked for: {text}") from error
    return job, url, faults


def _other_versions(tape: Tape) -> dict[str, tuple[str, str]]:
    """What has another version now than when the log was recorded."""
    try:
        then: Any = json.loads(tape.config.get("versions", "{}"))
    except ValueError:
        return {}
    if not isinstance(then, dict):
        return {}
    now = versions()
    return {name: (str(then[name])[:40], now[name]) for name in now if name in then and str(then[name]) != now[name]}
