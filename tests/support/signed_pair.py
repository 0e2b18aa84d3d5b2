"""Keys and signing ends for tests: nothing here reads a clock."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

from firmware_protocol.wire.mavlink import SignedMavlinkCodec
from firmware_protocol.wire.mavlink_layout import SIGNATURE_LENGTH
from firmware_protocol.wire.signing import Signing, SigningKey

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

KEY = SigningKey(bytes(range(1, 33)))
OTHER_KEY = SigningKey(bytes(range(2, 34)))
NOW = 30_000_000_000_000
"""A time in signatures: 2024, about."""
END = 2**48 - 1
"""The last time that a signature has room for."""


def signed_codec(
    key: SigningKey = KEY, *, system: int = 255, component: int = 190, now: int = NOW, link: int = 0
) -> SignedMavlinkCodec:
    """One end whose clock stands still."""
    return SignedMavlinkCodec(system=system, component=component, signing=Signing(key, lambda: now, link=link))


def signed_at(time: int, message: Message, *, key: SigningKey = KEY, system: int = 255, link: int = 0) -> bytes:
    """A frame signed at any time, as who holds the key can make one, whatever `Signing` lets pass.

    Args:
        time: In 10 us since 2015-01-01 GMT, 48 bits.
        message: What it says.
        key: Key that it is signed with.
        system: System id of the sender.
        link: Id of the link.
    """
    frame = signed_codec(key, system=system).encode(message)[:-SIGNATURE_LENGTH] + bytes((link,)) + time.to_bytes(6, "little")
    return frame + hashlib.sha256(key.secret + frame).digest()[:6]
