"""A ring with a person beside it: who says when it is ready and how bouts end, has a run pause, or changes the battery."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import RefusedError
from firmware_protocol.events import Received
from firmware_protocol.messages import BoutOutcome, JuniorSensors
from hil.bridge.operator import DRAWN, LOST, PAUSE, READY, RESUME, WON
from hil.connecting.serving import WAIT
from hil.sumo.contest import COUNTDOWN
from hil.sumo.driving import drive_until
from hil.sumo.ring import UNKNOWN, Encounter, lasted

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.events import Event
    from firmware_protocol.vocabulary import Maneuver, Stimulus
    from hil.questions import Questions
    from hil.sumo.controllers import Driver
    from hil.sumo.floor import FloorJudge
    from hil.sumo.junior import Junior
    from hil.sumo.ring import Ring

VERDICTS: Final = {WON: BoutOutcome.WIN, LOST: BoutOutcome.LOSS, DRAWN: BoutOutcome.DRAW}
_WORDS: Final = {outcome: word for word, outcome in VERDICTS.items()}
STEADY: Final = 1.0
"""A battery is low when it has been below what the robot warns of for so long, in s: pushing lowers it for moments."""


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


def start_after_countdown(junior: Junior) -> None:
    """Arm a robot that somebody has just let go of; it stands still for the countdown of sumo rules.

    Args:
        junior: The robot.

    Raises:
        RefusedError: Its emergency stop is engaged.
        PeerError: It does not answer.
    """
    junior.arm()
    junior.wait(COUNTDOWN)


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

    def begin(self, seed: int) -> Stimulus:  # noqa: ARG002 - a person places the robots
        """Begin a bout, when the person says that the ring is ready; see `Ring.begin`."""
        put_aside(self._junior)
        self._bouts += 1
        text = f"Bout {self._bouts}: set up both robots, and say when the ring is ready."
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
