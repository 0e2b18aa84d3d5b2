"""Messages to and from payload bytes, with struct formats and functions compiled from the annotations.

The payload is MAVLink's: little-endian, fields sorted widest first, extensions behind. Framing is the codecs' business.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import isfinite, isnan
from operator import attrgetter
from struct import Struct
from typing import Any, Final

from firmware_protocol.errors import EncodeError
from firmware_protocol.messages import MESSAGES
from firmware_protocol.wire.compiled import FAULTS, Pack, PayloadField, Unpack, compile_pack, compile_unpack
from firmware_protocol.wire.fields import Message, Wire, wire_order
from firmware_protocol.wire.mavlink_layout import INTEGER_LIMITS, STRUCT_CODES, raw_limits

Convert = Callable[[Any], Any]


_INFINITE: Final = frozenset((float("inf"), float("-inf")))


class BadValueError(ValueError):
    """A payload holds a value its field can't have; never leaves the codecs."""


def units_of_one(wire: Wire) -> int:
    """Wire units in one unit of the Python value: dividing by it gives the nearest float, multiplying by the scale does not."""
    divisor = round(1 / wire.scale)
    if abs(divisor * wire.scale - 1) > 1e-9:
        raise TypeError(f"a scale must be one over a whole number, not {wire.scale!r}")
    return divisor


def _text_to_raw(wire: Wire) -> Convert:
    count = wire.count

    def convert(value: str) -> bytes:
        raw = value.encode()
        if len(raw) > count or b"\0" in raw:
            raise ValueError
        return raw

    return convert


def _text_from_raw(raw: bytes) -> str:
    return raw.partition(b"\0")[0].decode(errors="replace")


def _float_check(wire: Wire) -> Convert:
    low = float("-inf") if wire.minimum is None else wire.minimum
    high = float("inf") if wire.maximum is None else wire.maximum
    nan = wire.nan

    def check(value: float) -> float:
        if isfinite(value):
            if low <= value <= high:
                return value
        elif nan and isnan(value):
            return value
        raise BadValueError

    return check


def _is_free_float(wire: Wire) -> bool:
    """A float that may be anything but infinite."""
    return wire.type == "f32" and wire.nan and not wire.count and wire.minimum is None and wire.maximum is None


def _to_raw(wire: Wire) -> Convert | None:
    """How a Python value becomes a wire value: a function that raises ValueError or TypeError, or None for as it is."""
    if wire.type == "char":
        return _text_to_raw(wire)
    if wire.type == "f32":
        return _float_check(wire)
    low, high = raw_limits(wire)
    full = (low, high) == INTEGER_LIMITS[wire.type]
    invalid = wire.invalid
    if wire.scale == 1 and invalid is None and full:
        return None  # struct checks the range and that it is whole

    divisor = units_of_one(wire)

    def one(value: Any) -> int:  # noqa: ANN401 - a number, or None
        if value is None and invalid is not None:
            return invalid
        raw = value if divisor == 1 else round(value * divisor)
        if not low <= raw <= high:
            raise ValueError
        return raw  # type: ignore[no-any-return]

    def many(values: Sequence[Any]) -> Sequence[int]:
        raw = values if divisor == 1 else list(map(round, [value * divisor for value in values]))
        if not full and (min(raw) < low or max(raw) > high):  # where the type is full, struct checks the range
            raise ValueError
        return raw

    def many_or_none(values: Sequence[Any]) -> Sequence[Any]:
        missing = values.count(None)
        if missing == wire.count:
            return [invalid] * wire.count
        return [one(value) for value in values] if missing else many(values)

    if not wire.count:
        return one
    return many if invalid is None else many_or_none


def _from_raw(wire: Wire) -> Convert | None:
    """How a wire value becomes a Python value: a function that raises BadValueError, or None for as it is."""
    if wire.type == "char":
        return _text_from_raw
    if wire.type == "f32":
        return _float_check(wire)
    low, high = raw_limits(wire)
    full = (low, high) == INTEGER_LIMITS[wire.type]
    invalid = wire.invalid
    divisor = units_of_one(wire)
    if wire.scale == 1 and invalid is None and full:
        return None

    def one(raw: int) -> int | float | None:
        if raw == invalid:
            return None
        if not low <= raw <= high:
            raise BadValueError
        return raw if divisor == 1 else raw / divisor

    def many(raw: Sequence[int]) -> tuple[int | float | None, ...]:
        if not full and (min(raw) < low or max(raw) > high):
            raise BadValueError
        return tuple(raw) if divisor == 1 else tuple([value / divisor for value in raw])

    def many_or_none(raw: Sequence[int]) -> tuple[int | float | None, ...]:
        return tuple([one(value) for value in raw]) if invalid in raw else many(raw)

    if not wire.count:
        return one
    return many if invalid is None else many_or_none


class Payload:
    """The payload of one kind of message.

    `pack` and `unpack` are compiled when they are first called, and hand to `pack_any` and `unpack_any`, which do the same of
    whatever they are given, what they do not accept.

    Attributes:
        message: The message class.
        length: Bytes of the untrimmed payload.
        pack: As `pack_any`, compiled.
        unpack: As `unpack_any`, compiled.
    """

    pack: Pack
    unpack: Unpack

    def __init__(self, message: type[Message]) -> None:
        order = wire_order(message)
        codes = "".join(f"{wire.count or ''}{STRUCT_CODES[wire.type]}" for _, wire in order)
        layout = Struct("<" + codes)
        self.message = message
        self.length = layout.size
        self._order = order
        self._pack = layout.pack
        self._unpack = layout.unpack
        self.pack = self._first_pack
        self.unpack = self._first_unpack
        self._get = attrgetter(*(name for name, _ in order))
        self._names = tuple(name for name, _ in order)
        free = [name for name, wire in order if _is_free_float(wire)]
        together = len(free) > 1  # several are looked at in one go; attrgetter gives no tuple for one
        self._floats = attrgetter(*free) if together else None
        out: list[tuple[int, int, Convert | None]] = []
        into: list[tuple[int, int, str, Convert | None]] = []
        at = 0
        for index, (name, wire) in enumerate(order):
            count = 0 if wire.type == "char" else wire.count
            to_raw, from_raw = _to_raw(wire), _from_raw(wire)
            if count or (to_raw is not None and not (together and _is_free_float(wire))):
                out.append((index, count, to_raw))
            if count or from_raw is not None:
                into.append((at, count, name, from_raw))
            at += count or 1
        self._out = tuple(reversed(out))  # from the end: an array that is spread out moves what is behind it
        self._in = tuple(reversed(into))

    def _fields(self) -> list[PayloadField]:
        """What the compiled functions are made of."""
        fields: list[PayloadField] = []
        for name, wire in self._order:
            if wire.type == "char":
                fields.append(PayloadField(name, wire, to_raw=_text_to_raw(wire), from_raw=_text_from_raw))
            else:
                fields.append(PayloadField(name, wire, 1 if wire.type == "f32" else units_of_one(wire)))
        return fields

    def _first_pack(self, message: Message) -> bytes:
        """Compile `pack`, and call it."""
        self.pack = compile_pack(self.message, self._fields(), self._pack, self.pack_any)
        return self.pack(message)

    def _first_unpack(self, payload: bytes) -> Message:
        """Compile `unpack`, and call it."""
        self.unpack = compile_unpack(self.message, self._fields(), self._unpack, self.length, self.unpack_any)
        return self.unpack(payload)

    def pack_any(self, message: Message) -> bytes:
        """The untrimmed payload.

        Args:
            message: A message of this kind.

        Raises:
            EncodeError: A field is out of range, of the wrong type or of the wrong length.
        """
        try:
            values = list(self._get(message))
            for index, count, convert in self._out:
                value = values[index]
                if not count:
                    values[index] = value if convert is None else convert(value)
                elif len(value) == count:
                    values[index : index + 1] = value if convert is None else convert(value)
                else:
                    raise ValueError
            if self._floats is not None and not _INFINITE.isdisjoint(self._floats(message)):
                raise ValueError
            return self._pack(*values)
        except FAULTS as cause:
            raise self._explain(message) from cause

    def unpack_any(self, payload: bytes) -> Message:
        """A message from its payload.

        Args:
            payload: At most `length` bytes; zeros are supplied where it has been trimmed.

        Returns:
            The message; its fields hold the Python values.

        Raises:
            BadValueError: A value is out of range.
        """
        values = list(self._unpack(payload if len(payload) == self.length else payload.ljust(self.length, b"\0")))
        at, count, name = 0, 0, ""
        try:
            for at, count, name, convert in self._in:  # noqa: B007 - for the message below
                if not count:
                    values[at] = values[at] if convert is None else convert(values[at])
                else:
                    value = tuple(values[at : at + count])
                    values[at : at + count] = (value if convert is None else convert(value),)
        except BadValueError:
            shown = values[at : at + count] if count else values[at]
            raise BadValueError(f"{self.message.NAME}.{name} can't be {shown!r} on the wire") from None
        message = self.message.__new__(self.message)
        # Past the frozen __setattr__: one assignment per field would cost more than all the rest.
        message.__dict__.update(zip(self._names, values, strict=True))
        return message

    def _explain(self, message: Message) -> EncodeError:
        """Which field the wire can't carry, and what it could."""
        for name, wire in wire_order(self.message):
            if not _fits(getattr(message, name), wire):
                shown = "a secret" if wire.secret else repr(getattr(message, name))
                what = f"{self.message.NAME}.{name} = {shown}"
                return EncodeError(f"{what} can't be sent: it takes {accepted(wire)}")
        return EncodeError(f"{self.message.NAME} can't be sent: {message!r}")


def _fits(value: Any, wire: Wire) -> bool:  # noqa: ANN401 - anything a caller may have put there
    convert = _to_raw(wire)
    try:
        if wire.type == "char":
            return convert is not None and bool(Struct(f"{wire.count}s").pack(convert(value)))
        values = value if wire.count else (value,)
        if wire.count and len(values) != wire.count:
            return False
        raw = values if convert is None else (convert(values) if wire.count else (convert(value),))
        Struct(f"<{max(1, wire.count)}{STRUCT_CODES[wire.type]}").pack(*raw)
    except FAULTS:
        return False
    return True


def accepted(wire: Wire) -> str:
    """What a field accepts, in words.

    Args:
        wire: The field.

    Returns:
        As `2 numbers from -1 to 1`.
    """
    if wire.type == "char":
        return f"text of at most {wire.count} bytes in UTF-8, without NUL"
    many = f"{wire.count} " if wire.count else "a "
    plural = "s" if wire.count else ""
    if wire.type == "f32":
        limits = "" if wire.minimum is None or wire.maximum is None else f" from {wire.minimum:g} to {wire.maximum:g}"
        kind = f"finite number{plural}{limits}" + (" or NaN" if wire.nan else "")
    else:
        low, high = raw_limits(wire)
        kind = f"whole number{plural} from {low} to {high}"
        if wire.scale != 1:
            divisor = units_of_one(wire)
            kind = f"number{plural} from {low / divisor:.10g} to {high / divisor:.10g}"
    unit = f" {wire.unit}" if wire.unit and wire.scale != 1 else ""
    return many + kind + unit + (" or None" if wire.invalid is not None else "")


PAYLOADS: Final[dict[int, Payload]] = {number: Payload(message) for number, message in MESSAGES.items()}
"""The payload of every message, by id."""
