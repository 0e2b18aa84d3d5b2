"""What a bridge says: encoded, written to the link, and told to the taps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.errors import LinkError
from firmware_protocol.messages import SetupSigning
from firmware_protocol.wire.signing import redacted

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.link import Link
    from firmware_protocol.wire.fields import Message
    from hil.bridge.taps import Tap


class Outlet:
    """Writes messages, and tells the taps what has become of them; of signing keys they see zeros.

    Args:
        encode: Makes wire data of a message.
        taps: What sees everything.
    """

    def __init__(self, encode: Callable[[Message], bytes], taps: Sequence[Tap]) -> None:
        self._encode = encode
        self._taps = taps

    def write(self, link: Link, messages: Sequence[Message], now: float) -> bytes | LinkError:
        """Write messages, in one piece.

        Args:
            link: Where to.
            messages: What to say.
            now: Time of the step, in s.

        Returns:
            The bytes as they went out; why they did not.
        """
        encode = self._encode
        frames = [encode(message) for message in messages]
        data = b"".join(frames)
        failure: LinkError | None = None
        try:
            link.write(data)
        except LinkError as error:
            failure = error
        told = data
        if any(isinstance(message, SetupSigning) for message in messages):
            pairs = zip(messages, frames, strict=True)
            told = b"".join(redacted(frame) if isinstance(message, SetupSigning) else frame for message, frame in pairs)
        if failure is not None:
            for tap in self._taps:
                tap.unsent(now, told, failure)
            return failure
        for tap in self._taps:
            tap.wire_tx(now, told)
            for message in messages:
                tap.sent(now, message)
        return data
