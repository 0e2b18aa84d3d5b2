"""The ring as the host knows it: bouts, and what a maneuver did in them.

With a referee (emulators have one) bouts begin and end by its word. Without one, a person sets the robot up and nobody
says where the opponent is: a bout has no end, and an objective that needs to know is refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from firmware_protocol.errors import HilError
from firmware_protocol.messages import BoutOutcome, OpponentCode, Phase
from firmware_protocol.near import did_you_mean
from hil.sumo.driving import drive_until

if TYPE_CHECKING:
    from firmware_protocol.maneuver_fields import ManeuverReport
    from firmware_protocol.messages import JuniorManeuverResult
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.vocabulary import Maneuver, Stimulus
    from hil.sumo.controllers import Driver
    from hil.sumo.junior import Junior
    from hil.sumo.referee import RefereeHandle

OPPONENTS: Final = {code.label: code for code in OpponentCode if code is not OpponentCode.KEEP}
"""The opponents that a referee can place, by name."""
SETTLE = 0.05
"""Time after a reset before the robot is asked what it senses, in s: its debouncing and thresholds forget the last bout."""
UNKNOWN = "unknown"
"""What an opponent is called of whom nobody says who it is."""


class RingError(HilError):
    """A bout can't be held as asked for."""


@dataclass(frozen=True)
class Encounter:
    """What one maneuver did.

    Attributes:
        report: What the robot counted.
        stimulus: What the robot senses now.
        outcome: UNDECIDED while the bout goes on.
        elapsed: Time since the bout began, in s; None without a referee.
        progress: How much nearer the opponent came to the border, in m; None without a referee.
        duration: Time from the command until its result came, in s.
    """

    report: ManeuverReport
    stimulus: Stimulus
    outcome: BoutOutcome
    elapsed: float | None
    progress: float | None
    duration: float


class Ring(Protocol):
    """Where bouts are held.

    Attributes:
        refereed: Somebody sees both robots and says how a bout ends.
    """

    refereed: bool

    @property
    def opponent(self) -> str:
        """Name of the opponent, as far as it is known."""
        ...

    def begin(self, seed: int) -> Stimulus:
        """Begin a bout.

        Args:
            seed: Decides the start poses, 0..2**32-1.

        Returns:
            What the robot senses.
        """
        ...

    def engage(self, maneuver: Maneuver) -> Encounter:
        """Have a maneuver performed.

        Args:
            maneuver: What to do.
        """
        ...

    def steer(self, driver: Driver) -> tuple[BoutOutcome, float]:
        """Let a driver have the wheels until the bout is over.

        Args:
            driver: Says what to do at every reading.

        Returns:
            Outcome, and the time that the bout took, in s.

        Raises:
            RingError: Nobody says when it is over.
            RefusedError: The robot does not drive: it is not armed, or is stopped.
            PeerError: The robot is gone or does not answer.
            LinkError: The link is gone.
        """
        ...

    def recover(self) -> None:
        """Wait for a robot that was lost, and arm it; the bout it was lost in has to be begun again.

        Raises:
            PeerGoneError: It does not come back.
            PeerLostError: It is lost again.
            LinkClosedError: Its link does not come back.
        """
        ...


class RefereedRing:
    """A ring with a referee.

    Args:
        junior: The robot; it has a referee.
        referee: The referee.
        opponent: Name of the opponent to place; None keeps the one that is there.

    Raises:
        RingError: There is no opponent of this name.
        PeerError: The referee does not answer.
    """

    def __init__(self, junior: Junior, referee: RefereeHandle, opponent: str | None = None) -> None:
        self.refereed = True
        self._junior = junior
        self._referee = referee
        self._code = OpponentCode.KEEP if opponent is None else _code(opponent)
        self._clearance = 0.0
        if opponent is None:
            referee.state()  # who is there

    @property
    def opponent(self) -> str:
        """Name of the opponent in the ring."""
        code = self._code or OpponentCode(self._referee.latest.opponent_code)
        return code.label

    def begin(self, seed: int) -> Stimulus:
        """Begin a bout; see `Ring.begin`. The robot stands still, whatever it was doing."""
        if self._junior.armed:
            self._junior.stop()
        self._place(seed)
        self._junior.wait(SETTLE)
        return self._junior.sense()

    def _place(self, seed: int) -> None:
        """Have everybody placed."""
        self._clearance = self._referee.reset(seed, self._code).clearance

    def engage(self, maneuver: Maneuver) -> Encounter:
        """Have a maneuver performed; it is broken off when the bout is over."""
        ticket = self._junior.start(maneuver)
        report = self._junior.follow(ticket, until=lambda: self._referee.latest.phase == Phase.OVER)
        state = self._referee.latest
        if state.phase != Phase.OVER:
            state = self._referee.state()
        progress = self._clearance - state.clearance
        self._clearance = state.clearance
        outcome = BoutOutcome(state.outcome)
        return Encounter(report, report.after, outcome, state.elapsed, progress, lasted(ticket))

    def steer(self, driver: Driver) -> tuple[BoutOutcome, float]:
        """Let a driver have the wheels until the bout is over; see `Ring.steer`."""
        drive_until(self._junior, driver, lambda: self._referee.latest.phase == Phase.OVER)
        state = self._referee.latest
        return BoutOutcome(state.outcome), state.elapsed

    def recover(self) -> None:
        """Wait for a lost robot, and arm it; see `Ring.recover`."""
        recover(self._junior)


class OpenRing:
    """A ring without a referee: one bout that nobody ends.

    Args:
        junior: The robot.
        opponent: What the user says it is up against.
    """

    def __init__(self, junior: Junior, opponent: str | None = None) -> None:
        self.refereed = False
        self._junior = junior
        self.opponent = opponent or UNKNOWN

    def begin(self, seed: int) -> Stimulus:  # noqa: ARG002 - nobody places anything here
        """Take the situation as it is."""
        return self._junior.sense()

    def engage(self, maneuver: Maneuver) -> Encounter:
        """Have a maneuver performed; see `Ring.engage`."""
        return perform(self._junior, maneuver)

    def steer(self, driver: Driver) -> tuple[BoutOutcome, float]:  # noqa: ARG002 - as `Ring.steer`
        """There is no end to it; see `Ring.steer`."""
        raise RingError("who sets the wheels plays until somebody says that the bout is over, and nobody does here")

    def recover(self) -> None:
        """Wait for a lost robot, and arm it; see `Ring.recover`."""
        recover(self._junior)


def open_ring(junior: Junior, opponent: str | None = None) -> Ring:
    """The ring that a robot stands in.

    Args:
        junior: The robot.
        opponent: Name of the opponent; None takes what is there.
    """
    return OpenRing(junior, opponent) if junior.referee is None else RefereedRing(junior, junior.referee, opponent)


def perform(junior: Junior, maneuver: Maneuver) -> Encounter:
    """Have a maneuver performed where nobody says how a bout goes.

    Args:
        junior: The robot.
        maneuver: What to do.
    """
    ticket = junior.start(maneuver)
    report = junior.follow(ticket)
    return Encounter(report, report.after, BoutOutcome.UNDECIDED, None, None, lasted(ticket))


def recover(junior: Junior) -> None:
    """Wait for a lost robot, and arm it; see `Ring.recover`.

    Args:
        junior: The robot.
    """
    junior.wait_until_back()
    junior.arm()


def lasted(ticket: Ticket[JuniorManeuverResult]) -> float:
    """From the step that sent a maneuver to the stamp of what brought its result, in s.

    To the microsecond: the difference of two clock readings has a rounding that depends on the hour.

    Args:
        ticket: Of the maneuver, which is over.
    """
    assert ticket.asked_at is not None
    assert ticket.answered_at is not None
    return round(ticket.answered_at - ticket.asked_at, 6)


def _code(name: str) -> OpponentCode:
    if name not in OPPONENTS:
        raise RingError(f"there is no opponent {name!r}: choose one of {', '.join(OPPONENTS)}{did_you_mean(name, OPPONENTS)}")
    return OPPONENTS[name]
