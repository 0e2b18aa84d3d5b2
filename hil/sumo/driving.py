"""Driving: a host sets the wheels of a robot at every reading, without waiting."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.messages import JuniorSensors, RobotAck
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from hil.sumo.controllers import Driver
    from hil.sumo.junior import Junior


class DriverPlayer:
    """A host that sets the wheels at every reading.

    Args:
        driver: Says what to do.
    """

    HOLD: Final = 0.1
    """A command goes on for so long unless the next one comes, in s: five readings."""

    def __init__(self, driver: Driver) -> None:
        self.maneuvers = 0
        self._driver = driver
        self._before: JuniorSensors | None = None
        self._asked: Ticket[RobotAck] | None = None

    def prepare(self, junior: Junior) -> None:
        """There is nothing to be done before."""

    def begin(self, junior: Junior) -> None:
        """Forget the bout before; what has been sensed by now is not acted on any more."""
        self._driver.begin()
        self._before, self._asked = junior.latest, None

    def attend(self, junior: Junior) -> None:
        """Set the wheels, where a reading has come."""
        if self._asked is not None and self._asked.done:
            junior.answer(self._asked)
            self._asked = None
        if junior.stale:
            junior.read_sensors()  # is it still there?
        if (reading := junior.latest) is not None and reading is not self._before:
            self._before = reading
            self._asked = junior.steer(*self._driver.drive(reading), self.HOLD)


def drive_until(junior: Junior, driver: Driver, over: Callable[[], bool]) -> None:
    """Let a driver have the wheels for a while.

    Args:
        junior: The robot; it is armed.
        driver: Says what to do at every reading.
        over: It is over; asked after each step of the link.

    Raises:
        RefusedError: The robot does not drive.
        PeerError: It is gone or does not answer.
        LinkError: The link is gone.
    """
    player = DriverPlayer(driver)
    player.begin(junior)
    while not over():
        junior.step()
        player.attend(junior)
