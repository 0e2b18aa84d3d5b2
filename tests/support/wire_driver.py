"""A host that drives an emulated Junior over a link in lock-step, frame by frame: the oracle of `simdevice.kernel.pilot`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from opening import opening

from firmware_protocol.events import Received
from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.links.faulty import FaultyLink
from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    REFEREE_COMPONENT,
    ROBOT_COMPONENT,
    BoutOutcome,
    JuniorSensors,
    JuniorWheels,
    OpponentCode,
    RefereeReset,
    RefereeState,
)
from firmware_protocol.wire.codec import SPLITTERS
from firmware_protocol.wire.mavlink import MavlinkCodec

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from firmware_protocol.wire.fields import Message
    from simdevice.sumo.world import World

_ROBOT = (1, ROBOT_COMPONENT)
_REFEREE = (1, REFEREE_COMPONENT)
_SESSION = 1
_HOST = 1
_SETTLING = 3
_DURATION = 0.1
_SLACK = 1e-6
"""A frame is late by this much less, in s, so that rounding does not put it into the next control period."""


class WireDriver:
    """Plays one bout by a list of actions.

    Args:
        world: The emulated robot; nobody has let it live yet.
        delay: Time that a frame takes, each way, in s.

    Attributes:
        outcome: Of the bout, as the referee says.
        placed: When everybody was put down, in s of the world's time.
    """

    def __init__(self, world: World, delay: float = 0.0) -> None:
        self._world, self._delay = world, delay
        link = MemoryLink(world)
        faulty = FaultyLink(link, FaultSpec(delay=max(0.0, delay - _SLACK)), seed=1, clock=world, split=SPLITTERS[world.wire])
        self._link = faulty if delay else link
        self._codec = MavlinkCodec(system=HOST_SYSTEM, component=HOST_COMPONENT)
        self._sequence = 0
        self.outcome = BoutOutcome.UNDECIDED
        self.placed = 0.0

    def _greet(self) -> None:
        """Open the session, and arm."""
        self._send(*opening(_SESSION, _HOST))
        self._sequence = 0

    def _send(self, *messages: Message) -> None:
        self._link.write(b"".join(map(self._codec.encode, messages)))

    def _drive(self, left: float, right: float) -> JuniorWheels:
        self._sequence += 1
        return JuniorWheels(_SESSION, self._sequence, (left, right), _DURATION, *_ROBOT)

    def _readings(self) -> Iterator[JuniorSensors]:
        """Each as it comes; what the referee says is taken note of."""
        while True:
            yield from self._hear()

    def _hear(self) -> list[JuniorSensors]:
        """Wait for a control period."""
        events = self._codec.receive(self._link.read(self._world.period), self._world.now())
        messages = [event.message for event in events if isinstance(event, Received)]
        for message in messages:
            if isinstance(message, RefereeState):
                self.outcome = BoutOutcome(message.outcome)
        return [message for message in messages if isinstance(message, JuniorSensors)]

    def _hear_the_referee(self, until: float) -> None:
        """Wait for what is still on its way."""
        while self.outcome is BoutOutcome.UNDECIDED and self._world.now() < until:
            self._hear()

    def play(self, seed: int, opponent: OpponentCode, actions: Sequence[tuple[float, float]]) -> list[JuniorSensors]:
        """Play, until the bout is over or no action is left.

        Args:
            seed: Of the bout.
            opponent: Who is met.
            actions: Left and right wheel, share of full speed.

        Returns:
            The readings, one more than actions that were sent.
        """
        self._greet()
        self._send(self._drive(0.0, 0.0))
        readings = self._readings()
        next(readings)
        self._send(RefereeReset(seed, _SESSION, 1, *_REFEREE, opponent), self._drive(0.0, 0.0))
        self.placed = self._world.now() + self._delay
        heard: list[JuniorSensors] = []
        settling, left = _SETTLING, list(actions)
        for reading in readings:
            if not heard:
                settling -= reading.time >= self.placed
                if settling > 0:
                    if settling < _SETTLING:
                        self._send(self._drive(0.0, 0.0))
                    continue
            heard.append(reading)
            if self.outcome is not BoutOutcome.UNDECIDED or not left:
                break
            self._send(self._drive(*left.pop(0)))
        self._hear_the_referee(self._world.now() + self._delay + self._world.period)
        return heard
