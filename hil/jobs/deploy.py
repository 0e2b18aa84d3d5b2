"""An advice is put into the robot's own memory, and may be played from there."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Final

from firmware_protocol.messages import State
from hil.jobs.options import MOST_SEED, wanted_file
from hil.jobs.session import ADVICE, Session, open_session
from hil.jobs.words import nothing
from hil.sumo import deploying
from hil.sumo.advice_file import advice_of, advice_text
from hil.sumo.contest import Contest, Ending, follow_contest, start_contest
from hil.sumo.junior import Junior

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Self

    from hil.jobs.stage import Stage
    from hil.sumo.deploying import Deployment
    from pal_advisor.fields import Fields
    from pal_advisor.maneuvers import Advice

MOST_COUNTDOWN: Final = 60.0
"""In s."""


@dataclass(frozen=True)
class Deployed:
    """What came of it.

    Attributes:
        memory: What the robot's memory holds.
        contest: The contest that was looked on at; None where there was none.
    """

    memory: Deployment
    contest: Contest | None

    def facts(self) -> dict[str, object]:
        """The same, as plain values."""
        done, ended = self.memory, self.contest
        return {
            "verified": True,
            "slots": [
                {
                    "situation": slot.situation,
                    "previous": slot.previous,
                    "current": slot.current,
                    "actions": [action.name for action in slot.maneuver.actions],
                    "period_s": slot.maneuver.period,
                }
                for slot in done.plan.slots
            ],
            "left_out": [slot.situation for slot in done.plan.left_out],
            "written": done.written,
            "kept": done.kept,
            "erased": done.erased,
            "checksum": done.checksum,
            "contest": None
            if ended is None
            else {
                "ending": str(ended.ending),
                "outcome": None if ended.outcome is None else ended.outcome.name.lower(),
                "elapsed_s": ended.elapsed,
            },
        }


@dataclass(frozen=True)
class DeployJob:
    """An advice to be deployed.

    Attributes:
        advice: The advice.
        contest: Then start a contest.
        countdown: The robot stands still for so long first, in s.
        leave: Do not look on.
        seed: Seed of the start poses, where there is a referee.
        stored: Is told what the memory holds, before a contest begins, and of which robot.
    """

    VERB: ClassVar[str] = "deploy"

    advice: Advice
    contest: bool
    countdown: float
    leave: bool
    seed: int
    stored: Callable[[str, Deployment], None] = field(default=nothing, compare=False)

    @property
    def reconnect(self) -> float:
        """A robot that is lost is not waited for, in s."""
        return 0.0

    def options(self) -> dict[str, Any]:
        """Everything that decides, but for the advice."""
        return {"contest": self.contest, "countdown": self.countdown, "leave": self.leave, "seed": self.seed}

    def files(self) -> dict[str, bytes]:
        """The advice."""
        return {ADVICE: advice_text(self.advice).encode()}

    @classmethod
    def of_log(cls, options: Fields, files: Mapping[str, bytes]) -> Self:
        """As a log has it; see `Job.of_log`."""
        return cls(
            advice=advice_of(wanted_file(files, ADVICE)),
            contest=options.flag("contest"),
            countdown=options.number("countdown", 0, MOST_COUNTDOWN),
            leave=options.flag("leave"),
            seed=options.integer("seed", 0, MOST_SEED),
        )

    def perform(self, stage: Stage) -> Deployed:
        """Write, read back, and have it play."""
        with open_session(Junior, stage, arm=False) as session:
            memory = deploying.deploy(session.robot, self.advice)
            self.stored(session.robot.description, memory)
            deployed = Deployed(memory, self._play(session, stage) if self.contest else None)
            session.finish(deployed.facts())
        return deployed

    def _play(self, session: Session[Junior], stage: Stage) -> Contest | None:
        if session.suspension is not None:
            session.suspension.plays_on = True
        start_contest(session.robot, self.countdown)
        if not stage.quiet:
            stage.say(f"Contest: the robot stands still for {self.countdown:g} s, then it plays. Ctrl-C stops it.")
        if self.leave:
            session.robot.leave()
            return None
        return look_on(session.robot, self.countdown, self.seed, nothing if stage.quiet else stage.say)


def look_on(junior: Junior, countdown: float, seed: int, say: Callable[[str], object]) -> Contest:
    """Look on at a contest that has just been started; a robot that is out of reach is left playing.

    Args:
        junior: The robot.
        countdown: What it was started with, in s.
        seed: Decides the start poses, where there is a referee.
        say: Is told when it plays.

    Returns:
        How it ended.
    """
    told: set[State] = set()

    def each(state: State) -> None:
        if state is State.CONTEST and state not in told:
            say("It plays.")
        told.add(state)

    ended = follow_contest(junior, countdown, seed=seed, each=each)
    if ended.ending is Ending.OUT_OF_REACH:  # should it hear us all the same: a contest is not ended by the loss of its host
        junior.leave()
    return ended
