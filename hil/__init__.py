"""The bridge: connects, coaches, records, replays, shows.

`connect` opens a robot, real or emulated, `connect_all` all that are on a link, `connect_swarm` a swarm of micro-robots,
`replay` runs a log again; the rest are the types they deal in. Public names are loaded when they are first used: every pytest
run loads this package for its plugin, whether a test asks for a robot or not.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    __version__: str
    from firmware_protocol.maneuver_fields import ManeuverReport
    from firmware_protocol.vocabulary import Action, Maneuver, Move, MoveOption, Outcome, Stimulus
    from hil.bridge.networks import RobotAddress
    from hil.connecting.handles import Answers
    from hil.replaying.difference import ReplayDiverged
    from hil.replaying.host import ReplayReport, replay
    from hil.safety import Limits
    from hil.sumo.connecting import connect, connect_all
    from hil.sumo.junior import Junior
    from hil.sumo.robots import Robots
    from hil.swarm.connecting import connect_swarm
    from hil.swarm.handle import Swarm
    from hil.swarm.rounds import Round, SwarmMoves

_HOMES: Final = {
    "Answers": "hil.connecting.handles",
    "Action": "firmware_protocol.vocabulary",
    "Junior": "hil.sumo.junior",
    "Limits": "hil.safety",
    "Maneuver": "firmware_protocol.vocabulary",
    "ManeuverReport": "firmware_protocol.maneuver_fields",
    "Outcome": "firmware_protocol.vocabulary",
    "ReplayDiverged": "hil.replaying.difference",
    "ReplayReport": "hil.replaying.host",
    "RobotAddress": "hil.bridge.networks",
    "Move": "firmware_protocol.vocabulary",
    "MoveOption": "firmware_protocol.vocabulary",
    "SwarmMoves": "hil.swarm.rounds",
    "Robots": "hil.sumo.robots",
    "Round": "hil.swarm.rounds",
    "Swarm": "hil.swarm.handle",
    "Stimulus": "firmware_protocol.vocabulary",
    "connect": "hil.sumo.connecting",
    "connect_all": "hil.sumo.connecting",
    "connect_swarm": "hil.swarm.connecting",
    "replay": "hil.replaying.host",
}

__all__ = [
    "Action",
    "Answers",
    "Junior",
    "Limits",
    "Maneuver",
    "ManeuverReport",
    "Move",
    "MoveOption",
    "Outcome",
    "ReplayDiverged",
    "ReplayReport",
    "RobotAddress",
    "Robots",
    "Round",
    "Stimulus",
    "Swarm",
    "SwarmMoves",
    "__version__",
    "connect",
    "connect_all",
    "connect_swarm",
    "replay",
]


def __getattr__(name: str) -> object:
    """Load a public name (PEP 562)."""
    if name == "__version__":
        from importlib import metadata  # noqa: PLC0415 - it takes a moment to load

        return metadata.version("junior-hil")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """The public names, loaded or not."""
    return sorted(__all__)
