"""Why a port can't be opened, as far as the system tells: who has it, and who may have it."""

from __future__ import annotations

import contextlib
import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Collection

PROC: Final = Path("/proc")
_OR_SHARE: Final = ". Or, to look on: if it is hil, start it with --share tcp://127.0.0.1:5770, and name that address here"
_USUAL_GROUP: Final = "dialout"
_NO_GROUP: Final = frozenset({"root", "wheel"})
"""Groups that nobody should join for the sake of a port."""


def holders(device: str, *, proc: Path = PROC) -> list[str]:
    """The other programs that have a device open (Linux; elsewhere nothing is known).

    Programs of other users are seen by root only.

    Args:
        device: As `/dev/ttyACM0`.
        proc: Where the kernel tells of its processes.

    Returns:
        Their names with their process ids, such as `screen (process 1234)`; empty where there is none, or none can be seen.
    """
    real = os.path.realpath(device)
    try:
        processes = sorted((path for path in proc.iterdir() if path.name.isdigit()), key=lambda path: int(path.name))
    except OSError:
        return []
    others = (path for path in processes if int(path.name) != os.getpid())
    return [f"{_name(path)} (process {path.name})" for path in others if _has_open(path, real)]


def _has_open(process: Path, device: str) -> bool:
    try:
        files = list((process / "fd").iterdir())
    except OSError:  # another user's, or it has ended
        return False
    for file in files:
        with contextlib.suppress(OSError):
            if str(file.readlink()) == device:
                return True
    return False


def _name(process: Path) -> str:
    try:
        return (process / "comm").read_text(encoding="utf-8", errors="replace").strip() or "a program"
    except OSError:
        return "a program"


def busy_remedy(device: str, having: Collection[str]) -> str:
    """What to do about a port that another program has.

    Args:
        device: The port.
        having: Who has it, from `holders`.
    """
    if any(name.startswith("ModemManager") for name in having):
        return (
            "ModemManager tries whether it is a modem: wait half a minute, or do without it: "
            "`sudo systemctl disable --now ModemManager`"
        )
    if having:
        return f"Close {' and '.join(having)}{_OR_SHARE}"
    return f"Close that program (`sudo fuser -v {device}` names it){_OR_SHARE}"


def access_remedy(device: str) -> str:
    """What to do about a port that this user may not open.

    Args:
        device: The port.

    Returns:
        Advice that names the group that owns it, and tells those who are in it already to log in again.
    """
    group, shared, member, listed = _USUAL_GROUP, True, False, False
    with contextlib.suppress(OSError, ImportError, KeyError):
        import grp  # noqa: PLC0415 - POSIX only
        import pwd  # noqa: PLC0415

        status = Path(device).stat()
        entry = grp.getgrgid(status.st_gid)
        group = entry.gr_name
        shared = status.st_mode & (stat.S_IRGRP | stat.S_IWGRP) == stat.S_IRGRP | stat.S_IWGRP
        member = status.st_gid in os.getgroups()
        listed = pwd.getpwuid(os.getuid()).pw_name in entry.gr_mem
    return group_remedy(device, group, shared=shared, member=member, listed=listed)


def group_remedy(device: str, group: str, *, shared: bool, member: bool, listed: bool) -> str:
    """The advice of `access_remedy`, from what the system says.

    Args:
        device: The port.
        group: Name of the group that owns it.
        shared: The group may read and write it.
        member: This process belongs to the group.
        listed: The user is named as one of its members, whatever this login says.
    """
    if group in _NO_GROUP or not shared or member:
        return (
            f"Only root may: give {device} to a group of yours by a udev rule "
            f'(SUBSYSTEM=="tty", GROUP="{_USUAL_GROUP}", MODE="0660"), or for now: sudo chmod a+rw {device}'
        )
    if listed:
        return f"You are in its group {group}, but this login is older than that: log out and in again, or: newgrp {group}"
    return f"Join the group that owns it: `sudo usermod -aG {group} $USER`, then log out and in again"
