"""The referee of an emulated bout, as the host sees it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.errors import PeerError
from firmware_protocol.messages import REFEREE_COMPONENT, BoutOutcome, OpponentCode, Phase, RefereeState

if TYPE_CHECKING:
    from hil.junior import Junior

NOBODY = RefereeState(
    time=0.0, bout=0, elapsed=0.0, junior=(0.0, 0.0), junior_heading=0.0, opponent=(0.0, 0.0), opponent_heading=0.0,
    clearance=0.0, phase=Phase.IDLE, outcome=BoutOutcome.UNDECIDED, opponent_code=OpponentCode.KEEP,
)  # fmt: skip
"""What is known before the referee has said anything."""


class Referee:
    """Puts everybody at a start pose, and says how a bout goes.

    Args:
        junior: The robot whose ring it watches.

    Attributes:
        latest: Its last word; of a bout that is over, the one that said so first.
    """

    def __init__(self, junior: Junior) -> None:
        self._junior = junior
        self.latest = NOBODY

    def heard(self, state: RefereeState) -> None:
        """Take its word; of a bout that is over, only the first, so that the phase of its reports makes no difference.

        Args:
            state: What it says.
        """
        known = self.latest
        if not (known.phase == Phase.OVER and state.phase == Phase.OVER and state.bout == known.bout):
            self.latest = state

    def forget(self) -> None:
        """What it said last may be of another ring: the emulator may have been started anew."""
        self.latest = NOBODY

    def reset(self, seed: int, opponent: OpponentCode = OpponentCode.KEEP) -> RefereeState:
        """Begin a new bout.

        Args:
            seed: Decides the start poses, 0..2**32-1.
            opponent: Who is to stand in the ring.

        Returns:
            The ring at the start of the bout.

        Raises:
            PeerError: The referee refused or did not answer.
        """
        before = self.latest.bout
        self._junior.finish(self._junior.peer.reset_bout(seed, opponent))
        state = self.state()
        if state.bout == before:
            raise PeerError(f"the referee did not begin a new bout: it is still number {before}")
        return state

    def state(self) -> RefereeState:
        """Ask what the referee sees now.

        Raises:
            PeerError: No answer.
        """
        return self._junior.finish(self._junior.peer.request(RefereeState, REFEREE_COMPONENT))
