"""Whom Junior meets while it is coached against robots: entrants of a tournament, and what it has learnt itself so far."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from hil.seeds import Branch, generator
from hil.sumo.bouts import Tally
from hil.sumo.tournament.entrants import Entrant, EntrantKind
from pal_advisor.fields import Fields
from pal_advisor.maneuvers import Advice

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hil.sumo.bouts import Bout

SELF: Final = "self"
"""Names what has been learnt so far as a rival."""
MOST: Final = 16
"""Rivals in a set: a run has some hundred bouts."""
FREEZE_EVERY: Final = 10
"""Bouts after which what has been learnt so far becomes the rival in self-play."""


class Rivals:
    """Who is met: one rival a bout, drawn by the seed of the bout.

    In self-play Junior meets the best advice so far, which is frozen every `FREEZE_EVERY` bouts: against one that changes with
    every maneuver nothing could be compared. Until the first time, random maneuvers are met.

    Args:
        entrants: Whom to meet.
        self_play: What has been learnt so far is one of them.
        frozen: What had been learnt when it was frozen last; None: it never was.

    Attributes:
        entrants: Whom to meet, but for what has been learnt so far.
        self_play: What has been learnt so far is one of them.

    Raises:
        ValueError: There is nobody, too many, one twice, or something frozen where that is met by nobody.
    """

    def __init__(self, entrants: tuple[Entrant, ...], *, self_play: bool = False, frozen: Advice | None = None) -> None:
        self.entrants = entrants
        self.self_play = self_play
        self._frozen = frozen
        labels = self._labels
        if not 1 <= len(labels) <= MOST:
            raise ValueError(f"a robot is coached against 1 to {MOST} others in turn, not {len(labels)}")
        if twice := next((label for label in labels if labels.count(label) > 1), None):
            raise ValueError(f"{twice} is named twice: give one another name, as other={twice.rpartition(':')[2]}")
        if frozen is not None and not self_play:
            raise ValueError("there is something frozen, and no self-play")

    @property
    def _labels(self) -> list[str]:
        return [*map(_label, self.entrants), *([SELF] if self.self_play else [])]

    @property
    def name(self) -> str:
        """What the opponent is called: `chase`, `advice:old,hobby`, `self`; no dummy is called so."""
        return ",".join(self._labels)

    @property
    def short_name(self) -> str:
        """As a part of the name of a file."""
        names = [entrant.name for entrant in self.entrants] + ([SELF] if self.self_play else [])
        return names[0] if len(names) == 1 else f"{len(names)}-robots"

    def anew(self) -> Rivals:
        """The same, before anything was learnt."""
        return Rivals(self.entrants, self_play=self.self_play)

    def drawn(self, seed: int) -> Entrant:
        """Who is met in a bout.

        Args:
            seed: Seed of the bout.
        """
        turn = self._turn(seed)
        return self.entrants[turn] if turn < len(self.entrants) else self._itself()

    def _turn(self, seed: int) -> int:
        """Whose turn it is, by number in the order of the name."""
        return int(generator(seed, Branch.RIVALS).integers(len(self._labels)))

    def _itself(self) -> Entrant:
        if self._frozen is None:
            return Entrant(SELF, EntrantKind.RANDOM)
        return Entrant(SELF, EntrantKind.ADVICE, self._frozen)

    def tallies(self, bouts: Sequence[Bout]) -> tuple[Tally, ...]:
        """Bouts by who was met in them, in the order of the name; none where there is but one to be met.

        Args:
            bouts: The bouts.
        """
        if len(self._labels) < 2:
            return ()
        met: dict[str, list[Bout]] = {label: [] for label in self._labels}
        for bout in bouts:
            met[self._labels[self._turn(bout.seed)]].append(bout)
        return tuple(Tally.of(label, each) for label, each in met.items())

    def keep_up(self, bouts: int, learnt: Callable[[], Advice]) -> None:
        """A bout is about to begin: freeze what has been learnt, where that is due.

        Args:
            bouts: Bouts that have been begun before it.
            learnt: Tells what has been learnt so far.
        """
        if self.self_play and bouts and bouts % FREEZE_EVERY == 0:
            advice = learnt()
            self._frozen = advice if advice.entries else self._frozen

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "entrants": [entrant.to_dict() for entrant in self.entrants],
            "self_play": self.self_play,
            "frozen": None if self._frozen is None else self._frozen.to_dict(),
        }

    @classmethod
    def from_fields(cls, found: Fields) -> Rivals:
        """The inverse of `to_dict`.

        Args:
            found: The fields.

        Raises:
            FieldError: A field is missing, unknown or wrong.
        """
        entrants = tuple(Entrant.from_fields(Fields(one, path)) for path, one in found.items("entrants"))
        self_play, frozen = found.flag("self_play"), found.read_by("frozen", Advice.from_dict)
        found.done()
        try:
            return cls(entrants, self_play=self_play, frozen=frozen)
        except ValueError as error:
            raise found.wrong("entrants", str(error)) from error


def _label(entrant: Entrant) -> str:
    """An entrant with how it plays, where its name does not say that."""
    return entrant.name if entrant.name == entrant.kind.value else f"{entrant.kind.value}:{entrant.name}"
