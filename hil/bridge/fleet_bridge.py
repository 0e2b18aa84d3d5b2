"""A bridge for many robots: what they say all the time is taken and given as arrays, and never becomes an object."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.events import Received
from firmware_protocol.peer.companion import Companion
from firmware_protocol.peer.fleets.fleet_peer import FleetPeer
from firmware_protocol.peer.timetable import NEVER
from firmware_protocol.peer.timing import HEARTBEAT_PERIOD, HOST_HEARTBEAT
from firmware_protocol.wire.batch import Arrivals
from firmware_protocol.wire.can.batch import CanBatchCodec
from firmware_protocol.wire.fields import CAN
from firmware_protocol.wire.mavlink_batch import MavlinkBatchCodec
from hil.bridge.bridge import Bridge

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.clock import Clock
    from firmware_protocol.errors import HilError
    from firmware_protocol.events import Event
    from firmware_protocol.link import Link
    from firmware_protocol.peer.fleets.fleet import Fleet, Said
    from firmware_protocol.peer.role import Role
    from firmware_protocol.wire.codec import Codec

FEW: Final = 3000
"""Fewer bytes than this are done sooner message by message: some sixty frames."""
BatchCodec = MavlinkBatchCodec | CanBatchCodec
"""A codec that takes and gives arrays, too."""


class FleetBridge(Bridge):
    """One link and the robots on it, of which there are many.

    As `Bridge`, but that steady messages go to the fleet, one heartbeat of ours a second goes to all, and no clocks are
    compared. What the fleet takes down is not among the events of a step: taps see it as arrays (`Tap.arrived`).

    Args:
        link: As of `Bridge`.
        clock: Likewise.
        fleet: The robots as arrays.
        **options: As of `Bridge`.

    Attributes:
        fleet: The robots as arrays.
    """

    def __init__(self, link: Link, clock: Clock, *, fleet: Fleet, **options: Any) -> None:  # noqa: ANN401 - as of `Bridge`
        self.fleet = fleet
        self._batches: BatchCodec | None = None
        self._companions: dict[tuple[int, int], Companion] = {}
        super().__init__(link, clock, **options)

    def _open_codec(self, wire: str) -> Codec:
        if self.signing is not None:
            return super()._open_codec(wire)
        kind = CanBatchCodec if wire == CAN else MavlinkBatchCodec
        self._batches = kind(system=self._system, component=self._component, kinds=self.fleet.kinds)
        return self._batches

    def beside(self, system: int, component: int, role: Role) -> Companion:
        """What stands beside the robots, under a system id of its own; it is served from now on.

        Args:
            system: Its system id.
            component: Its component id.
            role: What it is.
        """
        found = self._companions.get((system, component))
        if found is None:
            found = Companion(
                system,
                component,
                role=role,
                session=self._session(),
                host=self.host,
                host_system=self._system,
                host_component=self._component,
            )
            self._companions[system, component] = found
        return found

    # --- in ----------------------------------------------------------------------------------------------------------

    def _take_chunk(self, stamp: float, data: bytes, events: list[Event]) -> None:
        if self._batches is None or len(data) < FEW or self._redaction.suspects(data):
            found = self._codec.receive(data, stamp)
            passed = self._redaction.received(stamp, data, found)
            came = Arrivals({}, found, range(len(found)))
        else:
            came = self._batches.receive_batches(data, stamp)
            self._redaction.passed(self._batches.pending)
            passed = [(stamp, data)]
        if self._taps:
            self._pass(passed)
        self._arrive(came, events)

    def _arrive(self, came: Arrivals, events: list[Event]) -> None:
        """Tell taps, fleet and peers of what a chunk has brought."""
        if came.batches or came.events:
            for tap in self._taps:
                tap.arrived(came)
        news = self.fleet.take(came)
        for item in came.events:
            if not isinstance(item, Received):
                events.append(item)
                self.acquaintances.blame(item)
        for received in news:
            if self._looking:
                self.witness.saw(received)
            companion = self._companions.get((received.system, received.component))
            if companion is not None:
                companion.handle(received)
            self._hear(received, events)

    def _make_peer(self, system: int, now: float) -> FleetPeer:
        peer = self._introduce(partial(FleetPeer, fleet=self.fleet), system, now)
        self.fleet.enter(peer)
        return peer

    def keep(self, robots: Sequence[int]) -> None:  # type: ignore[override]
        """See `Bridge.keep`."""
        for system in self.peers.keys() - set(robots):
            self.fleet.leave(system)
        super().keep(robots)

    def _missed(self, gap: float) -> None:
        super()._missed(gap)
        self.fleet.missed(gap)

    # --- out ---------------------------------------------------------------------------------------------------------

    def next_due(self) -> float:
        """When something must be sent next."""
        if self._failed:
            return NEVER
        soonest = min(super().next_due(), self._hello_due, self.fleet.next_due())
        for companion in self._companions.values():
            soonest = min(soonest, companion.next_due())
        return soonest

    def _service(self, now: float, events: list[Event]) -> None:
        if self.urgent:  # nothing else may hold up a stop
            super()._service(now, events)
        said: list[Said] = []
        if now >= self._hello_due:
            self._hello_due = now + HEARTBEAT_PERIOD
            said.append(HOST_HEARTBEAT)
        said += self.fleet.due(now, self._taken_in)
        for companion in self._companions.values():
            if now >= companion.next_due():
                said += companion.due(now)
        if said:
            self._say(said, now)
        if self.peers:
            super()._service(now, events)

    def _say(self, said: Sequence[Said], now: float) -> None:
        """Encode, send, and tell the taps; many of a kind as one batch."""
        if self._failed:
            return
        self._sent(self._outlet.write_rows(self.link, said, now, self._batches))

    def _cut_off(self, error: HilError) -> None:
        """Companions can't be reached any more."""
        for companion in self._companions.values():
            companion.gone(error)
