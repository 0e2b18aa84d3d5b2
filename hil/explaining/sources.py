"""What an advice can be explained from: its run's checkpoint and log, the log alone, or no more than its own file."""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import HilError
from hil import runs
from hil.explaining.explanation import explain
from hil.explaining.history import TOPICS, LearningHistory
from hil.explaining.team import TOPICS as TEAM_TOPICS
from hil.explaining.team import TeamHistory, TeamMember
from hil.mcaplog.attachments import ENDED_WITH
from hil.mcaplog.errors import LogError
from hil.mcaplog.reading.reader import LogReader
from hil.sumo.advice_file import AdviceFileError, advice_of, load_advice
from hil.sumo.challenging import challenge_in_words
from hil.sumo.coaching import CheckpointError, checkpoint_of, load_checkpoint

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from hil.explaining.explanation import Explanation
    from hil.mcaplog.attachments import LogAttachment
    from hil.runs import Run
    from hil.sumo.challenging import ChallengeStanding
    from hil.sumo.coaching import Checkpoint
    from pal_advisor.maneuvers import Advice, AdviceEntry, Pal

MCAP: Final = ".mcap"
_MEMBER: Final = re.compile(r"run-([1-9]\d{0,3})\.(?:json|mcap)")
"""A run's checkpoint or log there."""


STAYED: Final = (
    "This advice is the one that the run began from: why its maneuvers are there, the run that made it can tell. When a run is "
    "over, what was learnt and did not take its place stands beside it, in learnt-advice.toml, which hil explain takes too."
)


class ExplainError(HilError):
    """There is nothing to be explained; the text says what to name instead."""


@dataclass
class Learning:
    """An advice, and what is there to explain it.

    Attributes:
        advice: The advice.
        source: File or folder that it was taken from.
        run: Folder of the run that made it; None where that is not known.
        log: The log that was read; None where there is none.
        pal: The learner as it was at the end; None where that is not known.
        history: What the log tells; None where there is none.
        team: The runs that the advice was put together from; None where it is of one.
        challenge: What came of the challenge of the advice that the run began from, in words; empty where there was none.
        unknown: What can't be told, and what to do about it, a sentence an item.
    """

    advice: Advice
    source: Path
    run: Path | None = None
    log: Path | None = None
    pal: Pal | None = None
    history: LearningHistory | None = None
    team: TeamHistory | None = None
    challenge: str = ""
    unknown: list[str] = field(default_factory=list)

    def explained(self, entries: Iterable[AdviceEntry]) -> list[Explanation]:
        """Say why maneuvers of the advice are there.

        Args:
            entries: Those entries of it that are to be explained.
        """
        return explain(entries, self.pal, self.history) if self.team is None else self.team.explain(entries)


def learning_of(given: Path | None) -> Learning:
    """An advice that a person names, with all that explains it.

    Args:
        given: A run's folder; an advice file; a log; None for the newest run that made an advice.

    Raises:
        RunError: There is no such run, or no advice in it.
        AdviceFileError: The file can't be read, or is no advice.
        LogError: The log can't be read.
        ExplainError: The log has no advice.
    """
    if given is not None and given.suffix == MCAP:
        return _of_log(given)
    if given is not None and given.is_dir() and not (given / runs.ADVICE).exists() and (given / runs.CHECKPOINT).exists():
        saved = load_checkpoint(given / runs.CHECKPOINT)
        advice = saved.pal.advice(opponent=saved.opponent, seed=saved.seed)
        if not advice.entries:
            raise ExplainError(
                f"the run {given} was cut before anything was learnt; go on with it: hil coach --resume-from {given}"
            )
        learning = Learning(advice, given / runs.CHECKPOINT, given, pal=saved.pal)
        learning.unknown.append(f"The run was cut: this is what it had learnt. To go on: hil coach --resume-from {given}.")
        _challenged(learning, saved.standing)
        _read_log(learning, given / runs.LOG)
        return learning
    found = runs.file_of(given, runs.ADVICE, verbs=("coach",))
    learning = Learning(load_advice(found), found)
    run = _run_of(found)
    if run is None:
        learning.unknown.append(
            f"The run that made {found} is not known, so that no more can be told than the file says. "
            "For all of it name the run's folder, or the run's log (hil runs lists the runs)."
        )
        return learning
    learning.run = run.folder
    if run.team is not None:
        _read_team(learning, run)
    else:
        _read_run(learning, run)
    return learning


def _run_of(advice: Path) -> Run | None:
    """The run that made an advice file: the one in whose folder it is, or that was told to leave it there."""
    with contextlib.suppress(runs.RunError):
        return runs.load_run(advice.parent)
    for run in runs.all_runs():
        named = run.record.settings.get("advice_out")
        if isinstance(named, str) and named and Path(named).absolute() == advice.absolute():
            return run
    return None


def _read_team(learning: Learning, run: Run) -> None:
    """Take the runs that an advice was put together from, and how that was done, as far as they can be read."""
    team = TeamHistory()
    if run.log.is_file():
        try:
            team, learning.log = _team_of(run.log), run.log
        except LogError as error:
            learning.unknown.append(f"The log of the team exam can't be read: {error}.")
    else:
        learning.unknown.append(f"There is no log {run.log}, so that it is not known how the team exam went.")
    learning.challenge = team.challenge
    with contextlib.suppress(AdviceFileError):
        if load_advice(run.folder / runs.GIVEN) == learning.advice:
            learning.unknown.append(STAYED)
            return
    learning.team = team
    made = {_MEMBER.fullmatch(path.name) for path in run.folder.glob("run-*")}
    for number in sorted({int(name[1]) for name in made if name is not None} | set(team.members)):
        checkpoint, log = run.folder / f"run-{number}.json", run.folder / f"run-{number}.mcap"
        history, pal = None, None
        if log.is_file():
            with contextlib.suppress(LogError):
                history, attachments = _history_of(log)
                pal = pal_of(attachments)
        with contextlib.suppress(CheckpointError):
            pal = load_checkpoint(checkpoint).pal
        if pal is None:
            learning.unknown.append(f"Neither {checkpoint} nor {log} tells how run {number} has learnt.")
        else:
            team.members[number] = TeamMember(pal.advice(), pal, history)


def _read_run(learning: Learning, run: Run) -> None:
    """Take a run's checkpoint and its log, as far as they can be read and belong to the advice."""
    saved = None
    if run.saved_to.is_file():
        try:
            saved = load_checkpoint(run.saved_to)
        except CheckpointError as error:
            learning.unknown.append(f"The run's checkpoint can't be read: {error}.")
    named = run.record.settings.get("log")
    data = _read_log(learning, Path(named) if isinstance(named, str) and named else run.log)
    if saved is None and data is not None:
        with contextlib.suppress(CheckpointError):
            saved = checkpoint_of(data)
    if saved is None:
        learning.unknown.append(
            f"There is no checkpoint of {run.folder}, so that it is not known how maneuvers were bred, nor what they beat."
        )
        return
    if _challenged(learning, saved.standing):
        return
    same = (saved.seed, saved.pal.settings) == (learning.advice.seed, learning.advice.settings)
    if not same:
        learning.unknown.append(
            f"{learning.source} was not made by the run {run.folder}: its seed or settings are others. What follows is from "
            "the file alone."
        )
        learning.history, learning.log = None, None
        return
    learning.pal = saved.pal
    if learning.history is not None and learning.history.count < saved.pal.used:
        source = f" It went on from {run.source}: there is more in the log of that run." if run.source is not None else ""
        learning.unknown.append(
            f"The log has {learning.history.count:,} of the {saved.pal.used:,} maneuvers that were performed: what for, and "
            f"what was expected of them, is known of these alone.{source}"
        )


def _challenged(learning: Learning, standing: ChallengeStanding | None) -> bool:
    """Take what came of a challenge, if there was one; says whether the advice is the one that was challenged."""
    if standing is None:
        return False
    learning.challenge = challenge_in_words(standing.challenge)
    given = learning.advice == standing.given
    if given:
        learning.history, learning.pal = None, None
        learning.unknown.append(STAYED)
    return given


def _read_log(learning: Learning, path: Path) -> bytes | None:
    """Take what a run's log tells; the checkpoint that it ended with, where it has one."""
    if not path.is_file():
        learning.unknown.append(
            f"There is no log {path}, so that it is not known what for maneuvers were performed, and what was expected of them."
        )
        return None
    try:
        learning.history, attachments = _history_of(path)
    except LogError as error:
        learning.unknown.append(f"The log can't be read: {error}.")
        return None
    learning.log = path
    found = attachments.get(ENDED_WITH + runs.CHECKPOINT)
    return None if found is None else found.data


def _of_log(path: Path) -> Learning:
    """The advice that a log has, explained from the log alone."""
    if not path.is_file():
        raise ExplainError(f"there is no log {path}")
    history, attachments = _history_of(path)
    advice = attachments.get(ENDED_WITH + runs.ADVICE)
    if advice is None:
        raise ExplainError(f"{path} has no advice: it is no log of a whole coaching (hil log info {path} tells more)")
    learning = Learning(_attached(path, advice), path, log=path, pal=pal_of(attachments), history=history)
    saved = _saved_of(attachments)
    if saved is not None and _challenged(learning, saved.standing):
        return learning
    team = _team_of(path)
    if team.members:
        learning.team, learning.challenge = team, team.challenge
        learning.unknown.append(
            f"{path} tells of several runs, and how each has learnt stands in its own log: name the folder."
        )
    elif learning.pal is None:
        learning.unknown.append(
            f"There is no checkpoint in {path}, so that it is not known how maneuvers were bred, nor what they beat."
        )
    return learning


def _team_of(path: Path) -> TeamHistory:
    """What a log tells of several runs; nothing, where it is of one."""
    team = TeamHistory()
    for entry in LogReader(path).entries(frozenset(TEAM_TOPICS)):
        team.take(entry)
    return team


def _attached(path: Path, advice: LogAttachment) -> Advice:
    try:
        return advice_of(advice.data)
    except AdviceFileError as error:
        raise ExplainError(f"the advice in {path} can't be read: {error}") from error


def _history_of(path: Path) -> tuple[LearningHistory, Mapping[str, LogAttachment]]:
    """What a log tells of the learning, and the files that it carries."""
    reader, history = LogReader(path), LearningHistory()
    for entry in reader.entries(frozenset(TOPICS)):
        history.take(entry)
    return history, reader.attachments


def pal_of(attachments: Mapping[str, LogAttachment]) -> Pal | None:
    """The learner that has made the advice of a log, as the log's attachments have it at the end of the run.

    None where they have none, where it can't be read, and where the advice stays that the run began from.

    Args:
        attachments: Of the log, by name.
    """
    saved = _saved_of(attachments)
    if saved is None or (saved.standing is not None and not saved.standing.beaten):
        return None
    return saved.pal


def _saved_of(attachments: Mapping[str, LogAttachment]) -> Checkpoint | None:
    """The checkpoint that a log ends with; None where it has none, or it can't be read."""
    found = attachments.get(ENDED_WITH + runs.CHECKPOINT)
    if found is None:
        return None
    try:
        return checkpoint_of(found.data)
    except CheckpointError:
        return None
