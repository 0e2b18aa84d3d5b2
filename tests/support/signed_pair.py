"""Keys and signing ends for tests: nothing here reads a clock."""

from __future__ import annotations

from firmware_protocol.mavlink import SignedMavlinkCodec
from firmware_protocol.signing import Signing, SigningKey

KEY = SigningKey(bytes(range(1, 33)))
OTHER_KEY = SigningKey(bytes(range(2, 34)))
NOW = 30_000_000_000_000
"""A time in signatures: 2024, about."""


def signed_codec(
    key: SigningKey = KEY, *, system: int = 255, component: int = 190, now: int = NOW, link: int = 0
) -> SignedMavlinkCodec:
    """One end whose clock stands still."""
    return SignedMavlinkCodec(system=system, component=component, signing=Signing(key, lambda: now, link=link))
