"""The adviser of the surround task: group reinforcement learning of two classes by ask and tell (Liu & Wu 2001, ch. 6 to 8)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.fields import Fields, StateError, shown
from pal_advisor.generators import plain, read_generator
from pal_advisor.surround.group import RobotGroup
from pal_advisor.surround.tables import StimulusRecord, Tables

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pal_advisor.surround.rounds import Lesson, Moves, Results, Sights
    from pal_advisor.surround.settings import GroupSettings

STATE_VERSION: Final = 1


class Surround:
    """Tells RANGERs and WILDs where to move, and lets them learn.

    A round of a class is `ask`, `redraw` for who was refused, and `tell`. Who takes part in a round says its sights: all of
    a class, or one robot alone. Both classes may be asked before either is told of.

    Args:
        rangers: How the RANGERs sense, move and learn.
        wilds: How the WILDs do.
        rng: Source of chance; its state is part of the adviser's.

    Attributes:
        groups: The classes, by `RobotClass`.

    Raises:
        ValueError: The settings are not those of RANGERs and of WILDs, or have not as many sectors.
    """

    def __init__(self, rangers: GroupSettings, wilds: GroupSettings, rng: np.random.Generator) -> None:
        if (rangers.kind, wilds.kind) != tuple(RobotClass):
            raise ValueError("settings of RANGERs are wanted first, then settings of WILDs")
        if rangers.sectors != wilds.sectors:
            raise ValueError(f"both classes have as many sectors, not {rangers.sectors} and {wilds.sectors}")
        self.groups = (RobotGroup(rangers), RobotGroup(wilds))
        self._rng = rng

    def ask(self, kind: RobotClass, sights: Sights) -> Moves:
        """The next moves of one class; see `RobotGroup.ask`.

        Args:
            kind: The class.
            sights: What its robots see.
        """
        return self.groups[kind].ask(sights, self._rng)

    def redraw(self, kind: RobotClass, refused: NDArray[np.bool_]) -> Moves:
        """Other moves for those that were refused; see `RobotGroup.redraw`.

        Args:
            kind: The class.
            refused: Whose move was refused, shape (robots of the class,).
        """
        return self.groups[kind].redraw(refused, self._rng)

    def tell(self, kind: RobotClass, results: Results) -> Lesson:
        """Take in what became of the moves of one class; see `RobotGroup.tell`.

        Args:
            kind: The class.
            results: What became of them.
        """
        return self.groups[kind].tell(results)

    def tables(self, case: str = "") -> Tables:
        """What has been learnt: all stimuli that were met, or whose weights are not uniform.

        Args:
            case: Name of the case, for the record.
        """
        known = []
        for group in self.groups:
            weights, mask = group.experience.weights, group.settings.mask
            learnt = (weights[:, mask] != 1.0 / max(1, int(mask.sum()))).any(axis=1)
            known.append(
                {
                    int(index) + 1: StimulusRecord(int(group.met[index]), tuple(weights[index].tolist()))
                    for index in np.flatnonzero(learnt | (group.met > 0))
                }
            )
        return Tables(self.groups[0].settings.sectors, case, *known)

    def take(self, tables: Tables) -> None:
        """Go on from what was learnt elsewhere; how often a stimulus was met is not counted on.

        Args:
            tables: What was learnt.

        Raises:
            ValueError: It has other sectors, or other behaviours are feasible.
        """
        sectors = self.groups[0].settings.sectors
        if tables.sectors != sectors:
            raise ValueError(f"the tables are of {tables.sectors} sectors, the robots have {sectors}")
        for group in self.groups:
            mask = group.settings.mask
            for number, vector in tables.of(group.settings.kind).items():
                if ((np.array(vector.weights) >= 0.0) != mask).any():
                    kind = group.settings.kind.name
                    raise ValueError(f"STIMULUS{number} of {kind}s: other behaviours are feasible than the robots can perform")
        for group in self.groups:
            for number, vector in tables.of(group.settings.kind).items():
                group.experience.weights[number - 1] = vector.weights

    def state_dict(self) -> dict[str, Any]:
        """Everything a resumed run needs, as plain values; moves that are under way count as never asked for.

        So it is taken between rounds.
        """
        return {
            "version": STATE_VERSION,
            "rng": plain(self._rng.bit_generator.state),
            "groups": [group.to_dict() for group in self.groups],
        }

    @classmethod
    def from_state(cls, state: object) -> Surround:
        """An adviser that goes on where another stood.

        Args:
            state: What `state_dict` gave.

        Raises:
            StateError: A field is missing, unknown or wrong.
        """
        fields = Fields(state, "", StateError)
        version = fields.take("version")
        if version != STATE_VERSION or type(version) is not int:
            raise fields.wrong("version", f"{shown(version)} is not known; this program goes on from {STATE_VERSION}")
        rng = read_generator(fields.table("rng"))
        groups = [RobotGroup.from_fields(Fields(data, path, StateError)) for path, data in fields.items("groups")]
        fields.done()
        if len(groups) != len(RobotClass):
            raise fields.wrong("groups", f"expected {len(RobotClass)} classes, not {len(groups)}")
        try:
            adviser = cls(groups[0].settings, groups[1].settings, rng)
        except ValueError as error:
            raise fields.wrong("groups", str(error)) from error
        adviser.groups = (groups[0], groups[1])
        return adviser
