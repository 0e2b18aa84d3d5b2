"""Options of jobs as a log has them: nothing that a log says is trusted."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Final, TypeVar

from firmware_protocol.errors import HilError
from hil.sumo.ring import OPPONENTS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from pal_advisor.fields import Fields

E = TypeVar("E", bound=StrEnum)
T = TypeVar("T")

MOST_SEED: Final = 2**32 - 1
DAY: Final = 86400.0
"""In s."""


class JobFileError(HilError):
    """A file that a job needs is not in the log."""


def none_or(options: Fields, name: str, take: Callable[[Fields, str], T]) -> T | None:
    """A field that may be null.

    Args:
        options: The fields.
        name: Which.
        take: Takes it where it is not.
    """
    if options.peek(name) is None:
        options.take(name)
        return None
    return take(options, name)


def opponent_of(options: Fields, name: str) -> str:
    """A field that names an opponent.

    Args:
        options: The fields.
        name: Which.

    Raises:
        FieldError: There is no such opponent.
    """
    found = options.text(name)
    if found not in OPPONENTS:
        raise options.wrong(name, f"expected one of {', '.join(OPPONENTS)}, not {found!r}")
    return found


def wanted_file(files: Mapping[str, bytes], name: str) -> bytes:
    """A file that has to be there.

    Args:
        files: The files.
        name: Which.

    Raises:
        JobFileError: It is not.
    """
    if name not in files:
        raise JobFileError(f"it does not hold {name}, by which it was run")
    return files[name]
