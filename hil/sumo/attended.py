"""A ring with a person beside it, who says when it is ready and how bouts end, or has a run pause."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import RefusedError
from firmware_protocol.messages import BoutOutcome
from hil.bridge.operator import DRAWN, LOST, PAUSE, READY, RESUME, WON
from hil.connecting.serving import WAIT
from hil.sumo.contest import COUNTDOWN
from hil.sumo.ring import UNKNOWN, Encounter, lasted

if TYPE_CHECKING:
    from firmware_protocol.vocabulary import Maneuver, Stimulus
    from hil.questions import Questions
    from hil.sumo.junior import Junior
    from hil.sumo.ring import Ring

VERDICTS: Final = {WON: BoutOutcome.WIN, LOST: BoutOutcome.LOSS, DRAWN: BoutOutcome.DRAW}


def put_aside(junior: Junior) -> None:
    """Disarm a robot that somebody is about to touch.

    Args:
        junior: The robot.

    Raises:
        RefusedError: Its emergency stop is engaged, which disarming would end.
        PeerError: It does not answer.
    """
    _check_not_stopped(junior)
    junior.disarm()


def wait_for_answer(junior: Junior, questions: Questions) -> str:
    """Wait until a question is answered; the link is served meanwhile.

    Args:
        junior: The robot.
        questions: The question is asked.

    Raises:
        RefusedError: The emergency stop was pressed.
    """
    while not (answer := questions.answer()):
        junior.step(WAIT)
        _check_not_stopped(junior)
    return answer


def _check_not_stopped(junior: Junior) -> None:
    if junior.stopped:
        raise RefusedError("to go on", "somebody pressed the emergency stop; disarm and arm the robot")


class JudgedRing:
    """A ring that a person sets up, and whose bouts end by the person's word.

    Between two bouts the robot is disarmed: hands may be in the ring. It stands still for the countdown of sumo rules when the
    person has said that the ring is ready.

    Args:
        junior: The robot.
        questions: Asks the person.
        opponent: What the user says it is up against.
    """

    def __init__(self, junior: Junior, questions: Questions, opponent: str | None = None) -> None:
        self.refereed = True
        self.opponent = opponent or UNKNOWN
        self._junior = junior
        self._questions = questions
        self._outcome = BoutOutcome.UNDECIDED
        self._begun = 0.0
        self._bouts = 0

    def begin(self, seed: int) -> Stimulus:  # noqa: ARG002 - a person places the robots
        """Begin a bout, when the person says that the ring is ready; see `Ring.begin`."""
        put_aside(self._junior)
        self._bouts += 1
        self._questions.ask(f"Bout {self._bouts}: set up both robots, and say when the ring is ready.", (READY,))
        wait_for_answer(self._junior, self._questions)
        self._junior.arm()
        self._junior.wait(COUNTDOWN)
        self._outcome = BoutOutcome.UNDECIDED
        self._questions.ask(f"Bout {self._bouts}: how does it end?", tuple(VERDICTS))
        self._begun = self._junior.now()
        return self._junior.sense()

    def engage(self, maneuver: Maneuver) -> Encounter:
        """Have a maneuver performed; it is broken off when the person says how the bout has ended."""
        ticket = self._junior.start(maneuver)
        report = self._junior.follow(ticket, until=self._over)
        self._over()
        elapsed = self._junior.now() - self._begun
        return Encounter(report, report.after, self._outcome, elapsed, None, lasted(ticket))

    def _over(self) -> bool:
        """Whether the person has said how the bout has ended."""
        if self._outcome is BoutOutcome.UNDECIDED and (verdict := self._questions.answer()):
            self._outcome = VERDICTS[verdict]
            self._questions.ask(f"Bout {self._bouts} is {verdict}.", ())
        return self._outcome is not BoutOutcome.UNDECIDED

    def recover(self) -> None:
        """Wait for a lost robot; see `Ring.recover`. It is armed when the bout is begun again."""
        self._junior.wait_until_back()


class PausedRing:
    """A ring in which nothing further is begun while a person wants a pause: no bout, or, where bouts have no end, no maneuver.

    A robot that pauses is disarmed.

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
        return self._ring.begin(seed)

    def engage(self, maneuver: Maneuver) -> Encounter:
        """See `Ring.engage`."""
        if not self.refereed:
            self._pause()
        return self._ring.engage(maneuver)

    def recover(self) -> None:
        """See `Ring.recover`."""
        self._ring.recover()

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
        self._junior.arm()
