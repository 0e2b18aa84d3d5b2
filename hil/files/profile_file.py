"""Profiles of emulated micro-robots as a user names them: one that comes with the program, or a TOML file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import HilError
from hil.doors import Door

if TYPE_CHECKING:
    from simdevice.swarm.profile import MicroProfile


class ProfileFileError(HilError):
    """A profile can't be read, or is none of a micro-robot."""


DOOR: Final = Door("device profile", ProfileFileError, largest=1 << 16)


def read_profile(text: str) -> MicroProfile:
    """Read the profile that a user wrote after `noise=` or `--noise`.

    Args:
        text: `default`, `none`, or the path of a TOML file, which ends in `.toml`: quantities by their names; what it does not
            name keeps its default.

    Raises:
        ProfileFileError: There is no such profile, or the file can't be read, or something in it is wrong.
    """
    from simdevice.swarm.profile import PROFILES, MicroProfile  # noqa: PLC0415 - only where it is wanted

    if text in PROFILES:
        return PROFILES[text]
    if not text.endswith(".toml"):
        raise ProfileFileError(f"there is no noise {text[:40]!r}: it is {', '.join(PROFILES)}, or a device profile FILE.toml")
    document = DOOR.document(Path(text))
    try:
        return MicroProfile.from_table(document.data)
    except ValueError as error:
        raise ProfileFileError(f"{text}: {error}") from error
