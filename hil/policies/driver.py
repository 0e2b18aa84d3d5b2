"""A policy at the wheels of a connected robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.policies.observing import Perception

if TYPE_CHECKING:
    from firmware_protocol.messages import JuniorSensors
    from hil.policies.policy import Policy


class PolicyDriver:
    """Drives by a policy; it is a `hil.sumo.controllers.Driver`.

    Args:
        policy: What was learnt.
    """

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self._perception = Perception()
        self._memory = policy.begin()

    def begin(self) -> None:
        """A bout begins: what was before is forgotten."""
        self._perception.begin()
        self._memory = self._policy.begin()

    def drive(self, sensors: JuniorSensors) -> tuple[float, float]:
        """Left and right wheel for what is sensed now, share of full speed, -1..1."""
        (left, right), self._memory = self._policy.act(self._perception.observe(sensors), self._memory)
        return float(left), float(right)
