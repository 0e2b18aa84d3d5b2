"""Who plays a robot in a duel: a host that chooses its maneuvers or sets its wheels, or the robot itself, from its memory.

Two robots play at the same time, so nothing here waits: what is asked is looked at after each step of the links.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from firmware_protocol.errors import RefusedError
from firmware_protocol.maneuver_fields import to_report
from firmware_protocol.messages import ContestCommand, JuniorSensors, Reason
from firmware_protocol.roles.junior import contest
from firmware_protocol.vocabulary import Outcome, Stimulus
from hil.sumo.deploying import deploy
from hil.sumo.junior import STIMULUS_BITS

if TYPE_CHECKING:
    from firmware_protocol.messages import JuniorManeuverResult, RobotAck
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from hil.sumo.controllers import Controller
    from hil.sumo.junior import Junior
    from pal_advisor.maneuvers import Advice


class Player(Protocol):
    """Plays one robot.

    Attributes:
        maneuvers: Maneuvers that it has had performed in this bout; 0 where nobody counts them.
    """

    maneuvers: int

    def prepare(self, junior: Junior) -> None:
        """Have the robot ready to play; it is disarmed. Waits.

        Args:
            junior: The robot.

        Raises:
            HilError: It can't be had ready.
        """
        ...

    def begin(self, junior: Junior) -> None:
        """The bout begins: the robot stands at its start pose, armed."""
        ...

    def attend(self, junior: Junior) -> None:
        """A step of the links is over.

        Raises:
            RefusedError: The robot refuses to go on.
            PeerError: It is gone or does not answer.
        """
        ...


class HostPlayer:
    """A host that chooses the next maneuver whenever one is over.

    Args:
        controller: Chooses.
    """

    def __init__(self, controller: Controller) -> None:
        self.maneuvers = 0
        self._controller = controller
        self._current = Stimulus.NONE
        self._previous: Stimulus | None = None
        self._sensed: Ticket[JuniorSensors] | None = None
        self._performed: Ticket[JuniorManeuverResult] | None = None

    def prepare(self, junior: Junior) -> None:
        """There is nothing to be done before."""

    def begin(self, junior: Junior) -> None:
        """Ask what the robot senses."""
        self.maneuvers = 0
        self._previous = self._performed = None
        self._sensed = junior.peer.request(JuniorSensors)

    def attend(self, junior: Junior) -> None:
        """Have the next maneuver performed, where it is known from what."""
        if self._sensed is not None and self._sensed.done:
            self._current = Stimulus(self._sensed.value().flags & STIMULUS_BITS)
            self._sensed = None
            self._choose(junior)
        elif self._performed is not None and self._performed.done:
            report = to_report(self._performed.value())
            if report.outcome is Outcome.REFUSED:
                raise RefusedError("a maneuver", report.reason.name.lower().replace("_", " "))
            self._previous, self._current = self._current, report.after
            self._choose(junior)

    def _choose(self, junior: Junior) -> None:
        self.maneuvers += 1
        self._performed = junior.start(self._controller.choose(self._current, self._previous))


class MemoryPlayer:
    """The robot itself: it plays by an advice that its memory holds, and the host only looks on.

    Args:
        advice: The advice.
    """

    def __init__(self, advice: Advice) -> None:
        self.maneuvers = 0
        self._advice = advice
        self._started: Ticket[RobotAck] | None = None

    def prepare(self, junior: Junior) -> None:
        """Write the advice into its memory."""
        deploy(junior, self._advice)

    def begin(self, junior: Junior) -> None:
        """Have it play from now on."""
        self._started = contest(junior.peer, ContestCommand.START, 0.0)

    def attend(self, junior: Junior) -> None:  # noqa: ARG002 - it needs nobody
        """See that it has begun."""
        if self._started is not None and self._started.done:
            if self._started.reason is not Reason.NONE:
                self._started.value()
            self._started = None
