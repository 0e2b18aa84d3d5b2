"""Takes plain values apart, as files hold them, and names the first field that is missing, unknown or wrong."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

E = TypeVar("E", bound=StrEnum)
T = TypeVar("T")

MOST: Final = 1 << 53
"""Counts are smaller."""
HUGE: Final = 1e12
"""Fitness and times are nearer to 0, so that their squares and sums are numbers too."""
LONGEST: Final = 1000
"""Texts have no more letters."""


def shown(value: object) -> str:
    """A value for a message to people, short whatever it is.

    Args:
        value: Any plain value.
    """
    if isinstance(value, str):
        return repr(value if len(value) <= 60 else value[:57] + "...")
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}" if len(value) > 4 else f"[{', '.join(map(shown, value))}]"
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**30:
        return f"a number of {value.bit_length()} bits"
    return repr(value)[:60]


class FieldError(ValueError):
    """A field is missing, unknown or wrong.

    Attributes:
        path: Which field, as `entries[3].actions[1]`.
    """

    def __init__(self, path: str, message: str) -> None:
        super().__init__(f"{path}: {message}")
        self.path = path


class SettingsError(FieldError):
    """A setting has a value that makes no sense; the path is its name."""


class StateError(FieldError):
    """A saved state can't be gone on from: a field is missing, unknown or wrong."""


class Fields:
    """The fields of a table, to be taken one after the other.

    Args:
        data: The table.
        path: What it is within the whole, as `entries[3]`; empty for the whole.
        error: The error of a field.

    Raises:
        FieldError: It is no table, or later a field is not as it should be; of the kind given.
    """

    def __init__(self, data: object, path: str = "", error: type[FieldError] = FieldError) -> None:
        if not isinstance(data, dict):
            raise error(path or "the whole", f"expected a table, not {shown(data)}")
        self._data: dict[Any, Any] = dict(data)
        self._path = path
        self._error = error

    @classmethod
    def row(cls, data: object, names: Sequence[str], path: str, error: type[FieldError]) -> Fields:
        """The elements of a list, each with a name.

        Args:
            data: The list.
            names: What its elements are called, in order.
            path: What it is within the whole.
            error: As for the class.
        """
        if not isinstance(data, list) or len(data) != len(names):
            raise error(path, f"expected a list of {len(names)}: {', '.join(names)}; not {shown(data)}")
        return cls(dict(zip(names, data, strict=True)), path, error)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fields that have not been taken."""
        return tuple(self._data)

    def at(self, name: str) -> str:
        """Path of a field."""
        return f"{self._path}.{name}" if self._path else name

    def wrong(self, name: str, message: str) -> FieldError:
        """The error of a field."""
        return self._error(self.at(name), message)

    def has(self, name: str) -> bool:
        """There is such a field, and it has not been taken."""
        return name in self._data

    def peek(self, name: str) -> Any:  # noqa: ANN401 - whatever the field holds
        """A field's value, which is still to be taken; None where there is no such field."""
        return self._data.get(name)

    def take(self, name: str) -> Any:  # noqa: ANN401 - whatever the field holds
        """A field as it is."""
        if name not in self._data:
            raise self.wrong(name, "missing")
        return self._data.pop(name)

    def integer(self, name: str, low: int = 0, high: int = MOST) -> int:
        """A whole number within bounds."""
        value = self.take(name)
        if type(value) is not int or not low <= value <= high:
            bounds = f"{low} or more" if high == MOST else f"{low} to {high}"
            raise self.wrong(name, f"expected a whole number, {bounds}, not {shown(value)}")
        return value

    def number(self, name: str, low: float = -HUGE, high: float = HUGE) -> float:
        """A number within bounds."""
        value = self.take(name)
        if type(value) not in (int, float) or not low <= value <= high:
            bounds = ", not negative" if low == 0 else ""
            raise self.wrong(name, f"expected a number{bounds}, not {shown(value)}")
        return float(value)

    def one_of(self, name: str, names: type[E]) -> E:
        """One of several names."""
        value = self.text(name)
        try:
            return names(value)
        except ValueError as error:
            raise self.wrong(name, f"expected one of {', '.join(names)}, not {shown(value)}") from error

    def flag(self, name: str, missing: bool | None = None) -> bool:  # noqa: FBT001 - what it is where nothing is said
        """A truth value.

        Args:
            name: Name of the field.
            missing: What it is where there is no such field; None: there has to be one.
        """
        if missing is not None and not self.has(name):
            return missing
        value = self.take(name)
        if type(value) is not bool:
            raise self.wrong(name, f"expected true or false, not {shown(value)}")
        return value

    def text(self, name: str) -> str:
        """A text of letters that can be printed, in one line."""
        return self._text(name, self.take(name))

    def texts(self, name: str) -> tuple[str, ...]:
        """A list of such texts."""
        return tuple(self._text(f"{name}[{index}]", value) for index, value in enumerate(self._list(name)))

    def _text(self, name: str, value: object) -> str:
        if not isinstance(value, str):
            raise self.wrong(name, f"expected a text, not {shown(value)}")
        if len(value) > LONGEST or not value.isprintable():
            raise self.wrong(name, f"expected a text of up to {LONGEST} letters in one line, not {shown(value)}")
        return value

    def _list(self, name: str) -> list[Any]:
        value = self.take(name)
        if not isinstance(value, list):
            raise self.wrong(name, f"expected a list, not {shown(value)}")
        return value

    def items(self, name: str) -> Iterator[tuple[str, Any]]:
        """The elements of a list, each with its path."""
        path = self.at(name)
        return ((f"{path}[{index}]", value) for index, value in enumerate(self._list(name)))

    def elements(self, name: str) -> Fields:
        """The elements of a list as fields, each by its path."""
        return Fields(dict(self.items(name)), "", self._error)

    def table(self, name: str) -> Fields:
        """A table within."""
        return Fields(self.take(name), self.at(name), self._error)

    def read_by(self, name: str, reader: Callable[[Any], T]) -> T | None:
        """What a field holds that has a reader of its own; None where it holds nothing.

        Args:
            name: Name of the field.
            reader: Takes the field as it is, and raises a FieldError, whose path is within the field.
        """
        value = self.take(name)
        if value is None:
            return None
        try:
            return reader(value)
        except FieldError as error:
            raise self.wrong(f"{name}.{error.path}", str(error).partition(": ")[2]) from error

    def done(self) -> None:
        """See that nothing is left over."""
        for name in self._data:
            raise self.wrong(str(name)[:60], "no field has this name")


def is_number(value: object) -> bool:
    """Whether a value is a number, and a finite one.

    Args:
        value: Any plain value.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number that no float holds
        return False
