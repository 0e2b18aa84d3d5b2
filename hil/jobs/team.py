"""Pal coaches several times over, apart, and one advice is put together from what was learnt."""

from __future__ import annotations

import json
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from itertools import count
from typing import TYPE_CHECKING, Any, ClassVar, Final, Generic, TypeVar

from firmware_protocol.errors import HilError
from firmware_protocol.vocabulary import LEAST_PERIOD, MOST_PERIOD
from hil.jobs.coach import HELD_OUT_LOCKSTEP, MOST_BOUTS, RANDOM_BOUTS, hold_challenge, play_held_out, settings_of
from hil.jobs.options import MOST_SEED, none_or, opponent_of
from hil.jobs.session import ADVICE, GIVEN, attach, begin_log, note_cut_short, open_session_within
from hil.jobs.team_progress import TeamDisplay
from hil.jobs.words import nothing
from hil.mcaplog.records import CoachedRunRecord, TeamBoutsRecord
from hil.seeds import Branch, generator, run_seed
from hil.sumo.advice_file import advice_of, advice_text
from hil.sumo.challenging import ChallengeStanding, facts
from hil.sumo.controllers import AdviceController, RandomController
from hil.sumo.junior import Junior
from hil.sumo.ring import open_ring
from hil.sumo.summary import in_words, per_stimulus
from hil.sumo.team import BoutsTask, CoachedRun, PlayedBouts, parts_of, play_bouts, score_of
from hil.working import WorkerError
from hil.working.recorded import Recorded
from pal_advisor.maneuvers import Advice, AdviceError, Challenge, PalSettings, TeamExam
from pal_advisor.maneuvers.settings import MOST_BUDGET
from pal_advisor.maneuvers.team import BOUTS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import Self

    from hil.jobs.session import Session
    from hil.jobs.stage import Stage
    from hil.recording.recorder import Recorder
    from hil.sumo.bouts import Bout, Tally
    from hil.sumo.ring import Ring
    from pal_advisor.fields import Fields
    from pal_advisor.maneuvers import TeamVerdict

R = TypeVar("R")

USUAL_RUNS: Final = 6
"""Runs on emulated robots that one advice is made of where nothing else is asked for."""
MOST_RUNS: Final = 100
PACES: Final = (0.18, 0.11, 0.08)
"""Time that an action lasts, in s, in one run after the other where none is asked for: opponents differ in what serves best."""
TEAM_SETTINGS: Final = PalSettings(budget=MOST_BUDGET, robot_time=1440.0, end_on_change=True, progress_weight=200.0)
"""How Pal coaches several runs where nothing else is asked for."""
VERB: Final = "coach --runs"
EXAM: Final = "team exam"
TEAM: Final = "team"
"""Kind of the events that tell how runs are put together."""


@dataclass(frozen=True)
class RunOrder:
    """A coaching that is wanted, for a worker; who does it knows where its log goes.

    Attributes:
        number: Its number, from 1.
        seed: Its seed.
        url: Address of its emulated robot.
        settings: How Pal coaches.
        opponent: Name of the opponent.
    """

    number: int
    seed: int
    url: str
    settings: PalSettings
    opponent: str


def _as_it_is(run: CoachedRun) -> CoachedRun:
    return run


@dataclass(frozen=True)
class TeamOutputs:
    """Where it leaves what; by default nowhere.

    Attributes:
        coach: Does a coaching, in a worker; of a module.
        task_of: Makes of an order what `coach` takes.
        take: Is given what came of a coaching, and gives it without what is only to be kept.
        save: Writes the advice.
        learnt: Writes what was learnt beside it, where the advice that was given stays.
        cut: Is told that it is cut short.
    """

    coach: Callable[[Any], CoachedRun] | None = None
    task_of: Callable[[RunOrder], object] = nothing
    take: Callable[[CoachedRun], CoachedRun] = _as_it_is
    save: Callable[[Advice], object] = nothing
    learnt: Callable[[Advice], object] = nothing
    cut: Callable[[], object] = nothing


@dataclass(frozen=True)
class Team:
    """What came of it.

    Attributes:
        advice: What was put together, or the advice that was given, where that stays.
        runs: What came of each run.
        verdicts: What the team exam found out.
        seed: Seed of it all.
        opponent: Name of the opponent.
        tally: Held-out bouts played by the advice; None where there were none.
        random: The same with random maneuvers.
        challenge: Whether what was put together has taken the place of the advice that was given; None where there was none.
    """

    advice: Advice
    runs: tuple[CoachedRun, ...]
    verdicts: tuple[TeamVerdict, ...]
    seed: int
    opponent: str
    tally: Tally | None
    random: Tally | None
    challenge: Challenge | None = None

    @property
    def best_run(self) -> int:
        """Number of the run whose advice the rest was put into."""
        whole = [verdict.run for verdict in self.verdicts if verdict.category is None and verdict.kept]
        return whole[0] if whole else 1

    @property
    def robot_seconds(self) -> float:
        """Time that robots performed for it, the team exam included, in s."""
        return sum(run.robot_seconds for run in self.runs) + sum(verdict.score.seconds for verdict in self.verdicts)

    def facts(self) -> dict[str, object]:
        """What was learnt and won, as plain values."""
        return {
            "opponent": self.opponent,
            "seed": self.seed,
            "objective": self.advice.objective.value,
            "runs": len(self.runs),
            "maneuvers": sum(run.maneuvers for run in self.runs),
            "bouts": sum(run.bouts for run in self.runs),
            "robot_seconds": round(self.robot_seconds, 3),
            "best_run": self.best_run,
            "exchanged": [
                {"run": verdict.run, "situation": list(verdict.category)}
                for verdict in self.verdicts
                if verdict.category is not None and verdict.kept
            ],
            "per_stimulus": per_stimulus(self.advice),
            **({} if self.challenge is None else {"challenge": facts(self.challenge)}),
            "held_out": self.tally.to_dict() if self.tally else None,
        }


@dataclass(frozen=True)
class TeamJob:
    """Several coachings by workers, each on an emulated robot of its own, and the team exam of what they have learnt.

    What comes out, log and all, is the same for any number of workers. The advice is tried by this process, on a robot of its
    own: the log tells of these bouts all that there is to see, and its time is that robot's.

    Attributes:
        settings: How Pal coaches, in each run.
        periods: Time that an action lasts in each run, in s, so that they learn which does best; none: as the settings say.
        opponent: Name of the opponent.
        urls: Address of the emulated robot of each run; robots of the first play the exam and the bouts afterwards, too.
        held_out: Bouts to be played with the advice afterwards; None is as many as usual.
        seed: Seed of every random choice.
        given: The advice that it begins from, which stays unless what was put together wins a challenge; None: there is none.
        outputs: Where it leaves what.
    """

    VERB: ClassVar[str] = VERB

    settings: PalSettings
    opponent: str
    urls: tuple[str, ...]
    held_out: int | None
    seed: int
    periods: tuple[float, ...] = ()
    given: Advice | None = None
    outputs: TeamOutputs = field(default=TeamOutputs(), compare=False)

    @property
    def reconnect(self) -> float:
        """Nobody is waited for: every run has a robot of its own."""
        return 0.0

    def options(self) -> dict[str, Any]:
        """Everything that decides."""
        return {
            "settings": self.settings.to_dict(),
            **({"periods": list(self.periods)} if self.periods else {}),
            "opponent": self.opponent,
            "urls": list(self.urls),
            "held_out": self.held_out,
            "seed": self.seed,
        }

    def files(self) -> dict[str, bytes]:
        """The advice that it begins from."""
        return {} if self.given is None else {GIVEN: advice_text(self.given).encode()}

    @classmethod
    def of_log(cls, options: Fields, files: Mapping[str, bytes]) -> Self:
        """As a log has it; see `Job.of_log`."""
        settings = settings_of(options)
        urls = options.texts("urls")
        if not 1 <= len(urls) <= MOST_RUNS:
            raise options.wrong("urls", f"expected 1 to {MOST_RUNS}, not {len(urls)}")
        paces = options.elements("periods") if options.has("periods") else None
        periods = () if paces is None else tuple(paces.number(name, LEAST_PERIOD, MOST_PERIOD) for name in paces.names)
        if len(periods) not in {0, len(urls)}:
            raise options.wrong("periods", f"expected {len(urls)}, one for each run, not {len(periods)}")
        return cls(
            settings=settings,
            opponent=opponent_of(options, "opponent"),
            urls=urls,
            held_out=none_or(options, "held_out", lambda fields, name: fields.integer(name, 0, MOST_BOUTS)),
            seed=options.integer("seed", 0, MOST_SEED),
            given=advice_of(files[GIVEN]) if GIVEN in files else None,
            periods=periods,
        )

    def settings_of_run(self, number: int) -> PalSettings:
        """How Pal coaches in a run.

        Args:
            number: Its number, from 1.
        """
        return replace(self.settings, period=self.periods[number - 1]) if self.periods else self.settings

    def perform(self, stage: Stage) -> Team:
        """Coach, put together, and try.

        Args:
            stage: The outside.

        Raises:
            WorkerError: Runs can't be had.
            KeyboardInterrupt: The operator asked for it.
        """
        with ExitStack() as stack:
            stack.enter_context(stage.interrupts())
            recorder = begin_log(stack, stage)
            try:
                return _TeamWork(self, stage, recorder).do()
            except (HilError, KeyboardInterrupt) as error:
                note_cut_short(recorder, error)
                self.outputs.cut()
                raise


class _FromWorkers(Generic[R]):
    """What workers give of one kind, counted for a replay."""

    def __init__(self, stage: Stage, recorded: Recorded[R]) -> None:
        self._stage = stage
        self._recorded = recorded
        self._before = 0

    def of(self, function: Callable[[Any], R], tasks: Sequence[object], take: Callable[[int, R], None]) -> None:
        """Have tasks done; each result is taken as it comes."""
        for place, result in enumerate(self._stage.results(function, tasks, self._recorded, self._before)):
            take(place, result)
        self._before += len(tasks)


class _TeamWork:
    """The runs, the exam and the bouts afterwards.

    Args:
        job: What was asked for.
        stage: The outside.
        recorder: Writes the log; None where there is none.
    """

    def __init__(self, job: TeamJob, stage: Stage, recorder: Recorder | None) -> None:
        self._job = job
        self._stage = stage
        self._recorder = recorder
        self._runs: list[CoachedRun] = []
        self._coached = _FromWorkers(stage, RUNS)
        self._bouts = _FromWorkers(stage, PLAYED)
        board = stage.board
        self._display = TeamDisplay(stage.console, len(job.urls), None if board is None else board.read, quiet=stage.quiet)
        self._examined = 0

    def do(self) -> Team:
        """Coach, examine, and try, with the display."""
        with self._display:
            return self._do()

    def _do(self) -> Team:
        job = self._job
        settings = job.settings
        budget = f"{settings.robot_time:g} s of robot time" if settings.robot_time else f"{settings.budget} maneuvers"
        self._say(
            f"Pal coaches {len(job.urls)} emulated robots against {job.opponent}, apart: {budget} each, "
            f"objective {settings.objective.value}. Then one advice is put together. (--runs 1 coaches one.)"
        )
        orders = [
            RunOrder(number, run_seed(job.seed, number), url, job.settings_of_run(number), job.opponent)
            for number, url in enumerate(job.urls, start=1)
        ]
        self._coached.of(job.outputs.coach or _nobody, [job.outputs.task_of(order) for order in orders], self._take_run)
        exam = TeamExam([Advice.from_dict(json.loads(run.json)) for run in self._runs])
        while len(self._runs) > 1 and not exam.finished:
            self._examine(exam)
        team = self._judged(exam)
        if self._recorder is not None:
            self._recorder.note("result", "done", **team.facts())
        return team

    def _take_run(self, place: int, told: CoachedRun) -> None:
        run = self._job.outputs.take(told)
        self._runs.append(run)
        self._display.run_over(place)
        if self._recorder is not None:
            self._recorder.coached_run(place + 1, run)
        learnt = f"{run.maneuvers} maneuvers, won {run.wins} of {run.bouts} bouts while it learnt"
        self._tell(f"Run {place + 1} of {len(self._job.urls)}: {learnt}.")

    def _examine(self, exam: TeamExam) -> None:
        """One turn of the exam."""
        wanted, before = exam.wanted, len(exam.verdicts)
        played = self._play(wanted, self._examined + BOUTS * exam.at_most)
        exam.tell([score_of(each) for each in played])
        for verdict in exam.verdicts[before:]:
            if self._recorder is not None:
                self._recorder.team_verdict(verdict)
        kept = [verdict for verdict in exam.verdicts[before:] if verdict.kept]
        score = exam.score
        if score is not None:
            what = f"run {kept[0].run} does better" if kept else "nothing better was found"
            category = exam.verdicts[before].category
            when = "" if category is None else f" when {in_words(category[1])}"
            self._tell(f"Team exam, {len(wanted)} tried{when}: {what}; {score.wins} of {score.trials} bouts won.")

    def _judged(self, exam: TeamExam) -> Team:
        """What was put together, or the given advice where that stays, and the bouts that it was tried by."""
        job, advice = self._job, exam.best
        team = Team(advice, tuple(self._runs), tuple(exam.verdicts), job.seed, job.opponent, None, None)
        trials = HELD_OUT_LOCKSTEP if job.held_out is None else job.held_out
        if not trials and job.given is None:
            self._keep(advice)
            return team
        with open_session_within(Junior, self._stage, self._recorder) as session:
            ring = open_ring(session.robot)
            if job.given is not None:
                standing = self._challenge(session, ring, job.given, advice)
                advice = advice if standing.beaten else job.given
                team = replace(team, advice=advice, challenge=standing.challenge)
            self._keep(advice)
            if not trials:
                return team
            at_random, done = min(trials, RANDOM_BOUTS), count(1)

            def each(_: Bout) -> None:
                self._display.played(next(done), trials + at_random)

            tally = play_held_out(session, ring, AdviceController(advice), seed=job.seed, trials=trials, each=each)
            player = RandomController(generator(job.seed, Branch.CONTROLLER))
            random = play_held_out(session, ring, player, seed=job.seed, trials=at_random, each=each)
            return replace(team, tally=tally, random=random)

    def _challenge(self, session: Session[Junior], ring: Ring, given: Advice, learnt: Advice) -> ChallengeStanding:
        """Have what was put together challenge the given advice, and keep it where that stays."""
        standing = ChallengeStanding(given)
        hold_challenge(session, ring, standing, learnt, seed=self._job.seed, tell=self._say)
        if not standing.beaten:
            self._job.outputs.learnt(learnt)
        return standing

    def _keep(self, advice: Advice) -> None:
        """Put what is handed out into the log and into a file."""
        if self._recorder is not None:
            self._recorder.advice(advice.to_dict())
            attach(self._recorder, ADVICE, advice_text(advice).encode())
        self._job.outputs.save(advice)

    def _play(self, advices: Sequence[Advice], most: int) -> list[list[PlayedBouts]]:
        """Bouts by each of several advices, from the same poses; there will be so many in the exam at the most."""
        parts = parts_of(BOUTS)
        url, seed = self._job.urls[0], self._job.seed
        tasks = [BoutsTask(url, advice, seed, Branch.VALIDATION, numbers) for advice in advices for numbers in parts]
        played: list[PlayedBouts] = []

        def take(place: int, result: PlayedBouts) -> None:
            played.append(result)
            self._examined += len(result.outcomes)
            self._display.examined(self._examined, most)
            if self._recorder is not None:
                self._recorder.team_bouts(EXAM, tasks[place].numbers[0], result)

        self._bouts.of(play_bouts, tasks, take)
        return [played[first : first + len(parts)] for first in range(0, len(played), len(parts))]

    def _tell(self, text: str) -> None:
        """Say how it goes, in the log as well; what is in it so far is safe then, since no time of it passes meanwhile."""
        self._say(text)
        if self._recorder is not None:
            self._recorder.note(TEAM, text.removesuffix("."))
            self._recorder.flush()

    def _say(self, text: str) -> None:
        if not self._stage.quiet:
            self._stage.say(text)


def _nobody(task: object) -> CoachedRun:
    raise WorkerError(f"nobody is there to coach: {task}")


def _run_of(entry: object) -> CoachedRun | None:
    """The run that an entry of a log tells of."""
    if not isinstance(entry, CoachedRunRecord):
        return None
    try:
        Advice.from_dict(json.loads(entry.json))
    except (AdviceError, ValueError):
        return None
    return CoachedRun(**{name: value for name, value in vars(entry).items() if name != "number"})


def _played_of(entry: object) -> PlayedBouts | None:
    """The bouts that an entry of a log tells of."""
    if not isinstance(entry, TeamBoutsRecord) or not len(entry.outcomes) == len(entry.times) == len(entry.maneuvers) > 0:
        return None
    if not all(1 <= outcome <= 3 for outcome in entry.outcomes):
        return None
    return PlayedBouts(entry.outcomes, entry.times, entry.maneuvers)


RUNS: Final = Recorded("/pal/run", _run_of)
"""How a log tells of coachings."""
PLAYED: Final = Recorded("/pal/bouts", _played_of)
"""How a log tells of bouts."""
