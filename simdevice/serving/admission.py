"""Who may speak with a served robot: what a server itself understands of MAVLink, and how it turns a client away.

Times are arguments, in s.
"""

from __future__ import annotations

import contextlib
import socket
from typing import TYPE_CHECKING, Final

from firmware_protocol.events import Received
from firmware_protocol.messages import ROBOT_COMPONENT, Statustext
from firmware_protocol.wire.mavlink import MavlinkCodec, SignedMavlinkCodec
from firmware_protocol.wire.mavlink_layout import FLAG_SIGNED, HEADER_LENGTH, MARKER

if TYPE_CHECKING:
    from firmware_protocol.wire.signing import Signing

SILENT: Final = 10.0
"""A client that holds a stream and has said nothing for this long loses its place when another asks for it, in s."""
INVITED: Final = 5.0
"""A sender of datagrams is spoken to until this long after its last good frame, in s."""
HELD: Final = "another client holds the robot"
TAKEN_OVER: Final = "silent for 10 s: another client has the robot now"
"""What a client that is turned away is told; a STATUSTEXT has room for 50 bytes."""
SERVER_LINK: Final = 255
"""Id of the link under which a server signs for its robot, whose own is another: each has its own times."""

_FAREWELL: Final = 1.0
"""A client that was turned away is given this long to read why, in s."""
_MOST: Final = 8
"""So many are given it at the same time; others are closed at once."""
_CHUNK: Final = 4096
_SEVERITY: Final = 3
"""MAV_SEVERITY_ERROR."""
_AT_FLAGS: Final = 2
_AT_SYSTEM: Final = 5


class Interpreter:
    """Speaks for the robot, as the robot that was heard last, and tells good frames from noise.

    Signatures are for the robot to judge, whose key may change while it is served.

    Args:
        signing: Signs what is said where the robot signs too; None signs nothing.
    """

    def __init__(self, signing: Signing | None = None) -> None:
        self._ears = MavlinkCodec(system=1, component=ROBOT_COMPONENT)
        self._signing = signing
        self._system = 1
        self._signs = False

    def overhear(self, data: bytes) -> None:
        """Note which robot speaks.

        Args:
            data: What it says; a whole frame to begin with, or nothing is learnt.
        """
        if len(data) >= HEADER_LENGTH and data[0] == MARKER:
            self._system = data[_AT_SYSTEM] or 1
            self._signs = bool(data[_AT_FLAGS] & FLAG_SIGNED)

    def line(self, text: str) -> bytes:
        """A frame that tells a person something.

        Args:
            text: What; at most 50 bytes.
        """
        voice: MavlinkCodec
        if self._signs and self._signing is not None:
            voice = SignedMavlinkCodec(system=self._system, component=ROBOT_COMPONENT, signing=self._signing)
        else:
            voice = MavlinkCodec(system=self._system, component=ROBOT_COMPONENT)
        return voice.encode(Statustext(_SEVERITY, text))

    def is_good(self, datagram: bytes, now: float) -> bool:
        """Whether a datagram holds a whole frame of a message that robots know, undamaged.

        Args:
            datagram: What came.
            now: When.
        """
        self._ears.reset()
        return any(isinstance(event, Received) for event in self._ears.receive(datagram, now))


class Farewells:
    """Clients that were turned away, until they have read why.

    A socket that is closed while something unread lies in it is reset, and what it was told is lost: so they are read from
    until they go, for a while.
    """

    def __init__(self) -> None:
        self._leaving: dict[socket.socket, float] = {}

    def files(self) -> list[int]:
        """Their file descriptors."""
        return [client.fileno() for client in self._leaving]

    def add(self, client: socket.socket, last: bytes, now: float) -> None:
        """Say a last thing to a client, and end the conversation.

        Args:
            client: Its socket, which does not block.
            last: What it is told.
            now: The time.
        """
        try:
            client.send(last)
            client.shutdown(socket.SHUT_WR)
        except OSError:  # it takes nothing, or has gone
            client.close()
            return
        if len(self._leaving) >= _MOST:
            client.close()
        else:
            self._leaving[client] = now + _FAREWELL

    def poll(self, now: float) -> None:
        """Close those that have gone, or had time enough."""
        for client, deadline in list(self._leaving.items()):
            over = now >= deadline
            with contextlib.suppress(BlockingIOError, InterruptedError):
                try:
                    over = not client.recv(_CHUNK) or over
                except ConnectionError:
                    over = True
            if over:
                client.close()
                del self._leaving[client]

    def close(self) -> None:
        """Close all."""
        for client in self._leaving:
            client.close()
        self._leaving.clear()
