"""A ring that a person may have pause."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.bridge.operator import PAUSE, RESUME
from hil.sumo.attended.hands import put_aside, start_after_countdown, wait_for_answer

if TYPE_CHECKING:
    from firmware_protocol.messages import BoutOutcome
    from firmware_protocol.vocabulary import Maneuver, Stimulus
    from hil.questions import Questions
    from hil.sumo.controllers import Driver
    from hil.sumo.junior import Junior
    from hil.sumo.ring import Encounter, Ring


class PausedRing:
    """A ring in which nothing further is begun while a person wants a pause: no bout, or, where bouts have no end, no maneuver.

    A robot that pauses is disarmed; when it is to go on, it stands still for the countdown of sumo rules.

    Args:
        ring: The ring.
        junior: The robot.
        questions: Asks nothing but whether to pause, and whether to go on.

    Attributes:
        refereed: As the ring.
    """

    def __init__(self, ring: Ring, junior: Junior, questions: Questions) -> None:
        self.refereed = ring.refereed
        self._ring = ring
        self._junior = junior
        self._questions = questions
        self._offer()

    @property
    def opponent(self) -> str:
        """See `Ring.opponent`."""
        return self._ring.opponent

    def begin(self, seed: int) -> Stimulus:
        """See `Ring.begin`."""
        self._pause()
        stimulus = self._ring.begin(seed)
        self._offer_again()
        return stimulus

    def engage(self, maneuver: Maneuver) -> Encounter:
        """See `Ring.engage`."""
        if not self.refereed:
            self._pause()
        return self._ring.engage(maneuver)

    def steer(self, driver: Driver) -> tuple[BoutOutcome, float]:
        """See `Ring.steer`."""
        return self._ring.steer(driver)

    def recover(self) -> None:
        """See `Ring.recover`."""
        self._ring.recover()

    def _offer_again(self) -> None:
        """Offer a pause where the ring has asked for something else since."""
        if PAUSE not in self._questions.open:
            self._offer()

    def _offer(self) -> None:
        what = "bout" if self.refereed else "maneuver"
        self._questions.ask(f"A pause begins before the next {what}.", (PAUSE,))

    def _pause(self) -> None:
        """Pause, if that is wanted."""
        if self._questions.answer() != PAUSE:
            return
        put_aside(self._junior)
        self._questions.ask("Pause: the robot is disarmed.", (RESUME,))
        wait_for_answer(self._junior, self._questions)
        self._offer()
        start_after_countdown(self._junior)
