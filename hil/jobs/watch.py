"""Robots that somebody else controls, or nobody: looked at on the live page, and stopped from there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from firmware_protocol.address import parse_address
from firmware_protocol.roles.swarm import MICRO_ROBOT
from hil.connecting.swarm_address import is_swarm
from hil.jobs.options import DAY, none_or
from hil.jobs.watched.juniors import JuniorsWatch
from hil.jobs.watched.micro_robots import MicroRobotsWatch
from hil.jobs.watched.one_role import LONGEST, OfOneRole, open_one_role, refusals_noted, shared

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Self

    from hil.jobs.stage import Stage
    from hil.recording.recorder import Recorder
    from pal_advisor.fields import Fields


@dataclass(frozen=True)
class WatchJob:
    """Robots to be looked at, and left alone: no session is opened, and none is stopped or disarmed by that.

    Attributes:
        duration: For how long, in s; None is until somebody ends it.
        reconnect: How long a link that is lost is waited for, in s.
        seed: Nothing is drawn by chance: of no meaning.
    """

    VERB: ClassVar[str] = "view"

    duration: float | None
    reconnect: float
    seed: int = 0

    def options(self) -> dict[str, Any]:
        """Everything that decides."""
        return {"duration": self.duration, "reconnect": self.reconnect}

    def files(self) -> dict[str, bytes]:
        """None."""
        return {}

    @classmethod
    def of_log(cls, options: Fields, files: Mapping[str, bytes]) -> Self:  # noqa: ARG003 - it has none
        """As a log has it; see `Job.of_log`."""
        return cls(
            duration=none_or(options, "duration", lambda fields, name: fields.number(name, 0.0, LONGEST)),
            reconnect=options.number("reconnect", 0, DAY),
        )

    def perform(self, stage: Stage) -> int:
        """Look at them until the time is over; how many there are. Whoever looks on may stop all, as on every watched link."""
        only = MICRO_ROBOT if is_swarm(parse_address(stage.url)) else None
        with open_one_role(stage, only, self.reconnect) as (robots, recorder):
            watch = _watch(robots, recorder, stage)
            if stage.tell is not None:
                who = f"{len(robots)} robots on {stage.url}" if len(robots) > 1 else next(iter(robots)).description
                stage.tell(f"Watching {who}. Ctrl-C ends it.")
                if said := shared(robots):
                    stage.tell(f"{stage.url}: {said}")
            end = float("inf") if self.duration is None else robots.now() + self.duration
            while robots.now() < end:
                robots.step()
                watch.step()
            return len(robots)


def _watch(robots: OfOneRole, recorder: Recorder | None, stage: Stage) -> JuniorsWatch | MicroRobotsWatch:
    """What is to be seen of the robots that are there: micro-robots are asked, Juniors tell by themselves."""
    refused = refusals_noted(recorder)
    if robots.role is MICRO_ROBOT:
        return MicroRobotsWatch(robots, tell=stage.tell, refused=refused)
    return JuniorsWatch(robots, tell=stage.tell, refused=refused)
