"""A ring with nobody beside it: the robot itself sets it up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import BoutOutcome
from firmware_protocol.vocabulary import Action, Maneuver
from hil.bridge.operator import READY
from hil.sumo.attended.floor import FloorJudge
from hil.sumo.attended.hands import put_aside, start_after_countdown, wait_for_answer
from hil.sumo.bouts import check_encounter
from hil.sumo.driving import drive_until
from hil.sumo.ring import UNKNOWN, Encounter, lasted, perform

if TYPE_CHECKING:
    from firmware_protocol.vocabulary import Stimulus
    from hil.questions import Questions
    from hil.sumo.controllers import Driver
    from hil.sumo.junior import Junior

_TRIES: Final = 3
"""So often a robot tries to get back on to the ring by itself."""
_ON: Final = Maneuver((Action.SF,) * 6, floor_reflex=False)
"""How it gets back on to the ring, some 20 cm: who leaves it forwards is turned back by the reflex; it has left backwards."""
_BACK: Final = (Action.SB, Action.SB)
"""How it backs off: some 6 cm, since it has no eyes behind."""
_MOST_TURNS: Final = 4
"""An action turns it by some 40 degrees."""


class LonelyRing:
    """A ring that a robot sets up by itself: between two bouts it backs off and turns, and its opponent stays where it is.

    Bouts end by floor sensors and clock; nobody sees a win. A person is asked for when the robot does not get back on to the
    ring; it is disarmed then. A robot that is disarmed, as at first, stands still for a countdown before it moves.

    Args:
        junior: The robot.
        questions: Asks the person.
        opponent: What the user says it is up against.
    """

    def __init__(self, junior: Junior, questions: Questions, opponent: str | None = None) -> None:
        self.refereed = False
        self.opponent = opponent or UNKNOWN
        self._junior = junior
        self._questions = questions
        self._judge = FloorJudge(junior)
        self._outcome = BoutOutcome.UNDECIDED
        self._begun = 0.0

    def begin(self, seed: int) -> Stimulus:
        """Back off and turn, as the seed says, and begin a bout; see `Ring.begin`."""
        if self._junior.armed:
            self._set_up(seed)
        else:
            start_after_countdown(self._junior)
        stimulus = self._junior.sense()
        self._judge.begin()
        self._outcome = BoutOutcome.UNDECIDED
        self._begun = self._junior.now()
        return stimulus

    def engage(self, maneuver: Maneuver) -> Encounter:
        """Have a maneuver performed; it is broken off when the bout is over."""
        ticket = self._junior.start(maneuver)
        report = self._junior.follow(ticket, until=self._over)
        self._over()
        return Encounter(report, report.after, self._outcome, self._junior.now() - self._begun, None, lasted(ticket))

    def steer(self, driver: Driver) -> tuple[BoutOutcome, float]:
        """Let a driver have the wheels until floor sensors and clock end the bout; see `Ring.steer`."""
        drive_until(self._junior, driver, self._over)
        return self._outcome, self._junior.now() - self._begun

    def _over(self) -> bool:
        """Whether floor sensors or clock have ended the bout."""
        self._outcome = self._outcome or self._judge.look()
        return self._outcome is not BoutOutcome.UNDECIDED

    def recover(self) -> None:
        """Wait for a lost robot; see `Ring.recover`. It is armed when the bout is begun again."""
        self._junior.wait_until_back()

    def _set_up(self, seed: int) -> None:
        """Back off and turn, so that the floor sensors see the ring; where they don't in the end, ask for a person."""
        turn = Action.R if seed & 1 else Action.L
        away = Maneuver((*_BACK, *[turn] * (1 + (seed >> 1) % _MOST_TURNS)))
        self._junior.sense()
        for _ in range(_TRIES):
            if self._judge.sees_no_ring:
                self._perform(_ON)
            if not self._judge.sees_no_ring:
                self._perform(away)
            if not self._judge.sees_no_ring:
                return
        put_aside(self._junior)
        self._questions.ask(
            "The floor sensors see no ring: put both robots back (or look whether FLOOR_L_OFF and FLOOR_R_OFF are right), and "
            "say when the ring is ready.",
            (READY,),
        )
        wait_for_answer(self._junior, self._questions)
        start_after_countdown(self._junior)

    def _perform(self, maneuver: Maneuver) -> None:
        """Have it performed, and look at the floor."""
        check_encounter(perform(self._junior, maneuver))
        self._junior.sense()
