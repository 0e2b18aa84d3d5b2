"""Files that hold a signing key, and the clock that signatures go by."""

from __future__ import annotations

import contextlib
import os
import secrets
import time
from pathlib import Path
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import AddressError, HilError
from firmware_protocol.wire.fields import MAVLINK
from firmware_protocol.wire.signing import KEY_LENGTH, Signing, SigningKey, signing_time, virtual_time
from hil.doors import Door

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.clock import Clock
    from firmware_protocol.link import Link

_OTHERS: Final = 0o077
"""What nobody but the owner may do with a key file."""


class KeyFileError(HilError):
    """A key file can't be used; the text says why, and never what is in it."""


DOOR: Final = Door("key file", KeyFileError, largest=1000)


def create_key(path: Path) -> SigningKey:
    """Draw a key, and write it to a new file that nobody but its owner can read.

    Args:
        path: Where to; nothing may be there.

    Returns:
        The key.

    Raises:
        KeyFileError: Something is there already, or it can't be written.
    """
    key = SigningKey(secrets.token_bytes(KEY_LENGTH))
    try:
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError as error:
        raise KeyFileError(f"{path} is there already, and a key that is overwritten is lost: choose another name") from error
    except OSError as error:
        raise KeyFileError(f"cannot write {path}: {error.strerror}") from error
    try:
        with os.fdopen(file, "w", encoding="ascii") as stream:
            stream.write(key.secret.hex() + "\n")
    except OSError as error:
        with contextlib.suppress(OSError):
            path.unlink()
        raise KeyFileError(f"cannot write {path}: {error.strerror}") from error
    return key


def load_key(path: Path) -> SigningKey:
    """Read a key file: 64 hexadecimal digits.

    Args:
        path: The file.

    Raises:
        KeyFileError: It can't be read, others can read it, or it holds something else.
    """

    def secret(status: os.stat_result) -> str:
        if os.name == "posix" and status.st_mode & _OTHERS:
            return f"others than its owner can use {path}: a key must be secret. Run: chmod 600 {path}"
        return ""

    text = DOOR.text(path, allowed=secret)
    try:
        return SigningKey(bytes.fromhex(text.strip()))
    except ValueError:  # whose text shows what is in the file
        reason = f"{path} is no key file: it must hold {2 * KEY_LENGTH} hexadecimal digits, not all 0. Make one: hil keygen"
    raise KeyFileError(reason)


def calendar() -> int:
    """The present time as signatures carry it: in 10 us since 2015-01-01 GMT."""
    return signing_time(time.time())


def open_signing(key: SigningKey | None, link: Link, reading: Clock, begun: Callable[[], int] = calendar) -> Signing | None:
    """What signs on a link.

    Times in signatures begin with the calendar's, so that they go on where an earlier run stopped, and go on by the steps'
    readings of the clock. On a link in lock-step they begin at zero, with a robot that is new as well: equal runs sign equally.

    Args:
        key: The key; None: nothing is signed.
        link: An open link; closed on an error.
        reading: The clock it runs by, as the bridge reads it.
        begun: Reads the calendar, in 10 us since 2015-01-01 GMT.

    Raises:
        AddressError: Nothing can be signed on this link.
    """
    if key is None:
        return None
    if link.wire != MAVLINK:
        link.close()
        raise no_signatures(link.url)
    if link.lockstep:
        return Signing(key, lambda: virtual_time(reading.now()))
    origin = begun() - virtual_time(reading.now())
    return Signing(key, lambda: origin + virtual_time(reading.now()))


def no_signatures(url: str) -> AddressError:
    """The error of a key on a CAN bus.

    Args:
        url: Address of the link.
    """
    return AddressError(url, "nothing is signed on a CAN bus", "Leave --signing-key out: who is on the bus is believed")
