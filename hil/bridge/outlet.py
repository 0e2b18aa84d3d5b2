"""What a bridge says: encoded, written to the link, and told to the taps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.errors import LinkError
from firmware_protocol.messages import SetupSigning
from firmware_protocol.wire.rows import messages_of
from firmware_protocol.wire.signing import redacted

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.link import Link
    from firmware_protocol.peer.fleets.fleet import Said
    from firmware_protocol.wire.can.batch import CanBatchCodec
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.mavlink_batch import MavlinkBatchCodec
    from hil.bridge.taps import Tap

    BatchCodec = MavlinkBatchCodec | CanBatchCodec


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
        frames = list(map(self._encode, messages))
        data = frames[0] if len(frames) == 1 else b"".join(frames)
        failure: LinkError | None = None
        try:
            link.write(data)
        except LinkError as error:
            failure = error
        if self._taps:
            self._tell(messages, frames, now, failure)
        return data if failure is None else failure

    def write_rows(self, link: Link, said: Sequence[Said], now: float, batches: BatchCodec | None) -> bytes | LinkError:
        """Write messages, many of a kind as arrays, in one piece.

        Args:
            link: Where to.
            said: What to say.
            now: Time of the step, in s.
            batches: Encodes arrays; None: they are encoded one by one.

        Returns:
            As `write`.
        """
        frames: list[bytes] = []
        for one in said:
            if not isinstance(one, tuple):
                frames.append(self._encode(one))
            elif batches is not None:
                frames.append(batches.encode_batch(*one))
            else:
                frames += map(self._encode, messages_of(*one))
        data = b"".join(frames)
        failure: LinkError | None = None
        try:
            link.write(data)
        except LinkError as error:
            failure = error
        for tap in self._taps:
            if failure is not None:
                tap.unsent(now, data, failure)
                continue
            tap.wire_tx(now, data)
            for one in said:
                if isinstance(one, tuple):
                    tap.sent_rows(now, *one)
                else:
                    tap.sent(now, one)
        return data if failure is None else failure

    def _tell(self, messages: Sequence[Message], frames: Sequence[bytes], now: float, failure: LinkError | None) -> None:
        """Tell the taps what was written, or was not."""
        pairs = zip(messages, frames, strict=True)
        told = b"".join([redacted(frame) if type(message) is SetupSigning else frame for message, frame in pairs])
        for tap in self._taps:
            if failure is not None:
                tap.unsent(now, told, failure)
                continue
            tap.wire_tx(now, told)
            for message in messages:
                tap.sent(now, message)
