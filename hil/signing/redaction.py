"""What comes over a link on its way to those who write it down: signing keys are left out, all else is as it came."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from firmware_protocol.events import Received
from firmware_protocol.messages import SetupSigning
from firmware_protocol.wire.fields import MAVLINK
from firmware_protocol.wire.mavlink import frame_size
from firmware_protocol.wire.mavlink_layout import HEADER_LENGTH
from firmware_protocol.wire.signing import carries_key, may_carry_key

if TYPE_CHECKING:
    from firmware_protocol.events import Rejected
    from hil.bridge.pump import Chunk


class Redaction:
    """Leaves out the payload of every frame that the codec has found to be a SETUP_SIGNING, whole or damaged.

    A chunk in which such a frame may have begun is held until the codec has judged it: until the next chunk, or the end of
    its patience. Everything else goes on at once, and unchanged.

    Args:
        wire: What the link carries; on CAN there are no keys.
    """

    def __init__(self, wire: str) -> None:
        self._keys = wire == MAVLINK
        self._unjudged = b""
        """Bytes that no event has held yet."""
        self._claimed = 0
        """Bytes that a damaged frame with a key would still have had."""
        self._held = bytearray()
        """The chunks that are held, one after the other; the last ones are those not judged."""
        self._chunks: list[tuple[float, int]] = []
        """Of each that is held, stamp in s and length."""

    def suspects(self, data: bytes) -> bool:
        """Whether a key may be in a chunk, or a part of one: then it is for `received`.

        Args:
            data: The chunk.
        """
        return self._keys and bool(self._chunks or self._claimed or may_carry_key(self._unjudged + data))

    def passed(self, rest: bytes) -> None:
        """A chunk has come in which there can be no key.

        Args:
            rest: What the codec has not judged yet.
        """
        if self._keys:
            self._unjudged = rest

    def received(self, stamp: float, data: bytes, events: list[Received | Rejected]) -> list[Chunk]:
        """A chunk has come.

        Args:
            stamp: When, in s.
            data: The chunk.
            events: What the codec has made of it; what was rejected and holds a key is replaced.

        Returns:
            The chunks that may go on, in order.
        """
        if not self._keys:
            return [(stamp, data)]
        if len(events) == 1 and not (self._unjudged or self._chunks or self._claimed):
            event = events[0]
            if isinstance(event, Received) and len(event.raw) == len(data) and type(event.message) is not SetupSigning:
                return [(stamp, data)]  # a frame without a key, and nothing before or behind it: what most chunks are
        unjudged = self._unjudged + data
        if not self._chunks and not self._claimed and not may_carry_key(unjudged):
            self._unjudged = unjudged[sum(len(event.raw) for event in events) :]
            return [(stamp, data)]
        self._unjudged = unjudged
        self._held += data
        self._chunks.append((stamp, len(data)))
        return self.judged(events)

    def judged(self, events: list[Received | Rejected]) -> list[Chunk]:
        """The codec has made up its mind without anything more having come.

        Args:
            events: As in `received`.

        Returns:
            As `received`.
        """
        if not self._keys:
            return []
        at = 0
        ahead = len(self._held) - len(self._unjudged)
        for index, event in enumerate(events):
            secret = self._secret(event)
            if secret:
                begin = max(0, ahead + at + secret.start)
                end = max(0, ahead + at + secret.stop)
                self._held[begin:end] = bytes(end - begin)
                if not isinstance(event, Received):
                    kept = event.raw[: secret.start] + bytes(len(secret)) + event.raw[secret.stop :]
                    events[index] = replace(event, raw=kept)
            at += len(event.raw)
        self._unjudged = self._unjudged[at:]
        if self._unjudged and (self._claimed or may_carry_key(self._unjudged)):
            return []
        return self._release()

    def ended(self, events: list[Received | Rejected]) -> list[Chunk]:
        """The link has ended, and the codec has given up all that was incomplete.

        Args:
            events: As in `received`.

        Returns:
            As `received`.
        """
        chunks = self.judged(events)
        self._unjudged = b""
        self._claimed = 0
        return chunks + self._release()

    def _secret(self, event: Received | Rejected) -> range:
        """Which bytes of an event are not fit to be kept."""
        size = len(event.raw)
        if carries_key(event):
            self._claimed = 0 if isinstance(event, Received) else max(0, (frame_size(event.raw, 0) or 0) - size)
            return range(min(HEADER_LENGTH, size), size)
        if isinstance(event, Received):
            self._claimed = 0
            return range(0)
        secret = range(min(self._claimed, size))
        self._claimed -= len(secret)
        return secret

    def _release(self) -> list[Chunk]:
        """Hand out all that is held."""
        chunks: list[Chunk] = []
        at = 0
        for stamp, size in self._chunks:
            chunks.append((stamp, bytes(self._held[at : at + size])))
            at += size
        self._held.clear()
        self._chunks.clear()
        return chunks
