"""Who enters a tournament: a learnt advice, played by a host or from the robot's own memory, or a controller of our own."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

from hil.seeds import Branch, generator
from hil.sumo.controllers import BUILT_IN, AdviceController
from hil.sumo.players import HostPlayer, MemoryPlayer
from pal_advisor.fields import FieldError, Fields
from pal_advisor.maneuvers import Advice, AdviceError

if TYPE_CHECKING:
    from hil.sumo.players import Player

LONGEST_NAME: Final = 40
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]*")


class EntrantKind(StrEnum):
    """How an entrant plays."""

    ADVICE = "advice"
    """A host chooses by the advice."""
    MEMORY = "memory"
    """The robot plays a contest by itself, from its memory."""
    CHASE = "chase"
    CHASE2 = "chase2"
    HOBBY = "hobby"
    RANDOM = "random"

    @property
    def learnt(self) -> bool:
        """It plays by an advice."""
        return self.value not in BUILT_IN


@dataclass(frozen=True)
class Entrant:
    """Somebody who enters.

    Attributes:
        name: What it is called, which is also part of names of files.
        kind: How it plays.
        advice: What it plays by, where it has learnt.

    Raises:
        ValueError: No file can be called so, or there is an advice that nobody plays by, or none where one is needed.
    """

    name: str
    kind: EntrantKind
    advice: Advice | None = None

    def __post_init__(self) -> None:
        if len(self.name) > LONGEST_NAME or not _NAME.fullmatch(self.name):
            raise ValueError(
                f"a name has up to {LONGEST_NAME} letters, digits and . _ + -, and begins with a letter or a digit: "
                f"not {self.name[:60]!r}"
            )
        if self.kind.learnt != (self.advice is not None):
            raise ValueError(
                f"{self.name} is to play by {self.kind}, which {'takes an' if self.kind.learnt else 'has no'} advice"
            )

    def player(self, seed: int, seat: int) -> Player:
        """What plays a robot for it in one bout.

        Args:
            seed: Seed of the bout; what is left to chance follows from it.
            seat: 0 plays the first robot, 1 the second.
        """
        if self.advice is None:
            return HostPlayer(BUILT_IN[self.kind.value](generator(seed, Branch.CONTROLLER, seat)))
        return MemoryPlayer(self.advice) if self.kind is EntrantKind.MEMORY else HostPlayer(AdviceController(self.advice))

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "name": self.name,
            "kind": self.kind.value,
            "advice": None if self.advice is None else self.advice.to_dict(),
        }

    @classmethod
    def from_fields(cls, found: Fields) -> Entrant:
        """The inverse of `to_dict`.

        Args:
            found: The fields.

        Raises:
            FieldError: A field is missing, unknown or wrong.
        """
        name, kind, advice = found.text("name"), found.one_of("kind", EntrantKind), found.take("advice")
        found.done()
        try:
            return cls(name, kind, None if advice is None else Advice.from_dict(advice))
        except AdviceError as error:
            raise FieldError(found.at(f"advice.{error.path}"), str(error).partition(": ")[2]) from error
        except ValueError as error:
            raise found.wrong("name", str(error)) from error
