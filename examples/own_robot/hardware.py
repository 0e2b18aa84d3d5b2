"""The seam: put your sensors, motors and non-volatile memory here."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from own_robot.tables import ACTIONS, MAX_ACTIONS

if TYPE_CHECKING:
    from pathlib import Path

    from own_robot.wire import Message


class Hardware:
    """The seam to sensors and motors. This one has none: it sees nothing, touches nothing, and stands on its ring."""

    uid = 0x0DD0B07
    encoders = ground_odometer = False

    def eye(self, side: int) -> int:
        """Counts of the left (0) or right (1) eye, 0 to 1023."""
        return 120 + side

    def floor(self, side: int) -> int:
        """Counts of a floor sensor, 0 to 1023."""
        return 300 + side

    def arm(self, side: int) -> bool:
        """An arm's switch is closed."""
        return side > 1

    def battery(self) -> int:
        """In mV."""
        return 7400

    def set_wheels(self, left: int, right: int) -> None:
        """Effort of the wheels, -1000 to 1000."""


@dataclass
class Plan:
    """A maneuver, as a message or the memory has it."""

    period: int
    options: int
    actions: list[int]

    @classmethod
    def read(cls, message: Message) -> Plan | None:
        """Take one from a message; None where a value is out of range."""
        codes = list(message.actions)
        good = 1 <= message.count <= MAX_ACTIONS and 20 <= message.period <= 5000 and message.options <= 31
        return cls(message.period, message.options, codes[: message.count]) if good and max(codes) < len(ACTIONS) else None


@dataclass
class Store:
    """What survives power-off: parameters and memory that were set, and how often it was switched on.

    A file is replaced as a whole, so that a power cut leaves the old one or the new one.
    """

    path: Path | None = None
    boots: int = 0
    parameters: dict[str, float] = field(default_factory=dict)
    memory: dict[tuple[int, int], Plan] = field(default_factory=dict)

    def load(self) -> None:
        """Read the file, if there is one."""
        if self.path is not None and self.path.exists():
            data = json.loads(self.path.read_text())
            self.boots, self.parameters = data["boots"], data["parameters"]
            self.memory = {(p, c): Plan(*rest) for p, c, *rest in data["memory"]}

    def save(self) -> None:
        """Write the file."""
        if self.path is not None:
            memory = [(*key, plan.period, plan.options, plan.actions) for key, plan in self.memory.items()]
            new = self.path.with_suffix(".new")
            new.write_text(json.dumps({"boots": self.boots, "parameters": self.parameters, "memory": memory}))
            new.replace(self.path)
