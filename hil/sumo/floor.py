"""What a robot's floor sensors and the clock tell of a bout, and a ring in which nobody else does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import BoutOutcome, SensorFlag
from firmware_protocol.vocabulary import Action, Maneuver
from hil.bridge.operator import READY
from hil.sumo.attended import put_aside, start_after_countdown, wait_for_answer
from hil.sumo.bouts import check_encounter
from hil.sumo.driving import drive_until
from hil.sumo.ring import UNKNOWN, Encounter, lasted

if TYPE_CHECKING:
    from firmware_protocol.vocabulary import Stimulus
    from hil.questions import Questions
    from hil.sumo.controllers import Driver
    from hil.sumo.junior import Junior

LIMIT: Final = 15.0
"""A bout that lasts longer is drawn, in s, as emulated referees have it."""
OUT_AFTER: Final = 0.3
"""Who has left the ring sees none on both sides for so long, in s: four times as long as one that turns back at the border."""
_OUT: Final = SensorFlag.OFF_RING_LEFT | SensorFlag.OFF_RING_RIGHT
_TRIES: Final = 3
"""So often a robot tries to get back on to the ring by itself."""
_ON: Final = Maneuver((Action.SF,) * 6, floor_reflex=False)
"""How it gets back on to the ring, some 20 cm: who leaves it forwards is turned back by the reflex; it has left backwards."""
_BACK: Final = (Action.SB, Action.SB)
"""How it backs off: some 6 cm, since it has no eyes behind."""
_MOST_TURNS: Final = 4
"""An action turns it by some 40 degrees."""


class FloorJudge:
    """Says that a bout is lost when both floor sensors have seen no ring for a while, and drawn when its time is over.

    That it is won nobody can say by these.

    Args:
        junior: The robot.
    """

    def __init__(self, junior: Junior) -> None:
        self._junior = junior
        self._begun = 0.0
        self._out_since: float | None = None

    @property
    def sees_no_ring(self) -> bool:
        """Neither floor sensor sees the ring, by the latest reading."""
        reading = self._junior.latest
        return reading is not None and reading.flags & _OUT == _OUT

    def begin(self) -> None:
        """A bout begins."""
        self._begun = self._junior.now()
        self._out_since = None

    def look(self) -> BoutOutcome:
        """How the bout stands; to be asked for whenever something has come."""
        now = self._junior.now()
        if not self.sees_no_ring:
            self._out_since = None
        elif self._out_since is None:
            self._out_since = now
        elif now - self._out_since >= OUT_AFTER:
            return BoutOutcome.LOSS
        return BoutOutcome.DRAW if now - self._begun >= LIMIT else BoutOutcome.UNDECIDED


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
        ticket = self._junior.start(maneuver)
        report = self._junior.follow(ticket)
        check_encounter(Encounter(report, report.after, BoutOutcome.UNDECIDED, None, None, lasted(ticket)))
        self._junior.sense()
