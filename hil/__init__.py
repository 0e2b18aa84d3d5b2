"""The bridge: connects, coaches, records, replays, shows.

`connect` opens a robot, real or emulated; the rest are the types it deals in. Public names are loaded when they are first
used: every pytest run loads this package for its plugin, whether a test asks for a robot or not.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from firmware_protocol.maneuver_fields import ManeuverReport
    from firmware_protocol.vocabulary import Action, Maneuver, Outcome, Stimulus
    from hil.connecting import connect
    from hil.junior import Junior
    from hil.safety import Limits

_HOMES: Final = {
    "Action": "firmware_protocol.vocabulary",
    "Junior": "hil.junior",
    "Limits": "hil.safety",
    "Maneuver": "firmware_protocol.vocabulary",
    "ManeuverReport": "firmware_protocol.maneuver_fields",
    "Outcome": "firmware_protocol.vocabulary",
    "Stimulus": "firmware_protocol.vocabulary",
    "connect": "hil.connecting",
}

__all__ = ["Action", "Junior", "Limits", "Maneuver", "ManeuverReport", "Outcome", "Stimulus", "connect"]


def __getattr__(name: str) -> object:
    """Load a public name (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
