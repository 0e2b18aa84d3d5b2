"""What a person is asked before robots move that no emulated table is with."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import HilError, RefusedError
from firmware_protocol.vocabulary import RobotClass

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from hil.jobs.stage import Stage
    from hil.jobs.swarm.session import SwarmSession

ENTER: Final = frozenset({"\n", "\r"})
FENCE: Final = ("FENCE_X", "FENCE_Y")
SHOWN: Final = 10
"""So many robots are named where all have the same fault."""


class NoFenceError(HilError):
    """Robots have no fence, and there is no wall either."""


class NobodyToAskError(RefusedError):
    """Something would have to be asked, and there is nobody to answer."""

    def __init__(self, what: str, instead: str) -> None:
        super().__init__(what, instead)
        self.args = (f"{what} would have to be asked, and nobody can answer: {instead}",)


class Asking:
    """Asks, and waits for Enter.

    Args:
        session: The robots.
        stage: Has a terminal, or not.
        possible: There is somebody to be asked.
    """

    def __init__(self, session: SwarmSession, stage: Stage, *, possible: bool) -> None:
        self._session = session
        self._swarm = session.swarm
        self._stage = stage
        self._possible = possible
        self._fences: dict[str, str] = {}

    def see_fence(self, *, wanted: bool) -> None:
        """Read every robot's fence.

        Args:
            wanted: Every robot has to have one.

        Raises:
            NoFenceError: One has none.
        """
        found = {name: self._swarm.ask(lambda robot, name=name: robot.peer.read_parameter(name)) for name in FENCE}  # type: ignore[misc]
        without = []
        for address, label in zip(self._swarm.addresses_by_row, self._swarm.labels, strict=True):
            sides = [found[name].values.get(address, 0.0) for name in FENCE]
            self._fences[label] = f"{2 * sides[0]:g} x {2 * sides[1]:g} m" if all(sides) else "none"
            if not all(sides):
                without.append(label)
        if wanted and without:
            named = f"{', '.join(without[:SHOWN])}{', ...' if len(without) > SHOWN else ''}"
            raise NoFenceError(
                f"there is no wall, and no fence on robots {named}: they may leave the table. Set one (hil param LINK FENCE_X "
                "1.0, FENCE_Y likewise: half the sides, in m), put up a wall and choose a case with one (D2, D4), or give "
                "--no-fence"
            )

    def first_move(self) -> None:
        """Say which robots are about to move within which fence, and wait until somebody agrees.

        Raises:
            NobodyToAskError: There is nobody.
        """
        for label, kind in zip(self._swarm.labels, self._swarm.kinds.tolist(), strict=True):
            name = RobotClass(kind).name if kind >= 0 else "no class"
            self._stage.say(f"robot {label}: {name}, fence {self._fences.get(label, 'none')}")
        self._enter("whether these robots may move", "give --yes where they may", "These robots will move. Enter goes on.")

    def places(self, poses: Mapping[int, NDArray[np.float64]]) -> None:
        """Say who is to stand where, and wait until they do.

        Args:
            poses: x, y in m and heading in rad, by row.

        Raises:
            NobodyToAskError: There is nobody.
        """
        for row, (x, y, heading) in poses.items():
            self._stage.say(
                f"robot {self._swarm.labels[row]}: x {x:.3f} m, y {y:.3f} m, heading {degrees(heading):.0f} degrees"
            )
        self._enter("whether the robots stand there", "choose --place drive or as-is", "Put the robots there. Enter goes on.")

    def _enter(self, what: str, instead: str, text: str) -> None:
        """Wait for Enter, the robots being looked after meanwhile."""
        if not self._possible:
            raise NobodyToAskError(what, instead)
        self._stage.say(text)
        self._session.keys.wait_for(ENTER)
