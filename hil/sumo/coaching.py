"""Pal joined to a robot: asks, has it performed, tells, until the budget is used; with checkpoints."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from firmware_protocol.errors import HilError, PeerGoneError, PeerLostError
from firmware_protocol.messages import BoutOutcome
from firmware_protocol.vocabulary import Outcome
from hil.doors import Document, checkpoint_door
from hil.files.outputs import replace_file
from hil.seeds import Branch, bout_seed, generator
from hil.sumo.bouts import MOST_LOSSES, Bout, check_encounter
from hil.sumo.challenging import ChallengeStanding
from hil.sumo.ring import OPPONENTS, UNKNOWN, Encounter, Ring, RingError
from hil.sumo.rivals.rivals import Rivals
from pal_advisor.fields import FieldError, Fields, shown
from pal_advisor.maneuvers import (
    Credit,
    GenerationRecord,
    ObjectiveError,
    Pal,
    PalSettings,
    Performance,
    StateError,
    Trial,
    ancestors_of,
    state_digest,
)
from pal_advisor.maneuvers.settings import Objective

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from firmware_protocol.vocabulary import Maneuver, Stimulus
    from pal_advisor.maneuvers import Advice

CHECKPOINT_VERSION: Final = 1
CHECKPOINT_EVERY: Final = 10.0
"""Least robot time between two checkpoints, in s."""


class CheckpointError(HilError):
    """A checkpoint can't be read, or belongs to another run."""


DOOR: Final = checkpoint_door(CheckpointError, largest=64 << 20)
"""A run of 1,600 maneuvers takes 200 kB."""


class Observer(Protocol):
    """Is told of everything that happens: a progress display, a recorder."""

    def decision(self, trial: Trial) -> None:
        """A maneuver is about to be performed: what is asked for, and why."""
        ...

    def credit(self, credit: Credit) -> None:
        """The adviser was told how it went (or that nobody knows), and has credited it."""
        ...

    def checkpoint(self, used: int, digest: str) -> None:
        """A checkpoint was due: maneuvers performed by then, and the digest of the adviser's whole state."""
        ...

    def trial(self, trial: Trial, encounter: Encounter, performance: Performance, fitness: float) -> None:
        """A maneuver was performed and rated: the fitness is what the adviser found it worth."""
        ...

    def generation(self, record: GenerationRecord) -> None:
        """A GP step was made."""
        ...

    def bout(self, bout: Bout) -> None:
        """A bout ended."""
        ...

    def interrupted(self, bout: int, error: str) -> None:
        """The robot was lost in a bout, of which this is the number: it is waited for, and the bout begun again."""
        ...


@dataclass
class Progress:
    """How far a run is.

    Attributes:
        bouts: Bouts begun.
        wins: Bouts won.
        losses: Bouts lost.
        robot_seconds: Time the robot spent performing, in s.
    """

    bouts: int = 0
    wins: int = 0
    losses: int = 0
    robot_seconds: float = 0.0


class _Standing:
    """Where a bout stands.

    Args:
        stimulus: What the robot senses at its start; None where it could not be asked.

    Attributes:
        way: The maneuvers that have led here, and what the robot sensed after each.
    """

    def __init__(self, stimulus: Stimulus | None) -> None:
        self.way: list[tuple[Maneuver, Stimulus]] = []
        self._current = 0 if stimulus is None else int(stimulus)
        self._previous: int | None = None

    @property
    def situation(self) -> tuple[int, int | None]:
        """Current and previous stimulus; no previous one at the start of a bout."""
        return self._current, self._previous

    def begin(self, stimulus: Stimulus) -> None:
        """The bout is begun again."""
        self.way = []
        self._current, self._previous = int(stimulus), None

    def follow(self, maneuver: Maneuver, encounter: Encounter) -> None:
        """A maneuver was performed."""
        self.way.append((maneuver, encounter.stimulus))
        self._current, self._previous = int(encounter.stimulus), self._current


class Coaching:
    """One coaching run.

    A checkpoint is written between bouts (where there is a referee; otherwise between maneuvers) and restores everything
    that decides what comes next, so that in lock-step a run cut and resumed equals the run not cut.

    A robot that is lost is waited for (as long as the connection has patience) and armed again. Nobody knows whether the
    maneuver under way was performed: it is not rated, and performed again; what was rated stays. The bout is begun again: in
    lock-step it is played up to where it was, by the same maneuvers, none of which is rated twice, so that such a run equals
    one without the loss. In real time the same maneuvers would not lead to the same place: there coaching goes on from the
    start pose, and the maneuver whose result was lost is performed as soon as its situation comes up.

    Args:
        ring: Where the robot learns.
        pal: The adviser.
        seed: Seed of the run.
        checkpoint: File to write checkpoints to; None writes none.
        observers: Who is told.
        progress: How far a resumed run is.
        vary: Share by which the robot's world differs from bout to bout, for the checkpoint.
        save_on_cut: Save in the middle of a bout when the run is cut: nothing learnt is lost, but the cut shows. In
            real time there is nothing to be repeated exactly; in lock-step the bout is played again instead.
        on_unsaved: Is told, in words, when a checkpoint can't be written; coaching goes on. None: that ends it.
        keep: Is given the best advice so far with every checkpoint; None: nobody is.
        standing: How the advice that it began from holds its place; None where it began from none.
        rivals: The robots that are met in the ring; None: there are none. In self-play they learn of what was learnt.

    Attributes:
        progress: How far the run is.
        pal: The adviser.
        unsaved: The last checkpoint could not be written.
        standing: How the advice that it began from holds its place; None where it began from none.
    """

    def __init__(
        self,
        ring: Ring,
        pal: Pal,
        *,
        seed: int,
        checkpoint: Path | None = None,
        observers: tuple[Observer, ...] = (),
        progress: Progress | None = None,
        vary: float = 0.0,
        save_on_cut: bool = False,
        on_unsaved: Callable[[str], None] | None = None,
        keep: Callable[[Advice], object] | None = None,
        standing: ChallengeStanding | None = None,
        rivals: Rivals | None = None,
    ) -> None:
        self.pal = pal
        self.standing = standing
        self.unsaved = False
        self._on_unsaved = on_unsaved
        self._keep = keep
        self._rivals = rivals
        self.progress = progress or Progress()
        self._ring = ring
        self._seed = seed
        self._vary = vary
        self._checkpoint = checkpoint
        self._observers = observers
        self._save_on_cut = save_on_cut
        self._saved_at = self.progress.robot_seconds
        self._losses = 0

    def run(self) -> None:
        """Coach until the budget is used.

        Raises:
            RefusedError: The robot was stopped by somebody.
            RingError: The objective asks for what nobody here can tell.
            LinkError: The link is gone for good; the checkpoint holds the state at the beginning of the bout.
            PeerError: The robot is gone for good, likewise.
        """
        self.save()
        try:
            while not self.pal.finished:
                self._bout()
                if self.progress.robot_seconds - self._saved_at >= CHECKPOINT_EVERY or self.pal.finished:
                    self.save()
        except BaseException:
            if self._save_on_cut:
                self.save()
            raise

    def _bout(self) -> None:
        """One bout, to its end or to that of the budget."""
        number = self.progress.bouts + 1
        seed = bout_seed(self._seed, Branch.COACHING_BOUTS, number)
        if self._rivals is not None:
            self._rivals.keep_up(self.progress.bouts, self.advice)
        place = self._begin(number, seed)
        trial: Trial | None = None
        maneuvers = 0
        while not self.pal.finished:
            if trial is None:
                trial = self.pal.ask(*place.situation)
                for observer in self._observers:
                    observer.decision(trial)
            try:
                encounter = self._ring.engage(trial.maneuver)
            except PeerLostError as error:
                if not self._return(place, number, seed, error):
                    self._discard(trial)
                    trial = None
                    self._note(self.pal.interrupt())
                continue
            self._losses = 0
            self._tell(trial, encounter)
            place.follow(trial.maneuver, encounter)
            trial = None
            maneuvers += 1
            if encounter.elapsed is None and self.progress.robot_seconds - self._saved_at >= CHECKPOINT_EVERY:
                self.save()
            if encounter.outcome is not BoutOutcome.UNDECIDED:
                self.progress.wins += encounter.outcome is BoutOutcome.WIN
                self.progress.losses += encounter.outcome is BoutOutcome.LOSS
                bout = Bout(number, seed, encounter.outcome, encounter.elapsed or 0.0, maneuvers)
                for observer in self._observers:
                    observer.bout(bout)
                break
        self.progress.bouts = number

    def _begin(self, number: int, seed: int) -> _Standing:
        """Begin a bout."""
        try:
            return _Standing(self._ring.begin(seed))
        except PeerLostError as error:
            place = _Standing(None)
            self._return(place, number, seed, error)
            return place

    def _return(self, place: _Standing, number: int, seed: int, error: PeerLostError) -> bool:
        """The robot was lost: wait for it, begin the bout again, and in lock-step play it up to where it was.

        Args:
            place: Where it was in the bout; where it is then.
            number: Number of the bout.
            seed: Its seed.
            error: What was said of the loss.

        Returns:
            It is again where it was.
        """
        repeatable = self._ring.refereed and not self._save_on_cut
        way = place.way if repeatable else []
        while True:
            self._losses += 1
            if self._losses > MOST_LOSSES:
                raise error
            for observer in self._observers:
                observer.interrupted(number, str(error))
            try:
                self._ring.recover()
                place.begin(self._ring.begin(seed))
                if not self._again(place, way):
                    place.begin(self._ring.begin(seed))
            except PeerGoneError:
                raise
            except PeerLostError as another:
                error = another
                continue
            return repeatable and place.way == way

    def _again(self, place: _Standing, way: list[tuple[Maneuver, Stimulus]]) -> bool:
        """Go the same way again.

        Returns:
            False when it led elsewhere, and the bout is over.
        """
        for maneuver, expected in way:
            encounter = self._ring.engage(maneuver)
            place.follow(maneuver, encounter)
            if encounter.outcome is not BoutOutcome.UNDECIDED:
                return False
            if encounter.stimulus != expected:
                return True
        return True

    def _tell(self, trial: Trial, encounter: Encounter) -> None:
        report = encounter.report
        if (report.outcome is Outcome.STOPPED and encounter.outcome is BoutOutcome.UNDECIDED) or not report.tallies:
            self._discard(trial)
            check_encounter(encounter)
            return
        performance = Performance(
            tallies=report.tallies,
            planned=len(trial.maneuver.actions),
            won=encounter.outcome is BoutOutcome.WIN,
            lost=encounter.outcome is BoutOutcome.LOSS,
            progress=encounter.progress,
            over=encounter.outcome is not BoutOutcome.UNDECIDED,
            duration=encounter.duration,
        )
        try:
            records = self.pal.tell(trial, performance)
        except ObjectiveError as error:
            raise RingError(str(error)) from error
        self.progress.robot_seconds += encounter.duration
        for observer in self._observers:
            observer.trial(trial, encounter, performance, self.pal.rating)
        self._note(records)

    def _discard(self, trial: Trial) -> None:
        """Nobody knows how a maneuver went."""
        self.pal.discard(trial)
        self._note([])

    def _note(self, records: list[GenerationRecord]) -> None:
        """Tell of what was credited, and of GP steps."""
        for observer in self._observers:
            if self.pal.credited is not None:
                observer.credit(self.pal.credited)
            for record in records:
                observer.generation(record)

    def advice(self) -> Advice:
        """What was learnt so far."""
        return self.pal.advice(opponent=self._ring.opponent, seed=self._seed)

    def best(self) -> Advice:
        """The best advice so far: the one that it began from until that is beaten, else what was learnt."""
        return self.advice() if self.standing is None or self.standing.beaten else self.standing.given

    def checkpoint(self) -> bytes:
        """All that decides how this run goes on, as a checkpoint holds it."""
        return self._checkpoint_of(self.pal.state_dict())

    def _checkpoint_of(self, state: object) -> bytes:
        document = {
            "version": CHECKPOINT_VERSION,
            "seed": self._seed,
            "opponent": self._ring.opponent,
            "bouts": self.progress.bouts,
            "wins": self.progress.wins,
            "losses": self.progress.losses,
            "robot_seconds": self.progress.robot_seconds,
            **({} if self.standing is None else {"challenge": self.standing.to_dict()}),
            **({"vary": self._vary} if self._vary else {}),
            **({} if self._rivals is None else {"rivals": self._rivals.to_dict()}),
            "pal": state,
        }
        return json.dumps(document, separators=(",", ":")).encode()

    def save(self) -> None:
        """Write the checkpoint, whole or not at all.

        Raises:
            CheckpointError: It can't be written.
        """
        self._saved_at = self.progress.robot_seconds
        state = self.pal.state_dict()
        if self._checkpoint is not None:
            self._write(self._checkpoint, self._checkpoint_of(state))
        digest = state_digest(state)
        for observer in self._observers:
            observer.checkpoint(self.pal.used, digest)
        if self._keep is not None and (self.pal.used or self.standing is not None):
            self._keep(self.best())

    def _write(self, path: Path, checkpoint: bytes) -> None:
        """Write the checkpoint; where that fails, say so once."""
        try:
            replace_file(path, checkpoint)
        except OSError as error:
            text = f"cannot write the checkpoint {path}: {error.strerror}"
            if self._on_unsaved is None:
                raise CheckpointError(text) from error
            if not self.unsaved:
                self._on_unsaved(text)
            self.unsaved = True
        else:
            self.unsaved = False


def new_pal(settings: PalSettings, seed: int, given: Advice | None = None) -> Pal:
    """An adviser that has learnt nothing.

    Args:
        settings: How to coach.
        seed: Seed of the run.
        given: An advice that was learnt before: what it breeds in phase 2 may descend from its maneuvers. None: there is none.
    """
    return Pal(settings, generator(seed, Branch.PAL), {} if given is None else ancestors_of(given, settings))


def check_objective(objective: Objective, ring: Ring) -> None:
    """See that somebody can tell what an objective asks for.

    Args:
        objective: What a good maneuver is to be.
        ring: Where the robot is to learn.

    Raises:
        RingError: Nobody can.
    """
    if objective is Objective.OUTCOME and not ring.refereed:
        raise RingError(
            "the objective 'outcome' needs a referee who sees the ring, and nobody answers as one: "
            "use --objective contact, or effective with a robot that has a ground odometer"
        )


@dataclass(frozen=True)
class Checkpoint:
    """A run that was cut.

    Attributes:
        pal: The adviser as it was.
        seed: Seed of the run.
        opponent: Name of the opponent.
        progress: How far the run was.
        standing: How the advice that it began from held its place; None where it began from none.
        vary: Share by which the robot's world differed from bout to bout.
        rivals: The robots that it was coached against; None: it was not against robots.
    """

    pal: Pal
    seed: int
    opponent: str
    progress: Progress
    vary: float = 0.0
    rivals: Rivals | None = None
    standing: ChallengeStanding | None = None


def load_checkpoint(path: Path) -> Checkpoint:
    """Read a checkpoint.

    Args:
        path: The file.

    Raises:
        CheckpointError: It can't be read, is of another version, or is damaged.
    """
    return _of_document(DOOR.document(path, json=True))


def checkpoint_of(data: bytes) -> Checkpoint:
    """A checkpoint that is held in memory, as a log has it.

    Args:
        data: As a file would hold it.

    Raises:
        CheckpointError: It is none, is of another version, or is damaged.
    """
    return _of_document(DOOR.document_of(data, "the checkpoint", json=True))


def _of_document(document: Document) -> Checkpoint:
    data = document.data
    if not isinstance(data, dict) or data.get("version") != CHECKPOINT_VERSION:
        raise CheckpointError(f"{document.path} is no checkpoint of version {CHECKPOINT_VERSION}")
    try:
        return _checkpoint(Fields(data))
    except FieldError as error:
        raise document.wrong("", f"this checkpoint is damaged: {error}") from error


def _checkpoint(fields: Fields) -> Checkpoint:
    """What a checkpoint says.

    Raises:
        FieldError: A field is missing, unknown or wrong.
    """
    fields.take("version")
    progress = Progress(
        bouts=fields.integer("bouts"),
        wins=fields.integer("wins"),
        losses=fields.integer("losses"),
        robot_seconds=fields.number("robot_seconds", 0.0),
    )
    if progress.wins + progress.losses > progress.bouts + 1:  # the one under way is counted when it is left
        raise fields.wrong("bouts", f"{progress.bouts} are fewer than were won and lost")
    seed = fields.integer("seed", 0, 2**32 - 1)
    rivals = Rivals.from_fields(fields.table("rivals")) if fields.has("rivals") else None
    known = (*OPPONENTS, UNKNOWN) if rivals is None else (rivals.name,)
    opponent = fields.text("opponent")
    if opponent not in known:
        raise fields.wrong("opponent", f"expected one of {', '.join(known)}, not {shown(opponent)}")
    vary = fields.number("vary", 0.0, 1.0) if fields.has("vary") else 0.0
    try:
        pal = Pal.from_state(fields.take("pal"))
    except StateError as error:
        raise fields.wrong("pal", str(error)) from error
    standing = ChallengeStanding.of_fields(fields.table("challenge"), seed) if fields.has("challenge") else None
    fields.done()
    return Checkpoint(pal, seed, opponent, progress, vary, rivals, standing)
