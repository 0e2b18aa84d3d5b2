"""Hand-made protobuf encoders and decoders: one per schema, compiled once.

python-protobuf needs several microseconds to fill a message field by field; here runs of fixed-width fields are packed
by one `struct` call with the tags as constants. The tests parse the result with google.protobuf.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from math import isnan, nan
from struct import Struct
from typing import Any, Final

from hil.mcaplog.records import BridgeStep, WireBytes
from hil.mcaplog.schemas import SENDER_FIELDS, SENDER_NUMBERS, VARIABLE, Field, FieldType, Schema, record_schema

Encoder = Callable[[object], bytes]
"""Object with the schema's fields as attributes -> protobuf."""

_FORMATS: Final[dict[FieldType, str]] = {
    "double": "d", "fixed32": "I", "sfixed32": "i", "fixed64": "Q", "sfixed64": "q", "bool": "?", "enum": "2s",
}  # fmt: skip
_WIRE_KIND: Final[dict[FieldType, int]] = {
    "double": 1, "fixed64": 1, "sfixed64": 1, "fixed32": 5, "sfixed32": 5, "bool": 0, "enum": 0, "string": 2, "bytes": 2,
}  # fmt: skip
_ENUM_BYTES: Final = tuple(bytes((value & 0x7F | 0x80, value >> 7)) for value in range(256))
"""Varints of 0..255, all of two bytes."""


NO_FRAME: Final = 256
"""As a frame's sequence number: not known."""


def varint(value: int) -> bytes:
    """A protobuf varint.

    Args:
        value: Not negative.
    """
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def _tag(number: int, kind: int) -> bytes:
    return varint(number << 3 | kind)


def _is_fixed(field: Field) -> bool:
    return field.kind not in ("string", "bytes") and field.count != VARIABLE


def compile_encoder(schema: Schema) -> Encoder:
    """Make the encoder of a schema, the sender's fields left out.

    Args:
        schema: The schema.

    Returns:
        A function from an object with the schema's fields to the protobuf bytes; it raises `struct.error` where a tuple
        has the wrong length or a number does not fit, which is a programming error.
    """
    pieces: list[Encoder] = []
    run: list[Field] = []
    for field in schema.fields:
        if field.name in SENDER_FIELDS:
            continue
        if _is_fixed(field):
            run.append(field)
            continue
        if run:
            pieces.append(_fixed_run(run))
            run = []
        pieces.append(_variable(field))
    if run:
        pieces.append(_fixed_run(run))
    if len(pieces) == 1:
        return pieces[0]
    return lambda value: b"".join([piece(value) for piece in pieces])


@cache
def sender_suffix(system: int, component: int, frame: int = NO_FRAME) -> bytes:
    """The fields that say who sent a message in which frame, to be appended to its encoding.

    Args:
        system: MAVLink system id, 0..255.
        component: MAVLink component id, 0..255.
        frame: Frame sequence number, 0..255.
    """
    tags = [_tag(number, _WIRE_KIND["fixed32"]) for number in SENDER_NUMBERS]
    item = Struct("<I").pack
    return b"".join(tag + item(value) for tag, value in zip(tags, (system, component, frame), strict=True))


def _fixed_run(run: Sequence[Field]) -> Encoder:
    """Encoder of neighbouring fields of fixed width: a template of struct arguments in which only the values change."""
    layout = "<"
    template: list[object] = []
    plain: list[tuple[int | slice, str]] = []
    converted: list[tuple[int | slice, str, Callable[[Any], Any]]] = []
    for field in run:
        letter = _FORMATS[field.kind]
        tag = _tag(field.number, _WIRE_KIND[field.kind])
        if field.count:
            tag = _tag(field.number, 2) + varint(field.count * Struct("<" + letter).size)
        layout += f"{len(tag)}s" + letter * (field.count or 1)
        template.append(tag)
        start = len(template)
        template += [0] * (field.count or 1)
        place = slice(start, len(template)) if field.count else start
        convert = _converter(field)
        if convert is None:
            plain.append((place, field.name))
        else:
            converted.append((place, field.name, convert))
    pack = Struct(layout).pack

    def encode(value: object) -> bytes:
        flat: list[Any] = template.copy()
        for place, name in plain:
            flat[place] = getattr(value, name)
        for place, name, change in converted:
            flat[place] = change(getattr(value, name))
        return pack(*flat)

    return encode


def _converter(field: Field) -> Callable[[Any], Any] | None:
    if field.kind == "enum":
        table = _ENUM_BYTES
        return (lambda values: [table[v] for v in values]) if field.count else table.__getitem__
    if field.nullable:
        return _nans if field.count else _nan
    return None


def _nan(value: float | None) -> float:
    return nan if value is None else value


def _nans(values: Sequence[float | None]) -> list[float]:
    return [nan if value is None else value for value in values]


def _variable(field: Field) -> Encoder:
    """Encoder of a text, of bytes, or of a tuple of any length."""
    name, tag = field.name, _tag(field.number, 2)
    if field.kind in ("string", "bytes"):
        raw: Callable[[Any], bytes] = bytes if field.kind == "bytes" else _utf8

        def one(value: object) -> bytes:
            data = raw(getattr(value, name))
            return tag + varint(len(data)) + data

        def many(value: object) -> bytes:
            return b"".join([tag + varint(len(data)) + data for data in map(raw, getattr(value, name))])

        return many if field.count else one
    item = Struct("<" + _FORMATS[field.kind])

    def packed(value: object) -> bytes:
        values = getattr(value, name)
        if not values:
            return b""
        return tag + varint(len(values) * item.size) + b"".join(map(item.pack, values))

    return packed


def _utf8(text: str) -> bytes:
    return text.encode("utf-8", errors="replace")


def wire_encoder(direction: str, link: str) -> Callable[[bytes], bytes]:
    """A faster encoder of `WireBytes` with everything but the bytes fixed.

    Args:
        direction: rx or tx.
        link: Address of the link.
    """
    schema = record_schema(WireBytes)
    head = compile_encoder(replace(schema, fields=schema.fields[:2]))(WireBytes(direction, link, b""))
    heads = tuple(head + _tag(schema.fields[2].number, 2) + varint(size) for size in range(1024))

    def encode(data: bytes) -> bytes:
        size = len(data)
        return heads[size] + data if size < 1024 else head + _tag(schema.fields[2].number, 2) + varint(size) + data

    return encode


def step_encoder() -> Callable[[float, Sequence[tuple[float, bytes]], tuple[str, ...]], bytes]:
    """A faster encoder of `BridgeStep`, for steps with at most one chunk and no input, which most are."""
    schema = record_schema(BridgeStep)
    general = compile_encoder(schema)
    clock, times, sizes = (_tag(field.number, 1 if index == 0 else 2) for index, field in enumerate(schema.fields[:3]))
    times, sizes = times + varint(8), sizes + varint(8)
    empty = Struct(f"<{len(clock)}sd").pack
    single = Struct(f"<{len(clock)}sd{len(times)}sd{len(sizes)}sq").pack

    def encode(time: float, chunks: Sequence[tuple[float, bytes]], inputs: tuple[str, ...]) -> bytes:
        if inputs or len(chunks) > 1:
            stamps = tuple(stamp for stamp, _ in chunks)
            return general(BridgeStep(time, stamps, tuple(len(data) for _, data in chunks), inputs))
        if not chunks:
            return empty(clock, time)
        ((stamp, data),) = chunks
        return single(clock, time, times, stamp, sizes, len(data))

    return encode


def rebuild(schema: Schema, parsed: object) -> object:
    """Make the dataclass again from a parsed protobuf message.

    Args:
        schema: The schema of the dataclass as this program knows it.
        parsed: The protobuf message as the log's own descriptor has parsed it.

    Returns:
        An instance of `schema.python`.

    Raises:
        AttributeError, TypeError, ValueError: The log was written by a program whose messages differ.
    """
    values: dict[str, Any] = {}
    for field in schema.fields:
        if field.name in SENDER_FIELDS:
            continue
        value = getattr(parsed, field.name)
        if field.count:
            value = tuple(value)
            if field.nullable:
                value = tuple(None if isnan(v) else v for v in value)
        elif field.nullable and isnan(value):
            value = None
        values[field.name] = value
    return schema.python(**values)
