"""Micro-robots at a glance, for `hil monitor`: all of them or one in full, and what keys do to the chosen one."""

from __future__ import annotations

from collections import defaultdict
from functools import partial
from math import degrees, radians
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import NoRobotError, RefusedError
from firmware_protocol.events import Received
from firmware_protocol.messages import State, SwarmObservation, TableState
from firmware_protocol.roles.swarm import longest_time, move, observe
from firmware_protocol.vocabulary import Move, MoveOption, RobotClass
from hil.bridge.networks import RobotAddress
from hil.cockpit.snapshot import Body, Fact, Figure, PlanView, Row, Snapshot, Tone
from hil.connecting.handle import answered
from hil.jobs.watched.junior_words import ONLY_WATCHED
from hil.jobs.watched.orders import OrderQueue, taken
from hil.jobs.watched.quality import Quality

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from firmware_protocol.errors import HilError
    from firmware_protocol.events import Event
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from hil.connecting.handles import RobotHandles
    from hil.swarm.robot import MicroRobot

EVERY: Final = 0.5
"""Each robot is asked what it observes so often, in s."""
HOLD: Final = 0.25
"""A key that moves is forgotten after so long, in s."""
STEP: Final = 0.04
TURN: Final = radians(15.0)
"""How far a key moves and turns, in m and rad."""
SPEED, TURN_SPEED = 0.2, 6.28
"""How fast, in m/s and rad/s: what a key begins is over within 0.25 s."""
_AHEAD: Final = MoveOption.BODY | MoveOption.STOP_ON_CONTACT | MoveOption.SENSE
MOVES: Final = {
    "^": Move(STEP, 0.0, options=_AHEAD),
    "v": Move(STEP, 0.0, options=_AHEAD | MoveOption.BACKWARD),
    "<": Move(0.0, TURN, options=_AHEAD),
    ">": Move(0.0, -TURN, options=_AHEAD),
}
STAND: Final = Move(0.0, 0.0, options=_AHEAD)
HELP: Final = (
    ("a", "arm"), ("arrows", "move"), ("space", "stop all"), ("e", "emergency stop"), ("d", "disarm"),
    ("E", "emergency stop of all"),
)  # fmt: skip
HELP_MANY: Final = (("n p", "choose"), *HELP)
HELP_SHARED: Final = (("n p", "choose"), ("e", "emergency stop"), ("E", "emergency stop of all"))
"""Where another program drives, and shares its link."""
_BODY, _BOX = 0.02, 0.08
"""Radius that a robot and the box are drawn with, in m."""
_FIGURES: Final = {RobotClass.RANGER: Figure.RANGER, RobotClass.WILD: Figure.WILD}
_HEADS: Final = ("robot", "class", "state", "x y (m)", "heading", "radius", "RANGERs", "WILDs", "fix", "lost")


class MicroRobotsWatch:
    """What there is to see of micro-robots, and what keys do to the chosen one.

    Keys are obeyed bit by bit, in `step`: nothing here waits for an answer.

    Args:
        robots: The robots, watched.
        which: The only one to be shown, as `3` or, where there are several networks, `2.3`; empty: all.
        tell: Says what is worth to be known; None: nobody wants to know.
        refused: Is told why a robot did not obey.

    Raises:
        NoRobotError: There is no such robot.
    """

    def __init__(
        self,
        robots: RobotHandles[MicroRobot],
        which: str = "",
        *,
        tell: Callable[[str], object] | None = None,
        refused: Callable[[HilError], object] | None = None,
    ) -> None:
        self._robots = robots
        self._tell = tell
        self._refused = refused
        self._asked: dict[MicroRobot, Ticket[SwarmObservation]] = {}
        self._seen: dict[MicroRobot, SwarmObservation] = {}
        self._orders: defaultdict[MicroRobot, OrderQueue] = defaultdict(OrderQueue)
        self._moving: dict[MicroRobot, Ticket[SwarmObservation]] = {}
        self._quality: defaultdict[MicroRobot, Quality] = defaultdict(Quality)
        self._area: tuple[float, float, float, float] | None = None
        self._table: TableState | None = None
        self._due = robots.now()
        self._alone = bool(which)
        self._chosen = self.members[0]
        if which:
            by_name = {self.name(robot): robot for robot in self.members}
            if which not in by_name:
                raise NoRobotError(f"there is no robot {which}: there are {', '.join(by_name)}")
            self._chosen = by_name[which]
        robots.listen(self._hear)

    def _hear(self, network: str, event: Event) -> None:
        """Take in what is said of the table, and to others."""
        if not isinstance(event, Received):
            return
        if type(event.message) is TableState:
            self._table = event.message
        elif type(event.message) is SwarmObservation:  # on a shared link it is another program that asks for them
            robot = self._robots.members.get(RobotAddress(network, event.system))
            if robot is not None and robot.bridge.acquaintances.shared:
                self._seen[robot] = event.message

    # --- who is there ------------------------------------------------------------------------------------------------

    @property
    def members(self) -> list[MicroRobot]:
        """Every robot that is or was there, network by network."""
        order = list(self._robots.networks.bridges)
        return sorted(
            self._robots.members.values(), key=lambda robot: (order.index(robot.address.network), robot.address.system)
        )

    @property
    def shown(self) -> list[MicroRobot]:
        """Those that are looked at."""
        return [self._chosen] if self._alone else self.members

    def name(self, robot: MicroRobot) -> str:
        """As `3`, or `2.3` where there are several networks."""
        networks = list(self._robots.networks.bridges)
        system = robot.address.system
        return str(system) if len(networks) == 1 else f"{networks.index(robot.address.network) + 1}.{system}"

    def aim(self, keys: str) -> list[str]:
        """For which robot each of several keys is: see `Overview.aim`."""
        members, aimed = self.members, []
        chosen = members.index(self._chosen)
        for key in keys:
            if key in "np" and not self._alone:
                chosen = (chosen + (1 if key == "n" else -1)) % len(members)
            aimed.append("" if key == "E" else str(members[chosen].peer.system))
        return aimed

    # --- what keys do ------------------------------------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """Something that was asked for has not been answered yet."""
        return any(orders.open for orders in self._orders.values())

    def press(self, key: str) -> None:
        """Begin what a key asks. The first that moves a robot takes it: by that it is stopped and disarmed, and no other is.

        What stops is begun at once, and what was asked for before is not done any more.

        Args:
            key: The key.
        """
        robot = self._chosen
        match key:
            case "n" | "p" if not self._alone:
                members = self.members
                self._chosen = members[(members.index(robot) + (1 if key == "n" else -1)) % len(members)]
            case "E":
                self._robots.call_emergency_stop()
                for each in self.members:
                    self._orders[each].instead(partial(self._stopping, each))
            case "e":
                self._orders[robot].instead(partial(self._stopping, robot))
            case "d":
                self._orders[robot].instead(partial(self._disarming, robot))
            case " ":
                for each in self.members:
                    if each.peer.taken or each is robot:
                        self._orders[each].instead(partial(self._begin, each, STAND))
            case "a":
                self._orders[robot].give(partial(self._arming, robot))
            case _ if key in MOVES:
                self._orders[robot].give(partial(self._begin, robot, MOVES[key]))
        self._go_on()

    def _stopping(self, robot: MicroRobot) -> Iterator[None]:
        yield from answered(robot.ask_emergency_stop())
        self._say(f"robot {self.name(robot)} has stopped, and says so: emergency stop")

    def _disarming(self, robot: MicroRobot) -> Iterator[None]:
        yield from answered(robot.ask_disarm())
        self._say(f"robot {self.name(robot)} is disarmed")

    def _arming(self, robot: MicroRobot) -> Iterator[None]:
        yield from taken(robot)
        yield from robot.arming()
        self._say(f"robot {self.name(robot)} is armed")

    def _begin(self, robot: MicroRobot, what: Move) -> Iterator[None]:
        """Have it move, unless the key is no longer pressed by then; how that ends is seen later."""
        pressed = self._robots.now()
        yield from taken(robot)
        if what is STAND or self._robots.now() - pressed <= HOLD:
            self._moving[robot] = move(robot.peer, what, longest_time(what, SPEED, TURN_SPEED))

    def step(self) -> None:
        """Ask those that are looked at what they observe, now and then, and go on with what keys have asked for."""
        for robot, ticket in list(self._asked.items()):
            if ticket.done:
                del self._asked[robot]
                if ticket.error is None and ticket.result is not None:
                    self._seen[robot] = ticket.result
        if (now := self._robots.now()) >= self._due:
            self._due = now + EVERY
            for robot in self.shown:
                if robot not in self._asked and robot.peer.ready and not robot.bridge.acquaintances.shared:
                    self._asked[robot] = observe(robot.peer)
        self._go_on()

    def _go_on(self) -> None:
        """Go on with what keys have asked for."""
        for orders in self._orders.values():
            for error in orders.step():
                self._say_refused(error)
        for robot, ticket in list(self._moving.items()):
            if ticket.done:
                del self._moving[robot]
                if isinstance(ticket.error, RefusedError):
                    self._say_refused(ticket.error)

    def _say_refused(self, error: HilError) -> None:
        if self._refused is not None:
            self._refused(error)
        self._say(str(error))

    def _say(self, text: str) -> None:
        if self._tell is not None:
            self._tell(text)

    # --- what there is to see ----------------------------------------------------------------------------------------

    def picture(self) -> Snapshot:
        """What is to be seen now."""
        robot, now = self._chosen, self._robots.now()
        for each in self.shown:
            self._quality[each].look(now, each.peer.counters)
        many = not self._alone
        members = self.members
        state, tone = _doing(robot)
        return Snapshot(
            title=f"{len(members)} micro-robots on {', '.join(self._robots.networks.bridges)}" if many else robot.description,
            now=now,
            state=f"robot {self.name(robot)}: {state}",
            tone=tone,
            facts=(*self._facts(robot), *self._quality[robot].facts(now, robot.peer.counters)),
            ground=self._ground(),
            heads=_HEADS if many else (),
            rows=tuple(Row(self._cells(each), _doing(each)[1]) for each in members) if many else (),
            chosen=members.index(robot),
            keys=HELP_SHARED if robot.bridge.acquaintances.shared else HELP_MANY if many else HELP,
        )

    def _ground(self) -> PlanView | None:
        """Where everybody is, by their own word; the box and the goal by the table's."""
        bodies = [
            Body(_figure(robot), seen.position, seen.heading, _BODY, chosen=robot is self._chosen)
            for robot, seen in self._seen.items()
        ]
        if self._table is not None and any(self._table.box):
            bodies.append(Body(Figure.BOX, self._table.box, self._table.box_heading, _BOX))
            bodies.append(Body(Figure.GOAL, self._table.goal, None, _BOX))
        if not bodies:
            return None
        ground = PlanView(tuple(bodies), caption=f"{len(self._seen)} have said where they are", area=self._area)
        self._area = ground.bounds
        return PlanView(ground.bodies, caption=ground.caption, area=self._area)

    def _facts(self, robot: MicroRobot) -> tuple[Fact, ...]:
        """What is known of one, line by line."""
        seen = self._seen.get(robot)
        if seen is None:
            return (Fact("class", _kind(robot)), Fact("observes", "nothing yet", tone=Tone.WARNING))
        age = "never had one" if seen.fix_age is None else f"{seen.fix_age * 1000:.0f} ms old"
        return (
            Fact("class", _kind(robot)),
            Fact("at", f"{seen.position[0]:.3f} {seen.position[1]:.3f} m"),
            Fact("heading", f"{round(degrees(seen.heading))} deg"),
            Fact("position fix", age, tone=Tone.WARNING if seen.fix_age is None else Tone.CALM),
            Fact("sees within", f"{seen.radius:.2f} m"),
            Fact("RANGERs", f"{seen.count[0]}, in {seen.seen[0].bit_count()} sectors"),
            Fact("WILDs", f"{seen.count[1]}, in {seen.seen[1].bit_count()} sectors"),
            *_box(seen),
        )

    def lines(self) -> list[str]:
        """The same in plain lines."""
        heads = ("", "", "", "at", "heading", "radius", "RANGERs", "WILDs", "fix", "lost")
        return [
            "  ".join(f"{head} {cell}".strip() for head, cell in zip(heads, self._cells(robot), strict=True))
            for robot in self.shown
        ]

    def _cells(self, robot: MicroRobot) -> tuple[str, ...]:
        seen = self._seen.get(robot)
        who = (self.name(robot), _kind(robot), _state(robot))
        lost = str(robot.peer.counters.lost)
        if seen is None:
            return (*who, "-", "-", "-", "-", "-", "-", lost)
        age = "never" if seen.fix_age is None else f"{seen.fix_age * 1000:.0f} ms"
        place = f"{seen.position[0]:.3f} {seen.position[1]:.3f}"
        return (*who, place, f"{round(degrees(seen.heading))} deg", f"{seen.radius:.2f} m", *map(str, seen.count), age, lost)

    def plain(self, robot: MicroRobot) -> dict[str, object]:
        """All that is known of a robot, for `--json` and the full view."""
        seen, counters = self._seen.get(robot), robot.peer.counters
        found: dict[str, object] = {
            "robot": self.name(robot),
            "system": robot.address.system,
            "network": robot.address.network,
            "class": _kind(robot),
            "ring": robot.ring,
            "state": robot.state.name.lower(),
            "armed": robot.armed,
        }
        if seen is not None:
            found |= {
                "time": seen.time,
                "position": list(seen.position),
                "heading": seen.heading,
                "radius": seen.radius,
                "near": list(seen.near),
                "seen": list(seen.seen),
                "count": list(seen.count),
                "box_bearing": seen.box_bearing,
                "box_distance": seen.box_distance,
                "goal_bearing": seen.goal_bearing,
                "fix_age": seen.fix_age,
                "flags": seen.flags,
            }
        return found | {"frames": counters.good, "lost": counters.lost, "rejected": counters.rejected}

    def document(self) -> dict[str, object] | list[dict[str, object]]:
        """What `--json` prints: one robot, or a list of all."""
        found = [self.plain(robot) for robot in self.shown]
        return found[0] if self._alone else found


def _box(seen: SwarmObservation) -> tuple[Fact, ...]:
    """Where it sees the box, if it does."""
    if seen.box_distance is None or seen.box_bearing is None:
        return ()
    return (Fact("box", f"{seen.box_distance:.2f} m at {round(degrees(seen.box_bearing))} deg"),)


def _figure(robot: MicroRobot) -> Figure:
    return Figure.ROBOT if robot.kind is None else _FIGURES[robot.kind]


def _doing(robot: MicroRobot) -> tuple[str, Tone]:
    """What it is doing, and how much that matters."""
    if not robot.peer.ready:
        return "NOT HEARD", Tone.ALARM
    shared = robot.bridge.acquaintances.shared
    if robot.state is State.STOPPED:
        return f"EMERGENCY STOP{f', {shared}' if shared else ': d releases it, then a arms'}", Tone.ALARM
    if robot.armed:
        return f"{robot.state.name} (armed){f', {shared}' if shared else ''}", Tone.WARNING
    return f"{robot.state.name.lower()}{'' if robot.peer.taken else f', {shared or ONLY_WATCHED}'}", Tone.CALM


def _kind(robot: MicroRobot) -> str:
    return "-" if robot.kind is None else RobotClass(robot.kind).name


def _state(robot: MicroRobot) -> str:
    if not robot.peer.ready:
        return "NOT HEARD"
    return f"{robot.state.name.lower()}{' (armed)' if robot.armed and robot.state is not State.STOPPED else ''}"
