"""What is seen on a link on which no robot can be used: the facts for `hil.connecting.diagnosis`. No I/O, no clock."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fastcrc.crc16 import mcrf4xx

from firmware_protocol.events import Received, RejectReason
from firmware_protocol.messages import (
    GROUND_STATION,
    HOST_SYSTEM,
    MESSAGES,
    ROBOT_COMPONENT,
    SEVERITY_ERROR,
    Heartbeat,
    Statustext,
)
from firmware_protocol.roles.known import SIGNS
from firmware_protocol.wire.mavlink_layout import (
    CHECKSUM_LENGTH,
    FLAG_SIGNED,
    HEADER_LENGTH,
    MARKER,
    SIGNATURE_LENGTH,
    crc_extra,
)

if TYPE_CHECKING:
    from firmware_protocol.events import Rejected

EVERYBODY: Final = 0
"""No system has this id: it means all of them."""
_KEPT: Final = 512
"""Bytes kept of what comes, to see what it is."""
_OURS: Final = 4096
"""Bytes kept of what we say, to know it again."""
_MARKER_1: Final = 0xFE
"""First byte of a frame of MAVLink 1, which has no other place here: no codec of ours reads it."""
_HEADER_1: Final = 6
_AROUND_1: Final = _HEADER_1 + CHECKSUM_LENGTH
_MARKERS: Final = ((MARKER, HEADER_LENGTH + CHECKSUM_LENGTH, 2), (_MARKER_1, _AROUND_1, 1))
"""Start marker, bytes of a frame around its payload, version of MAVLink."""
_MOSTLY: Final = 0.9
"""Share of letters that makes bytes a text."""
_DAMAGED: Final = frozenset(
    (
        RejectReason.NOISE,
        RejectReason.BAD_HEADER,
        RejectReason.UNKNOWN_MESSAGE,
        RejectReason.BAD_CHECKSUM,
        RejectReason.INCOMPLETE,
    )
)


class Witness:
    """Remembers what came on a link, and what of it was our own.

    Args:
        own: Our system id.
        now: Time in s.

    Attributes:
        own: Likewise.
        since: From when on, in s.
        until: When something came last, in s.
        received: Bytes that have come.
        good: Good messages heard.
        damaged: Pieces of what came that were no good message.
        robots: Systems that say what only a robot with a role of ours says.
        vehicles: Systems that say that they are a vehicle, those robots among them.
        hosts: Systems that say that they are a ground station.
        misnumbered: Ids under which robots speak that no robot may have.
        echo: What we have said comes back.
        told: The last error that was told to people.
    """

    def __init__(self, own: int, now: float) -> None:
        self.own = own
        self.since = self.until = now
        self.received = 0
        self.good = 0
        self.damaged = 0
        self.robots: set[int] = set()
        self.vehicles: set[int] = set()
        self.hosts: set[int] = set()
        self.misnumbered: set[int] = set()
        self.echo = False
        self.told = ""
        self._tail = b""
        self._ours = b""

    def sent(self, data: bytes) -> None:
        """We have said something.

        Args:
            data: As it went out.
        """
        self._ours = (self._ours + data)[-_OURS:]

    def came(self, data: bytes, now: float) -> None:
        """Something came.

        Args:
            data: As it came.
            now: Its stamp in s.
        """
        self.received += len(data)
        self.until = now
        self._tail = (self._tail + data)[-_KEPT:]

    def saw(self, event: Received | Rejected) -> None:
        """A codec has found something in what came.

        Args:
            event: A good message, or what was none.
        """
        if not isinstance(event, Received):
            self.damaged += event.reason in _DAMAGED
            return
        self.good += 1
        if self.is_ours(event):
            self.echo = True
        else:
            self._look(event)

    def is_ours(self, event: Received) -> bool:
        """Whether we have said this ourselves: every byte of it, the frame's number too.

        Args:
            event: What was heard.
        """
        return event.system == self.own and bool(event.raw) and event.raw in self._ours

    def _look(self, event: Received) -> None:
        message, system = event.message, event.system
        if isinstance(message, Statustext) and message.severity <= SEVERITY_ERROR:
            self.told = message.text
        if isinstance(message, Heartbeat) and message.type == GROUND_STATION:
            self.hosts.add(system)
        elif event.component == ROBOT_COMPONENT and (isinstance(message, Heartbeat) or type(message) in SIGNS):
            if system in {EVERYBODY, HOST_SYSTEM}:
                self.misnumbered.add(system)
                return
            self.vehicles.add(system)
            if not isinstance(message, Heartbeat):
                self.robots.add(system)

    def rate(self, now: float) -> float:
        """Bytes that have come in a second, on the average.

        Args:
            now: Time in s.
        """
        return self.received / (now - self.since) if now > self.since else 0.0

    @property
    def mavlink(self) -> int:
        """Version of MAVLink that seems to be spoken, in whatever dialect; 0 for none."""
        return framing(self._tail) or (1 if speaks_mavlink_1(self._tail) else 0)

    @property
    def text(self) -> str:
        """What has come last, if it is text for people; else empty."""
        return printable(self._tail)


def speaks_mavlink_1(data: bytes) -> bool:
    """Whether there is a whole MAVLink 1 frame in it, of a message we know, with a good checksum.

    Args:
        data: Bytes from a byte link.
    """
    at = data.find(_MARKER_1)
    while 0 <= at <= len(data) - _AROUND_1:
        length, number = data[at + 1], data[at + 5]
        end = at + _HEADER_1 + length
        if number in MESSAGES and end + 2 <= len(data):
            extra = bytes((crc_extra(MESSAGES[number]),))
            if mcrf4xx(data[at + 1 : end] + extra) == data[end] | data[end + 1] << 8:
                return True
        at = data.find(_MARKER_1, at + 1)
    return False


def framing(data: bytes) -> int:
    """See whether bytes are MAVLink of any dialect: two frames, the second where the length of the first says.

    Args:
        data: Bytes from a byte link.

    Returns:
        2 or 1, the version of MAVLink; 0 for none.
    """
    for marker, around, version in _MARKERS:
        at = data.find(marker)
        while 0 <= at < len(data) - around:
            signed = SIGNATURE_LENGTH if version == 2 and data[at + 2] & FLAG_SIGNED else 0
            following = at + around + data[at + 1] + signed
            if following < len(data) and data[following] == marker and following + around + 1 < len(data):
                beyond = following + around + data[following + 1]
                beyond += SIGNATURE_LENGTH if version == 2 and data[following + 2] & FLAG_SIGNED else 0
                if beyond == len(data) or (beyond < len(data) and data[beyond] == marker):
                    return version
            at = data.find(marker, at + 1)
    return 0


def printable(data: bytes) -> str:
    """The last line of a text; empty when the bytes are none.

    Args:
        data: Bytes from a serial port.
    """
    letters = sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in data)
    if len(data) < 8 or letters < _MOSTLY * len(data):
        return ""
    lines = [line.strip() for line in data.decode("ascii", "replace").splitlines() if line.strip()]
    if not lines:
        return ""
    whole = lines[-2] if len(lines) > 1 and not data.endswith((b"\r", b"\n")) else lines[-1]
    return "".join(letter for letter in whole if letter.isprintable())[:60]
