"""The robot under test: what the checks say to it, and how it is left as it was found."""

from __future__ import annotations

from contextlib import nullcontext, suppress
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import NoRobotError, VersionError, WrongRoleError
from firmware_protocol.messages import PROTOCOL_MAJOR, AutopilotVersion, Command, RobotStatus, State
from firmware_protocol.peer.role import role_of
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.roles.known import ROLES
from firmware_protocol.versions import other_version, spoken_minor
from hil.conformance.examples import EXAMPLES, SLOW_TURN
from hil.conformance.junior.speech import JuniorSpeech
from hil.conformance.micro.speech import MicroSpeech
from hil.conformance.registry import CheckFailedError, require
from hil.connecting.diagnosis import nobody

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager

    from firmware_protocol.clock import Clock
    from firmware_protocol.link import Link
    from firmware_protocol.peer.role import Role
    from firmware_protocol.wire.signing import Signing
    from hil.bridge.operator import Operator
    from hil.bridge.pump import Pump
    from hil.bridge.taps import Tap
    from hil.conformance.probe import Translator

REBOOT_WAIT: Final = 8.0
"""How long a robot may take to restart, boot loader and all, in s."""


class Subject(JuniorSpeech, MicroSpeech):
    """The robot under test.

    Args:
        link: An open link; closed with it.
        clock: Tells the time.
        session: Gives session numbers, 1..65535.
        system: System id of the robot; None takes the first that is heard.
        codec: Speaks the link's language; None is MAVLink.
        taps: What sees everything.
        signing: Signs what is sent, where nothing else speaks the link's language.
        pump: As in `Probe`.
        operator: Likewise.
        network: Likewise.
        second: System id of a robot beside it on the link, for the checks that need one.
    """

    def __init__(
        self,
        link: Link,
        clock: Clock,
        *,
        session: Callable[[], int],
        system: int | None = None,
        codec: Translator | None = None,
        taps: Sequence[Tap] = (),
        signing: Signing | None = None,
        pump: Pump | None = None,
        operator: Operator | None = None,
        network: str | None = None,
        second: int | None = None,
    ) -> None:
        super().__init__(
            link,
            clock,
            host=session(),
            system=system,
            codec=codec,
            taps=taps,
            signing=signing,
            pump=pump,
            operator=operator,
            network=network,
        )
        self._draw_session = session
        self._opened = set()
        self.second = second

    @property
    def role(self) -> Role:
        """What kind of robot it is."""
        return self.examples.role

    # --- before and after --------------------------------------------------------------------------------------------

    def greet(self, timeout: float = 5.0) -> None:
        """Find the robot, stop it, and take down its parameters and its memory.

        Raises:
            NoRobotError: None was heard, or what was heard is no robot of ours, or is the one that is to stand beside it.
            WrongRoleError: It has a role that no check is for.
            VersionError: It speaks a protocol we do not.
            LinkError: The link is gone.
        """
        self.find(timeout)
        if self.second == self.system:
            raise NoRobotError(f"{self._link.url}: robot {self.system} is the one that is checked: name another one beside it")
        version = self.requested(AutopilotVersion)
        if version is not None and version.middleware_sw_version >> 24 != PROTOCOL_MAJOR:
            major, minor = version.middleware_sw_version >> 24, version.middleware_sw_version >> 16 & 0xFF
            if not major:
                raise NoRobotError(nobody(self.seen(wanted=self.system, unusable=[self.system]), timeout))
            raise VersionError(f"{self._link.url}: the robot {other_version(f'{major}.{minor}')}")
        product = 0 if version is None else version.product_id
        if product not in EXAMPLES:
            wanted = " or a ".join(role.name for role in ROLES)
            what = role_of(product, ROLES).name
            raise WrongRoleError(f"{self._link.url}: robot {self.system} is a {what}; these checks are for a {wanted}")
        self.examples = EXAMPLES[product]
        self.minor = spoken_minor(0 if version is None else version.middleware_sw_version)
        try:
            self.fresh()
        except CheckFailedError as failure:
            raise NoRobotError(f"{nobody(self.seen(), timeout)} ({failure})") from failure
        self.parameters_found = self._values()
        if self.role is JUNIOR:
            with suppress(CheckFailedError):
                self.memory_found = self.read_memory()

    def restore(self) -> list[str]:
        """Leave the robot disarmed, its parameters and its memory as they were found.

        Returns:
            What is not as it was found, in words.
        """
        self.fresh()
        present = self._values()
        left = [
            f"{name} was {value:g}"
            for name, value in self.parameters_found.items()
            if present.get(name) != value and not self._put_back(name, value)
        ]
        if not self.restore_memory():
            left.append(f"the memory held {len(self.memory_found or ())} maneuvers")
        if self.told_to_sense:
            self.reboot()
            self.told_to_sense = False
        self.command(Command.ARM_DISARM, 0)
        if self.state() != State.DISARMED:
            left.append("it is not disarmed")
        return left

    def _values(self) -> dict[str, float]:
        """All parameters; those that a bad line swallows from the list are asked for one by one."""
        values = {value.param_id: value.param_value for value in self.list_parameters()}
        for parameter in self.examples.parameters:
            if parameter.name not in values:
                with suppress(CheckFailedError):
                    values[parameter.name] = self.parameter(parameter.name).param_value
        return values

    def _put_back(self, name: str, value: float) -> bool:
        try:
            return self.set_parameter(name, value) == value
        except CheckFailedError:
            return False

    def slowly(self) -> AbstractContextManager[None]:
        """Inside, `lasting` lasts as long as it says."""
        return nullcontext() if self.examples.stands else self.parameters(TURN_SPEED=SLOW_TURN)

    def reboot(self) -> RobotStatus:
        """Restart the robot.

        Returns:
            Its status after the restart.
        """
        before = self.status()
        lost = self.lost
        self.order(Command.PREFLIGHT_REBOOT, 1)
        again = self.wait(RobotStatus, lambda status: status.time < before.time, timeout=REBOOT_WAIT)
        require(again is not None, f"it was not back {REBOOT_WAIT:g} s after the order to reboot")
        self.lost = lost  # its frames are counted anew
        self.open_session()
        return self.status()
