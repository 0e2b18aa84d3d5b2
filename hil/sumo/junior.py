"""Junior, as a program on the PC holds it: sensors in, maneuvers out, and a safe stop on every way out."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, TypeVar, cast

from firmware_protocol.errors import PeerLostError
from firmware_protocol.maneuver_fields import ManeuverReport, to_report
from firmware_protocol.messages import REFEREE_COMPONENT, JuniorSensors, Reason, RefereeState, SensorFlag
from firmware_protocol.near import did_you_mean
from firmware_protocol.roles.junior import JUNIOR, SLOW_REFEREE, drive, perform
from firmware_protocol.vocabulary import Action, Maneuver, Stimulus
from hil.connecting.handle import RobotHandle
from hil.connecting.serving import WAIT, Serving
from hil.safety import Limits
from hil.sumo.referee import RefereeHandle

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from firmware_protocol.events import Received
    from firmware_protocol.messages import JuniorManeuverResult, RobotAck
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.peer.peer import Peer
    from firmware_protocol.peer.role import Role
    from hil.bridge.bridge import Bridge

T = TypeVar("T")

REFEREE_WAIT = 0.5
"""A referee speaks 20 times a second: who is silent for ten periods is not there, bad line or slow emulator, in s."""
STIMULUS_BITS = 15


class Junior(RobotHandle):
    """A connected Junior. Leaving its `with` block stops and disarms it; `hil.connect` makes one.

    What any robot can do (arm, parameters, a safe stop) it has from `RobotHandle`.

    Args:
        bridge: As of `RobotHandle`.
        limits: Likewise.
        robots: Likewise.

    Attributes:
        referee: The referee, where one is; else None.
    """

    ROLE: ClassVar[Role | None] = JUNIOR
    COMPANION_WAIT: ClassVar[float] = REFEREE_WAIT

    def __init__(
        self,
        bridge: Bridge,
        limits: Limits = Limits(),  # noqa: B008 - frozen
        robots: Serving | None = None,
    ) -> None:
        super().__init__(bridge, limits, robots)
        self.referee: RefereeHandle | None = None
        self._reading: Received | None = None
        self._early: dict[int, Received] = {}

    # --- connecting --------------------------------------------------------------------------------------------------

    def find(self, system: int | None = None, timeout: float = 5.0) -> None:
        """Wait for a Junior and its referee; see `RobotHandle.find`."""
        super().find(system, timeout)
        self._look_for_referee()

    def adopt(self, peer: Peer, network: str | None = None) -> None:
        """Be the handle of this robot; see `RobotHandle.adopt`."""
        super().adopt(peer, network)
        self._reading = self._early.get(peer.system)

    def _look_for_referee(self) -> None:
        referee = RefereeHandle(self)
        pace = self.bridge.pace  # on a slow line a referee that was asked to says less
        deadline = self.now() + (REFEREE_WAIT if pace is None else REFEREE_WAIT + 2 * SLOW_REFEREE)
        while self.now() < deadline and REFEREE_COMPONENT not in self.peer.components:
            self.step(min(WAIT, deadline - self.now()))
        if REFEREE_COMPONENT in self.peer.components:
            self.referee = referee

    @property
    def complete(self) -> bool:
        """A referee has been heard."""
        return self.referee is not None

    def wait_until_back(self) -> None:
        """Wait until a Junior that was lost can be used again; see `RobotHandle.wait_until_back`."""
        super().wait_until_back()
        if self.referee is not None:
            self.referee.forget()

    def hear(self, received: Received) -> None:
        """Take in what somebody on the link has said."""
        message = received.message
        if not hasattr(self, "peer"):
            if type(message) is JuniorSensors:
                self._early[received.system] = received
        elif received.system == self.peer.system:
            if self._robots is not None and self.referee is None and received.component == REFEREE_COMPONENT:
                self.referee = RefereeHandle(self)
            if type(message) is JuniorSensors:
                self._reading = received
            elif type(message) is RefereeState and self.referee is not None:
                self.referee.heard(message)

    # --- what it senses ----------------------------------------------------------------------------------------------

    @property
    def sensors(self) -> JuniorSensors:
        """The latest reading that has come, unless it is stale: then a fresh one is asked for, as the first is.

        Raises as `read_sensors`.
        """
        if not self.telling and (self._robots is None or not self._robots.telling):  # else this is as fresh as can be
            self.step(0.0)
        latest = self.latest
        return self.read_sensors() if latest is None or self.stale else latest

    @property
    def latest(self) -> JuniorSensors | None:
        """The latest reading, without waiting and however old it is (`age`); None before the first."""
        return None if self._reading is None else cast("JuniorSensors", self._reading.message)

    @property
    def age(self) -> float:
        """Time from the latest reading to the last step, in s; infinite before the first."""
        return float("inf") if self._reading is None else self.now() - self._reading.time

    @property
    def stale(self) -> bool:
        """The latest reading is too old to act on: older than three intervals of the stream, or 0.25 s where that is more."""
        return self.peer.streams.stale(JuniorSensors, self.age)

    @property
    def stimulus(self) -> Stimulus:
        """Eyes and arms of the latest reading."""
        return Stimulus(self.sensors.flags & STIMULUS_BITS)

    @property
    def flags(self) -> SensorFlag:
        """All flags of the latest reading."""
        return SensorFlag(self.sensors.flags)

    def read_sensors(self) -> JuniorSensors:
        """Ask for a fresh reading.

        Raises:
            PeerError: No answer.
            LinkError: The link is gone.
        """
        return self.finish(self.peer.request(JuniorSensors))

    def sense(self) -> Stimulus:
        """Eyes and arms of a fresh reading; raises as `read_sensors` does."""
        return Stimulus(self.read_sensors().flags & STIMULUS_BITS)

    # --- what it does ------------------------------------------------------------------------------------------------

    def stop(self) -> None:
        """Stop the wheels and whatever it is performing; it stays armed. Raises as `drive` does."""
        self.finish(drive(self.peer, 0.0, 0.0, 0.0))

    def drive(self, left: float, right: float, duration: float = 0.25) -> tuple[float, float, float]:
        """Turn the wheels for a while; repeat it to go on (a dead-man's handle).

        Args:
            left: Left wheel, share of full, -1..1.
            right: Right wheel, likewise.
            duration: The wheels stop after this time, in s.

        Returns:
            What was really sent, after the limits: left, right, duration.

        Raises:
            RefusedError: It is not armed, or is stopped.
            ValueError: A value is not a finite number.
            PeerError: The robot is gone or does not answer.
            LinkError: The link is gone.
        """
        sent = self.limits.wheels(left, right, duration)
        self.finish(drive(self.peer, *sent))
        return sent

    def steer(self, left: float, right: float, duration: float = 0.25) -> Ticket[RobotAck]:
        """As `drive`, without waiting for the answer; of two the newer counts, and the older ticket fails if it is still open.

        Args:
            left: As for `drive`.
            right: Likewise.
            duration: Likewise.

        Returns:
            Done when the robot has answered.

        Raises:
            ValueError: A value is not a finite number.
        """
        return drive(self.peer, *self.limits.wheels(left, right, duration))

    def perform(
        self,
        maneuver: Maneuver | Iterable[Action | str],
        *,
        period: float = 0.25,
        until: Callable[[], bool] | None = None,
    ) -> ManeuverReport:
        """Have a maneuver performed, and wait for the report. The robot times it; nothing of it depends on the host.

        Args:
            maneuver: What to do: a `Maneuver`, or up to eight actions by name, as `["FF", "S"]` or `"FF S"`.
            period: Time each action lasts, in s, where names are given.
            until: Break the maneuver off when this says so; looked at whenever something has come.

        Returns:
            How it went.

        Raises:
            RefusedError: The robot does not begin it: it is not armed, or is stopped.
            ValueError: No such action, none or too many, or a period out of range.
            PeerError: The robot is gone, does not answer, or was lost and is back since it was armed.
            LinkError: The link is gone.
        """
        return self.follow(self.start(maneuver, period=period), until=until)

    def follow(self, ticket: Ticket[JuniorManeuverResult], *, until: Callable[[], bool] | None = None) -> ManeuverReport:
        """Wait for the report of a maneuver that was started.

        Args:
            ticket: What `start` gave.
            until: As for `perform`.

        Returns:
            How it went.

        Raises:
            RefusedError: As by `perform`, and the other errors likewise.
        """
        broken_off = False
        while not ticket.done:
            self.step(WAIT)
            if until is not None and not broken_off and not ticket.done and until():
                drive(self.peer, 0.0, 0.0, 0.0)
                broken_off = True
        return to_report(self.answer(ticket))

    def answer(self, ticket: Ticket[T]) -> T:
        """What came of something that it was asked to do.

        Args:
            ticket: What one was given for it; it is done.

        Raises:
            RefusedError: It refused.
            PeerError: It is gone, did not answer, or was lost and is back since it was armed.
        """
        if ticket.reason is Reason.DISARMED and self._armed_in not in {None, self.peer.session}:
            raise PeerLostError(f"robot {self.peer.system} was lost since it was armed, and is back: it is disarmed")
        return ticket.value()

    def start(self, maneuver: Maneuver | Iterable[Action | str], *, period: float = 0.25) -> Ticket[JuniorManeuverResult]:
        """Have a maneuver performed, and do not wait for it; `to_report` makes a report of what comes.

        Args:
            maneuver: As for `perform`.
            period: Likewise.

        Raises:
            ValueError: As by `perform`.
        """
        if isinstance(maneuver, str):
            maneuver = maneuver.split()
        if not isinstance(maneuver, Maneuver):
            maneuver = Maneuver(tuple(_action(one) for one in maneuver), period=period)
        return perform(self.peer, self.limits.bounded(maneuver))


def _action(name: Action | str) -> Action:
    if isinstance(name, Action):
        return name
    if name not in Action.__members__:
        known = Action.__members__
        raise ValueError(f"no action is called {name!r}: choose from {', '.join(known)}{did_you_mean(name, known)}")
    return Action[name]
