"""One bout of a tournament, with a log: two entrants in one emulated ring."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final

from hil.connecting.connecting_all import connect_all_as
from hil.jobs.options import MOST_SEED, entrant_files, entrant_from
from hil.jobs.session import begin_log, nothing_said
from hil.sumo.bouts import Bout
from hil.sumo.robots import Robots
from hil.sumo.tournament.duels import duel_url, fight

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Self

    from hil.jobs.stage import Stage
    from hil.sumo.tournament.duels import Duel
    from hil.sumo.tournament.entrants import Entrant
    from pal_advisor.fields import Fields

SEATS: Final = ("home", "away")


@dataclass(frozen=True)
class DuelJob:
    """A bout between two entrants, to be played and recorded.

    Attributes:
        home: Who has the first seat, that of Junior.
        away: Who has the second, that of the opponent.
        seed: Seed of the start poses, and of every random choice.
    """

    VERB: ClassVar[str] = "tournament"

    home: Entrant
    away: Entrant
    seed: int

    @property
    def reconnect(self) -> float:
        """Robots that are lost are not waited for, in s."""
        return 0.0

    @property
    def url(self) -> str:
        """Address of the ring."""
        return duel_url(self.seed)

    def options(self) -> dict[str, Any]:
        """Everything that decides, but for what has been learnt."""
        kinds = {seat: one.kind.value for seat, one in zip(SEATS, (self.home, self.away), strict=True)}
        return {"seed": self.seed, **kinds, "home_name": self.home.name, "away_name": self.away.name}

    def files(self) -> dict[str, bytes]:
        """What has been learnt."""
        both = zip(SEATS, (self.home, self.away), strict=True)
        return {name: data for seat, one in both for name, data in entrant_files(seat, one).items()}

    @classmethod
    def of_log(cls, options: Fields, files: Mapping[str, bytes]) -> Self:
        """As a log has it; see `Job.of_log`."""
        seed = options.integer("seed", 0, MOST_SEED)
        home, away = (entrant_from(options, seat, f"{seat}_name", seat, files) for seat in SEATS)
        return cls(home, away, seed)

    def perform(self, stage: Stage) -> Duel:
        """Play.

        Args:
            stage: The outside.
        """
        home, away = self.home.player(self.seed, 0), self.away.player(self.seed, 1)
        with ExitStack() as stack:
            stack.enter_context(stage.interrupts())
            recorder = begin_log(stack, stage)
            with nothing_said(recorder):
                robots = connect_all_as(
                    Robots,
                    self.url,
                    taps=[recorder] if recorder else [],
                    operator=stage.operator,
                    opener_of=stage.opener_of,
                )
                stack.enter_context(robots)
            if recorder is not None:
                recorder.series(f"{self.home.name} (Junior) against {self.away.name} (opponent)")
            duel = fight(robots, home, away, self.seed)
            if recorder is not None:
                recorder.bout(Bout(1, self.seed, duel.outcome, duel.time, duel.maneuvers[0]))
                recorder.note(
                    "result",
                    "done",
                    home=self.home.name,
                    away=self.away.name,
                    outcome=duel.outcome.name.lower(),
                    time=duel.time,
                    maneuvers=list(duel.maneuvers),
                )
        return duel
