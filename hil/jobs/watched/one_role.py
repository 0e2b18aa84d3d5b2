"""The robots of one role on one link or several, which are looked at: those that `hil monitor` and `hil view LINK` show."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.errors import RefusedError
from firmware_protocol.roles.junior import JUNIOR
from hil.connecting.handle import RobotHandle
from hil.connecting.handles import RobotHandles
from hil.jobs.session import open_watch
from hil.sumo.junior import Junior
from hil.swarm.robot import MicroRobot

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from firmware_protocol.errors import HilError
    from firmware_protocol.peer.peer import Peer
    from firmware_protocol.peer.role import Role
    from hil.bridge.networks import Networks
    from hil.jobs.stage import Stage
    from hil.recording.recorder import Recorder
    from hil.safety import Limits

LONGEST: Final = 1e9
"""No longer look is asked for, in s."""
_KINDS: Final[tuple[type[RobotHandle], ...]] = (Junior, MicroRobot)
"""What robots are held by that can be looked at."""


@contextmanager
def open_one_role(stage: Stage, only: Role | None, reconnect: float) -> Iterator[tuple[OfOneRole, Recorder | None]]:
    """Watch the robots of one role, with a log, and tell who would not be watched; see `open_watch`.

    Args:
        stage: The outside.
        only: The role that they must have; None: that which is heard first.
        reconnect: How long a link that is lost is waited for, in s.

    Yields:
        The robots, and what writes the log.
    """
    with open_watch(stage, make=lambda networks, limits: OfOneRole(networks, limits, only), reconnect=reconnect) as (
        robots,
        recorder,
    ):
        if stage.tell is not None:
            for error in robots.refused.values():
                stage.tell(str(error))
        yield robots, recorder


def refusals_noted(recorder: Recorder | None) -> Callable[[HilError], None]:
    """What notes in a log, if there is one, that a robot has refused.

    Args:
        recorder: Writes the log.
    """

    def refused(error: HilError) -> None:
        if recorder is not None and isinstance(error, RefusedError):
            recorder.note("safety", str(error))

    return refused


def shared(robots: RobotHandles[Any]) -> str:
    """What is said of who drives, where another program does, and shares its link; empty: none does.

    Args:
        robots: The robots.
    """
    return next((bridge.acquaintances.shared for bridge in robots.networks.bridges.values() if bridge.acquaintances.shared), "")


class OfOneRole(RobotHandles[Any]):
    """The robots of one role on one link or several: of that which is heard first, unless another is asked for.

    Args:
        networks: The links, open.
        limits: Bounds on what is asked of each robot.
        only: The role that they must have; None: of those that can be looked at, the first that is heard.

    Attributes:
        role: The role that they have; None as long as nobody has been heard, and every role will do.
    """

    def __init__(self, networks: Networks, limits: Limits, only: Role | None) -> None:
        super().__init__(RobotHandle if only is None else _kind_of(only) or RobotHandle, networks, limits)
        self.role = only

    def _needed_of(self, peer: Peer) -> Role | None:
        if self.role is None:
            return JUNIOR if _kind_of(peer.role) is None else None
        return super()._needed_of(peer)

    def _join(self, network: str, system: int) -> None:
        role = self.networks.bridges[network].peers[system].role
        if self.role is None and (kind := _kind_of(role)) is not None:
            self.role, self._make = role, kind
        super()._join(network, system)


def _kind_of(role: Role) -> type[RobotHandle] | None:
    """What a robot of a role is held by; None where it can't be looked at."""
    return next((kind for kind in _KINDS if kind.ROLE is role), None)
