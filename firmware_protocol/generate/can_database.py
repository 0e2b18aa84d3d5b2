"""The CAN database (DBC): the single frames that are on the bus, and every message at full length for decoding transfers.

Single frames have 11-bit identifiers `function << 7 | node`, function = 2 * urgency class + direction (0 down, 1 up).
Every message also has an entry at full length under a 29-bit identifier that is never sent, `message id << 11 | 0x780`:
its payload is MAVLink's untrimmed one without the target fields. Function 15 is never sent either, so that masking all
identifiers by 0x780, as `cantools monitor -m 0x780` does, mixes no long message up with a single frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag
from typing import Final

from firmware_protocol.mavlink_layout import INTEGER_LIMITS, raw_limits
from firmware_protocol.messages import MESSAGES, JuniorSensors, JuniorWheels
from firmware_protocol.wire import SIZES, Direction, Message, Wire, wire_order

FUNCTION_SHIFT: Final = 7
FUNCTION_MASK: Final = 0x780
"""Bits of an 11-bit identifier that hold the function; the rest is the node."""
ESTOP_FUNCTION: Final = 0
WHEELS_FUNCTION: Final = 2
SWITCHES_FUNCTION: Final = 3
EYES_FUNCTION: Final = 5
TRAVEL_FUNCTION: Final = 7
TRANSFER_DOWN_FUNCTION: Final = 12
TRANSFER_UP_FUNCTION: Final = 13
NEVER_FUNCTION: Final = 15

TARGET_FIELDS: Final = frozenset({"target_system", "target_component", "target"})
"""Fields that CAN does not carry: the identifier says for whom a frame is."""
_LONG_NAME: Final = 32
"""Longest name the DBC format knows; longer ones go into an attribute."""


@dataclass(frozen=True)
class _Frame:
    identifier: int
    name: str
    text: str
    sender: str
    fields: tuple[tuple[str, Wire], ...]

    @property
    def length(self) -> int:
        return sum(SIZES[wire.type] * max(1, wire.count) for _, wire in self.fields)


def long_identifier(message: type[Message]) -> int:
    """The never-sent 29-bit identifier under which a message is in the DBC at full length."""
    return message.ID << 11 | NEVER_FUNCTION << FUNCTION_SHIFT


def _pick(message: type[Message], *names: str) -> tuple[tuple[str, Wire], ...]:
    by_name = dict(wire_order(message))
    return tuple((name, by_name[name]) for name in names)


def single_frames() -> tuple[_Frame, ...]:
    """The frames that travel alone, node 0."""
    stop = Wire("u8", minimum=1, maximum=1, text="1; any other value is ignored")
    time = Wire("u32", "s", 1e-3, text="Time since boot, wraps after 49 days")
    flags, battery, travel = _pick(JuniorSensors, "flags", "battery", "travel")
    table: tuple[tuple[int, str, str, str, tuple[tuple[str, Wire], ...]], ...] = (
        (ESTOP_FUNCTION, "JUNIOR_ESTOP", "Emergency stop, latched; node 0 stops all.", "HOST", (("stop", stop),)),
        (
            WHEELS_FUNCTION,
            "JUNIOR_WHEELS_FRAME",
            "JUNIOR_WHEELS without the session.",
            "HOST",
            _pick(JuniorWheels, "sequence", "speed", "duration"),
        ),
        (
            SWITCHES_FUNCTION,
            "JUNIOR_SENSORS_SWITCHES",
            "Digest of JUNIOR_SENSORS: decisions, battery.",
            "ROBOT",
            (("time", time), flags, battery),
        ),
        (
            EYES_FUNCTION,
            "JUNIOR_SENSORS_EYES",
            "Digest of JUNIOR_SENSORS: eyes and floor, raw.",
            "ROBOT",
            _pick(JuniorSensors, "eye", "floor"),
        ),
        (TRAVEL_FUNCTION, "JUNIOR_SENSORS_TRAVEL", "Digest of JUNIOR_SENSORS: wheel travel.", "ROBOT", (travel,)),
    )
    return tuple(
        _Frame(function << FUNCTION_SHIFT, name, text, sender, fields) for function, name, text, sender, fields in table
    )


def _long_frames() -> tuple[_Frame, ...]:
    return tuple(
        _Frame(
            long_identifier(message) | 1 << 31,
            message.NAME,
            " ".join((message.__doc__ or "").split()),
            "ROBOT" if message.DIRECTION is Direction.UP else "HOST",
            tuple(pair for pair in wire_order(message) if pair[0] not in TARGET_FIELDS),
        )
        for message in MESSAGES.values()
    )


def _elements(field: str, wire: Wire) -> list[str]:
    if not wire.count:
        return [field]
    if wire.count == 2:
        suffixes = ("x", "y") if "Position" in wire.text else ("left", "right")
        return [f"{field}_{suffix}" for suffix in suffixes]
    return [f"{field}_{index}" for index in range(wire.count)]


def _quote(text: str) -> str:
    return '"' + text.replace('"', "'") + '"'


def _signal(name: str, wire: Wire, start: int) -> str:
    signed = wire.type[0] in "if"
    low, high = (0.0, 0.0)  # DBC's way to say: no limits but the type's
    if wire.type in INTEGER_LIMITS and (wire.minimum is not None or wire.maximum is not None):
        raw_low, raw_high = raw_limits(wire)
        low, high = raw_low * wire.scale, raw_high * wire.scale
    place = f"{start}|{8 * SIZES[wire.type]}@1{'-' if signed else '+'}"
    return f' SG_ {name} : {place} ({wire.scale:g},0) [{low:.10g}|{high:.10g}] "{wire.unit}" Vector__XXX'


def can_database() -> str:
    """The text of `junior.dbc`."""
    frames = (*single_frames(), *_long_frames())
    body, comments, values, floats, long_names = [], [], [], [], []
    for frame in frames:
        body.append(f"BO_ {frame.identifier} {frame.name}: {frame.length} {frame.sender}")
        comments.append(f"CM_ BO_ {frame.identifier} {_quote(frame.text)};")
        at = 0
        used: set[str] = set()
        for field, wire in frame.fields:
            for full in _elements(field, wire):
                name = full
                if len(full) > _LONG_NAME:
                    name = next(n for i in range(10) if (n := f"{full[: _LONG_NAME - 2]}_{i}") not in used)
                    long_names.append(f'BA_ "SystemSignalLongSymbol" SG_ {frame.identifier} {name} "{full}";')
                used.add(name)
                body.append(_signal(name, wire, at))
                at += 8 * SIZES[wire.type]
                if wire.text:
                    comments.append(f"CM_ SG_ {frame.identifier} {name} {_quote(wire.text)};")
                if wire.type == "f32":
                    floats.append(f"SIG_VALTYPE_ {frame.identifier} {name} : 1;")
                if wire.enum is not None and not issubclass(wire.enum, IntFlag):
                    choices = " ".join(f'{int(member)} "{member.name}"' for member in wire.enum)
                    values.append(f"VAL_ {frame.identifier} {name} {choices} ;")
        body.append("")
    comment = "Generated by python -m firmware_protocol.generate from messages.py: edit that."
    attributes = ['BA_DEF_ SG_ "SystemSignalLongSymbol" STRING ;', 'BA_DEF_DEF_ "SystemSignalLongSymbol" "";']
    lines = [
        'VERSION ""', "", "NS_ :", "", "BS_:", "", "BU_: HOST ROBOT", "", *body, f"CM_ {_quote(comment)};", *comments, "",
        *attributes, *long_names, "", *values, "", *floats,
    ]  # fmt: skip
    return "\n".join(lines) + "\n"
