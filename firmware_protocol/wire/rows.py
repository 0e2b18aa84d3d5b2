"""Messages of one kind as rows of an array, in wire units, with types made from the same annotations as the objects.

A row is the untrimmed payload: `row.tobytes()` is what `Payload.pack` makes of the object. `column` gives a field in units of
the Python value, `rows_of` makes rows of such columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from operator import and_
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.errors import EncodeError
from firmware_protocol.messages import MESSAGES
from firmware_protocol.wire.fields import Message, Wire, wire_order
from firmware_protocol.wire.mavlink_layout import INTEGER_LIMITS, raw_limits
from firmware_protocol.wire.payload import PAYLOADS, accepted, units_of_one

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

Rows = np.ndarray[tuple[int], np.dtype[np.void]]
"""Messages of one kind, one in a row."""

_TYPES: Final[dict[str, str]] = {
    "u8": "u1", "i8": "i1", "u16": "<u2", "i16": "<i2", "u32": "<u4", "i32": "<i4", "u64": "<u8", "i64": "<i8", "f32": "<f4",
}  # fmt: skip


def _row_type(message: type[Message]) -> np.dtype[np.void]:
    fields: list[Any] = []
    for name, wire in wire_order(message):
        kind = f"S{wire.count}" if wire.type == "char" else _TYPES[wire.type]
        fields.append((name, kind, (wire.count,)) if wire.count and wire.type != "char" else (name, kind))
    return np.dtype(fields)


ROWS: Final[dict[type[Message], np.dtype[np.void]]] = {message: _row_type(message) for message in MESSAGES.values()}
"""The type of a row of each message."""


_WIRES: Final = {message: dict(wire_order(message)) for message in MESSAGES.values()}


@dataclass(frozen=True)
class _RangeCheck:
    """A field that can't hold everything that its type can.

    Attributes:
        name: Of the field.
        wire: Its annotation.
        low: Least wire value, as far as the type has lesser ones.
        high: Greatest, likewise.
    """

    name: str
    wire: Wire
    low: int | float | None
    high: int | float | None

    def passes(self, values: NDArray[Any]) -> NDArray[np.bool_]:
        """Which rows hold nothing else."""
        parts: list[NDArray[np.bool_]] = []
        if self.wire.type == "f32":
            parts.append(~np.isinf(values) if self.wire.nan else np.isfinite(values))
        if self.low is not None:
            parts.append(values >= self.low)
        if self.high is not None:
            parts.append(values <= self.high)
        good = reduce(and_, parts)
        if self.wire.invalid is not None:
            good |= values == self.wire.invalid
        return good if good.ndim == 1 else np.all(good, axis=1)


def _checks(message: type[Message]) -> tuple[_RangeCheck, ...]:
    found = []
    for name, wire in wire_order(message):
        if wire.type == "char":
            continue
        if wire.type == "f32":
            found.append(_RangeCheck(name, wire, wire.minimum, wire.maximum))
            continue
        least, greatest = INTEGER_LIMITS[wire.type]
        low, high = raw_limits(wire)
        least += least == wire.invalid
        greatest -= greatest == wire.invalid
        if (low, high) != (least, greatest):
            found.append(_RangeCheck(name, wire, low if low > least else None, high if high < greatest else None))
    return tuple(found)


_CHECKS: Final = {message: _checks(message) for message in MESSAGES.values()}


def good_rows(message: type[Message], rows: Rows) -> NDArray[np.bool_]:
    """Which rows hold no value that its field can't have.

    Args:
        message: Class of the messages.
        rows: The rows.
    """
    good = np.ones(len(rows), bool)
    for check in _CHECKS[message]:
        good &= check.passes(rows[check.name])
    return good


def row_bytes(rows: Rows) -> NDArray[np.uint8]:
    """Rows as bytes, shape (rows, length of the payload); a view where they lie together."""
    return np.ascontiguousarray(rows).view(np.uint8).reshape(len(rows), rows.dtype.itemsize)


def take_rows(rows: Rows, which: NDArray[np.intp]) -> Rows:
    """Some rows; quicker than by index, which copies field by field.

    Args:
        rows: Rows that lie together.
        which: Their numbers.
    """
    taken: Rows = rows.view(np.dtype((np.void, rows.dtype.itemsize)))[which].view(rows.dtype)
    return taken


def column(message: type[Message], rows: Rows, name: str) -> NDArray[Any]:
    """One field of all rows, in units of the Python value.

    Args:
        message: Class of the messages.
        rows: The rows.
        name: Of the field.

    Returns:
        Shape (rows,), of an array field (rows, elements): whole numbers of a field that has no scale, else floats, with NaN
        where a value is not available.
    """
    wire = _WIRES[message][name]
    raw = rows[name]
    if wire.type in {"char", "f32"} or (wire.scale == 1 and wire.invalid is None):
        return np.array(raw)
    values: NDArray[np.float64] = raw / units_of_one(wire)
    if wire.invalid is not None:
        values[raw == wire.invalid] = np.nan
    return values


def rows_of(message: type[Message], count: int, columns: Mapping[str, ArrayLike]) -> Rows:
    """Rows made of columns in units of the Python values.

    Args:
        message: Class of the messages.
        count: How many rows.
        columns: Values by name of the field, each as `column` gives it or one for all rows; NaN is "not available" where the
            field has that. What is left out is 0, or not available.

    Raises:
        EncodeError: The wire can't carry a value, or there is no such field.
    """
    rows = np.zeros(count, ROWS[message])
    fields = _WIRES[message]
    for name in columns:
        if name not in fields:
            raise EncodeError(f"{message.NAME} has no field {name}")
    for name, wire in fields.items():
        if name not in columns:
            if wire.invalid is not None:
                rows[name] = wire.invalid
            continue
        rows[name] = _raw(message, name, wire, columns[name])
    return rows


def _raw(message: type[Message], name: str, wire: Wire, given: ArrayLike) -> NDArray[Any]:
    """Values as wire units, which the type of the field can hold."""
    values: NDArray[Any] = np.asarray(given)
    if wire.type == "char":
        text: NDArray[Any] = np.strings.encode(values, "utf-8") if values.dtype.kind == "U" else values
        if text.dtype.itemsize > wire.count:
            raise EncodeError(f"{message.NAME}.{name} = {values} can't be sent: it takes {accepted(wire)}")
        return text
    if wire.type == "f32":
        with np.errstate(over="ignore"):  # infinity is refused
            floats = values.astype(np.float32)
        if not _RangeCheck(name, wire, wire.minimum, wire.maximum).passes(np.atleast_1d(floats)).all():
            raise EncodeError(f"{message.NAME}.{name} = {values} can't be sent: it takes {accepted(wire)}")
        return floats
    low, high = raw_limits(wire)
    if not values.ndim and values.dtype.kind == "i" and wire.scale == 1 and low <= int(values) <= high:
        return values
    missing = None
    if values.dtype.kind == "f":
        missing = np.isnan(values) if wire.invalid is not None else None
        scaled = values * units_of_one(wire)
        raw: NDArray[Any] = np.rint(scaled)
        if wire.scale == 1 and not (raw == scaled)[~missing if missing is not None else ...].all():
            raise EncodeError(f"{message.NAME}.{name} takes whole numbers")
    else:
        raw = values if wire.scale == 1 else values.astype(np.int64) * units_of_one(wire)
    wrong = ~((raw >= low) & (raw <= high))
    if missing is not None and wire.invalid is not None:
        wrong &= ~missing
        raw = np.where(missing, wire.invalid, raw)
    if wrong.any():
        shown = values[wrong].reshape(-1)[0]
        raise EncodeError(f"{message.NAME}.{name} = {shown} can't be sent: it takes {accepted(wire)}")
    return raw


def _refuse_bad(message: type[Message], rows: Rows) -> None:
    for check in _CHECKS[message]:
        good = check.passes(rows[check.name])
        if not good.all():
            at = int(np.argmin(good))
            what = f"{message.NAME}.{check.name} = {rows[check.name][at]} (wire units) in row {at}"
            raise EncodeError(f"{what} can't be sent: it takes {accepted(check.wire)}")


def check_rows(message: type[Message], rows: Rows) -> None:
    """See that the wire can carry rows that somebody else has made.

    Args:
        message: Class of the messages.
        rows: The rows.

    Raises:
        EncodeError: It can't; or they are rows of something else.
    """
    if rows.dtype != ROWS.get(message):
        raise EncodeError(f"these are no rows of {message.__name__}")
    _refuse_bad(message, rows)


def messages_of(message: type[Message], rows: Rows) -> list[Message]:
    """Rows as objects.

    Args:
        message: Class of the messages.
        rows: The rows, good ones.
    """
    unpack = PAYLOADS[message.ID].unpack
    return [unpack(row.tobytes()) for row in rows]


def rows_of_messages(message: type[Message], messages: Sequence[Message]) -> Rows:
    """Objects as rows.

    Args:
        message: Their class.
        messages: The objects.

    Raises:
        EncodeError: The wire can't carry one.
    """
    pack = PAYLOADS[message.ID].pack
    return rows_of_payloads(message, [pack(each) for each in messages])


def rows_of_payloads(message: type[Message], payloads: Sequence[bytes]) -> Rows:
    """Payloads as rows.

    Args:
        message: Class of the messages.
        payloads: Their payloads; zeros at the end may be left out.
    """
    kind = ROWS[message]
    data = b"".join([payload.ljust(kind.itemsize, b"\0") for payload in payloads])
    return np.frombuffer(data, kind).copy()
