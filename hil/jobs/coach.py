"""Pal coaches Junior, and the advice is tried."""

from __future__ import annotations

from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, ClassVar, Final

from firmware_protocol.errors import HilError
from hil.jobs.options import DAY, MOST_SEED, none_or, opponent_of, rivals_files, rivals_of, rivals_options
from hil.jobs.progress import CoachingDisplay
from hil.jobs.session import ADVICE, CHECKPOINT, GIVEN, LEARNT, Session, open_pair_session, open_session
from hil.jobs.stage import keys_taken_in
from hil.jobs.words import nothing
from hil.seeds import Branch, bout_seed, generator
from hil.sumo.advice_file import advice_of, advice_text
from hil.sumo.attended import Evenness, FloorJudge, JudgedRing, LonelyRing, PausedRing, PoweredRing, try_wheels
from hil.sumo.bouts import Tally, play
from hil.sumo.challenging import ChallengeStanding, beginning_in_words, facts, hold, pair_in_words
from hil.sumo.coaching import Coaching, check_objective, checkpoint_of, new_pal
from hil.sumo.controllers import AdviceController, Controller, RandomController
from hil.sumo.junior import Junior
from hil.sumo.ring import Ring, RingError, open_ring
from hil.sumo.rivals.ring import RivalRing
from hil.sumo.summary import per_stimulus
from pal_advisor.fields import SettingsError
from pal_advisor.maneuvers import Objective, PalSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from contextlib import AbstractContextManager
    from pathlib import Path
    from typing import Self

    from hil.jobs.stage import Stage
    from hil.sumo.bouts import Bout
    from hil.sumo.coaching import Checkpoint, Observer
    from hil.sumo.rivals.pair import Pair
    from hil.sumo.rivals.rivals import Rivals
    from pal_advisor.fields import Fields
    from pal_advisor.maneuvers import Advice, ChallengeVerdict

HELD_OUT_LOCKSTEP: Final = 50
HELD_OUT_REAL_TIME: Final = 5
RANDOM_BOUTS: Final = 20
MOST_BOUTS: Final = 1_000_000


class Reset(StrEnum):
    """How a ring without a referee is set up between bouts."""

    ASK = "ask"
    """A person does it, and says when it is ready."""
    AUTO = "auto"
    """The robot backs off and turns."""


def settings_of(options: Fields) -> PalSettings:
    """How Pal coaches, as a log has it.

    Args:
        options: What the run was asked for.

    Raises:
        FieldError: There are no settings, or they make no sense.
    """
    settings = options.take("settings")
    try:
        return PalSettings.of_saved(settings)
    except (SettingsError, TypeError, AttributeError) as error:
        raise options.wrong("settings", str(error)) from error


@dataclass(frozen=True)
class Outputs:
    """Where a coaching run leaves what; by default nowhere.

    Attributes:
        checkpoint: The file of its checkpoint; None writes none.
        save: Writes the advice; says False where it can't.
        learnt: Writes what was learnt beside it, where the advice that was given stays.
        keep: Writes the best advice so far, whenever a checkpoint was due in real time.
        cut: Is told of a run that is cut short.
        unsaved: Is told, in words, that a checkpoint can't be written.
        resumed: Is told what is gone on from.
        observers: Are told of the coaching, besides log and display.
    """

    checkpoint: Path | None = None
    save: Callable[[Advice], object] = nothing
    learnt: Callable[[Advice], object] = nothing
    keep: Callable[[Advice], object] = nothing
    cut: Callable[[Coaching], None] = nothing
    unsaved: Callable[[str], None] = nothing
    resumed: Callable[[Checkpoint], None] = nothing
    observers: tuple[Observer, ...] = ()


@dataclass(frozen=True)
class Coached:
    """What came of it.

    Attributes:
        coaching: The run.
        opponent: Name of the opponent.
        seed: Seed of the run.
        tally: Held-out bouts played by the advice; None where there were none.
        random: The same with random maneuvers.
        by_rival: The held-out bouts of the advice by whom it met, where several robots are met in turn.
        wheels: What was found out of the robot's wheels; None where they were not measured.
    """

    coaching: Coaching
    opponent: str
    seed: int
    tally: Tally | None
    random: Tally | None
    by_rival: tuple[Tally, ...] = ()
    wheels: Evenness | None = None

    def facts(self) -> dict[str, object]:
        """What was learnt and won, as plain values."""
        pal, advice, standing = self.coaching.pal, self.coaching.best(), self.coaching.standing
        return {
            "opponent": self.opponent,
            "seed": self.seed,
            "objective": advice.objective.value,
            "maneuvers": pal.used,
            "bouts": self.coaching.progress.bouts,
            "robot_seconds": round(self.coaching.progress.robot_seconds, 3),
            "per_stimulus": per_stimulus(advice),
            **({} if standing is None else {"challenge": facts(standing.challenge)}),
            "held_out": self.tally.to_dict() if self.tally else None,
            **({"held_out_by_rival": [tally.to_dict() for tally in self.by_rival]} if self.by_rival else {}),
            **({"wheels": self.wheels.figures()} if self.wheels else {}),
        }


@dataclass(frozen=True)
class CoachJob:
    """A coaching run.

    Attributes:
        settings: How Pal coaches; of a run that is gone on with, its own hold.
        choose_objective: The objective is `contact` where nobody can tell what is better.
        choose_mirror: Left and right are exchanged where the robot's wheels are even.
        measure_wheels: Whether the wheels of a robot at a link are even is measured; else nobody knows.
        opponent: Opponent to place, or what the user says it is up against; None takes what is there.
        held_out: Bouts to be played with the advice afterwards; None is as many as usual.
        seed: Seed of every random choice.
        reconnect: How long a robot or link that is lost is waited for, in s.
        saved: The checkpoint that is gone on from; None begins anew.
        pauses: A person who looks on may have the run pause.
        reset: How the ring is set up between bouts; None: by its referee, or not at all.
        judged: Only a person says how bouts end, who sets the ring up as well; else floor sensors and clock do, too.
        vary: Share by which the world of an emulated robot differs from bout to bout: its address says so, and the checkpoint
            has it.
        find: Finds that checkpoint by the robot's unique id, once that is known; None where there is none to be found.
        outputs: Where it leaves what.
        rivals: The robots that are met in an emulated ring of two, instead of an opponent that a referee places.
        given: The advice that it begins from, which stays unless what was learnt wins a challenge; None: there is none. A run
            that is gone on with has its own.
    """

    VERB: ClassVar[str] = "coach"

    settings: PalSettings
    choose_objective: bool
    choose_mirror: bool
    measure_wheels: bool
    opponent: str | None
    held_out: int | None
    seed: int
    reconnect: float
    saved: bytes | None = None
    pauses: bool = False
    reset: Reset | None = None
    judged: bool = False
    vary: float = 0.0
    find: Callable[[str], bytes] | None = field(default=None, compare=False)
    outputs: Outputs = field(default=Outputs(), compare=False)
    rivals: Rivals | None = field(default=None, compare=False)
    given: Advice | None = field(default=None, compare=False)

    def options(self) -> dict[str, Any]:
        """Everything that decides, but for the checkpoint."""
        return {
            "settings": self.settings.to_saved(),
            "choose_objective": self.choose_objective,
            **({"choose_mirror": True} if self.choose_mirror else {}),
            **({"measure_wheels": True} if self.measure_wheels else {}),
            "opponent": self.opponent,
            "held_out": self.held_out,
            "seed": self.seed,
            "reconnect": self.reconnect,
            **({"pauses": True} if self.pauses else {}),
            **({"reset": self.reset.value} if self.reset else {}),
            **({"judged": True} if self.judged else {}),
            **({"vary": self.vary} if self.vary else {}),
            **({"rivals": rivals_options(self.rivals)} if self.rivals else {}),
        }

    def files(self) -> dict[str, bytes]:
        """The checkpoint, as far as it is known before the robot is; the advice that it begins from; what rivals play by."""
        return {
            **({} if self.saved is None else {CHECKPOINT: self.saved}),
            **({} if self.given is None else {GIVEN: advice_text(self.given).encode()}),
            **({} if self.rivals is None else rivals_files(self.rivals)),
        }

    @classmethod
    def of_log(cls, options: Fields, files: Mapping[str, bytes]) -> Self:
        """As a log has it; see `Job.of_log`."""
        return cls(
            settings=settings_of(options),
            choose_objective=options.flag("choose_objective"),
            choose_mirror=options.flag("choose_mirror", missing=False),
            measure_wheels=options.flag("measure_wheels", missing=False),
            opponent=none_or(options, "opponent", opponent_of),
            held_out=none_or(options, "held_out", lambda fields, name: fields.integer(name, 0, MOST_BOUTS)),
            seed=options.integer("seed", 0, MOST_SEED),
            reconnect=options.number("reconnect", 0, DAY),
            saved=files.get(CHECKPOINT),
            pauses=options.flag("pauses", missing=False),
            reset=options.one_of("reset", Reset) if options.has("reset") else None,
            judged=options.flag("judged", missing=False),
            vary=options.number("vary", 0, 1) if options.has("vary") else 0.0,
            rivals=rivals_of(options, "rivals", files) if options.has("rivals") else None,
            given=advice_of(files[GIVEN]) if GIVEN in files else None,
        )

    def perform(self, stage: Stage) -> Coached:
        """Coach, and try the advice."""
        with self._session(stage) as (session, pair), self._keys(stage):
            run = _CoachingRun(self, session, stage, pair)
            try:
                run.coach()
                tally, random = run.held_out()
            except (HilError, KeyboardInterrupt):
                run.end()
                self.outputs.cut(run.coaching)
                raise
            run.end()
            coached = Coached(run.coaching, run.ring.opponent, run.seed, tally, random, run.by_rival, run.wheels)
            session.finish(coached.facts())
        return coached

    @contextmanager
    def _session(self, stage: Stage) -> Iterator[tuple[Session[Junior], Pair | None]]:
        """Inside, the robot is there; against rivals the other, too."""
        if self.rivals is not None:
            with open_pair_session(stage, reconnect=self.reconnect) as both:
                yield both
            return
        armed = self.reset is None  # else the ring arms it, when nobody's hands are in it
        with open_session(Junior, stage, reconnect=self.reconnect, arm=armed) as session:
            yield session, None

    def _keys(self, stage: Stage) -> AbstractContextManager[None]:
        """Inside, a person beside the ring may answer by keys."""
        return nullcontext() if self.reset is None else keys_taken_in(stage)


class _CoachingRun:
    """One coaching run."""

    def __init__(self, job: CoachJob, session: Session[Junior], stage: Stage, pair: Pair | None) -> None:
        self._job = job
        self._session = session
        self._stage = stage
        saved = self._saved()
        self.seed = job.seed if saved is None else saved.seed
        rivals = saved.rivals if saved is not None else job.rivals and job.rivals.anew()
        self._rivals = rivals
        self.by_rival: tuple[Tally, ...] = ()
        self.ring = self._ring() if pair is None or rivals is None else RivalRing(pair, rivals)
        self.wheels: Evenness | None = None
        if saved is None:
            standing = None if job.given is None else ChallengeStanding(job.given)
            self._check(standing)
            pal, progress = new_pal(self._settings(), self.seed, job.given), None
        else:
            pal, progress, standing = saved.pal, saved.progress, saved.standing
            job.outputs.resumed(saved)
            self._check(standing)
        check_objective(pal.settings.objective, self.ring)
        self._display = CoachingDisplay(stage.console, pal.settings, used=pal.used, seconds=pal.seconds, quiet=stage.quiet)
        self._display.headline(session.robot, self.ring.opponent, pal)
        self.coaching = Coaching(
            self.ring,
            pal,
            seed=self.seed,
            checkpoint=job.outputs.checkpoint,
            observers=(*session.observers(), self._display, *job.outputs.observers),
            progress=progress,
            vary=job.vary if saved is None else saved.vary,
            save_on_cut=not session.lockstep,
            on_unsaved=job.outputs.unsaved,
            keep=None if session.lockstep else job.outputs.keep,
            rivals=rivals,
            standing=standing,
        )
        stage.describe(opponent=self.ring.opponent)

    def _saved(self) -> Checkpoint | None:
        job = self._job
        if job.saved is not None:
            return checkpoint_of(job.saved)
        if job.find is None:
            return None
        found = job.find(self._session.robot.uid)
        self._session.attach(CHECKPOINT, found, begun=True)
        return checkpoint_of(found)

    def _ring(self) -> Ring:
        """The ring, with who is beside it."""
        job, junior, stage = self._job, self._session.robot, self._stage
        if job.reset is None:
            ring = open_ring(junior, job.opponent)
            return PausedRing(ring, junior, self._session.questions()) if job.pauses else ring
        questions = self._session.questions(stage.say)
        lonely = job.reset is Reset.AUTO
        bare: Ring = (
            LonelyRing(junior, questions, job.opponent)
            if lonely
            else JudgedRing(junior, questions, job.opponent, None if job.judged else FloorJudge(junior))
        )
        low = junior.parameter("BATT_LOW") * 1e-3
        if not low and stage.tell is not None:
            stage.tell(
                "The battery is not watched: have the robot say when it is low, as by hil param LINK BATT_LOW 6600 (mV)."
            )
        ring = PoweredRing(bare, junior, questions, low, self._save) if low else bare
        return PausedRing(ring, junior, questions) if lonely else ring

    def _check(self, standing: ChallengeStanding | None) -> None:
        """See that somebody can tell whether an advice is beaten, where one is to be.

        Raises:
            RingError: Nobody can.
        """
        if standing is not None and not self.ring.refereed:
            raise RingError(
                "whether what is learnt is better than the given advice is decided by bouts that somebody sees won, and nobody "
                "does here: have a person say it (--reset ask, --judge), or leave --from out"
            )

    def _save(self) -> None:
        """Save what was learnt: the robot may be off for long."""
        self.coaching.save()

    def _settings(self) -> PalSettings:
        settings = self._job.settings
        if self._job.choose_objective and not self.ring.refereed:
            settings = replace(settings, objective=Objective.CONTACT)
        if self._job.choose_mirror and not self._session.lockstep:
            settings = replace(settings, mirror=self._job.measure_wheels and self._even())
        return settings

    def _even(self) -> bool:
        """Whether the robot's wheels are even; who has a referee is emulated, and its wheels are taken for even."""
        junior, tell = self._session.robot, self._stage.tell or nothing
        if junior.referee is not None:
            return True
        tell("Whether the wheels are even is found out first, within 30 s; with --mirror or --no-mirror that is left out.")
        questions = self._session.questions(self._stage.say) if self._job.reset is Reset.ASK else None
        self.wheels = found = try_wheels(junior, self.ring, questions)
        words = f"{found} {'Left and right are learnt as one.' if found.even else 'Left and right are learnt apart.'}"
        if found.trim is not None:
            name, factor = found.trim
            words += f" They would be about even with {name} {factor * junior.parameter(name):.2f}."
        self._session.note("wheels", words, **found.figures())
        tell(words)
        return found.even

    def coach(self) -> None:
        """Coach, with the display, and write the advice."""
        self._session.series("coaching")
        with self._display:
            self.coaching.run()
        self._challenge(self.coaching.standing)
        advice = self.coaching.best()
        self._session.advice(advice)
        self._session.attach(ADVICE, advice_text(advice).encode())
        self._job.outputs.save(advice)

    def _challenge(self, standing: ChallengeStanding | None) -> None:
        """Have what was learnt challenge the given advice, if there is one, and keep it where that stays."""
        if standing is not None:
            learnt, tell = self.coaching.advice(), self._stage.tell or nothing
            hold_challenge(self._session, self.ring, standing, learnt, seed=self.seed, tell=tell, save=self.coaching.save)
            if not standing.beaten:
                self._job.outputs.learnt(learnt)

    def held_out(self) -> tuple[Tally | None, Tally | None]:
        """Play bouts from fresh poses, as many as usual for None: by the advice, and in lock-step at random for comparison."""
        trials = self._job.held_out
        if trials is None:
            trials = HELD_OUT_LOCKSTEP if self._session.lockstep else HELD_OUT_REAL_TIME
        if not trials or not self.ring.refereed:
            return None, None
        tally, bouts = self._played(AdviceController(self.coaching.best()), trials)
        if self._rivals is not None:
            self.by_rival = self._rivals.tallies(bouts)
        if not self._session.lockstep:
            return tally, None
        player = RandomController(generator(self.seed, Branch.CONTROLLER))
        return tally, self._played(player, min(trials, RANDOM_BOUTS))[0]

    def _played(self, controller: Controller, trials: int) -> tuple[Tally, list[Bout]]:
        bouts: list[Bout] = []
        tally = play_held_out(self._session, self.ring, controller, seed=self.seed, trials=trials, each=bouts.append)
        return tally, bouts

    def end(self) -> None:
        """Put into the log how far it has come: whoever has the log can go on from there."""
        self._session.attach(CHECKPOINT, self.coaching.checkpoint())


def play_held_out(
    session: Session[Junior],
    ring: Ring,
    controller: Controller,
    *,
    seed: int,
    trials: int,
    each: Callable[[Bout], object] = nothing,
) -> Tally:
    """Play bouts from poses that nothing was learnt from, and put them into the log.

    Args:
        session: The robot, and its log.
        ring: Where.
        controller: Chooses the maneuvers.
        seed: Seed of the run that they belong to.
        trials: How many.
        each: Is told of each.
    """
    seeds = [bout_seed(seed, Branch.HELD_OUT_BOUTS, number) for number in range(1, trials + 1)]
    session.series(f"bouts played by {'the advice' if isinstance(controller, AdviceController) else 'random maneuvers'}")
    bouts = []
    for bout in play(ring, controller, seeds):
        bouts.append(bout)
        session.bout(bout)
        each(bout)
    return Tally.of(ring.opponent, bouts)


def hold_challenge(
    session: Session[Junior],
    ring: Ring,
    standing: ChallengeStanding,
    learnt: Advice,
    *,
    seed: int,
    tell: Callable[[str], object],
    save: Callable[[], object] = nothing,
) -> None:
    """Have what was learnt challenge a given advice, and put that into the log.

    Args:
        session: The robot, and its log.
        ring: Where.
        standing: How the challenge stands, and then how it has ended.
        learnt: What was learnt; where that is nothing, no bout is played.
        seed: Seed of the run.
        tell: Says to whoever waits what happens.
        save: Saves how it stands, after each bout.
    """
    if learnt.entries:
        tell(beginning_in_words(standing.challenge))
        hold(ring, standing, learnt, seed, _ChallengeNotes(session, nothing if session.lockstep else tell, save))
    if session.recorder is not None:
        session.recorder.challenge(standing.challenge)
    if not standing.beaten:
        session.attach(LEARNT, advice_text(learnt).encode())


class _ChallengeNotes:
    """Who is told of a challenge: the log, whoever waits, and who saves.

    Args:
        session: The robot and the log.
        tell: Says something to whoever waits.
        save: Saves how it stands.
    """

    def __init__(self, session: Session[Junior], tell: Callable[[str], object], save: Callable[[], object]) -> None:
        self._session = session
        self._tell = tell
        self._save = save

    def series(self, title: str) -> None:
        """A bout begins that belongs to these."""
        self._session.series(title)

    def bout(self, bout: Bout) -> None:
        """A bout ended."""
        self._session.bout(bout)

    def verdict(self, verdict: ChallengeVerdict) -> None:
        """A pair is complete."""
        if self._session.recorder is not None:
            self._session.recorder.challenge_verdict(verdict)
        self._tell(pair_in_words(verdict))

    def save(self) -> None:
        """Save how it stands."""
        self._save()
