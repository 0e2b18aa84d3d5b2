"""Several robots at a glance, for `hil monitor`: one line each, keys for the chosen one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Group
from rich.table import Table
from rich.text import Text

from firmware_protocol.errors import PeerError
from firmware_protocol.messages import State
from hil.jobs.words import sensed

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil.sumo.junior import Junior
    from hil.sumo.robots import Robots

NEXT, BEFORE, STOP_ALL = "n", "p", "E"
NEEDS_SESSION = "a^v<> "
HELP = "n p choose   a arm   d disarm   arrows drive   space stop   e emergency stop   E of all   q quit"


class Overview:
    """Which of several robots is chosen, and what there is to see of all.

    Args:
        robots: The robots, watched.
        obey: Does what a key asks of one robot, and returns why that refused; empty when it did not.

    Attributes:
        refusal: Why the last key did nothing.
    """

    def __init__(self, robots: Robots, obey: Callable[[Junior, str], str]) -> None:
        self.refusal = ""
        self._robots = robots
        self._obey = obey
        self._chosen: Junior | None = None

    @property
    def members(self) -> list[Junior]:
        """Every robot that is or was there, in order."""
        return [junior for _, junior in sorted(self._robots.members.items())]

    @property
    def chosen(self) -> Junior:
        """The robot that keys act on: the same one until another is chosen, whoever joins."""
        if self._chosen is None:
            self._chosen = self.members[0]
        return self._chosen

    def step(self) -> None:
        """Nothing is asked for: Juniors say by themselves what they sense."""

    def aim(self, keys: str) -> list[str]:
        """For which robot each of several keys is, if they are pressed one after the other.

        Args:
            keys: The keys.

        Returns:
            System ids; empty for a key that is for all, or for none.
        """
        members = self.members
        chosen = members.index(self.chosen)
        aimed = []
        for key in keys:
            if key in {NEXT, BEFORE}:
                chosen = (chosen + (1 if key == NEXT else -1)) % len(members)
            aimed.append("" if key == STOP_ALL else str(members[chosen].peer.system))
        return aimed

    def press(self, key: str) -> None:
        """Do what a key asks. The first that moves a robot takes it: it is stopped and disarmed by that, and no other one is.

        Args:
            key: The key.
        """
        self.refusal = ""
        if key in {NEXT, BEFORE}:
            members = self.members
            self._chosen = members[(members.index(self.chosen) + (1 if key == NEXT else -1)) % len(members)]
            return
        try:
            if key == STOP_ALL:
                errors = self._robots.emergency_stop().errors
                self.refusal = "; ".join(str(error) for error in errors.values())
                return
            if key in NEEDS_SESSION and not self.chosen.peer.taken:
                self.chosen.take()
            self.refusal = self._obey(self.chosen, key)
        except PeerError as error:
            self.refusal = str(error)

    def view(self) -> Group:
        """A table for a terminal."""
        network = next(iter(self._robots.networks.bridges))
        table = Table(title=f"{len(self.members)} robots on {network}", title_justify="left", box=None)
        for head in ("", "robot", "state", "battery", "senses", "frames", "lost", "rejected", "answers in"):
            table.add_column(head, justify="left" if head in {"", "state", "senses"} else "right")
        for junior in self.members:
            table.add_row(">" if junior is self.chosen else "", *_cells(junior))
        unclaimed = sum(bridge.unclaimed for bridge in self._robots.networks.bridges.values())
        rest = f"rejected, and nobody knows whose: {unclaimed}" if unclaimed else ""
        return Group(table, rest, Text(self.refusal), HELP)

    def lines(self) -> list[str]:
        """The same in plain lines."""
        heads = ("robot", "", "", "senses", "frames", "lost", "rejected", "answers in")
        return [
            "  ".join(f"{head} {cell}".strip() for head, cell in zip(heads, _cells(junior), strict=True))
            for junior in self.members
        ]


def _cells(junior: Junior) -> tuple[str, ...]:
    counters, sensors = junior.peer.counters, junior.latest
    state = junior.state.name.lower() if junior.peer.ready else "NOT HEARD"
    if junior.peer.ready and junior.state is not State.STOPPED and junior.armed:
        state += " (armed)"
    flags = 0 if sensors is None else sensors.flags
    return (
        str(junior.peer.system),
        state,
        "-" if sensors is None else f"{sensors.battery:.2f} V",
        f"({junior.age:.1f} s old)" if sensors is not None and junior.stale else sensed(flags),
        str(counters.good),
        str(counters.lost),
        str(counters.rejected),
        f"{counters.latency * 1000:.1f} ms" if counters.answers else "-",
    )
