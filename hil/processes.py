"""Which processes there are: whether one that has left something still runs."""

from __future__ import annotations

import os
from pathlib import Path


def is_running(pid: int, identity: str = "") -> bool:
    """Whether there is a process of this id.

    Args:
        pid: Process id.
        identity: What `process_identity` said of it; another process that was given the same id does not count. Empty where
            that is not known.
    """
    if identity not in {"", process_identity(pid)}:
        return False
    if pid == os.getpid():
        return True
    if os.name != "posix":  # there is no asking without pywin32; a leftover stays
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:  # somebody else's
        return True
    return True


def process_identity(pid: int) -> str:
    """Which process has an id: when the computer and the process were started; empty where the system does not tell.

    Args:
        pid: Process id. Ids are used again, in a container soon: this is not.
    """
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        started = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]  # field 22; 2 may hold anything
    except (OSError, IndexError):
        return ""
    return f"{boot} {started}"
