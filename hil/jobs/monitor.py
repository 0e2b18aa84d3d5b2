"""A live view of one robot or several, and the keys that drive them."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Any, ClassVar, Final

from rich.console import Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from firmware_protocol.address import parse_address
from firmware_protocol.errors import PeerError, PeerLostError, RefusedError
from firmware_protocol.messages import State
from firmware_protocol.vocabulary import Stimulus
from hil.bridge.operator import KEY
from hil.connecting.connecting import asked_for
from hil.connecting.handles import RobotHandles
from hil.connecting.swarm_address import is_swarm
from hil.jobs.micro_monitor import MicroOverview
from hil.jobs.options import DAY, MOST_SEED, none_or
from hil.jobs.overview import Overview
from hil.jobs.session import Session, open_session, open_watch
from hil.jobs.stage import keys_taken_in
from hil.jobs.words import sensed
from hil.sumo.junior import STIMULUS_BITS, Junior
from hil.sumo.robots import Robots
from hil.swarm.robot import MicroRobot
from hil.terminal.suspending import around_stop

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from typing import Self

    from rich.console import Console

    from firmware_protocol.messages import JuniorSensors
    from hil.bridge.operator import Operator
    from hil.jobs.stage import Stage
    from pal_advisor.fields import Fields

DRIVE_TIME: Final = 0.3
"""A key drives for this long, in s; holding it down repeats it."""
SPEED, TURN = 0.6, 0.35
DRIVES: Final = {"^": (SPEED, SPEED), "v": (-SPEED, -SPEED), "<": (-TURN, TURN), ">": (TURN, -TURN)}
STOPS: Final = "Ee "
"""The keys that stop, the hardest first: all robots, this robot, and its wheels alone."""
QUIT: Final = "q\x03\x04"
HELP: Final = "a arm   d disarm   arrows drive   space stop   e emergency stop   q quit"
LOCKSTEP_DURATION: Final = 10.0
"""How much is shown of what runs faster than time, in s."""
IN_LOCKSTEP: Final = "An emulated robot in this process runs faster than time: shown are its first 10 s."
LINE_EVERY: Final = 1.0
"""Without a terminal a line is printed this often, in s."""
LONGEST: Final = 1e9
"""No longer look is asked for, in s."""


@dataclass(frozen=True)
class MonitorJob:
    """Robots to be looked at.

    Attributes:
        duration: For how long, in s; None is until the operator has enough, or for `LOCKSTEP_DURATION` in lock-step.
        seed: Seed of an emulated robot in this process.
        reconnect: How long a robot or link that is lost is waited for, in s.
        silent: Nothing is shown: there is a result at the end only.
        micro: The robots are micro-robots; those of an emulated swarm are in any case.
        robot: The only micro-robot to be shown, as `3` or `2.3`; empty: all.
    """

    VERB: ClassVar[str] = "monitor"

    duration: float | None
    seed: int
    reconnect: float
    silent: bool = False
    micro: bool = False
    robot: str = ""

    def options(self) -> dict[str, Any]:
        """Everything that decides."""
        of_swarm = {"micro": self.micro, "robot": self.robot} if self.micro or self.robot else {}
        return {"duration": self.duration, "seed": self.seed, "reconnect": self.reconnect, **of_swarm}

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
            micro=options.has("micro") and options.flag("micro"),
            robot=options.text("robot") if options.has("robot") else "",
        )

    def perform(self, stage: Stage) -> dict[str, object] | list[dict[str, object]]:
        """Show them, and do what the keys ask; what `--json` prints of them in the end."""
        view = _View(stage.console, self.silent or stage.quiet)
        if self.micro or is_swarm(parse_address(stage.url)):
            with open_watch(stage, make=partial(RobotHandles, MicroRobot), reconnect=self.reconnect) as (micro_robots, _):
                which = self.robot
                if not which and len(micro_robots) == 1:
                    which = MicroOverview(micro_robots).name(next(iter(micro_robots)))
                micro_overview = MicroOverview(micro_robots, which)
                _look(micro_overview, micro_robots, stage, view, self.duration)
                return micro_overview.document()
        if may_be_several(stage.url):
            with open_watch(stage, make=Robots, reconnect=self.reconnect) as (robots, recorder):
                members = list(robots)
                if len(members) > 1:
                    overview = Overview(robots, lambda junior, key: obey(Session(junior, recorder), key))
                    _look(overview, robots, stage, view, self.duration)
                    return [_plain(junior) for junior in overview.members if junior.latest is not None]
                members[0].take()
                _watch(Session(members[0], recorder), stage, view, self.duration)
                return _plain(members[0])
        with open_session(Junior, stage, arm=False, reconnect=self.reconnect) as session:
            duration = self.duration
            if session.lockstep and duration is None:
                duration = LOCKSTEP_DURATION
                stage.console.print(IN_LOCKSTEP)
            _watch(session, stage, view, duration)
            return _plain(session.robot)


def may_be_several(link: str) -> bool:
    """The address leaves open which robot is meant, and it is not one alone in this process.

    Args:
        link: The address.
    """
    address = parse_address(link)
    return asked_for(address) is None and (address.scheme != "sim" or "count" in address.options)


class _View:
    """How it is shown: live on a terminal, else a line now and then.

    Args:
        console: Where to.
        silent: Nothing is shown.
    """

    def __init__(self, console: Console, silent: bool) -> None:  # noqa: FBT001 - one of two
        self.console = console
        self.live = console.is_terminal and not silent
        self.lines = not silent and not self.live

    @contextmanager
    def display(self) -> Iterator[Live]:
        """What is drawn again and again; while the program is stopped, the cursor is given back."""
        with (
            Live(console=self.console, auto_refresh=False, transient=False) as display,
            around_stop(display.stop, display.start),
        ):
            yield display


def _pressed(operator: Operator) -> str:
    """The keys to obey, of those that the steps have taken in."""
    return worth_obeying("".join(one.what.removeprefix(KEY) for one in operator.pressed()))


def _look(
    overview: Overview | MicroOverview, robots: RobotHandles[Any], stage: Stage, view: _View, duration: float | None
) -> None:
    """Show several robots."""
    if duration is None and all(bridge.link.lockstep for bridge in robots.networks.bridges.values()):
        duration = LOCKSTEP_DURATION
        stage.console.print(IN_LOCKSTEP)
    end = None if duration is None else robots.now() + duration
    line_due = robots.now()
    with keys_taken_in(stage, overview.aim), view.display() as display:
        while end is None or robots.now() < end:
            robots.step()
            overview.step()
            for key in _pressed(stage.operator):
                if key in QUIT:
                    return
                overview.press(key)
            if view.live:
                display.update(overview.view(), refresh=True)
            elif view.lines and robots.now() >= line_due:
                line_due = robots.now() + LINE_EVERY
                stage.console.print(f"{robots.now():.2f} s", *overview.lines(), sep="\n", markup=False)


def _watch(session: Session[Junior], stage: Stage, view: _View, duration: float | None) -> None:
    """Show one robot."""
    junior = session.robot
    end = None if duration is None else junior.now() + duration
    line_due = junior.now()
    refusal = ""
    robot = str(junior.peer.system)
    with keys_taken_in(stage, lambda keys: [robot] * len(keys)), view.display() as display:
        while end is None or junior.now() < end:
            junior.step()
            for key in _pressed(stage.operator):
                if key in QUIT:
                    return
                refusal = obey(session, key)
            try:
                _shown(junior)
            except PeerLostError:  # it was lost before its first reading came
                continue
            if view.live:
                display.update(_table(junior, refusal), refresh=True)
            elif view.lines and junior.now() >= line_due:
                line_due = junior.now() + LINE_EVERY
                stage.console.print(_line(junior), markup=False)


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


def obey(session: Session[Junior], key: str) -> str:
    """Do what a key asks.

    Args:
        session: The robot that it is for.
        key: The key.

    Returns:
        Why the robot refused; empty when it did not.
    """
    junior = session.robot
    try:
        match key:
            case "a":
                junior.arm()
            case "d":
                junior.disarm()
            case "e" | "E":
                junior.emergency_stop()
            case " ":
                junior.stop()
            case _ if key in DRIVES:
                junior.drive(*DRIVES[key], DRIVE_TIME)
            case _:
                pass
    except RefusedError as error:
        if session.recorder is not None:
            session.recorder.note("safety", str(error))
        return str(error)
    except PeerError as error:  # it may be back, and the next key may reach it
        return str(error)
    return ""


def _shown(junior: Junior) -> JuniorSensors:
    """The latest reading, however old: `_warning` says so. The first is waited for."""
    return junior.latest or junior.sensors


def _line(junior: Junior) -> str:
    sensors, counters = _shown(junior), junior.peer.counters
    state = junior.state.name.lower() if junior.peer.ready else "not heard" if junior.bridge.lost is None else "no link"
    return (
        f"{sensors.time:8.2f} s  {state:10}  eyes {sensors.eye[0]:4} {sensors.eye[1]:4}  "
        f"floor {sensors.floor[0]:4} {sensors.floor[1]:4}  battery {sensors.battery:.2f} V  senses {sensed(sensors.flags)}  "
        f"frames {counters.good}, lost {counters.lost}, rejected {counters.rejected}"
        f"{'  ' if (warning := _warning(junior)) else ''}{warning}"
    )


def _table(junior: Junior, refusal: str) -> Group:
    sensors, counters = _shown(junior), junior.peer.counters
    table = Table(title=junior.description, title_justify="left", show_header=True, box=None)
    for head in ("", "left", "right"):
        table.add_column(head, justify="right" if head else "left")
    table.add_row("eye (counts)", str(sensors.eye[0]), str(sensors.eye[1]))
    table.add_row("floor (counts)", str(sensors.floor[0]), str(sensors.floor[1]))
    table.add_row("travel (mm)", f"{sensors.travel[0] * 1000:.0f}", f"{sensors.travel[1] * 1000:.0f}")
    latency = f"{counters.latency * 1000:.1f} ms" if counters.answers else "-"
    return Group(
        table,
        f"senses: {sensed(sensors.flags)}",
        f"state: {junior.state.name.lower()}{' (armed)' if junior.armed else ''}   battery {sensors.battery:.2f} V"
        f"{'   EMERGENCY STOP: d, then a' if junior.state is State.STOPPED else ''}",
        f"link: {counters.good} frames, {counters.lost} lost, {counters.rejected} rejected, "
        f"{counters.retries} repeated, answer in {latency}",
        _warning(junior),
        Text(refusal),
        HELP,
    )


def _warning(junior: Junior) -> str:
    """What makes the readings old; empty when they are not."""
    if not junior.stale:
        return ""
    old = f"these readings are {junior.age:.1f} s old"
    if junior.peer.ready:
        return f"NO READINGS COME, stopped by another client: {old}"
    if junior.bridge.lost is not None:
        return f"LINK LOST, trying to open it again: {old}"
    return f"NOT HEARD ANY MORE: {old}"


def _plain(junior: Junior) -> dict[str, object]:
    sensors, counters = _shown(junior), junior.peer.counters
    return {
        "system": junior.peer.system,
        "state": junior.state.name.lower(),
        "armed": junior.armed,
        "time": sensors.time,
        "age_s": junior.age,
        "stale": junior.stale,
        "eye": list(sensors.eye),
        "floor": list(sensors.floor),
        "travel": list(sensors.travel),
        "battery": sensors.battery,
        "stimulus": Stimulus(sensors.flags & STIMULUS_BITS).label,
        "link": {
            "good": counters.good,
            "lost": counters.lost,
            "rejected": counters.rejected,
            "retries": counters.retries,
            "latency_s": counters.latency if counters.answers else None,
        },
    }
