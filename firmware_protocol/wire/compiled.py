"""Packers and unpackers of one kind of message each, compiled from its annotations: for what is plain and good.

What is not - a value out of range, or of the wrong type - they hand to the general path of `payload`, which judges it: there
is one truth for what is refused, and why. A function is made when it is first wanted, since most programs want few.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from struct import error
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.wire.mavlink_layout import INTEGER_LIMITS, raw_limits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.wire.fields import Message, Wire

Pack = Callable[["Message"], bytes]
"""The untrimmed payload of a message; EncodeError where the wire can't carry it."""
Unpack = Callable[[bytes], "Message"]
"""The message of a payload, which may be trimmed; BadValueError where a value is out of range."""

FAULTS: Final = (error, ValueError, TypeError, OverflowError, AttributeError)
"""What a value that can't be sent may raise on its way into a payload."""
_INFINITY: Final = float("inf")


@dataclass(frozen=True)
class PayloadField:
    """One field, in the order of the payload.

    Attributes:
        name: Its name.
        wire: Its annotation.
        divisor: Wire units in one unit of the Python value; 1 for text and floats.
        to_raw: Of text: how it becomes bytes; raises one of `FAULTS`.
        from_raw: Of text: how bytes become it.
    """

    name: str
    wire: Wire
    divisor: int = 1
    to_raw: Callable[[Any], Any] | None = None
    from_raw: Callable[[Any], Any] | None = None

    @property
    def elements(self) -> int:
        """Elements of an array; 0 for a scalar and for text, which are one value each."""
        return 0 if self.wire.type == "char" else self.wire.count


class _Source:
    """The source of a function under way.

    Args:
        names: What it uses, by name.
    """

    def __init__(self, names: dict[str, Any]) -> None:
        self._names = names
        self._lines: list[str] = []

    def line(self, text: str, depth: int = 1) -> None:
        """Add a line, indented so deep."""
        self._lines.append("    " * depth + text)

    def function(self, head: str, what: str) -> Any:  # noqa: ANN401 - of a type that only the caller knows
        """Compile it.

        Args:
            head: The line of its `def`.
            what: What it is, for tracebacks.
        """
        code = compile("\n".join([head, *self._lines]), f"<{what}>", "exec")
        exec(code, self._names)  # noqa: S102 - made of our own annotations: nothing that was read from anywhere
        return self._names[head.removeprefix("def ").partition("(")[0]]


def _literal(value: float) -> str:
    """A limit as an expression."""
    if abs(value) == _INFINITY:
        return "infinity" if value > 0 else "-infinity"
    return repr(value)


def _good_float(name: str, wire: Wire) -> str:
    """The condition under which a float is accepted."""
    low = -_INFINITY if wire.minimum is None else wire.minimum
    high = _INFINITY if wire.maximum is None else wire.maximum
    sign = {False: "<=", True: "<"}
    good = f"{_literal(low)} {sign[low == -_INFINITY]} {name} {sign[high == _INFINITY]} {_literal(high)}"
    return f"({good} or {name} != {name})" if wire.nan else good


def _good_raw(name: str, wire: Wire) -> str | None:
    """The condition under which a wire integer is accepted; None where all that the type can hold are."""
    low, high = raw_limits(wire)
    return None if (low, high) == INTEGER_LIMITS[wire.type] else f"{low} <= {name} <= {high}"


def compile_unpack(
    kind: type[Message], fields: Sequence[PayloadField], raw: Callable[..., Any], length: int, general: Unpack
) -> Unpack:
    """A function that does what the general path does, and hands it what it does not accept.

    Args:
        kind: The message class.
        fields: Its fields.
        raw: Unpacks the wire values from an untrimmed payload.
        length: Bytes of that.
        general: The general path.
    """
    names = {"kind": kind, "raw": raw, "general": general, "new": object.__new__, "infinity": _INFINITY}
    source = _Source(names)
    wire_values: list[str] = []
    conditions: list[str] = []
    results: list[tuple[str, str]] = []
    for index, field in enumerate(fields):
        wire = field.wire
        values = [f"v{index}_{element}" for element in range(field.elements or 1)]
        wire_values += values
        found: list[str] = []
        for value in values:
            if field.from_raw is not None:
                names[f"text{index}"] = field.from_raw
                found.append(f"text{index}({value})")
                continue
            good = _good_float(value, wire) if wire.type == "f32" else _good_raw(value, wire)
            result = value if field.divisor == 1 else f"{value} / {field.divisor}"
            if wire.invalid is not None:
                good = good and f"({value} == {wire.invalid} or {good})"
                result = f"None if {value} == {wire.invalid} else {result}"
            conditions += [good] if good else []
            found.append(result)
        results.append((field.name, f"({', '.join(found)},)" if field.elements else found[0]))
    source.line(f"if len(payload) != {length}:")
    source.line(f"payload = payload.ljust({length}, b'\\0')", 2)
    source.line(f"{', '.join(wire_values)}, = raw(payload)")
    if conditions:
        source.line(f"if not ({' and '.join(conditions)}):")
        source.line("return general(payload)", 2)
    source.line("message = new(kind)")
    source.line("values = message.__dict__")  # past the frozen __setattr__
    for name, result in results:
        source.line(f"values[{name!r}] = {result}")
    source.line("return message")
    unpack: Unpack = source.function("def unpack(payload):", f"unpacks {kind.NAME}")
    return unpack


def compile_pack(kind: type[Message], fields: Sequence[PayloadField], raw: Callable[..., bytes], general: Pack) -> Pack:
    """A function that does what the general path does, and hands it what it does not accept.

    Args:
        kind: The message class.
        fields: Its fields.
        raw: Packs the wire values.
        general: The general path.
    """
    names = {"raw": raw, "general": general, "FAULTS": FAULTS, "infinity": _INFINITY, "len": len, "round": round}
    source = _Source(names)
    wire_values: list[str] = []
    conditions: list[str] = []
    source.line("try:")
    for index, field in enumerate(fields):
        values = [f"v{index}_{element}" for element in range(field.elements or 1)]
        wire_values += values
        if field.elements:
            source.line(f"array = message.{field.name}", 2)
            source.line(f"if len(array) != {field.elements}:", 2)
            source.line("return general(message)", 3)
            source.line(f"{', '.join(values)}, = array", 2)
        else:
            source.line(f"{values[0]} = message.{field.name}", 2)
        for value in values:
            if field.to_raw is not None:
                names[f"text{index}"] = field.to_raw
                source.line(f"{value} = text{index}({value})", 2)
                continue
            conditions += _convert(value, field, source)
    if conditions:
        source.line(f"if {' and '.join(conditions)}:", 2)
    source.line(f"return raw({', '.join(wire_values)})", 3 if conditions else 2)
    source.line("except FAULTS:")
    source.line("pass", 2)
    source.line("return general(message)")
    pack: Pack = source.function("def pack(message):", f"packs {kind.NAME}")
    return pack


def _convert(value: str, field: PayloadField, source: _Source) -> list[str]:
    """Write how a number becomes a wire value.

    Returns:
        The conditions under which it may be sent.
    """
    wire = field.wire
    if wire.type == "f32":
        return [_good_float(value, wire)]
    good = _good_raw(value, wire)
    raw = value if field.divisor == 1 else f"round({value} * {field.divisor})"
    if wire.invalid is None:
        if field.divisor != 1:
            source.line(f"{value} = {raw}", 2)
        return [good] if good else []
    source.line(f"if {value} is None:", 2)
    source.line(f"{value} = {wire.invalid}", 3)
    source.line("else:", 2)
    source.line(f"{value} = {raw}", 3)
    if good:
        source.line(f"if not {good}:", 3)
        source.line("return general(message)", 4)
    return []
