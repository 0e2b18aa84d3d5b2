"""Numbers of hosts and sessions, drawn by chance."""

from __future__ import annotations

import secrets


def random_session() -> int:
    """A session number that nobody can foresee, 1..65535."""
    return 1 + secrets.randbelow(0xFFFF)
