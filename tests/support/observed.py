"""A robot on a pty that is served by this process, and says by its own clock what it was told and when its wheels turned."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from serving import Stepped, in_thread

from firmware_protocol.events import Received
from firmware_protocol.messages import ROBOT_COMPONENT, Heartbeat, State
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.serving.endpoints import PtyEndpoint
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Iterator


class Observed(Stepped):
    """A robot that is watched.

    Attributes:
        heard: When it was told something last, in s of its clock.
        moved: When a wheel was turned on last.
        state: What it says it does.
    """

    def __init__(self) -> None:
        self.world = junior_world(WorldSettings(seed=5))
        super().__init__(self.world)
        self.listened = 0.0
        self.moved = 0.0
        self.state = State.DISARMED
        self._codec = MavlinkCodec(system=255, component=190)

    def step(self, inbound: bytes) -> bytes:
        if inbound:
            self.listened = self.now
        return super().step(inbound)

    def heard(self, out: bytes) -> None:
        if self.turning:
            self.moved = self.now
        for event in self._codec.receive(out, self.now):
            if isinstance(event, Received) and event.component == ROBOT_COMPONENT and isinstance(event.message, Heartbeat):
                self.state = State(event.message.custom_mode)

    @property
    def now(self) -> float:
        return self.world.now()

    @property
    def turning(self) -> bool:
        return self.world.device.wheels != (0.0, 0.0)

    def let_pass(self, duration: float) -> None:
        """Wait for the robot's clock."""
        end = self.now + duration
        self.until(lambda: self.now >= end)

    def becomes(self, state: State, within: float) -> bool:
        """Wait for a state, for so long in s of the robot's clock."""
        end = self.now + within
        self.until(lambda: self.state is state or self.now >= end)
        return self.state is state


@contextmanager
def served() -> Iterator[tuple[Observed, str]]:
    """An observed robot on a pty."""
    robot, endpoint = Observed(), PtyEndpoint()
    with in_thread(robot, endpoint):
        yield robot, endpoint.url
