"""What the kernel is made from, as one number: compiled in, and compared when it is loaded.

It runs before the package is installed and therefore imports nothing of it.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Final

KERNEL: Final = Path(__file__).resolve().parent
_PARTS: Final = ("*.c", "*.h", "../build_host.py")


def digest(kernel: Path = KERNEL) -> int | None:
    """Hash the sources.

    Args:
        kernel: Their folder.

    Returns:
        64 bits of it; None where there are no sources, as in a package that was stripped of them.
    """
    hashed = hashlib.sha256()
    for part in _PARTS:
        paths = sorted(kernel.glob(part)) if "*" in part else [kernel / part]
        if not paths or not paths[0].is_file():
            return None
        for path in paths:
            content = path.read_bytes().replace(b"\r\n", b"\n")
            hashed.update(f"{path.name} {len(content)}\n".encode())
            hashed.update(content)
    return int.from_bytes(hashed.digest()[:8], "big")
