"""Several scripted robots on one line: each takes what is for it or for all."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from scripted_robot import PERIOD, ScriptedRobot

from firmware_protocol.events import Received
from firmware_protocol.wire.mavlink import MavlinkCodec

if TYPE_CHECKING:
    from collections.abc import Iterable


@dataclass
class ScriptedCrowd:
    """Robots by system id, stepped together by control periods of 5 ms.

    Attributes:
        robots: The robots; one that is taken out of here is off the line.
    """

    robots: dict[int, ScriptedRobot] = field(default_factory=dict)

    @classmethod
    def of(cls, systems: Iterable[int]) -> ScriptedCrowd:
        """Robots with these ids."""
        return cls({system: ScriptedRobot(system=system) for system in systems})

    def __post_init__(self) -> None:
        self._ticks = 0
        self._codec = MavlinkCodec(system=250, component=1)

    def now(self) -> float:
        """Time in s."""
        return self._ticks * PERIOD

    def step(self, inbound: bytes) -> bytes:
        """Live for one control period."""
        self._ticks += 1
        frames = [event for event in self._codec.receive(inbound, self.now()) if isinstance(event, Received)]
        out = []
        for system, robot in self.robots.items():
            meant = [frame.raw for frame in frames if getattr(frame.message, "target_system", 0) in {0, system}]
            out.append(robot.step(b"".join(meant)))
        return b"".join(out)
