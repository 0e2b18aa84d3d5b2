"""A ring with a person beside it, who says when it is ready and how bouts end."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import BoutOutcome
from hil.bridge.operator import DRAWN, LOST, READY, WON
from hil.sumo.attended.hands import put_aside, start_after_countdown, wait_for_answer
from hil.sumo.driving import drive_until
from hil.sumo.ring import UNKNOWN, Encounter, lasted

if TYPE_CHECKING:
    from firmware_protocol.vocabulary import Maneuver, Stimulus
    from hil.questions import Questions
    from hil.sumo.attended.floor import FloorJudge
    from hil.sumo.controllers import Driver
    from hil.sumo.junior import Junior

VERDICTS: Final = {WON: BoutOutcome.WIN, LOST: BoutOutcome.LOSS, DRAWN: BoutOutcome.DRAW}
_WORDS: Final = {outcome: word for word, outcome in VERDICTS.items()}


class JudgedRing:
    """A ring that a person sets up, and whose bouts end by the person's word.

    Between two bouts the robot is disarmed: hands may be in the ring. It stands still for the countdown of sumo rules when the
    person has said that the ring is ready.

    Args:
        junior: The robot.
        questions: Asks the person.
        opponent: What the user says it is up against.
        judge: Says, by floor sensors and clock, how a bout ends where the person has not; None: only the person does.
    """

    def __init__(
        self, junior: Junior, questions: Questions, opponent: str | None = None, judge: FloorJudge | None = None
    ) -> None:
        self.refereed = True
        self.opponent = opponent or UNKNOWN
        self._judge = judge
        self._junior = junior
        self._questions = questions
        self._outcome = BoutOutcome.UNDECIDED
        self._begun = 0.0
        self._bouts = 0
        self._poses: int | None = None

    def begin(self, seed: int) -> Stimulus:
        """Begin a bout, when the person says that the ring is ready; see `Ring.begin`.

        The same seed as before has the person place both robots as before.
        """
        put_aside(self._junior)
        self._bouts += 1
        placed = " as for the bout before" if seed == self._poses else ""
        self._poses = seed
        text = f"Bout {self._bouts}: set up both robots{placed}, and say when the ring is ready."
        while True:
            self._questions.ask(text, (READY,))
            wait_for_answer(self._junior, self._questions)
            if self._judge is None:
                break
            self._junior.sense()
            if not self._judge.sees_no_ring:
                break
            text = (
                f"Bout {self._bouts}: the floor sensors see no ring. Put the robot on it, or look whether FLOOR_L_OFF and "
                "FLOOR_R_OFF are right; then say when the ring is ready."
            )
        start_after_countdown(self._junior)
        self._outcome = BoutOutcome.UNDECIDED
        self._questions.ask(f"Bout {self._bouts}: how does it end?", tuple(VERDICTS))
        self._begun = self._junior.now()
        if self._judge is not None:
            self._judge.begin()
        return self._junior.sense()

    def engage(self, maneuver: Maneuver) -> Encounter:
        """Have a maneuver performed; it is broken off when somebody says how the bout has ended."""
        ticket = self._junior.start(maneuver)
        report = self._junior.follow(ticket, until=self._over)
        self._over()
        elapsed = self._junior.now() - self._begun
        return Encounter(report, report.after, self._outcome, elapsed, None, lasted(ticket))

    def steer(self, driver: Driver) -> tuple[BoutOutcome, float]:
        """Let a driver have the wheels until the person says how the bout has ended; see `Ring.steer`."""
        drive_until(self._junior, driver, self._over)
        return self._outcome, self._junior.now() - self._begun

    def _over(self) -> bool:
        """Whether somebody has said how the bout has ended: the person, else the floor sensors and the clock."""
        if self._outcome is BoutOutcome.UNDECIDED:
            if verdict := self._questions.answer():
                self._outcome = VERDICTS[verdict]
            elif self._judge is not None:
                self._outcome = self._judge.look()
            if self._outcome is not BoutOutcome.UNDECIDED:
                self._questions.ask(f"Bout {self._bouts} is {_WORDS[self._outcome]}.", ())
        return self._outcome is not BoutOutcome.UNDECIDED

    def recover(self) -> None:
        """Wait for a lost robot; see `Ring.recover`. It is armed when the bout is begun again."""
        self._junior.wait_until_back()
