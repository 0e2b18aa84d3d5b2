"""Protobuf schemas made at run time from the dataclasses, so that there is nothing to keep in step.

Every field has a fixed width on the wire wherever its type allows it (`fixed32`, `fixed64`, `double`, one-byte `bool`,
two-byte enumerations), so that a whole message is packed by a single `struct` call (see `encode`). That is plain, valid
protobuf: any reader decodes it from the descriptor that the log carries. Compression takes the zeros out again.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum
from functools import cache
from types import NoneType, UnionType
from typing import Any, Final, Literal, get_args, get_origin, get_type_hints

from google.protobuf import descriptor_pb2 as pb

from firmware_protocol.wire.fields import Message, Wire, wire_fields

PACKAGE: Final = "hil"
SENDER_FIELDS: Final = ("sender_system", "sender_component", "frame")
"""Extra fields of every robot message in a log: who sent it, and the frame's sequence number (of received ones)."""
SENDER_NUMBERS: Final = (1001, 1002, 1003)
SENDER_TEXTS: Final = (
    "MAVLink system of the sender",
    "MAVLink component of the sender",
    "frame sequence number; 256: not known",
)

FieldType = Literal["double", "fixed32", "sfixed32", "fixed64", "sfixed64", "bool", "string", "bytes", "enum"]
VARIABLE: Final = -1
"""As a field's count: repeated, any number of elements."""

_WIRE_TYPES: Final[dict[str, FieldType]] = {
    "u8": "fixed32", "u16": "fixed32", "u32": "fixed32", "i8": "sfixed32", "i16": "sfixed32", "i32": "sfixed32",
    "u64": "fixed64", "i64": "sfixed64", "f32": "double", "char": "string",
}  # fmt: skip
_PYTHON_TYPES: Final[dict[type, FieldType]] = {
    bool: "bool", int: "sfixed64", float: "double", str: "string", bytes: "bytes",
}  # fmt: skip
_PROTO_TYPES: Final[dict[FieldType, Any]] = {
    "double": pb.FieldDescriptorProto.TYPE_DOUBLE,
    "fixed32": pb.FieldDescriptorProto.TYPE_FIXED32,
    "sfixed32": pb.FieldDescriptorProto.TYPE_SFIXED32,
    "fixed64": pb.FieldDescriptorProto.TYPE_FIXED64,
    "sfixed64": pb.FieldDescriptorProto.TYPE_SFIXED64,
    "bool": pb.FieldDescriptorProto.TYPE_BOOL,
    "string": pb.FieldDescriptorProto.TYPE_STRING,
    "bytes": pb.FieldDescriptorProto.TYPE_BYTES,
    "enum": pb.FieldDescriptorProto.TYPE_ENUM,
}


@dataclass(frozen=True)
class SchemaField:
    """One field of a schema.

    Attributes:
        name: Name in the dataclass and in the log.
        kind: Protobuf type.
        number: Protobuf field number.
        count: 0 for a scalar, n for a tuple of n, VARIABLE for a tuple of any length.
        enum: The names of the values, for kind `enum`.
        nullable: The Python value may be None, which is a NaN in the log.
        text: Unit and meaning.
        added: Logs of before the field was added do not have it: it is as the dataclass has it by default then.
    """

    name: str
    kind: FieldType
    number: int
    count: int = 0
    enum: type[IntEnum] | None = None
    nullable: bool = False
    text: str = ""
    added: bool = False


@dataclass(frozen=True)
class Schema:
    """What entries of one kind look like in a log.

    Attributes:
        name: Full protobuf name.
        topic: Topic of the robot messages of this kind; empty for other records.
        python: The dataclass.
        fields: Its fields, in order.
        text: Its meaning.
    """

    name: str
    topic: str
    python: type
    fields: tuple[SchemaField, ...]
    text: str

    @property
    def data(self) -> bytes:
        """The descriptor, as a serialized FileDescriptorSet: what a log embeds."""
        return _describe(self)


RENAMED: Final[dict[str, str]] = {
    f"{PACKAGE}.Junior{name}": f"{PACKAGE}.Robot{name}" for name in ("Ack", "Status", "Session", "ResultAck")
}
"""What messages of protocol 1.0 are called since: their schemas, and below their topics."""
RENAMED_TOPICS: Final[dict[str, str]] = {
    f"/junior/{name}": f"/robot/{name}" for name in ("ack", "status", "session", "result_ack")
}
SINCE_2_0: Final = frozenset({"target_system", "target_component", "host"})
"""Fields that logs of protocol 1.0 do not have where they are read as those of 2.0: they are 0 then, not filled in."""


def matches(field: SchemaField, found: Any) -> bool:  # noqa: ANN401 - protobuf's own, whichever it is made of
    """Whether a field is in a log as this program has it.

    Args:
        field: As this program has it.
        found: The field of this name in the log's descriptor; None where there is none.
    """
    if found is None:
        return field.added or field.name in SINCE_2_0
    repeated = found.is_repeated if hasattr(found, "is_repeated") else found.label == found.LABEL_REPEATED
    return bool(found.type == _PROTO_TYPES[field.kind] and bool(repeated) == bool(field.count))


_MESSAGE_SCHEMAS: Final[dict[type[Message], Schema]] = {}
_RECORD_SCHEMAS: Final[dict[type, Schema]] = {}


def topic_of(message: type[Message]) -> str:
    """Topic of a robot message: `/robot/status`, `/junior/sensors`, `/referee/state`, `/mavlink/heartbeat`.

    Args:
        message: The message's class.
    """
    name = message.NAME.lower()
    for room in ("robot", "junior", "referee", "swarm"):
        if name.startswith(room + "_"):
            return f"/{room}/{name[len(room) + 1 :]}"
    return f"/mavlink/{name}"


def message_schema(message: type[Message]) -> Schema:
    """The schema of a robot message: its own fields, then the sender.

    Args:
        message: The message's class.
    """
    if message not in _MESSAGE_SCHEMAS:
        _MESSAGE_SCHEMAS[message] = _read_message(message)
    return _MESSAGE_SCHEMAS[message]


def _read_message(message: type[Message]) -> Schema:
    found = [_wire_field(name, wire, number) for number, (name, wire) in enumerate(wire_fields(message), 1)]
    found += [
        SchemaField(name, "fixed32", number, text=text)
        for name, number, text in zip(SENDER_FIELDS, SENDER_NUMBERS, SENDER_TEXTS, strict=True)
    ]
    return Schema(f"{PACKAGE}.{message.__name__}", topic_of(message), message, tuple(found), _first_line(message))


def record_schema(record: type) -> Schema:
    """The schema of one of the dataclasses in `records`.

    Args:
        record: The dataclass.

    Raises:
        TypeError: A field has a type that a log cannot hold.
    """
    if record not in _RECORD_SCHEMAS:
        _RECORD_SCHEMAS[record] = _read_record(record)
    return _RECORD_SCHEMAS[record]


def _read_record(record: type) -> Schema:
    hints = get_type_hints(record, include_extras=True)
    found: list[SchemaField] = []
    for number, field in enumerate(fields(record), 1):
        base, *notes = get_args(hints[field.name]) or (hints[field.name],)
        count, nullable = 0, False
        if get_origin(base) is tuple:
            base, count = get_args(base)[0], VARIABLE
        elif isinstance(base, UnionType) and set(get_args(base)) == {float, NoneType}:
            base, nullable = float, True
        if base not in _PYTHON_TYPES:
            raise TypeError(f"{record.__name__}.{field.name}: a log cannot hold {base}")
        found.append(
            SchemaField(
                field.name,
                _PYTHON_TYPES[base],
                number,
                count,
                nullable=nullable,
                text="; ".join(map(str, notes)),
                added=field.name in getattr(record, "ADDED", ()),
            )
        )
    return Schema(f"{PACKAGE}.{record.__name__}", "", record, tuple(found), _first_line(record))


def _wire_field(name: str, wire: Wire, number: int) -> SchemaField:
    note = "; ".join(part for part in (wire.unit, wire.text) if part)
    count = 0 if wire.type == "char" else wire.count
    if wire.type == "u8" and wire.enum is not None and issubclass(wire.enum, IntEnum):
        return SchemaField(name, "enum", number, count, wire.enum, text=note)
    nullable = wire.invalid is not None
    kind = "double" if nullable or wire.scale != 1 else _WIRE_TYPES[wire.type]
    return SchemaField(name, kind, number, count, nullable=nullable, text=note)


def _first_line(python: type) -> str:
    return (python.__doc__ or "").strip().split("\n")[0]


@cache
def _describe(schema: Schema) -> bytes:
    short = schema.name.removeprefix(PACKAGE + ".")
    file = pb.FileDescriptorProto(name=f"{PACKAGE}/{short}.proto", package=PACKAGE, syntax="proto3")
    message = file.message_type.add(name=short)
    _comment(file, [4, 0], schema.text)
    for index, field in enumerate(schema.fields):
        entry = message.field.add(name=field.name, number=field.number, type=_PROTO_TYPES[field.kind], json_name=field.name)
        entry.label = entry.LABEL_REPEATED if field.count else entry.LABEL_OPTIONAL
        if field.enum is not None:
            entry.type_name = f".{schema.name}.{field.enum.__name__}.Value"
            _add_enum(message, field.enum)
        _comment(file, [4, 0, 2, index], field.text)
    return pb.FileDescriptorSet(file=[file]).SerializeToString(deterministic=True)


def _add_enum(message: pb.DescriptorProto, enum: type[IntEnum]) -> None:
    """Put an enumeration into a holder of its own, since protobuf's value names share their parent's scope."""
    if any(holder.name == enum.__name__ for holder in message.nested_type):
        return
    values = message.nested_type.add(name=enum.__name__).enum_type.add(name="Value").value
    for member in sorted(enum, key=int):
        values.add(name=member.name, number=int(member))


def _comment(file: pb.FileDescriptorProto, path: list[int], text: str) -> None:
    if text:
        file.source_code_info.location.add(path=path, span=[0, 0, 0], leading_comments=f" {text}\n")
