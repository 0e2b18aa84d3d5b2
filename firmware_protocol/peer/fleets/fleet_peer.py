"""A robot of a fleet, as the host sees it: what it says all the time, and whether it is heard, is the fleet's business."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from firmware_protocol.peer.connection import Input
from firmware_protocol.peer.peer import Peer
from firmware_protocol.peer.quality import FrameStreams
from firmware_protocol.peer.timetable import NEVER, NOW
from firmware_protocol.peer.timing import SILENCE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from firmware_protocol.events import Event, Received
    from firmware_protocol.peer.fleets.fleet import Fleet
    from firmware_protocol.peer.role import Role
    from firmware_protocol.wire.fields import Message


class UncountedFrames(FrameStreams):
    """Frames of a robot of a fleet, which counts them itself (`SteadyMessages.count`): none of them is taken down here."""

    def count(self, received: Received) -> bool:  # noqa: ARG002 - as of `FrameStreams`
        """Let a frame pass."""
        return True


class FleetPeer(Peer):
    """One robot of a fleet.

    As `Peer`, but that the fleet counts its frames, watches for its silence while it can be used, and acknowledges its
    results. No heartbeats are sent on its account, no clocks are compared, and no streams are asked for.

    Args:
        system: System id of the robot.
        fleet: The robots as arrays.
        **options: As of `Peer`.
    """

    def __init__(self, system: int, *, fleet: Fleet, **options: Any) -> None:  # noqa: ANN401 - as of `Peer`
        self._fleet = fleet
        super().__init__(system, numbering=fleet.numbering(system), **options)
        self._frames = UncountedFrames(self.counters)

    def plugged_in(self, now: float) -> Sequence[Event]:
        """See `Peer.plugged_in`."""
        self._fleet.restarted(self.system)
        return super().plugged_in(now)

    def fell_silent(self, now: float) -> None:
        """The fleet has not heard it for `SILENCE`.

        Args:
            now: Time in s.
        """
        self._move(Input.SILENCE, now)
        self._timer_due = NOW
        self._plan()

    def _plan(self) -> None:
        super()._plan()
        self._fleet.attend(self.system, usable=self.ready, waits=self._exchanges.active)

    def _begin_heartbeats(self) -> None:
        """One of ours goes to all robots of the fleet."""

    def _keep_up(self, now: float) -> None:
        """Nothing but what the fleet does."""

    def _watched(self, role: Role) -> Mapping[type[Message], float]:  # noqa: ARG002 - as of `Peer`
        return {}

    def _next_look(self) -> float:
        return NEVER if self.ready else super()._next_look()

    def _watch_silence(self, now: float) -> None:
        self._heard = max(self._heard, self._fleet.steady.heard[self.system])
        if self.ready:  # the fleet says when it falls silent
            self._silence_due = self._heard + SILENCE
            self._set_timer()
        else:
            super()._watch_silence(now)

    def _acknowledge(self, message: Message) -> None:
        """The fleet does, for many at once."""

    def _forget(self, now: float) -> None:
        self._fleet.restarted(self.system)
        super()._forget(now)
