"""Bouts, played and counted."""

from __future__ import annotations

from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, ClassVar, Final

from firmware_protocol.messages import BoutOutcome
from hil.jobs.options import DAY, MOST_SEED, none_or, opponent_of, wanted_file
from hil.jobs.session import ADVICE, POLICY, Session, open_session
from hil.jobs.stage import keys_taken_in
from hil.policies import PolicyDriver, policy_of, policy_text
from hil.seeds import Branch, bout_seed, generator
from hil.sumo.advice_file import advice_of, advice_text
from hil.sumo.attended import JudgedRing, PausedRing
from hil.sumo.bouts import Bout, Tally, play
from hil.sumo.controllers import BUILT_IN, AdviceController, Controller
from hil.sumo.junior import Junior
from hil.sumo.ring import Ring, RingError, open_ring
from hil.terminal.bars import bar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from contextlib import AbstractContextManager
    from typing import Self

    from rich.console import Console

    from hil.jobs.stage import Stage
    from hil.policies import Policy
    from hil.sumo.controllers import Driver
    from pal_advisor.fields import Fields
    from pal_advisor.maneuvers import Advice

MOST_TRIALS: Final = 100_000


class ControllerName(StrEnum):
    """Who chooses the maneuvers."""

    ADVICE = "advice"
    POLICY = "policy"
    CHASE = "chase"
    CHASE2 = "chase2"
    HOBBY = "hobby"
    RANDOM = "random"


TITLES: Final = {
    ControllerName.ADVICE: "the advice",
    ControllerName.POLICY: "the policy",
    ControllerName.CHASE: "chasing",
    ControllerName.CHASE2: "chasing and ramming",
    ControllerName.HOBBY: "a hobby robot's state machine",
    ControllerName.RANDOM: "random maneuvers",
}


@dataclass(frozen=True)
class BoutJob:
    """Bouts to be played.

    Attributes:
        controller: Who chooses the maneuvers.
        advice: What to play by, where it is an advice.
        trials: Bouts to play.
        opponent: Opponent to place; None keeps the one that is there.
        seed: Seed of every random choice.
        reconnect: How long a robot or link that is lost is waited for, in s.
        first: Number of the first bout in its series: these may be a part of one that is played in parts.
        judged: A person sets the ring up, and says how each bout ends.
        pauses: A person who looks on may have the run pause.
        policy: What to drive by, where it is a policy.
    """

    VERB: ClassVar[str] = "bout"

    controller: ControllerName
    advice: Advice | None
    trials: int
    opponent: str | None
    seed: int
    reconnect: float
    first: int = 1
    judged: bool = False
    pauses: bool = False
    policy: Policy | None = None

    def options(self) -> dict[str, Any]:
        """Everything that decides, but for advice and policy."""
        return {
            **({"first": self.first} if self.first > 1 else {}),
            **({"judged": True} if self.judged else {}),
            **({"pauses": True} if self.pauses else {}),
            "controller": self.controller.value,
            "trials": self.trials,
            "opponent": self.opponent,
            "seed": self.seed,
            "reconnect": self.reconnect,
        }

    def files(self) -> dict[str, bytes]:
        """The advice, or the policy."""
        if self.policy is not None:
            return {POLICY: policy_text(self.policy).encode()}
        return {} if self.advice is None else {ADVICE: advice_text(self.advice).encode()}

    @classmethod
    def of_log(cls, options: Fields, files: Mapping[str, bytes]) -> Self:
        """As a log has it; see `Job.of_log`."""
        controller = options.one_of("controller", ControllerName)
        advice = advice_of(wanted_file(files, ADVICE)) if controller is ControllerName.ADVICE else None
        return cls(
            controller=controller,
            advice=advice,
            trials=options.integer("trials", 1, MOST_TRIALS),
            opponent=none_or(options, "opponent", opponent_of),
            seed=options.integer("seed", 0, MOST_SEED),
            reconnect=options.number("reconnect", 0, DAY),
            first=options.integer("first", 1, MOST_TRIALS) if options.has("first") else 1,
            judged=options.flag("judged", missing=False),
            pauses=options.flag("pauses", missing=False),
            policy=policy_of(wanted_file(files, POLICY)) if controller is ControllerName.POLICY else None,
        )

    def parts(self, size: int) -> list[BoutJob]:
        """The same bouts as several jobs, which know nothing of each other.

        Args:
            size: Bouts of each; the last may have fewer.
        """
        end = self.first + self.trials
        return [replace(self, first=first, trials=min(size, end - first)) for first in range(self.first, end, size)]

    def perform(self, stage: Stage) -> Tally:
        """Play, and count."""
        return Tally.of(*self.play(stage))

    def play(self, stage: Stage) -> tuple[str, list[Bout]]:
        """Play.

        Args:
            stage: The outside.

        Returns:
            Name of the opponent, and the bouts.
        """
        with open_session(Junior, stage, reconnect=self.reconnect, arm=not self.judged) as session, self._keys(stage):
            ring = self._ring(session, stage)
            bouts = self._play(session, stage, ring)
            session.finish({"controller": self.controller.value, **Tally.of(ring.opponent, bouts).to_dict()})
        return ring.opponent, bouts

    def _keys(self, stage: Stage) -> AbstractContextManager[None]:
        """Inside, a person who judges may do it by keys."""
        return keys_taken_in(stage) if self.judged else nullcontext()

    def _ring(self, session: Session[Junior], stage: Stage) -> Ring:
        """The ring, with the person beside it, if one is."""
        if self.judged:
            return JudgedRing(session.robot, session.questions(stage.say), self.opponent)
        ring = open_ring(session.robot, self.opponent)
        return PausedRing(ring, session.robot, session.questions()) if self.pauses else ring

    def _player(self) -> Controller | Driver:
        if self.policy is not None:
            return PolicyDriver(self.policy)
        if self.controller is ControllerName.ADVICE:
            assert self.advice is not None
            return AdviceController(self.advice)
        part = (self.first,) if self.first > 1 else ()
        return BUILT_IN[self.controller.value](generator(self.seed, Branch.CONTROLLER, *part))

    def _play(self, session: Session[Junior], stage: Stage, ring: Ring) -> list[Bout]:
        if not ring.refereed:
            raise RingError(
                "a bout needs a referee who says how it ends, and nobody answers as one: use an emulated robot, or --judge"
            )
        numbers = range(self.first, self.first + self.trials)
        seeds = [bout_seed(self.seed, Branch.BOUTS, number) for number in numbers]
        bouts: list[Bout] = []
        session.series(f"bouts played by {TITLES[self.controller]}")
        with counting(stage.console, self.trials, quiet=stage.quiet) as count:
            for one in play(ring, self._player(), seeds, self.first):
                bouts.append(one)
                session.bout(one)
                count(one)
        return bouts


@contextmanager
def counting(console: Console, trials: int, *, quiet: bool) -> Iterator[Callable[[Bout], None]]:
    """Inside, a bar shows on a terminal how far bouts are; gives what is told of each.

    Args:
        console: Where.
        trials: Bouts to be played.
        quiet: Show nothing.
    """
    with bar(console, shown=console.is_terminal and not quiet) as progress:
        task = progress.add_task("Playing", total=trials)
        played = won = 0

        def count(bout: Bout) -> None:
            nonlocal played, won
            played += 1
            won += bout.outcome is BoutOutcome.WIN
            progress.update(task, advance=1, description=f"Playing: won {won} of {played}")

        yield count
