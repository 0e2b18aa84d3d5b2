"""A guest of a shared link, as a test has it: a socket, and MAVLink over it."""

from __future__ import annotations

import socket
from time import monotonic
from typing import TYPE_CHECKING, Self, TypeVar

from firmware_protocol.events import Received
from firmware_protocol.messages import ROBOT_COMPONENT, Command, CommandLong, Heartbeat, Statustext
from firmware_protocol.wire.mavlink import MavlinkCodec

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.wire.fields import Message

M = TypeVar("M", bound="Message")
PATIENCE = 30.0
"""How long anything may take to come, in s."""
ROVER = Heartbeat(type=10, autopilot=0, base_mode=65, custom_mode=0, system_status=3)
"""What a robot says that is there."""
ROBOT = (1, ROBOT_COMPONENT)
STOP = CommandLong(*ROBOT, Command.FLIGHT_TERMINATION, 0, 1.0)
"""The emergency stop, as a guest asks for it."""


class Guest:
    """One program that looks on.

    Args:
        port: Where.
        system: Its system id.
        component: Its component id.
        holds: Bytes that its system holds for it at most; None: as it likes.

    Attributes:
        heard: All that it has been told.
        welcome: What it was told when it came.
        socket: Its connection.
    """

    def __init__(self, port: int, system: int = 255, component: int = 190, holds: int | None = None) -> None:
        self.socket = socket.socket()
        if holds is not None:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, holds)
        self.socket.settimeout(PATIENCE)
        self.socket.connect(("127.0.0.1", port))
        self.heard: list[Received] = []
        self._codec = MavlinkCodec(system=system, component=component)
        self._looked_at = 0
        self.welcome = self.wait_for(Statustext)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def say(self, message: Message) -> None:
        """Say something."""
        self.socket.sendall(self._codec.encode(message))

    def take(self) -> bool:
        """Take what has come, and wait for it; False where nothing comes any more."""
        try:
            data = self.socket.recv(1 << 16)
        except ConnectionResetError:
            return False
        self.heard += [event for event in self._codec.receive(data, 0.0) if isinstance(event, Received)]
        return bool(data)

    def until(self, done: Callable[[Received], bool]) -> Received:
        """Wait for something to be said, after what was waited for before."""
        end = monotonic() + PATIENCE
        while monotonic() < end:
            for at in range(self._looked_at, len(self.heard)):
                if done(self.heard[at]):
                    self._looked_at = at + 1
                    return self.heard[at]
            self._looked_at = len(self.heard)
            assert self.take(), "it was cut off"
        raise AssertionError("it does not come")

    def wait_for(self, kind: type[M], done: Callable[[M], bool] = lambda _: True) -> M:
        """Wait for a message of a kind."""
        found = self.until(lambda event: isinstance(event.message, kind) and done(event.message)).message
        assert isinstance(found, kind)
        return found

    def of_kind(self, kind: type[M]) -> list[M]:
        """All of a kind that were said."""
        return [event.message for event in self.heard if isinstance(event.message, kind)]

    def to_the_end(self) -> None:
        """Take everything until nothing comes any more."""
        while self.take():
            pass
