"""Several Juniors, on one link or more: calls for many at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from firmware_protocol.maneuver_fields import to_report
from firmware_protocol.roles.junior import drive
from firmware_protocol.vocabulary import Maneuver
from hil.connecting.handles import Answers, RobotHandles
from hil.safety import Limits
from hil.sumo.junior import Junior

if TYPE_CHECKING:
    from collections.abc import Iterable

    from firmware_protocol.maneuver_fields import ManeuverReport
    from firmware_protocol.messages import RobotAck
    from firmware_protocol.vocabulary import Action
    from hil.bridge.networks import Networks, RobotAddress

    Plan = Maneuver | Iterable[Action | str]


class Robots(RobotHandles[Junior]):
    """The Juniors on one link or several. Leaving its `with` block stops and disarms all; `hil.connect_all` makes one.

    Iterating gives the `Junior` of every robot that is there now, in order; see `RobotHandles` for what is true of all roles.

    Args:
        networks: The links, open.
        limits: Bounds on what is asked of each robot.
    """

    def __init__(self, networks: Networks, limits: Limits = Limits()) -> None:  # noqa: B008 - frozen
        super().__init__(Junior, networks, limits)

    def come_together(self) -> None:
        """Serve whose link is behind: what is asked of all from now on is asked at the same time.

        Raises:
            LinkError: The links are gone.
        """
        while not self.networks.together:
            self.step()

    def stop(self) -> Answers[RobotAck]:
        """Stop all wheels and what is being performed; all stay armed."""
        return self.ask(lambda junior: drive(junior.peer, 0.0, 0.0, 0.0))

    def perform(
        self, plans: Plan | Mapping[RobotAddress, Plan], *, period: float = 0.25, timeout: float | None = None
    ) -> Answers[ManeuverReport]:
        """Have maneuvers performed by several robots at the same time, and wait for all reports.

        Args:
            plans: A maneuver for all that are there (see `Junior.perform`), or one for each address.
            period: Time each action lasts, in s, where names are given.
            timeout: Longest wait in s; None waits until each has reported or is given up.

        Returns:
            How it went with each.

        Raises:
            KeyError: A robot was never there.
            ValueError: No such action, none or too many, or a period out of range.
        """
        if isinstance(plans, Mapping):
            each = plans
            among = [self[address] for address in each]
            return self._gather(lambda junior: junior.start(each[junior.address], period=period), to_report, among, timeout)
        plan: Plan = plans if isinstance(plans, Maneuver | str) else list(plans)  # to be gone through for each
        return self._gather(lambda junior: junior.start(plan, period=period), to_report, None, timeout)
