"""Golden vectors: every message at the limits of every field, as frames.

The files are compared with, never rewritten, by the ordinary run of the generator: a changed frame is a changed
protocol. `python -m firmware_protocol.generate --golden` writes them anew after such a change has been decided.

`mavlink.bin` holds the frames one after the other, `mavlink.txt` says which is which: per frame a line with the name
of the vector, one with the message and one with the frame in hexadecimal. The frame sequence numbers count from 0.
Frames that a robot sends come from system 1, component 1; the referee's from component 25; the table's from component 25 of
system 254; all others from the host.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.messages import (
    BYTE_LINKS_ONLY,
    HOST_COMPONENT,
    HOST_SYSTEM,
    MESSAGES,
    REFEREE_COMPONENT,
    ROBOT_COMPONENT,
    TABLE_COMPONENT,
    TABLE_NODE,
    TABLE_SYSTEM,
    JuniorSensors,
    JuniorWheels,
    SwarmMove,
)
from firmware_protocol.vocabulary import MoveOption
from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.fields import Direction, Party, wire_fields
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.mavlink_layout import raw_limits

if TYPE_CHECKING:
    from firmware_protocol.wire.can.frame import CanFrame
    from firmware_protocol.wire.fields import Message, Wire

LARGEST_FLOAT: Final = (2 - 2**-23) * 2.0**127
"""Largest finite single-precision number."""
_TYPICAL_TEXT: Final = "WHEEL_SPEED"


@dataclass(frozen=True)
class Vector:
    """One golden vector.

    Attributes:
        name: As `JUNIOR_WHEELS max`.
        message: The message.
        frame: The frame it becomes.
    """

    name: str
    message: Message
    frame: bytes


def _value(wire: Wire, kind: str, seed: int) -> Any:  # noqa: ANN401 - int, float, text or None
    """One element: at a limit, or somewhere between, different for every seed."""
    if wire.type == "char":
        return {"min": "", "max": "~" * wire.count, "typical": _TYPICAL_TEXT}[kind]
    if wire.type == "f32":
        return {"min": -LARGEST_FLOAT, "max": LARGEST_FLOAT, "typical": seed + 0.25}[kind]
    if kind == "none":
        return None
    low, high = raw_limits(wire)
    raw = {"min": low, "max": high, "typical": low + (seed * 0x9E3779B97F4A7C15 >> 7) % (high - low + 1)}[kind]
    return raw if wire.scale == 1 else raw / round(1 / wire.scale)


def example(message: type[Message], kind: str) -> Message:
    """A message with every field at one end of its range, or in between.

    Args:
        message: A message class.
        kind: `min`, `max`, `typical`, or `none`: typical, with None wherever a field may say "not available".

    Returns:
        The message.
    """
    values: dict[str, Any] = {}
    seed = 0
    for name, wire in wire_fields(message):
        of_field = "typical" if kind == "none" and wire.invalid is None else kind
        elements = []
        for _ in range(1 if wire.type == "char" else max(1, wire.count)):
            seed += 1
            elements.append(_value(wire, of_field, seed))
        values[name] = tuple(elements) if wire.count and wire.type != "char" else elements[0]
    return message(**values)


_SENDERS: Final = {Party.REFEREE: (1, REFEREE_COMPONENT), Party.TABLE: (TABLE_SYSTEM, TABLE_COMPONENT)}


def _sender(message: type[Message]) -> tuple[int, int]:
    if message.DIRECTION is not Direction.UP:
        return HOST_SYSTEM, HOST_COMPONENT
    return _SENDERS.get(message.PARTY, (1, ROBOT_COMPONENT))


def vectors() -> list[Vector]:
    """All golden vectors, in the order of `MESSAGES`."""
    found: list[Vector] = []
    codecs: dict[tuple[int, int], MavlinkCodec] = {}
    for message in MESSAGES.values():
        system, component = _sender(message)
        codec = codecs.setdefault((system, component), MavlinkCodec(system=system, component=component))
        kinds = ["min", "max", "typical"]
        if any(wire.invalid is not None for _, wire in wire_fields(message)):
            kinds.append("none")
        for kind in kinds:
            made = example(message, kind)
            found.append(Vector(f"{message.NAME} {kind}", made, codec.encode(made)))
    return found


@dataclass(frozen=True)
class CanVector:
    """One golden vector over CAN.

    Attributes:
        name: As `JUNIOR_WHEELS max`.
        message: The message; what CAN does not carry is as the other end supplies it.
        frames: The frames it becomes.
    """

    name: str
    message: Message
    frames: tuple[CanFrame, ...]


NODE: Final = 42
"""The robot of the CAN vectors."""
_NODES: Final = {1: NODE, TABLE_SYSTEM: TABLE_NODE}


def can_vectors() -> list[CanVector]:
    """All golden vectors over CAN: robot 42, its referee, the table and the host.

    They are in the order of `MESSAGES`, and at the end is a SWARM_MOVE that a single frame has room for.
    """
    found: list[CanVector] = []
    codecs: dict[tuple[int, int], CanCodec] = {}
    plain = SwarmMove(0, 0x1234, -1.5, 0.08, None, 0.0, 0, 0, 0, 0, 0, int(MoveOption.SENSE))
    named = [(vector.name, vector.message) for vector in vectors()] + [(f"{SwarmMove.NAME} single", plain)]
    for name, sent in named:
        kind = type(sent)
        if kind in BYTE_LINKS_ONLY:
            continue
        system, component = _sender(kind)
        codec = codecs.setdefault((system, component), CanCodec(system=_NODES.get(system, system), component=component))
        message = _addressed(sent, upward=system in _NODES)
        found.append(CanVector(name, message, tuple(codec.encode_frames(message))))
    return found


def _addressed(message: Message, *, upward: bool) -> Message:
    """The message for the only other node there is; and of the robot's time and JUNIOR_WHEELS, what single frames carry."""
    kind = type(message)
    system, component = (HOST_SYSTEM, HOST_COMPONENT)
    if not upward:
        at, component = _SENDERS.get(kind.PARTY, (1, ROBOT_COMPONENT))
        system = _NODES[at]
    given: dict[str, Any] = {"target_system": system, "target": system, "target_component": component}
    changes = {name: given[name] for name, _ in wire_fields(kind) if name in given}
    if isinstance(message, JuniorSensors):
        changes["time"] = round(message.time * 1e3) % 2**32 / 1e3
    elif isinstance(message, JuniorWheels):
        changes["session"] = 0
    return replace(message, **changes)  # type: ignore[type-var]


def can_text() -> str:
    """The text of `can.txt`: per vector its name, the message, and its frames as candump's log writes them."""
    head = "# Golden vectors over CAN; python -m firmware_protocol.generate --golden writes them.\n"
    return head + "".join(
        f"\n{vector.name}\n{vector.message!r}\n{' '.join(map(str, vector.frames))}\n" for vector in can_vectors()
    )


def golden_binary() -> bytes:
    """The text of `mavlink.bin`."""
    return b"".join(vector.frame for vector in vectors())


def golden_text() -> str:
    """The text of `mavlink.txt`."""
    head = "# Golden vectors; python -m firmware_protocol.generate --golden writes them. Frames as in mavlink.bin, in order.\n"
    return head + "".join(f"\n{vector.name}\n{vector.message!r}\n{vector.frame.hex()}\n" for vector in vectors())
