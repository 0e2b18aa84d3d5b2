"""A view of one robot or several, and the keys that drive them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any, ClassVar, Final

from firmware_protocol.address import parse_address
from firmware_protocol.roles.swarm import MICRO_ROBOT
from hil.bridge.operator import KEY
from hil.connecting.swarm_address import is_swarm
from hil.jobs.options import DAY, MOST_SEED, none_or
from hil.jobs.stage import keys_taken_in
from hil.jobs.watched.dead_man import HOLD
from hil.jobs.watched.juniors import JuniorsWatch
from hil.jobs.watched.micro_robots import MicroRobotsWatch
from hil.jobs.watched.one_role import LONGEST, OfOneRole, open_one_role, refusals_noted, shared

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Self

    from hil.bridge.operator import Operator
    from hil.jobs.stage import Stage, Window
    from hil.recording.recorder import Recorder
    from pal_advisor.fields import Fields

STOPS: Final = "Ee "
"""The keys that stop, the hardest first: all robots, this robot, and wheels alone."""
QUIT: Final = "q\x03\x04"
BOUT: Final = "b"
LOCKSTEP_DURATION: Final = 10.0
"""How much is shown of what runs faster than time, in s."""
IN_LOCKSTEP: Final = "An emulated robot in this process runs faster than time: shown are its first 10 s."
ONLY_WATCHED: Final = "The robots are only watched: the first key that arms or moves one takes it, which stops and disarms it"
LINE_EVERY: Final = 1.0
"""Without a display a line is printed this often, in s."""
LEAVING: Final = 1.0
"""So long what keys have asked for last may take when the view is left, in s."""


@dataclass(frozen=True)
class MonitorJob:
    """Robots to be looked at.

    Attributes:
        duration: For how long, in s; None is until the operator has enough, or for `LOCKSTEP_DURATION` in lock-step.
        seed: Seed of an emulated robot in this process.
        reconnect: How long a robot or link that is lost is waited for, in s.
        silent: Nothing is shown: there is a result at the end only.
        micro: Only micro-robots are looked at; else those of the role that is heard first.
        robot: The only micro-robot to be shown, as `3` or `2.3`; empty: all.
        live: It is looked at on a terminal: an emulated robot in this process runs in real time, and until somebody leaves.
        hold: Driving ends so long after the last key, in s; None: as logs of before have it.
    """

    VERB: ClassVar[str] = "monitor"

    duration: float | None
    seed: int
    reconnect: float
    silent: bool = False
    micro: bool = False
    robot: str = ""
    live: bool = False
    hold: float | None = HOLD

    def options(self) -> dict[str, Any]:
        """Everything that decides."""
        of_swarm = {"micro": self.micro, "robot": self.robot} if self.micro or self.robot else {}
        return {
            "duration": self.duration,
            "seed": self.seed,
            "reconnect": self.reconnect,
            "live": self.live,
            "hold": self.hold,
            **of_swarm,
        }

    def files(self) -> dict[str, bytes]:
        """None."""
        return {}

    @classmethod
    def of_log(cls, options: Fields, files: Mapping[str, bytes]) -> Self:  # noqa: ARG003 - it has none
        """As a log has it; see `Job.of_log`."""
        return cls(
            duration=none_or(options, "duration", lambda fields, name: fields.number(name, 0.0, LONGEST)),
            seed=options.integer("seed", 0, MOST_SEED),
            reconnect=options.number("reconnect", 0, DAY),
            silent=True,
            micro=options.flag("micro", missing=False),
            robot=options.text("robot") if options.has("robot") else "",
            live=options.flag("live", missing=False),
            hold=options.number("hold", 0.0, LONGEST) if options.has("hold") else None,
        )

    def perform(self, stage: Stage) -> dict[str, object] | list[dict[str, object]]:
        """Show them, and do what the keys ask; what `--json` prints of them in the end."""
        only = MICRO_ROBOT if self.micro or self.robot or is_swarm(parse_address(stage.url)) else None
        with stage.window() as window, open_one_role(stage, only, self.reconnect) as (robots, recorder):
            watch = self._watch(robots, recorder, stage)
            _View(stage, window, self).look(watch, robots)
            return watch.document()

    def _watch(self, robots: OfOneRole, recorder: Recorder | None, stage: Stage) -> JuniorsWatch | MicroRobotsWatch:
        """What is to be seen of the robots that are there."""
        members, refused = list(robots), refusals_noted(recorder)
        if robots.role is MICRO_ROBOT:
            which = self.robot
            if not which and len(robots) == 1:
                which = MicroRobotsWatch(robots).name(members[0])
            return MicroRobotsWatch(robots, which, tell=stage.tell, refused=refused)
        if len(members) == 1 and not shared(robots):
            members[0].take()
            if recorder is not None and members[0].bridge.link.lockstep:
                recorder.metadata("robot", {name: f"{value:g}" for name, value in members[0].parameters().items()})
        return JuniorsWatch(robots, tell=stage.tell, refused=refused, seed=self.seed, hold=self.hold)


class _View:
    """Serves the robots, obeys keys, and shows them: in a window, else by a line now and then.

    Args:
        stage: The outside.
        window: Where they are shown; None: nowhere.
        job: What was asked for.
    """

    def __init__(self, stage: Stage, window: Window | None, job: MonitorJob) -> None:
        self._stage = stage
        self._window = window
        self._job = job
        self._silent = job.silent or stage.quiet
        self._line_due = float("-inf")

    def look(self, watch: JuniorsWatch | MicroRobotsWatch, robots: OfOneRole) -> None:
        """Look at them until the time is over, or somebody has had enough.

        Args:
            watch: What is to be seen of them.
            robots: The robots.
        """
        stage, duration = self._stage, self._job.duration
        lockstep = all(bridge.link.lockstep for bridge in robots.networks.bridges.values())
        if lockstep and self._job.live:
            watch.press(BOUT)
        elif lockstep and duration is None:
            duration = LOCKSTEP_DURATION
            stage.console.print(IN_LOCKSTEP)
        if said := shared(robots):
            stage.say(f"{next(iter(robots.networks.bridges))}: {said}")
        elif self._window is not None:
            ours = any(robot.peer.taken for robot in robots)
            stage.say("It is disarmed: a arms it, arrows drive it, ? shows all keys" if ours else ONLY_WATCHED)
        end = None if duration is None else robots.now() + duration
        with keys_taken_in(stage, watch.aim):
            while end is None or robots.now() < end:
                waiting = self._job.hold is None and watch.busy  # in logs of before a key waited for what was asked before it
                robots.step()
                if lockstep and self._job.live:
                    stage.pace(robots.now())
                for key in "" if waiting else _pressed(stage.operator):
                    if key in QUIT:
                        self._leave(watch, robots)
                        return
                    watch.press(key)
                watch.step()
                self._show(watch, robots.now())

    def _leave(self, watch: JuniorsWatch | MicroRobotsWatch, robots: OfOneRole) -> None:
        """Have answered what was asked for last: a stop, as like as not."""
        end = robots.now() + LEAVING
        while watch.busy and robots.now() < end:
            robots.step()
            watch.step()

    def _show(self, watch: JuniorsWatch | MicroRobotsWatch, now: float) -> None:
        if self._window is not None and self._window.there:
            if self._window.wanting:
                self._window.show(watch.picture())
        elif not self._silent and now >= self._line_due and (lines := watch.lines()):
            self._line_due = now + LINE_EVERY
            if len(lines) > 1:
                lines.insert(0, f"{now:.2f} s")
            self._stage.console.print(*lines, sep="\n", markup=False)


def _pressed(operator: Operator) -> str:
    """The keys to obey, of those that the steps have taken in."""
    return worth_obeying("".join(one.what.removeprefix(KEY) for one in operator.pressed()))


def worth_obeying(keys: str) -> str:
    """Of the keys pressed since the last look, those that still matter.

    A key held down repeats faster than a bad line answers: it counts once, or the robot would go on after it was let go.
    What was pressed before a stop is not done at all; of several stops the hardest counts, wherever it was pressed, so that a
    space bar behind it does not make a mere stop of an emergency stop. To leave is never forgotten.

    Args:
        keys: What was pressed, in order.
    """
    stops = [key for key in keys if key in STOPS]
    if not stops:
        return "".join(key for key, _ in groupby(keys))
    last_stop = max(keys.rfind(key) for key in STOPS)
    after = "".join(key for key, _ in groupby(keys[last_stop + 1 :]))
    left = "".join(key for key in keys[:last_stop] if key in QUIT)[:1]
    return min(stops, key=STOPS.index) + (left or after)
