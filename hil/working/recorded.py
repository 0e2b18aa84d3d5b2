"""How a log tells of what was done by other processes, so that a replay need not do it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

R = TypeVar("R")


@dataclass(frozen=True)
class Recorded(Generic[R]):
    """How a log tells of what was done elsewhere.

    Attributes:
        topic: Topic of the entries, one for each result.
        result_of: Makes the result of an entry; None where the entry can't be one.
    """

    topic: str
    result_of: Callable[[object], R | None]


CUT_SHORT: Final = "cut short"
"""Kind of the event by which a log tells that other processes gave no further result: `interrupted`, `status` of the error."""
