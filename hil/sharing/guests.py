"""The guests of a shared link: programs that look on over TCP. One thread serves them all; nobody waits for any of them.

A guest that does not take what it is sent is cut off, one that says more than it need is listened to no faster than
`MOST_HEARD` a `LISTENING`, and more than `MOST_GUESTS` at a time are turned away with a word. Any page that is open in a
browser on this machine can send bytes here, though it can't read what comes back: HTTP begins with a letter, MAVLink never.
"""

from __future__ import annotations

import asyncio
import socket
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, cast

from firmware_protocol.errors import EncodeError
from firmware_protocol.events import Received
from firmware_protocol.links.tcp import notice_half_open
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    ROBOT_COMPONENT,
    SEVERITY_ERROR,
    SHARE_COMPONENT,
    CommandAck,
    Heartbeat,
    Statustext,
)
from firmware_protocol.peer.exchanges.answers import ANSWERS
from firmware_protocol.peer.timing import HEARTBEAT_PERIOD, HOST_HEARTBEAT
from firmware_protocol.wire.mavlink import MavlinkCodec
from hil.sharing.desk import Asker

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from firmware_protocol.wire.fields import Message
    from hil.sharing.desk import FrontDesk, Reply

MOST_GUESTS: Final = 4
"""Programs that look on at a time."""
MOST_WAITING: Final = 1 << 18
"""Bytes that wait for a guest at most, beside what its system holds; one that takes less is cut off."""
SYSTEM_HOLDS: Final = 1 << 16
"""Bytes that the system is asked to hold for it at most."""
MOST_HEARD: Final = 4096
"""Bytes that a guest is listened to in each `LISTENING`: its heartbeats and questions are a hundredth of that."""
LISTENING: Final = 0.25
"""In s."""
INFORMATION, WARNING = 6, 4
"""MAV_SEVERITY."""
HOST: Final = (HOST_SYSTEM, HOST_COMPONENT)
SHARE: Final = (HOST_SYSTEM, SHARE_COMPONENT)
"""Who says, by a host's heartbeat, that the link is shared."""


class Guests:
    """Everybody who looks on. All but the making of it is done in its loop's thread.

    Args:
        desk: Answers them.
        welcome: What each is told when it comes, in up to 50 letters.

    Attributes:
        gone: Nobody is there.
    """

    def __init__(self, desk: FrontDesk, welcome: str) -> None:
        self._desk = desk
        self._welcome = welcome
        self.gone = asyncio.Event()
        self.gone.set()
        self._guests: dict[int, _Guest] = {}
        self._comers = 0
        self._server: asyncio.Server | None = None
        self._ticking: asyncio.Task[None] | None = None

    def __len__(self) -> int:
        return len(self._guests)

    async def listen(self, host: str, port: int) -> int:
        """Let guests in from now on.

        Args:
            host: Address of this machine to listen at.
            port: Port; 0: any that is free.

        Returns:
            The port.

        Raises:
            OSError: It can't be listened at.
        """
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(self._come, host, port)
        self._ticking = loop.create_task(self._tick(loop))
        return int(self._server.sockets[0].getsockname()[1])

    def _come(self) -> _Guest:
        self._comers += 1
        return _Guest(self._comers, self._desk, self._enter, self._leave)

    def _enter(self, guest: _Guest) -> bool:
        """Let one in, and tell it how things stand; False where there is no room."""
        guest.say(SHARE, HOST_HEARTBEAT)
        if len(self._guests) >= MOST_GUESTS:
            guest.say(SHARE, Statustext(SEVERITY_ERROR, f"{MOST_GUESTS} programs look on already"))
            return False
        self._guests[guest.number] = guest
        self.gone.clear()
        guest.say(SHARE, Statustext(INFORMATION, self._welcome))
        for robot in self._desk.known:
            heartbeat = robot.latest(Heartbeat)
            if heartbeat is not None:
                guest.say((robot.system, ROBOT_COMPONENT), heartbeat)
        return True

    def _leave(self, guest: _Guest) -> None:
        self._guests.pop(guest.number, None)
        self._desk.left(guest.number)
        if not self._guests:
            self.gone.set()

    async def _tick(self, loop: asyncio.AbstractEventLoop) -> None:
        """Say once a second that the link is shared, and see to stops that nobody answers."""
        due = loop.time()
        while True:
            now = loop.time()
            self.give(self._desk.overdue(now))
            if now >= due:
                due = now + HEARTBEAT_PERIOD
                self.tell(SHARE, HOST_HEARTBEAT)
            await asyncio.sleep(LISTENING)

    def tell(self, sender: tuple[int, int], message: Message) -> None:
        """Tell everybody what somebody on the link has said, but for answers to the host that a guest may take for its own.

        Those to commands are for nobody else, since few programs look whom they name; others not for guests with its ids.

        Args:
            sender: System and component id of who has said it.
            message: What.
        """
        kind = type(message)
        to_host = kind in ANSWERS and _named(message) == HOST
        if to_host and kind is CommandAck:
            return
        for guest in list(self._guests.values()):
            if not (to_host and guest.ids == HOST):
                guest.say(sender, message)

    def give(self, replies: Iterable[Reply]) -> None:
        """Tell guests what they have asked for.

        Args:
            replies: What, and whom.
        """
        for reply in replies:
            guest = self._guests.get(reply.guest)
            if guest is not None:
                guest.say((reply.system, ROBOT_COMPONENT), reply.message)

    def close(self, text: str) -> None:
        """Tell everybody that it is over, and let nobody in any more.

        Args:
            text: Why, in up to 50 letters.
        """
        if self._ticking is not None:
            self._ticking.cancel()
        if self._server is not None:
            self._server.close()
        for guest in list(self._guests.values()):
            guest.say(SHARE, Statustext(SEVERITY_ERROR, text))
            guest.end()

    def cut_off(self) -> None:
        """Wait for nobody."""
        for guest in list(self._guests.values()):
            guest.cut_off()


class _Guest(asyncio.Protocol):
    """One program that looks on.

    Args:
        number: Its number.
        desk: Answers it.
        enter: Is called when it has come; False: it has to go.
        leave: Is called when it has gone.

    Attributes:
        number: As given.
        ids: System and component id that it gives itself; (0, 0) while it has said nothing.
    """

    def __init__(self, number: int, desk: FrontDesk, enter: Callable[[_Guest], bool], leave: Callable[[_Guest], None]) -> None:
        self.number = number
        self.ids = (0, 0)
        self._desk = desk
        self._enter = enter
        self._leave = leave
        self._loop = asyncio.get_running_loop()
        self._transport: asyncio.Transport | None = None
        self._listener = MavlinkCodec(system=HOST_SYSTEM, component=SHARE_COMPONENT)
        self._speakers: dict[tuple[int, int], MavlinkCodec] = {}
        self._begun = False
        self._heard = 0
        self._since = self._loop.time()

    # --- the connection ----------------------------------------------------------------------------------------------

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """It has come."""
        self._transport = cast("asyncio.Transport", transport)
        with suppress(OSError):  # it may have gone already
            connection: socket.socket = transport.get_extra_info("socket")
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SYSTEM_HOLDS)
            notice_half_open(connection)
        if not self._enter(self):
            self.end()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - why is of no interest
        """It has gone."""
        self._transport = None
        self._leave(self)

    def end(self) -> None:
        """Say no more; what was said goes out, where it is taken."""
        if self._transport is not None:
            self._transport.close()

    def cut_off(self) -> None:
        """Say no more, and give up what was said and is not taken."""
        if self._transport is not None:
            self._transport.abort()

    # --- in ----------------------------------------------------------------------------------------------------------

    def data_received(self, data: bytes) -> None:
        """It has said something: whole frames of it are answered. What begins with a letter is a browser's, and is cut off."""
        if not self._begun and data[:1].isalpha():
            self.cut_off()
            return
        self._begun = True
        now = self._loop.time()
        for event in self._listener.receive(data, now):
            if isinstance(event, Received):
                self.ids = event.system, event.component
                for reply in self._desk.answer(Asker(self.number, *self.ids), event.message, now):
                    self.say((reply.system, ROBOT_COMPONENT), reply.message)
        self._slow_down(len(data), now)

    def _slow_down(self, size: int, now: float) -> None:
        """Listen no faster than need be."""
        if now - self._since >= LISTENING:
            self._since, self._heard = now, 0
        self._heard += size
        if self._heard > MOST_HEARD and self._transport is not None and not self._transport.is_closing():
            self._transport.pause_reading()
            self._loop.call_later(LISTENING * self._heard / MOST_HEARD, self._listen_again)

    def _listen_again(self) -> None:
        if self._transport is not None and not self._transport.is_closing():
            self._transport.resume_reading()

    # --- out ---------------------------------------------------------------------------------------------------------

    def say(self, sender: tuple[int, int], message: Message) -> None:
        """Tell it something; where too much waits for it, it is cut off.

        Frames are numbered for each guest: what is said to one alone would be missing to the others.

        Args:
            sender: System and component id of who says it.
            message: What.
        """
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        speaker = self._speakers.get(sender)
        if speaker is None:
            speaker = self._speakers[sender] = MavlinkCodec(system=sender[0], component=sender[1])
        with suppress(EncodeError):  # what one wire has carried and another can't
            transport.write(speaker.encode(message))
        if transport.get_write_buffer_size() > MOST_WAITING:
            transport.abort()


def _named(message: Message) -> tuple[int, int]:
    """Whom an answer names."""
    answer: Any = message
    return answer.target_system, answer.target_component
