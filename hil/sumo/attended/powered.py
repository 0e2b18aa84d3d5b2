"""A ring in which a person changes the battery."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.events import Received
from firmware_protocol.messages import BoutOutcome, JuniorSensors
from hil.bridge.operator import READY
from hil.sumo.attended.hands import put_aside, wait_for_answer

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.events import Event
    from firmware_protocol.vocabulary import Maneuver, Stimulus
    from hil.questions import Questions
    from hil.sumo.controllers import Driver
    from hil.sumo.junior import Junior
    from hil.sumo.ring import Encounter, Ring

STEADY: Final = 1.0
"""A battery is low when it has been below what the robot warns of for so long, in s: pushing lowers it for moments."""


class PoweredRing:
    """A ring in which no bout is begun with a low battery: a person changes it.

    The robot is disarmed meanwhile, and may be switched off: it is waited for as any that is lost, and its battery is looked at
    again before it goes on.

    Args:
        ring: The ring.
        junior: The robot.
        questions: Asks the person.
        low: A battery below this is low, in V.
        before: Called before the person is asked: the robot may be off for long.

    Attributes:
        refereed: As the ring.
    """

    def __init__(
        self, ring: Ring, junior: Junior, questions: Questions, low: float, before: Callable[[], None] = lambda: None
    ) -> None:
        self.refereed = ring.refereed
        self._ring = ring
        self._junior = junior
        self._questions = questions
        self._low = low
        self._before = before
        self._voltage = float("inf")
        self._good_at = float("-inf")
        self._low_at = float("-inf")
        junior.listen(self._hear)

    @property
    def opponent(self) -> str:
        """See `Ring.opponent`."""
        return self._ring.opponent

    def begin(self, seed: int) -> Stimulus:
        """See `Ring.begin`."""
        if self._low_at - self._good_at >= STEADY:
            self._have_it_changed()
        return self._ring.begin(seed)

    def engage(self, maneuver: Maneuver) -> Encounter:
        """See `Ring.engage`."""
        return self._ring.engage(maneuver)

    def steer(self, driver: Driver) -> tuple[BoutOutcome, float]:
        """See `Ring.steer`."""
        return self._ring.steer(driver)

    def recover(self) -> None:
        """See `Ring.recover`."""
        self._ring.recover()

    def _hear(self, event: Event) -> None:
        """Take note of the battery in a reading."""
        if not isinstance(event, Received) or not isinstance(event.message, JuniorSensors):
            return
        if event.system == self._junior.peer.system:
            self._voltage = event.message.battery
            if self._voltage < self._low:
                self._low_at = event.time
            else:
                self._good_at = event.time

    def _have_it_changed(self) -> None:
        """Have the battery changed, until it is good."""
        put_aside(self._junior)
        self._before()
        while True:
            self._questions.ask(
                f"The battery is low, {self._voltage:.2f} V: the robot is disarmed. Change it, and say when the robot is back.",
                (READY,),
            )
            wait_for_answer(self._junior, self._questions)
            self._junior.wait_until_back()
            self._junior.sense()
            if self._voltage >= self._low:
                return
