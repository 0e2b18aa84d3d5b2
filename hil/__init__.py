"""The bridge: connects, coaches, records, replays, shows.

`connect` opens a robot, real or emulated, `connect_all` all that are on a link, `replay` runs a log again; the rest are the
types they deal in. Public names are loaded when they are first used: every pytest run loads this package for its plugin,
whether a test asks for a robot or not.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from firmware_protocol.maneuver_fields import ManeuverReport
    from firmware_protocol.vocabulary import Action, Maneuver, Outcome, Stimulus
    from hil.connecting import connect
    from hil.connecting_all import connect_all
    from hil.junior import Junior
    from hil.networks import RobotAddress
    from hil.replaying.difference import ReplayDiverged
    from hil.replaying.host import ReplayReport, replay
    from hil.robots import Answers, Robots
    from hil.safety import Limits

_HOMES: Final = {
    "Answers": "hil.robots",
    "Action": "firmware_protocol.vocabulary",
    "Junior": "hil.junior",
    "Limits": "hil.safety",
    "Maneuver": "firmware_protocol.vocabulary",
    "ManeuverReport": "firmware_protocol.maneuver_fields",
    "Outcome": "firmware_protocol.vocabulary",
    "ReplayDiverged": "hil.replaying.difference",
    "ReplayReport": "hil.replaying.host",
    "RobotAddress": "hil.networks",
    "Robots": "hil.robots",
    "Stimulus": "firmware_protocol.vocabulary",
    "connect": "hil.connecting",
    "connect_all": "hil.connecting_all",
    "replay": "hil.replaying.host",
}

__all__ = [
    "Action",
    "Answers",
    "Junior",
    "Limits",
    "Maneuver",
    "ManeuverReport",
    "Outcome",
    "ReplayDiverged",
    "ReplayReport",
    "RobotAddress",
    "Robots",
    "Stimulus",
    "connect",
    "connect_all",
    "replay",
]


def __getattr__(name: str) -> object:
    """Load a public name (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
