"""Quantities of emulated devices: a constant of nature, and profiles from tables of TOML files."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

if TYPE_CHECKING:
    from collections.abc import Mapping

    from _typeshed import DataclassInstance

    Profile = TypeVar("Profile", bound=DataclassInstance)

GRAVITY: Final = 9.81
"""In m/s^2."""


def from_table(profile: type[Profile], table: Mapping[str, object]) -> Profile:
    """Make a profile from a table of a TOML file; what it does not name keeps its default.

    Args:
        profile: Its class, a dataclass whose fields all have defaults.
        table: Values by name; arrays stand for pairs.

    Returns:
        The profile.

    Raises:
        ValueError: A name is unknown, or a value is of the wrong kind.
    """
    defaults = {field.name: field.default for field in fields(profile)}
    values: dict[str, Any] = {}
    for name, value in table.items():
        if name not in defaults:
            raise ValueError(f"unknown quantity {name!r} of a device: expected one of {', '.join(defaults)}")
        values[name] = _like(name, value, defaults[name])
    return profile(**values)


def _like(name: str, value: object, default: object) -> object:
    """A value of a TOML file as the kind of the default.

    Raises:
        ValueError: It is not of that kind.
    """
    if isinstance(default, tuple) and isinstance(value, list | tuple) and len(value) == len(default):
        return tuple(_like(name, part, default[0]) for part in value)
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if isinstance(default, bool) and isinstance(value, bool):
        return value
    if isinstance(default, float) and number:
        return float(cast("float", value))
    if isinstance(default, int) and not isinstance(default, bool) and number and isinstance(value, int):
        return value
    raise ValueError(f"{name} is {value!r}, but must be like {default!r}")
