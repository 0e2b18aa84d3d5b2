"""What the host build of the firmware is made from, as one number: compiled in, and compared when it is loaded.

It runs before the package is installed and therefore imports nothing of it.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Final

FIRMWARE: Final = Path(__file__).resolve().parent
_PARTS: Final = (
    "core/*.c",
    "core/*.h",
    "junior/*.c",
    "junior/*.h",
    "micro/*.c",
    "micro/*.h",
    "roles.h",
    "targets/host/*.c",
    "targets/host/*.h",
    "build_host.py",
    "headers.py",
    "host_header.py",
)
_DIALECT: Final = Path("dialect") / "junior.xml"


def digest(firmware: Path = FIRMWARE) -> int | None:
    """Hash the sources.

    Args:
        firmware: The folder with `core`, the roles and `targets`, in the one with `dialect`.

    Returns:
        64 bits of it; None where there are no sources, as in a package that was stripped of them.
    """
    paths = [firmware.parent / _DIALECT]
    for part in _PARTS:
        found = list(firmware.glob(part))
        if not found:
            return None
        paths += found
    hashed = hashlib.sha256()
    for path in sorted(paths):
        try:
            content = path.read_bytes().replace(b"\r\n", b"\n")
        except OSError:
            return None
        hashed.update(f"{path.name} {len(content)}\n".encode())
        hashed.update(content)
    return int.from_bytes(hashed.digest()[:8], "big")
