"""Where the coverage-guided fuzz target begins: every golden vector as an input of `guided.c`, and a robot that is driven.

`python fuzz_seeds.py FOLDER` writes them; the package must be installed.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from firmware_protocol.generate.vectors import vectors
from firmware_protocol.messages import (
    Command,
    CommandLong,
    ContestCommand,
    JuniorContest,
    JuniorManeuver,
    JuniorMemoryWrite,
    RobotSession,
    SwarmMove,
    SwarmSense,
)
from firmware_protocol.vocabulary import MoveOption
from firmware_protocol.wire.fields import Direction
from firmware_protocol.wire.payload import PAYLOADS

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

MODES: Final = {"line": 0, "can": 1, "key": 2, "slow": 4, "key-slow": 6, "key-busy": 10, "micro": 32, "micro-can": 33}
MESSAGE, SIGNED, TIME, SENSORS = 0, 1, 4, 5
"""Steps of `guided.c`."""
TARGETS: Final = ("target_system", "target_component", "target")


def step(message: Message, *, signed: bool) -> bytes:
    """A message as a step: id, sender, payload, and how far a signature's time goes on."""
    payload = PAYLOADS[message.ID].pack(message)
    return (
        bytes([SIGNED if signed else MESSAGE]) + message.ID.to_bytes(2, "little") + b"\0" + payload + (b"\5" if signed else b"")
    )


def driven() -> list[Message]:
    """A session, what arms in it, a maneuver, one that is stored, and a contest."""
    host, actions, target = 7, (5, 6, 0, 0, 0, 0, 0, 0), (1, 1)
    return [
        RobotSession(session=1, sequence=0, host=host, target_system=1, target_component=1, major=2, minor=0),
        CommandLong(*target, command=int(Command.ARM_DISARM), param1=1.0, param3=float(host)),
        JuniorManeuver(1, 1, 0.05, 7, *target, count=2, actions=actions),
        JuniorMemoryWrite(1, 2, 0.05, 7, *target, previous=255, current=0, count=2, actions=actions),
        JuniorContest(1, 3, 0.0, *target, command=int(ContestCommand.START)),
    ]


def moved() -> list[Message]:
    """A session, what arms in it, and moves of a micro-robot: one that drives, one that ends at contact and tells ranges."""
    target = (1, 1)
    return [
        *driven()[:2],
        SwarmMove(1, 1, 1.0, 0.02, 0.5, 0.0, *target, 0, 0, 0, int(MoveOption.SENSE)),
        SwarmSense(1, 2, 0.2, 0.05, 0.5, *target, sectors=8, ranges=8),
        SwarmMove(1, 3, None, 0.1, None, 0.0, *target, 3, 8, 50, int(MoveOption.STOP_ON_CONTACT | MoveOption.RANGES)),
    ]


def addressed(message: Message) -> bool:
    """Whether it is for the robot, or for all."""
    return all(getattr(message, name, 0) in {0, 1} for name in TARGETS)


def write_seeds(folder: Path) -> int:
    """Write the inputs.

    Args:
        folder: Where to; it is made.

    Returns:
        How many there are.
    """
    folder.mkdir(parents=True, exist_ok=True)
    alone = {v.name: [v.message] for v in vectors() if v.message.DIRECTION is not Direction.UP and addressed(v.message)}
    written = 0
    for mode, number in MODES.items():
        for name, messages in {**alone, "driven": driven(), "moved": moved()}.items():
            steps = b"".join(step(message, signed=mode.startswith("key")) + bytes([TIME, 40]) for message in messages)
            path = folder / f"{mode}-{name}".replace("/", "-").replace(" ", "-")
            path.write_bytes(bytes([number]) + steps + bytes([SENSORS, 255, *range(8), TIME, 200]))
            written += 1
    return written


if __name__ == "__main__":
    sys.stdout.write(f"{write_seeds(Path(sys.argv[1]))} seeds in {sys.argv[1]}\n")
