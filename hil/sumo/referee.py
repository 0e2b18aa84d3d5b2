"""The referee of an emulated bout, as the host sees it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.errors import PeerError
from firmware_protocol.messages import REFEREE_COMPONENT, BoutOutcome, OpponentCode, Phase, RefereeState
from firmware_protocol.roles.referee import reset_bout

if TYPE_CHECKING:
    from hil.sumo.junior import Junior

NOBODY = RefereeState(
    time=0.0, bout=0, elapsed=0.0, junior=(0.0, 0.0), junior_heading=0.0, opponent=(0.0, 0.0), opponent_heading=0.0,
    clearance=0.0, phase=Phase.IDLE, outcome=BoutOutcome.UNDECIDED, opponent_code=OpponentCode.KEEP,
)  # fmt: skip
"""What is known before the referee has said anything."""

OVERTAKEN = 1.0
"""What is older than this, by the referee's own clock, was not overtaken: the emulator was started anew. In s."""
LOOKS = 5
"""A new bout that is not seen in so many answers was not begun."""


class RefereeHandle:
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
        """Take its word, unless a later one has overtaken it on the line.

        Of a bout that is over it is only the first, so that the phase of its reports makes no difference.

        Args:
            state: What it says.
        """
        known = self.latest
        if _overtaken(state, known):
            return
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
        self._junior.finish(reset_bout(self._junior.peer, seed, opponent))
        for _ in range(LOOKS):  # the first may have been on its way before the reset
            state = self.state()
            if state.bout != before:
                return state
        raise PeerError(f"the referee did not begin a new bout: it is still number {before}")

    def state(self) -> RefereeState:
        """Ask what the referee sees now.

        Raises:
            PeerError: No answer.
        """
        known = self.latest
        answer = self._junior.finish(self._junior.peer.request(RefereeState, REFEREE_COMPONENT))
        self.heard(answer)
        return self.latest if _overtaken(answer, known) else answer  # and not what came with it: that depends on its phase


def _overtaken(state: RefereeState, known: RefereeState) -> bool:
    """It is older than what is known, and only because it was late on the line."""
    return known.time - OVERTAKEN < state.time < known.time
