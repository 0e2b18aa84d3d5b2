"""Hand-made protobuf encoders and decoders: one per schema, compiled once.

python-protobuf needs several microseconds to fill a message field by field; here runs of fixed-width fields are packed
by one `struct` call with the tags as constants. The tests parse the result with google.protobuf.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import MISSING, fields, replace
from functools import cache
from math import isnan, nan
from operator import attrgetter
from struct import Struct
from typing import Any, Final

from firmware_protocol.errors import bare_text
from hil.bridge.taps import NOTHING, Circumstances
from hil.mcaplog.records import BridgeStep, WireBytes
from hil.mcaplog.schemas import SENDER_FIELDS, SENDER_NUMBERS, VARIABLE, FieldType, Schema, SchemaField, record_schema

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


def field_tag(field: SchemaField) -> bytes:
    """What stands before a field of fixed width: its tag, and of several values their length.

    Args:
        field: The field; neither text nor bytes nor of any length.
    """
    if field.count:
        return _tag(field.number, 2) + varint(field.count * Struct("<" + _FORMATS[field.kind]).size)
    return _tag(field.number, _WIRE_KIND[field.kind])


def _is_fixed(field: SchemaField) -> bool:
    return field.kind not in ("string", "bytes") and field.count != VARIABLE


def compile_encoder(schema: Schema) -> Encoder:
    """Make the encoder of a schema, the sender's fields left out.

    Args:
        schema: The schema.

    Returns:
        A function from an object with the schema's fields to the protobuf bytes; it raises `struct.error` where a number
        does not fit and ValueError where a tuple has the wrong length, which is a programming error.
    """
    source = _EncoderSource()
    run: list[SchemaField] = []
    for field in schema.fields:
        if field.name in SENDER_FIELDS:
            continue
        if _is_fixed(field):
            run.append(field)
            continue
        source.add_fixed(run)
        source.add_variable(field)
        run = []
    source.add_fixed(run)
    return source.function(schema.name)


@cache
def sender_suffix(system: int, component: int, frame: int = NO_FRAME) -> bytes:
    """The fields that say who sent a message in which frame, to be appended to its encoding.

    Args:
        system: MAVLink system id, 0..255.
        component: MAVLink component id, 0..255.
        frame: Frame sequence number, 0..255.
    """
    one, two, three = _SUFFIX_TAGS
    return _SUFFIX.pack(one, system, two, component, three, frame)


_SUFFIX_TAGS: Final = tuple(_tag(number, _WIRE_KIND["fixed32"]) for number in SENDER_NUMBERS)
_SUFFIX: Final = Struct("<" + "".join(f"{len(tag)}sI" for tag in _SUFFIX_TAGS))


class _EncoderSource:
    """The source of an encoder under way."""

    def __init__(self) -> None:
        self._names: dict[str, Any] = {"nan": nan, "varints": _ENUM_BYTES}
        self._lines: list[str] = []
        self._parts: list[str] = []

    def add_fixed(self, run: Sequence[SchemaField]) -> None:
        """Encode neighbouring fields of fixed width by one `struct` call.

        Args:
            run: The fields; where there is none, nothing is added.
        """
        if not run:
            return
        layout, arguments = "<", []
        for field in run:
            letter = _FORMATS[field.kind]
            tag = field_tag(field)
            values = [f"value.{field.name}"]
            if field.count:
                values = [f"{field.name}_{index}" for index in range(field.count)]
                self._lines.append(f"{', '.join(values)}, = value.{field.name}")
            layout += f"{len(tag)}s" + letter * len(values)
            arguments += [repr(tag), *(_converted(field, value) for value in values)]
        pack = f"pack{len(self._parts)}"
        self._names[pack] = Struct(layout).pack
        self._parts.append(f"{pack}({', '.join(arguments)})")

    def add_variable(self, field: SchemaField) -> None:
        """Encode a text, bytes, or a tuple of any length.

        Args:
            field: The field.
        """
        encode = f"encode{len(self._parts)}"
        self._names[encode] = _variable(field)
        self._parts.append(f"{encode}(value)")

    def function(self, name: str) -> Encoder:
        """Compile it.

        Args:
            name: Of what it encodes.
        """
        head = "def encode(value):"
        code = "\n    ".join([head, *self._lines, f"return {' + '.join(self._parts)}"])
        exec(compile(code, f"<encodes {name}>", "exec"), self._names)  # noqa: S102 - made of our own annotations alone
        encode: Encoder = self._names["encode"]
        return encode


def _converted(field: SchemaField, value: str) -> str:
    """The expression that makes of a field's value, or of one of several, what `struct` takes."""
    if field.kind == "enum":
        return f"varints[{value}]"
    return f"nan if {value} is None else {value}" if field.nullable else value


def _variable(field: SchemaField) -> Encoder:
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


def step_encoder(network: str) -> Callable[[float, Sequence[tuple[float, bytes]], Circumstances], bytes]:
    """A faster encoder of `BridgeStep`, for steps with at most one chunk that meet nothing else, which most are.

    Args:
        network: Name of the network.
    """
    schema = record_schema(BridgeStep)
    general = compile_encoder(schema)
    clock, times, sizes = (_tag(field.number, 1 if index == 0 else 2) for index, field in enumerate(schema.fields[:3]))
    times, sizes = times + varint(8), sizes + varint(8)
    named = next(field for field in schema.fields if field.name == "network")
    name = network.encode("utf-8", errors="replace")
    suffix = _tag(named.number, 2) + varint(len(name)) + name
    empty = Struct(f"<{len(clock)}sd").pack
    single = Struct(f"<{len(clock)}sd{len(times)}sd{len(sizes)}sq").pack

    def encode(time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> bytes:
        if met is not NOTHING or len(chunks) > 1:
            return general(_step(network, time, chunks, met))
        if not chunks:
            return empty(clock, time) + suffix
        ((stamp, data),) = chunks
        return single(clock, time, times, stamp, sizes, len(data)) + suffix

    return encode


def _step(network: str, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> BridgeStep:
    return BridgeStep(
        clock=time,
        chunk_times=tuple(stamp for stamp, _ in chunks),
        chunk_sizes=tuple(len(data) for _, data in chunks),
        inputs=tuple(one.what for one in met.inputs),
        input_robots=tuple(one.robot for one in met.inputs),
        network=network,
        lost="" if met.lost is None else bare_text(met.lost),
        lost_link="" if met.lost is None else met.lost.url,
        ended="" if met.ended is None else bare_text(met.ended),
        ended_link="" if met.ended is None else met.ended.url,
        back=met.back,
        news=met.news,
        dropped=met.dropped,
    )


def compile_rebuilder(schema: Schema, absent: Collection[str] = ()) -> Callable[[object], Any]:
    """Make the way back: from a parsed protobuf message to the dataclass.

    Args:
        schema: The schema of the dataclass as this program knows it.
        absent: Fields that the log does not have: they are as the dataclass has them by default, or 0.

    Returns:
        A function from the protobuf message, as the log's own descriptor has parsed it, to an instance of
        `schema.python`; it raises AttributeError, TypeError or ValueError where the log was written by a program whose
        messages differ.
    """
    own = [field for field in schema.fields if field.name not in SENDER_FIELDS]
    defaults = {one.name: one.default for one in fields(schema.python) if one.default is not MISSING}
    given = {index: defaults.get(field.name, 0) for index, field in enumerate(own) if field.name in absent}
    names = [own[0].name if index in given else field.name for index, field in enumerate(own)]
    get = attrgetter(*names, own[0].name)  # one more, for a tuple even of one
    tuples = [index for index, field in enumerate(own) if field.count]
    counted = [(index, field.count) for index, field in enumerate(own) if field.count > 0]
    nullable = [index for index, field in enumerate(own) if field.nullable and field.name not in absent]
    make = schema.python

    def rebuild(parsed: object) -> Any:  # noqa: ANN401 - whatever the schema says
        values: list[Any] = list(get(parsed))
        values.pop()
        for index, value in given.items():
            values[index] = value
        for index in tuples:
            values[index] = tuple(values[index])
        for index, count in counted:
            if len(values[index]) != count:
                raise ValueError(f"{len(values[index])} elements, not {count}")
        for index in nullable:
            value = values[index]
            if index in tuples:
                values[index] = tuple(None if isnan(one) else one for one in value)
            elif isnan(value):
                values[index] = None
        return make(*values)

    return rebuild


def read_sender(data: bytes) -> tuple[tuple[int, int], int | None] | None:
    """Who sent a robot message in which frame, without decoding the rest.

    Args:
        data: The entry, as `compile_encoder` and `sender_suffix` made it.

    Returns:
        (system, component) and the frame's sequence number, None where it is not known; None for anything else.
    """
    if len(data) < _SUFFIX.size:
        return None
    one, system, two, component, three, frame = _SUFFIX.unpack_from(data, len(data) - _SUFFIX.size)
    if (one, two, three) != _SUFFIX_TAGS:
        return None
    return (system, component), None if frame == NO_FRAME else frame
