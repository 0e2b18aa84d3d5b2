"""Where robots are, as a camera's program tells it: a line of text for each robot, `NETWORK ID x y heading age_ms`.

What it tells decides, so it comes in by the bridges' steps as all that comes from outside: a log tells of it, and a replay of
that log has it again.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import LinkError
from hil.bridge.networks import RobotAddress
from hil.bridge.operator import POSE, OperatorInput

if TYPE_CHECKING:
    from firmware_protocol.link import Link
    from hil.swarm.handle import Swarm

INTERVAL: Final = 0.05
"""A robot is told where it is no more often, in s."""
FARTHEST: Final = 32.0
"""Positions farther away, in m, can't be sent."""
OLDEST: Final = 60.0
"""What is older, in s, is of no use."""
MOST_READS: Final = 100
LONGEST: Final = 200
"""No line has more letters."""
_SLACK: Final = 1e-9


@dataclass(frozen=True)
class PoseLine:
    """Where a robot is.

    Attributes:
        network: Number of its network, from 1.
        system: Its id there.
        pose: x, y in m and heading in rad.
        age: How old that is, in s.
    """

    network: int
    system: int
    pose: tuple[float, float, float]
    age: float

    @classmethod
    def parse(cls, line: str) -> PoseLine | None:
        """Read a line.

        Args:
            line: `NETWORK ID x y heading age_ms`, in m and rad.

        Returns:
            What it says; None where it is no such line, or says what can't be.
        """
        words = line.split()
        if len(words) != 6 or len(line) > LONGEST:
            return None
        try:
            network, system = int(words[0]), int(words[1])
            x, y, heading, age_ms = map(float, words[2:])
        except ValueError:
            return None
        good = all(map(isfinite, (x, y, heading, age_ms))) and abs(x) < FARTHEST and abs(y) < FARTHEST and abs(heading) < 1e6
        if not good or not 0.0 <= age_ms / 1000.0 <= OLDEST or network < 1 or not 1 <= system <= 255:
            return None
        return cls(network, system, (x, y, heading), age_ms / 1000.0)


class PoseFeed:
    """Takes the lines that come over a link, for the steps of the bridges.

    Args:
        link: Brings them; a line that is cut, or longer than any is, is left out.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._rest = b""

    def inputs(self) -> list[OperatorInput]:
        """What has come: the newest line of each robot."""
        try:
            for _ in range(MOST_READS):
                data = self._link.read(0.0)
                if not data:
                    break
                self._rest += data
        except LinkError:
            return []  # the robots have no fix then, and say so
        *lines, self._rest = self._rest.split(b"\n")
        if len(self._rest) > LONGEST:
            self._rest = b""
        newest: dict[tuple[int, int], str] = {}
        for data in lines:
            line = data.decode("ascii", errors="replace").strip()
            said = PoseLine.parse(line)
            if said is not None:
                newest[said.network, said.system] = line
        return [OperatorInput(f"{POSE}{line}") for line in newest.values()]


class PoseFixes:
    """Tells robots where they are.

    Args:
        swarm: The robots.
    """

    def __init__(self, swarm: Swarm) -> None:
        self._swarm = swarm
        self._waiting: dict[RobotAddress, tuple[PoseLine, float]] = {}
        self._sent_at = -INTERVAL

    def take(self, lines: list[str]) -> None:
        """Take in lines that have come, and send what is due; it goes out with the next step.

        Args:
            lines: As the steps have taken them in.
        """
        now = self._swarm.now()
        names = list(self._swarm.networks.bridges)
        for line in lines:
            said = PoseLine.parse(line)
            if said is not None and said.network <= len(names):
                address = RobotAddress(names[said.network - 1], said.system)
                if address in self._swarm.robots:
                    self._waiting[address] = (said, now)
        if not self._waiting or now - self._sent_at < INTERVAL - _SLACK:
            return
        self._sent_at = now
        by_age: dict[float, dict[RobotAddress, tuple[float, float, float]]] = {}
        for address, (said, since) in self._waiting.items():
            by_age.setdefault(round(said.age + now - since, 3), {})[address] = said.pose
        self._waiting = {}
        for age, poses in by_age.items():
            self._swarm.fix(poses, min(age, OLDEST))
