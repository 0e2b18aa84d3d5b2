"""Fault specifications from text and tables, with the place of what is wrong in them.

Text is a list with commas. An item is a fault, what it takes after colons (`=` may stand for `:`), and the time of a spell
after `@` as `T` or `T+D`: from T on, for D s.

    drop:0.05                    always
    drop:0.3@10+2                from 10 s to 12 s
    unplug:20+3                  or unplug@20+3
    brownout:30+0.5              or brownout@30+0.5
    stuck:eye_left:60@5+3        at 60 counts; stuck:eye_left@5+3 at what it told last
    wheel:left@40                dead from then on; wheel:left:0.5@40 gives half
    battery:6.2@50

In a table the same faults are keys; a value is what the fault takes, or a table with `at` and `lasts`, or a list of these.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final, cast

from firmware_protocol.errors import FaultSpecError
from firmware_protocol.faults.spells import (
    LINE_FAULTS,
    Brownout,
    LineSpell,
    LowBattery,
    Spell,
    StuckSensor,
    Unplug,
    WeakWheel,
    check_line,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

_SPELLS: Final[dict[str, tuple[type[Spell], str, tuple[str, ...]]]] = {
    "unplug": (Unplug, "unplugs", ()),
    "brownout": (Brownout, "brownouts", ()),
    "stuck": (StuckSensor, "stuck", ("sensor", "value")),
    "wheel": (WeakWheel, "wheels", ("side", "effort")),
    "battery": (LowBattery, "batteries", ("voltage",)),
}
"""Class, field of `FaultSpec`, and what is written between the name and the time."""
_KNOWN: Final = (*LINE_FAULTS, *_SPELLS)
_WORDS: Final = {"sensor", "side"}
"""What is a word; all else is a number."""
_PLUS: Final = re.compile(r"(?<![eE])\+")
"""Between the two times of a spell; 1e+3 is one number."""
_SWITCH: Final = {"": 1.0, "true": 1.0, "false": 0.0}
"""`reorder` as it may be written besides a share."""


class _Builder:
    """Collects faults, one after the other.

    Attributes:
        fields: Fields of `FaultSpec` by name.
    """

    def __init__(self) -> None:
        self.fields: dict[str, Any] = {}

    def add(self, name: str, entry: Mapping[str, Any]) -> None:
        """Take one fault.

        Args:
            name: Which.
            entry: What it takes: `value` of a fault of the line, else the fields of its class; and its time.

        Raises:
            FaultSpecError: Something of it is wrong; `path` says what, where it is one field.
        """
        if name not in LINE_FAULTS:
            cls, place, needed = _SPELLS[name]
            first = needed[0] if needed else "at"
            if first not in entry:
                raise FaultSpecError(f"fault {name!r} needs its {first!r}")
            self.fields[place] = (*self.fields.get(place, ()), cls(**entry))
            return
        if "value" not in entry:
            raise FaultSpecError(f"fault {name!r} needs a number")
        if "at" in entry or "lasts" in entry:
            spell = LineSpell(name, **entry)
            self.fields["spells"] = (*self.fields.get("spells", ()), spell)
        elif name in self.fields:
            raise FaultSpecError(f"fault {name!r} is given twice; give each a time of its own")
        else:
            check_line(name, entry["value"])
            self.fields[name] = entry["value"]


# --- text ----------------------------------------------------------------------------------------------------------------


def read_text(text: str) -> dict[str, Any]:
    """Read a specification from text.

    Args:
        text: As described above; blank is no fault at all.

    Returns:
        Fields of `FaultSpec` by name; what is not named does not happen.

    Raises:
        FaultSpecError: An unknown name, or a value that does not fit; the text says in which item.
    """
    builder = _Builder()
    items = [part.strip() for part in text.split(",")]
    for number, item in enumerate(items, 1):
        if not item:
            continue
        try:
            _parse_item(builder, item)
        except FaultSpecError as error:
            where = f"item {number}, {item!r}: " if len(items) > 1 else ""
            raise FaultSpecError(f"{where}{error}") from None
    return builder.fields


def _parse_item(builder: _Builder, item: str) -> None:
    """Read one item; in an address a plus sign arrives as a blank."""
    head, at, time = re.sub(r"\s*[+\s]\s*", "+", item).replace("=", ":").partition("@")
    name, *taken = head.split(":")
    if name not in _KNOWN:
        raise FaultSpecError(f"unknown fault {name!r}: known are {', '.join(_KNOWN)}")
    names = ("value",) if name in LINE_FAULTS else _SPELLS[name][2]
    if name in _SPELLS and not names and taken and not at:
        time, at, taken = ":".join(taken), "@", []
    if len(taken) > len(names):
        raise FaultSpecError(f"fault {name!r} does not take {taken[len(names)]!r}")
    entry: dict[str, object] = {}
    for key, word in zip(names, taken, strict=False):
        entry[key] = word if key in _WORDS else _number(name, word)
    if name == "reorder" and not taken:
        entry["value"] = 1.0
    if at:
        begins, *lasts = _PLUS.split(time, 1)
        entry["at"] = _number(name, begins)
        if lasts:
            entry["lasts"] = _number(name, lasts[0])
    if name == "stuck" and "value" in entry:
        entry["value"] = _whole(cast("float", entry["value"]))
    builder.add(name, entry)


def _number(name: str, word: str) -> float:
    """A number as written.

    Raises:
        FaultSpecError: It is none.
    """
    if name == "reorder" and word in _SWITCH:
        return _SWITCH[word]
    try:
        return float(word)
    except ValueError:
        wanted = "is on or off, or a share of frames" if name == "reorder" else "needs a number"
        raise FaultSpecError(f"fault {name!r} {wanted}, not {word!r}") from None


def _whole(value: float) -> float:
    """A whole number as an int; another as it is, to be refused."""
    return int(value) if value.is_integer() else value


# --- tables --------------------------------------------------------------------------------------------------------------


def read_table(table: Mapping[str, object]) -> dict[str, Any]:
    """Read a specification from the table of a TOML or JSON file.

    Args:
        table: Faults by name. `drop = 0.05` is always there; `[[drop]]` with `value`, `at` and `lasts` is a spell.
            `unplug = 20` or `[[unplug]]` with `at` and `lasts`; likewise `brownout`. `[[stuck]]` with `sensor`, `value`;
            `[[wheel]]` with `side`, `effort`; `[[battery]]` with `voltage`; each with `at` and `lasts`.

    Returns:
        Fields of `FaultSpec` by name.

    Raises:
        FaultSpecError: An unknown name, or a value that does not fit; `path` is the field.
    """
    builder = _Builder()
    if not isinstance(table, dict):
        raise FaultSpecError("faults are a table of names and values", "")
    for name, value in table.items():
        if name not in _KNOWN:
            raise FaultSpecError(f"unknown fault {name!r}: known are {', '.join(_KNOWN)}", name)
        many = isinstance(value, list)
        for index, one in enumerate(value if isinstance(value, list) else [value]):
            path = f"{name}[{index}]" if many else name
            entry = _entry(name, one, path)
            try:
                builder.add(name, entry)
            except FaultSpecError as error:
                raise FaultSpecError(f"{path}: {error}", path) from None
    return builder.fields


def _entry(name: str, value: object, path: str) -> dict[str, object]:
    """What one fault of a table takes."""
    names = ("value",) if name in LINE_FAULTS else _SPELLS[name][2]
    plain = not isinstance(value, dict)
    fields = value if isinstance(value, dict) else {(*names, "at")[0]: value}
    known = (*names, "at", "lasts")
    entry: dict[str, object] = {}
    for key, one in fields.items():
        where = path if plain else f"{path}.{key}"
        if key not in known:
            raise FaultSpecError(f"{where}: unknown field {key!r} of fault {name!r}: known are {', '.join(known)}", where)
        if key in _WORDS:
            if not isinstance(one, str):
                raise FaultSpecError(f"{where}: fault {name!r} needs a name, not {one!r}", where)
            entry[key] = one
        elif isinstance(one, bool) and name == "reorder":
            entry[key] = float(one)
        elif isinstance(one, bool) or not isinstance(one, int | float):
            raise FaultSpecError(f"{where}: fault {name!r} needs a number, not {one!r}", where)
        else:
            try:
                number = float(one)
            except OverflowError:
                raise FaultSpecError(f"{where}: fault {name!r} needs a number of ordinary size", where) from None
            entry[key] = _whole(number) if (name, key) == ("stuck", "value") else number
    return entry
