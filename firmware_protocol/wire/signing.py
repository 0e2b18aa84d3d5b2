"""MAVLink 2 signing without I/O: who holds the key is believed, once.

A signature is 13 bytes behind a frame: link id, time (48 bits, in 10 us since 2015-01-01 GMT) and the first six bytes of
SHA-256 over key, frame, link id and time. A receiver believes a frame only if

- its signature is that of the same key, and
- its time is later than that of the last one believed of the same stream (system, component, link), or
- it is the first of its stream, and not signed more than a minute before our own time;
- and its time is before 2100.

Not more than `STREAMS` streams are remembered: the one whose last time is furthest back is forgotten, and from then on no
stream may begin at or before that time, so that nothing of it can be replayed.

Nothing is believed unsigned. (The guide lets receivers make exceptions, for RADIO_STATUS above all, which telemetry radios
send unsigned: this project takes no notice of that message, so it needs none.)

Our own time runs with the clock that is handed in, and is put forward to any later time that a believed frame was signed
at, so that ends whose clocks differ understand each other after one frame. It never goes back, and never beyond 2100: one
frame from the end of the 48 bits would shut out everybody for ever.

Source: the MAVLink guide, "Message Signing" (https://mavlink.io/en/guide/message_signing.html).
"""

from __future__ import annotations

import hmac
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from typing import TYPE_CHECKING, Final

from firmware_protocol.events import Received, Rejected, RejectReason
from firmware_protocol.messages import ROBOT_COMPONENT, SetupSigning
from firmware_protocol.wire.mavlink_layout import FLAG_SIGNED, HEADER_LENGTH, MARKER, SIGNATURE_LENGTH

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

KEY_LENGTH: Final = 32
"""Bytes of a key."""
EPOCH: Final = 1_420_070_400
"""2015-01-01 GMT in Unix time, in s: the zero of the times in signatures."""
TICKS: Final = 100_000
"""Units of these times in a second."""
OLDEST: Final = 60 * TICKS
"""A first frame of a stream may be signed so long before our own time."""
TIME_LIMIT: Final = (4_102_444_800 - EPOCH) * TICKS >> 16 << 16
"""From here on a time is none: 2100-01-01 GMT, in the units of 0.66 s that robots store their time in."""

STREAMS: Final = 1024
"""Streams remembered: four components of every system."""

_TIME_LENGTH: Final = 6
_HASH_LENGTH: Final = 6
_AT_SYSTEM: Final = 5
_AT_ID: Final = 7
_SETUP: Final = SetupSigning.ID.to_bytes(3, "little")
_WITH_HEADER: Final = frozenset(RejectReason) - {RejectReason.NOISE, RejectReason.BAD_HEADER, RejectReason.UNKNOWN_MESSAGE}
"""What is rejected for these reasons begins with the header of a frame that there can be."""


class SigningKey:
    """A secret that robots and hosts share. Its text never shows it.

    Args:
        secret: 32 bytes, not all zero (which means "no key" on the wire).

    Attributes:
        secret: The bytes.

    Raises:
        ValueError: It is no such thing.
    """

    __slots__ = ("secret",)

    def __init__(self, secret: bytes) -> None:
        if len(secret) != KEY_LENGTH:
            raise ValueError(f"a signing key has {KEY_LENGTH} bytes, not {len(secret)}")
        if not any(secret):
            raise ValueError("a signing key is not all zero")
        self.secret = bytes(secret)

    def __repr__(self) -> str:
        return "SigningKey(secret)"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SigningKey) and hmac.compare_digest(self.secret, other.secret)

    def __hash__(self) -> int:
        return hash(self.secret)


class Signing:
    """One end's signatures: makes them, checks the other ends', and remembers how far each stream came.

    It outlives a codec: one that is made anew when a link comes back is given the same.

    Args:
        key: The key.
        time: Gives the time in 10 us since 2015-01-01 GMT; it may stand still or go back, what is signed does not. A run
            that must be repeatable passes its own virtual time.
        link: Id of the link, 0..255. One process that reaches the same robot over two links needs two.

    Attributes:
        refused: Time of the last frame that was refused for its time alone, in 10 us since 2015-01-01 GMT; None: none was.
    """

    def __init__(self, key: SigningKey, time: Callable[[], int], *, link: int = 0) -> None:
        self._secret = sha256(key.secret)
        self._time = time
        self._link = bytes((link,))
        self._ahead = 0
        self._last = -1
        self.refused: int | None = None
        self._streams: dict[bytes, int] = {}
        self._forgotten = -1

    def clock(self) -> int:
        """What our clock says, in 10 us since 2015-01-01 GMT, whatever was heard."""
        return self._time()

    def now(self) -> int:
        """Our own time, in 10 us since 2015-01-01 GMT; `TIME_LIMIT` at most, which nobody believes."""
        return min(max(self._time() + self._ahead, self._last + 1, 0), TIME_LIMIT)

    def sign(self, frame: bytes) -> bytes:
        """Make a signature.

        Args:
            frame: A whole frame with its checksum, the flag for signed frames set.

        Returns:
            The 13 bytes that follow it.
        """
        self._last = self.now()
        head = self._link + self._last.to_bytes(_TIME_LENGTH, "little")
        return head + self._hash(frame + head)

    def check(self, frame: bytes) -> RejectReason | None:
        """Judge a frame that has come; one that is believed counts as seen.

        Args:
            frame: A whole frame with a good checksum.

        Returns:
            Why it is not to be believed; None where it is.
        """
        if not frame[2] & FLAG_SIGNED:
            return RejectReason.NOT_SIGNED
        if not hmac.compare_digest(frame[-_HASH_LENGTH:], self._hash(frame[:-_HASH_LENGTH])):
            return RejectReason.BAD_SIGNATURE
        time = int.from_bytes(frame[-_HASH_LENGTH - _TIME_LENGTH : -_HASH_LENGTH], "little")
        stream = frame[_AT_SYSTEM:_AT_ID] + frame[-SIGNATURE_LENGTH : 1 - SIGNATURE_LENGTH]
        now = self.now()
        reason = _untimely(time, self._streams.get(stream), now)
        if reason is None and stream not in self._streams and time <= self._forgotten:
            reason = RejectReason.TOO_OLD
        if reason is not None:
            self.refused = time
            return reason
        self._streams[stream] = time
        if len(self._streams) > STREAMS:
            self._forget_one()
        if time > now:
            self._ahead = time - self._time()
        return None

    def _forget_one(self) -> None:
        """Forget the stream whose last frame was signed longest ago."""
        oldest = min(self._streams, key=self._streams.__getitem__)
        self._forgotten = max(self._forgotten, self._streams.pop(oldest))

    def _hash(self, data: bytes) -> bytes:
        hashed = self._secret.copy()
        hashed.update(data)
        return hashed.digest()[:_HASH_LENGTH]


def _untimely(time: int, last: int | None, now: int) -> RejectReason | None:
    """What is wrong with the time of a frame.

    Args:
        time: Its time, in 10 us since 2015-01-01 GMT.
        last: That of the last one believed of its stream; None: it is the first.
        now: Our own.
    """
    if time >= TIME_LIMIT:
        return RejectReason.NO_TIME
    if last is None:
        return RejectReason.TOO_OLD if time + OLDEST < now else None
    return RejectReason.REPLAYED if time <= last else None


def time_text(time: int) -> str:
    """A time for a person.

    Args:
        time: In 10 us since 2015-01-01 GMT.
    """
    if time >= TIME_LIMIT:
        return "2100 or later"
    return f"{datetime.fromtimestamp(EPOCH, UTC) + timedelta(seconds=time // TICKS):%Y-%m-%d %H:%M:%S} GMT"


def signing_time(unix_time: float) -> int:
    """A time as signatures carry it.

    Args:
        unix_time: In s since 1970-01-01 GMT.

    Returns:
        In 10 us since 2015-01-01 GMT.
    """
    return int((unix_time - EPOCH) * TICKS)


def virtual_time(now: float) -> int:
    """A time for signatures where no calendar may be asked: that of a clock that begins at 0, from one second on.

    Args:
        now: Reading of the clock, in s.

    Returns:
        In 10 us.
    """
    return int((now + 1.0) * TICKS)


def setup_signing(system: int, key: SigningKey | None, time: int) -> SetupSigning:
    """The message that gives a robot its key, or takes it away.

    Args:
        system: System id of the robot.
        key: The key; None takes it away.
        time: Our own time, in 10 us since 2015-01-01 GMT; 0 with no key. One that is none (2100 or later) is not said.
    """
    secret = bytes(KEY_LENGTH) if key is None else key.secret
    return SetupSigning(system, ROBOT_COMPONENT, tuple(secret), time if time < TIME_LIMIT else 0)


def carries_key(event: Received | Rejected) -> bool:
    """Whether a codec has found a SETUP_SIGNING, whole or damaged: its bytes are not fit to be kept.

    Args:
        event: What the codec of a byte link has found.
    """
    if isinstance(event, Received):
        return type(event.message) is SetupSigning
    return event.reason in _WITH_HEADER and event.raw[_AT_ID:HEADER_LENGTH] == _SETUP


def redacted(frame: bytes) -> bytes:
    """A SETUP_SIGNING fit to be kept: all behind its header is zero.

    Args:
        frame: The frame, or as much of it as has come.
    """
    return frame[:HEADER_LENGTH] + bytes(max(0, len(frame) - HEADER_LENGTH))


def may_carry_key(data: bytes) -> bool:
    """Whether some SETUP_SIGNING may begin in here, and go on: what a codec has not judged yet.

    Args:
        data: Bytes of a MAVLink link.
    """
    at = data.find(_SETUP, _AT_ID)
    while at >= 0:
        if data[at - _AT_ID] == MARKER:
            return True
        at = data.find(_SETUP, at + 1)
    return False


def trouble(rejected: Mapping[RejectReason, int], signed: int, signing: Signing | None) -> str:
    """What may be wrong with the keys when a robot does not answer.

    Args:
        rejected: Rejections by reason, as a codec counts them.
        signed: Good frames with a signature.
        signing: What we sign and check with; None: we have no key.

    Returns:
        What is seen and what to do; empty where it is nothing about keys.
    """
    if signing is None:
        if signed:
            return "it signs what it says, and believes only what is signed: pass its key file with --signing-key"
        return ""
    if rejected[RejectReason.BAD_SIGNATURE]:
        return "it signs with another key than ours: pass its own key file with --signing-key"
    if signing.refused is not None:
        clock, now = signing.clock(), signing.now()
        heard = f" (put forward to {time_text(now)} by what it heard)" if now > clock + OLDEST else ""
        return (
            f"it has our key, but another time: the robot's is {time_text(signing.refused)}, this computer's "
            f"{time_text(clock)}{heard}. Who is behind follows as soon as it hears the other, but never to 2100 or later. "
            "Do they hear each other? If so, set the clock, or let the robot forget its time: docs/signing.md"
        )
    if rejected[RejectReason.NOT_SIGNED]:
        return "it does not sign, and so is not believed: leave --signing-key out, or give it the key first (hil key)"
    return ""
