"""Who enters a tournament: an advice, played by a host or from the robot's own memory, a policy, or a controller of our own."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

from hil.policies import Policy, PolicyDriver
from hil.seeds import Branch, generator
from hil.sumo.controllers import BUILT_IN, AdviceController
from hil.sumo.driving import DriverPlayer
from hil.sumo.tournament.players import HostPlayer, MemoryPlayer
from pal_advisor.maneuvers import Advice

if TYPE_CHECKING:
    from hil.sumo.tournament.players import Player
    from pal_advisor.fields import Fields

LONGEST_NAME: Final = 40
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]*")


class EntrantKind(StrEnum):
    """How an entrant plays."""

    ADVICE = "advice"
    """A host chooses by the advice."""
    MEMORY = "memory"
    """The robot plays a contest by itself, from its memory."""
    POLICY = "policy"
    """A host sets the wheels by the policy."""
    CHASE = "chase"
    CHASE2 = "chase2"
    HOBBY = "hobby"
    RANDOM = "random"

    @property
    def takes(self) -> str:
        """What it plays by, in words; empty where that is written by hand."""
        return "" if self.value in BUILT_IN else "a policy" if self is EntrantKind.POLICY else "an advice"


@dataclass(frozen=True)
class Entrant:
    """Somebody who enters.

    Attributes:
        name: What it is called, which is also part of names of files.
        kind: How it plays.
        advice: What it plays by, where that is an advice.
        policy: Likewise, where that is a policy.

    Raises:
        ValueError: No file can be called so, or there is what nobody plays by, or nothing where something is needed.
    """

    name: str
    kind: EntrantKind
    advice: Advice | None = None
    policy: Policy | None = None

    def __post_init__(self) -> None:
        if len(self.name) > LONGEST_NAME or not _NAME.fullmatch(self.name):
            raise ValueError(
                f"a name has up to {LONGEST_NAME} letters, digits and . _ + -, and begins with a letter or a digit: "
                f"not {self.name[:60]!r}"
            )
        has = [name for name, one in (("an advice", self.advice), ("a policy", self.policy)) if one is not None]
        if has != [self.kind.takes][: bool(self.kind.takes)]:
            raise ValueError(
                f"{self.name} plays by {self.kind}, which takes {self.kind.takes or 'nothing'}, and there is "
                f"{' and '.join(has) or 'nothing'}"
            )

    def player(self, seed: int, seat: int) -> Player:
        """What plays a robot for it in one bout.

        Args:
            seed: Seed of the bout; what is left to chance follows from it.
            seat: 0 plays the first robot, 1 the second.
        """
        if self.policy is not None:
            return DriverPlayer(PolicyDriver(self.policy))
        if self.advice is None:
            return HostPlayer(BUILT_IN[self.kind.value](generator(seed, Branch.CONTROLLER, seat)))
        return MemoryPlayer(self.advice) if self.kind is EntrantKind.MEMORY else HostPlayer(AdviceController(self.advice))

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "name": self.name,
            "kind": self.kind.value,
            "advice": None if self.advice is None else self.advice.to_dict(),
            "policy": None if self.policy is None else self.policy.to_dict(),
        }

    @classmethod
    def from_fields(cls, found: Fields) -> Entrant:
        """The inverse of `to_dict`.

        Args:
            found: The fields.

        Raises:
            FieldError: A field is missing, unknown or wrong.
        """
        name, kind, advice, policy = (
            found.text("name"),
            found.one_of("kind", EntrantKind),
            found.read_by("advice", Advice.from_dict),
            found.read_by("policy", Policy.from_dict),
        )
        found.done()
        try:
            return cls(name, kind, advice, policy)
        except ValueError as error:
            raise found.wrong("name", str(error)) from error
