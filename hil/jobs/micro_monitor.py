"""A live view of micro-robots: a line for each, or one in full, and the keys that move it."""

from __future__ import annotations

from math import degrees, radians
from typing import TYPE_CHECKING, Final

from rich.console import Group
from rich.table import Table
from rich.text import Text

from firmware_protocol.errors import NoRobotError, PeerError, RefusedError
from firmware_protocol.messages import State
from firmware_protocol.roles.swarm import longest_time, move, observe
from firmware_protocol.vocabulary import Move, MoveOption, RobotClass

if TYPE_CHECKING:
    from rich.console import RenderableType

    from firmware_protocol.messages import SwarmObservation
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from hil.connecting.handles import RobotHandles
    from hil.swarm.robot import MicroRobot

EVERY: Final = 0.5
"""Each robot is asked what it observes so often, in s."""
STEP: Final = 0.04
TURN: Final = radians(15.0)
"""How far a key moves and turns, in m and rad."""
SPEED, TURN_SPEED = 0.2, 6.28
"""How fast, in m/s and rad/s."""
_AHEAD: Final = MoveOption.BODY | MoveOption.STOP_ON_CONTACT | MoveOption.SENSE
MOVES: Final = {
    "^": Move(STEP, 0.0, options=_AHEAD),
    "v": Move(STEP, 0.0, options=_AHEAD | MoveOption.BACKWARD),
    "<": Move(0.0, TURN, options=_AHEAD),
    ">": Move(0.0, -TURN, options=_AHEAD),
    " ": Move(0.0, 0.0, options=_AHEAD),
}
HELP: Final = "a arm   d disarm   arrows move   space stop   e emergency stop   E of all   q quit"
HELP_MANY: Final = f"n p choose   {HELP}"


class MicroOverview:
    """What there is to see of micro-robots, and what keys do to the chosen one.

    Args:
        robots: The robots, watched.
        which: The only one to be shown, as `3` or, where there are several networks, `2.3`; empty: all.

    Attributes:
        refusal: Why the last key did nothing.

    Raises:
        NoRobotError: There is no such robot.
    """

    def __init__(self, robots: RobotHandles[MicroRobot], which: str = "") -> None:
        self.refusal = ""
        self._robots = robots
        self._asked: dict[MicroRobot, Ticket[SwarmObservation]] = {}
        self._seen: dict[MicroRobot, SwarmObservation] = {}
        self._due = robots.now()
        self._alone = bool(which)
        self._chosen = self.members[0]
        if which:
            by_name = {self.name(robot): robot for robot in self.members}
            if which not in by_name:
                raise NoRobotError(f"there is no robot {which}: there are {', '.join(by_name)}")
            self._chosen = by_name[which]

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

    def step(self) -> None:
        """Ask those that are looked at what they observe, now and then, and take what has been answered."""
        for robot, ticket in list(self._asked.items()):
            if ticket.done:
                del self._asked[robot]
                if ticket.error is None and ticket.result is not None:
                    self._seen[robot] = ticket.result
        if (now := self._robots.now()) >= self._due:
            self._due = now + EVERY
            for robot in self.shown:
                if robot not in self._asked and robot.peer.ready:
                    self._asked[robot] = observe(robot.peer)

    def aim(self, keys: str) -> list[str]:
        """For which robot each of several keys is: see `Overview.aim`."""
        members, aimed = self.members, []
        chosen = members.index(self._chosen)
        for key in keys:
            if key in "np" and not self._alone:
                chosen = (chosen + (1 if key == "n" else -1)) % len(members)
            aimed.append("" if key == "E" else str(members[chosen].peer.system))
        return aimed

    def press(self, key: str) -> None:
        """Do what a key asks. The first that moves a robot takes it: it is stopped and disarmed by that, and no other one is.

        Args:
            key: The key.
        """
        self.refusal = ""
        robot = self._chosen
        try:
            if key in "np" and not self._alone:
                members = self.members
                self._chosen = members[(members.index(robot) + (1 if key == "n" else -1)) % len(members)]
            elif key == "E":
                self.refusal = "; ".join(map(str, self._robots.emergency_stop().errors.values()))
            elif key == "e":
                robot.emergency_stop()
            elif key == "d":
                robot.disarm()
            elif key == "a" or key in MOVES:
                if not robot.peer.taken:
                    robot.take()
                if key == "a":
                    robot.arm()
                else:
                    move(robot.peer, MOVES[key], longest_time(MOVES[key], SPEED, TURN_SPEED))
        except (PeerError, RefusedError) as error:
            self.refusal = str(error)

    def view(self) -> RenderableType:
        """A table for a terminal."""
        if self._alone:
            table = Table(title=self._chosen.description, title_justify="left", show_header=False, box=None)
            for name, value in self.plain(self._chosen).items():
                table.add_row(name, _text(value))
            return Group(table, Text(self.refusal), HELP)
        table = Table(title=f"{len(self.members)} micro-robots", title_justify="left", box=None)
        for head in ("", "robot", "class", "state", "x y (m)", "heading", "radius", "RANGERs", "WILDs", "fix", "lost"):
            table.add_column(head, justify="left" if head in {"", "class", "state"} else "right")
        for robot in self.members:
            table.add_row(">" if robot is self._chosen else "", *self._cells(robot))
        return Group(table, Text(self.refusal), HELP_MANY)

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
        return (*who, place, f"{degrees(seen.heading):.0f} deg", f"{seen.radius:.2f} m", *map(str, seen.count), age, lost)

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


def _kind(robot: MicroRobot) -> str:
    return "-" if robot.kind is None else RobotClass(robot.kind).name


def _state(robot: MicroRobot) -> str:
    if not robot.peer.ready:
        return "NOT HEARD"
    return f"{robot.state.name.lower()}{' (armed)' if robot.armed and robot.state is not State.STOPPED else ''}"


def _text(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.3f}"
    return " ".join(map(_text, value)) if isinstance(value, list) else str(value)
