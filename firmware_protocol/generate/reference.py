"""The protocol page of the documentation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from firmware_protocol.generate.dialect import field_enum
from firmware_protocol.generate.names import enumerations
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    JUNIOR_MESSAGES,
    PROTOCOL_MAJOR,
    PROTOCOL_MINOR,
    REFEREE_MESSAGES,
    ROBOT_MESSAGES,
    STANDARD_MESSAGES,
    SWARM_MESSAGES,
    TABLE_MESSAGES,
    JuniorWheels,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS, SWARM_PARAMETERS
from firmware_protocol.vocabulary import ACTIONS, MAX_ACTIONS
from firmware_protocol.wire.can.dbc import PART_TIMEOUT
from firmware_protocol.wire.can.layout import (
    FUNCTION_SHIFT,
    REFEREE_DOWN_FUNCTION,
    REFEREE_UP_FUNCTION,
    TRANSFER_DOWN_FUNCTION,
    TRANSFER_UP_FUNCTION,
    long_identifier,
    single_frames,
)
from firmware_protocol.wire.fields import Direction, wire_fields
from firmware_protocol.wire.mavlink import HOLD_BACK, MavlinkCodec
from firmware_protocol.wire.mavlink_layout import C_TYPES, INTEGER_LIMITS, crc_extra, offsets, payload_length, raw_limits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.parameters import Parameter
    from firmware_protocol.wire.fields import Message, Wire

_HEAD: Final = Path(__file__).with_name("protocol_head.md")
_UNITS: Final[dict[tuple[str, float], str]] = {
    ("s", 1e-3): "1 ms", ("s", 1e-6): "1 us", ("m", 1e-3): "1 mm", ("m", 1e-4): "0.1 mm", ("V", 1e-3): "1 mV",
    ("rad", 1e-4): "0.0001 rad", ("m/s", 1e-3): "1 mm/s", ("", 1e-3): "0.001",
}  # fmt: skip
_DIRECTIONS: Final = {
    Direction.UP: "robot → host",
    Direction.DOWN: "host → robot",
    Direction.BOTH: "both ways",
}


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join(lines)


def _anchor(name: str) -> str:
    return f"[{name}](#{name.lower()})"


def _unit(wire: Wire) -> str:
    """What one wire unit is."""
    if wire.scale == 1:
        return wire.unit
    return _UNITS.get((wire.unit, wire.scale), f"{wire.scale:g} {wire.unit}".strip())


def _range(wire: Wire) -> str:
    """Wire values accepted; empty where it is all that the type can carry."""
    if wire.type == "char":
        return f"UTF-8, {wire.count} bytes"
    if wire.type == "f32":
        return "finite or NaN" if wire.nan else "finite"
    low, high = raw_limits(wire)
    limited = wire.minimum is not None or wire.maximum is not None
    text = f"{low} to {high}" if limited and (low, high) != INTEGER_LIMITS[wire.type] else ""
    if wire.invalid is not None:
        text += f", {wire.invalid}: not available"
    return text.lstrip(", ")


def _message(message: type[Message]) -> str:
    at = offsets(message)
    rows = []
    for name, wire in sorted(wire_fields(message), key=lambda pair: at[pair[0]]):
        kind = C_TYPES[wire.type] + (f"[{wire.count}]" if wire.count else "")
        enum = field_enum(message, name, wire)
        text = wire.text or "Not used"
        if enum in text.split(":"):
            text = text.replace(enum, _anchor(enum), 1)
        elif enum:
            text += f": {_anchor(enum)}"
        rows.append(
            (str(at[name]), f"`{name}`", kind, _unit(wire), _range(wire), text + (" *(extension)*" if wire.extension else ""))
        )
    facts = f"Id {message.ID}, {_DIRECTIONS[message.DIRECTION]}, {payload_length(message)} bytes, seed {crc_extra(message)}" + (
        ", **numbered**." if message.NUMBERED else "."
    )
    text = "\n\n".join(" ".join(part.split()) for part in (message.__doc__ or "").split("\n\n"))
    return "\n\n".join(
        (f"### {message.NAME}", facts, text, _table(("at", "field", "type", "one unit is", "range", "meaning"), rows))
    )


def _example() -> str:
    """One frame, byte by byte."""
    message = JuniorWheels(4711, 1, (0.5, -0.35), 0.25, 1, 1)
    frame = MavlinkCodec(system=HOST_SYSTEM, component=HOST_COMPONENT).encode(message)
    at = offsets(JuniorWheels)
    starts = [*at.values(), payload_length(JuniorWheels)]
    rows = [
        (frame[:1].hex(), "start of a MAVLink 2 frame"),
        (frame[1:2].hex(), f"{frame[1]} bytes of payload"),
        (frame[2:4].hex(" "), "flags: none"),
        (frame[4:5].hex(), "frame number, 0 to 255 and again from 0, for counting losses"),
        (frame[5:7].hex(" "), f"from system {HOST_SYSTEM}, component {HOST_COMPONENT}: the host"),
        (frame[7:10].hex(" "), f"message {message.ID}: {message.NAME}"),
    ]
    for index, name in enumerate(at):
        rows.append((frame[10 + starts[index] : 10 + starts[index + 1]].hex(" "), f"`{name}` = {getattr(message, name)}"))
    rows.append((frame[-2:].hex(" "), f"checksum, seed {crc_extra(JuniorWheels)}"))
    intro = "The left wheel half forward, the right wheel 35 % backward, for a quarter of a second:"
    return f"{intro}\n\n" + _table(("bytes", "meaning"), rows)


def _actions() -> str:
    word = {-1: "back", 0: "-", 1: "forward"}
    rows = [
        (
            str(action.value),
            action.name,
            spec.meaning,
            word[spec.left],
            word[spec.right],
            f"SPD_{spec.speed.name}" if spec.speed else "",
        )
        for action, spec in ACTIONS.items()
    ]
    return (
        "## Actions\n\n"
        f"A maneuver is 1 to {MAX_ACTIONS} of these (J. Liu and J. Wu, *Multi-Agent Robotic Systems*, 2001, Table 10.1).\n\n"
        + _table(("code", "name", "action", "left wheel", "right wheel", "speed"), rows)
    )


def _parameter_table(parameters: Sequence[Parameter]) -> str:
    rows = [
        (
            f"`{p.name}`",
            f"{p.default:g}",
            "read only" if p.read_only else f"{p.minimum:g} to {p.maximum:g}" + (", whole" if p.whole else ""),
            p.unit,
            p.text,
        )
        for p in parameters
    ]
    return _table(("name", "default", "range", "unit", "what it does"), rows)


def _parameters() -> str:
    return (
        "## Parameters\n\n"
        "Every parameter is a REAL32 (MAV_PARAM_TYPE 9) and survives power-off. PARAM_SET is answered by PARAM_VALUE with the "
        "value in force: what is out of range changes nothing. Asking for a name or an index that does not exist is answered "
        "with index 65535 and NaN.\n\n"
        "### A Junior's parameters\n\n" + _parameter_table(JUNIOR_PARAMETERS) + "\n\n"
        "### A micro-robot's parameters\n\n" + _parameter_table(SWARM_PARAMETERS)
    )


def _enums() -> str:
    parts = ["## Enumerations\n\nOf the standard ones (MAV_...), only what is used here is listed."]
    for enumeration in enumerations():
        prefix = f"{enumeration.name}_"
        rows = [
            (str(value), name.removeprefix(prefix) if name.startswith(prefix) else name, text)
            for name, value, text in enumeration.entries
        ]
        kind = "bit" if enumeration.bitmask else "value"
        parts.append(f"### {enumeration.name}\n\n{enumeration.text}\n\n" + _table((kind, "name", "meaning"), rows))
    return "\n\n".join(parts)


def _can() -> str:
    rows = []
    for frame in single_frames():
        function = frame.identifier >> FUNCTION_SHIFT
        fields = ", ".join(
            f"`{name}` {C_TYPES[wire.type]}{f'[{wire.count}]' if wire.count else ''}"
            + (f" ({_unit(wire)})" if _unit(wire) else "")
            for name, wire in frame.fields
        )
        arrow = _DIRECTIONS[Direction.UP if function & 1 else Direction.DOWN]
        rows.append((f"0x{frame.identifier:03X} + node", str(function), frame.name, arrow, fields, frame.text))
    return (
        "## CAN frames\n\n"
        "The same messages on a classical CAN 2.0A bus, for one host and up to 127 robots. `junior.dbc` is the database.\n\n"
        "An 11-bit identifier is `function << 7 | node`. The node is the robot, 0 for all; a function is twice the urgency "
        "(0 is the most urgent) plus the direction (0 to the robot, 1 from it). A frame with a 29-bit "
        "identifier, or under a function "
        "that is not listed here, is other people's. "
        "A system id above 127 has no place on the bus: SYS_ID refuses it there, and a robot that was given one elsewhere is "
        "node 127. These travel as single frames:\n\n"
        + _table(("identifier", "function", "name", "direction", "data, in order", "what it is"), rows)
        + "\n\n"
        "`cantools monitor -m 0x1FFFFF80 junior.dbc` shows them. The digests stand for JUNIOR_SENSORS, and leave in the order "
        "of their identifiers; what they do not carry of its time, ROBOT_STATUS tells. JUNIOR_WHEELS_FRAME belongs to the "
        "session that is open. SWARM_MOVE_FRAME does, too; what it does not carry is: no `face`, `speed` and `effort` 0, and "
        "`sectors` as SWARM_SENSE said last in this session. A move that needs anything else is a transfer. "
        "A function means the same whatever the role of the node; a robot leaves alone what is not for its role. "
        "JUNIOR_ESTOP is COMMAND_LONG 185, and is answered as that. "
        "A single frame of another length, or a JUNIOR_ESTOP of another value than 1, is counted and left alone.\n\n"
        "Everything else travels as a transfer: function "
        f"{TRANSFER_DOWN_FUNCTION} to a robot and {TRANSFER_UP_FUNCTION} from it, {REFEREE_DOWN_FUNCTION} and "
        f"{REFEREE_UP_FUNCTION} for the emulators' referee or table, which is a node of its own. "
        "A HEARTBEAT of the host goes to node 0. A transfer is cut into frames with one identifier:\n\n"
        + _table(
            ("byte", "holds"),
            [
                ("0", "transfer number << 5 (0 to 7, counted for each identifier) plus part, from 0"),
                ("1 to 7", "seven bytes of the following, the last part fewer:"),
                ("", "message id (u16), length of the payload (u8), the payload, CRC-16/MCRF4XX (u16)"),
            ],
        )
        + "\n\n"
        "The payload is MAVLink's, untrimmed, without the target fields. The CRC is over message id, length, payload and the "
        "message's seed. A missing part discards the whole, and a part that comes twice in a row is taken once; an "
        f"incomplete transfer is given up after {PART_TIMEOUT * 1000:.0f} ms without a part, or when another begins under "
        "its identifier. A payload may end early, with the rest 0, as an older host's does. Gaps in the transfer numbers "
        "count as lost messages.\n\n"
        "Every message of this page is in the database at full length, too, under a 29-bit identifier that is never sent "
        "(message id << 11 | 0x780, as "
        f"0x{long_identifier(JuniorWheels):X} for JUNIOR_WHEELS): for decoding payloads after reassembly."
    )


def reference() -> str:
    """The text of `docs/protocol.md`."""
    head = _HEAD.read_text(encoding="utf-8").rstrip("\n")
    head = head.replace("{version}", f"{PROTOCOL_MAJOR}.{PROTOCOL_MINOR}").replace("{example}", _example())
    head = head.replace("{hold_back}", str(HOLD_BACK))
    groups = (
        ("Any robot's messages", ROBOT_MESSAGES),
        ("Junior's own messages", JUNIOR_MESSAGES),
        ("The micro-robot's own messages", SWARM_MESSAGES),
        ("The referee's messages", REFEREE_MESSAGES),
        ("The table's messages", TABLE_MESSAGES),
        ("Standard messages", STANDARD_MESSAGES),
    )
    overview = _table(
        ("message", "direction", "what it says"),
        [
            (_anchor(message.NAME), _DIRECTIONS[message.DIRECTION], " ".join((message.__doc__ or "").split("\n\n")[0].split()))
            for _, group in groups
            for message in group
        ],
    )
    notes = {
        "The referee's messages": "Emulators only: with a physical robot there is no referee component, and a person judges.",
        "The micro-robot's own messages": "Since protocol 2.1. A robot of that role names product 2 in AUTOPILOT_VERSION.",
        "The table's messages": "Since protocol 2.1. Emulators only: component 25 of system 254 (127 on a CAN bus).",
        "Standard messages": "Declared field for field as in MAVLink's `common`.",
    }
    parts = [head, "## Messages\n\n" + overview]
    for title, group in groups:
        parts.append(f"## {title}" + (f"\n\n{notes[title]}" if title in notes else ""))
        parts += [_message(message) for message in group]
    parts += [_actions(), _parameters(), _enums(), _can()]
    return "\n\n".join(parts) + "\n"
