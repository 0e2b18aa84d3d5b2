"""What comes out of a codec and of a peer: typed events, never exceptions."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message


class RejectReason(Enum):
    """Why wire input was not accepted."""

    NOISE = "bytes outside any frame"
    BAD_HEADER = "length or flags no frame of this id can have"
    UNKNOWN_MESSAGE = "unknown message id"
    BAD_CHECKSUM = "bad checksum"
    BAD_VALUE = "value out of range"
    INCOMPLETE = "frame broken off"
    NOT_SIGNED = "no signature"
    BAD_SIGNATURE = "bad signature"
    REPLAYED = "signed at a time that has been: replayed"
    TOO_OLD = "signed more than a minute before"
    NO_TIME = "signed in 2100 or later: no time"


class Received(NamedTuple):  # there are more of these than of all others: a tuple is made in a third of the time
    """A good message.

    Attributes:
        message: The message.
        system: System id of the sender.
        component: Component id of the sender.
        sequence: Frame sequence number (0..255).
        time: Stamp of the chunk that completed the frame, in s.
        raw: The frame as it came.
    """

    message: Message
    system: int
    component: int
    sequence: int
    time: float
    raw: bytes


@dataclass(frozen=True, slots=True)
class Rejected:
    """Wire input that was not accepted; it has been skipped.

    Attributes:
        reason: Why.
        raw: The bytes.
        time: Stamp of the chunk, in s.
        detail: More, where there is more to say.
        system: System id of the sender, where that much is certain: the frame came whole, and what was in it was bad.
    """

    reason: RejectReason
    raw: bytes
    time: float
    detail: str = ""
    system: int | None = None


@dataclass(frozen=True, slots=True)
class PeerFound:
    """A robot answered and the handshake with it is done."""

    system: int
    time: float


@dataclass(frozen=True, slots=True)
class PeerLost:
    """A robot that had answered fell silent, or its link closed (then `cause` says so)."""

    system: int
    time: float
    cause: str


@dataclass(frozen=True, slots=True)
class PeerBack:
    """A lost robot answers again.

    Attributes:
        rebooted: Its boot counter or clock shows that it has restarted meanwhile.
    """

    system: int
    time: float
    rebooted: bool


@dataclass(frozen=True, slots=True)
class LinkNews:
    """Something has happened to the link that is worth telling a person: a CAN bus in trouble, or well again."""

    text: str
    time: float


@dataclass(frozen=True, slots=True)
class StreamStopped:
    """A robot that is heard does not send something that is needed of it.

    Attributes:
        stream: Name of the message.
        requests: How often it has been asked for again; 0 where we only watch, and change nothing, or where it has stopped
            again so soon that it is asked for later.
        last: It is not asked for any more.
    """

    system: int
    time: float
    stream: str
    requests: int
    last: bool

    @property
    def text(self) -> str:
        """What has happened, in words."""
        head = f"robot {self.system} sends no {self.stream} any more: stopped by another client"
        if not self.requests:
            return head
        return f"{head}; asked for it {self.requests} times, to no avail" if self.last else f"{head}; asking for it again"


@dataclass(frozen=True, slots=True)
class StreamBack:
    """What had stopped comes again.

    Attributes:
        stream: Name of the message.
    """

    system: int
    time: float
    stream: str

    @property
    def text(self) -> str:
        """What has happened, in words."""
        return f"robot {self.system} sends {self.stream} again"


StreamNews = StreamStopped | StreamBack
Event = Received | Rejected | PeerFound | PeerLost | PeerBack | LinkNews | StreamNews
