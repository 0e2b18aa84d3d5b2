"""A whole emulated bout behind one `step`: match, firmware, referee, and one clock."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.wire.signing import Signing, virtual_time
from simdevice.emulation import check_periods
from simdevice.junior.device import VirtualDevice
from simdevice.junior.second import Keeper
from simdevice.sumo.eeprom import image_of
from simdevice.sumo.late import Late
from simdevice.sumo.match import HELD_UP, PUT_DOWN, Match, Purpose, stream
from simdevice.sumo.referee import Referee
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.links.memory import Stamped
    from simdevice.junior.hardware import JuniorHardware

SECOND_SYSTEM: Final = 2
"""System id of a second Junior that has a host of its own: a log of both tells them apart by it."""


class World:
    """Junior, its opponent and the referee; time passes only in `step`.

    It is a `Clock` (`now`), and what an in-process link can step.

    Args:
        settings: What it begins with; None are the defaults.

    Attributes:
        period: One control period, in s.
        device: Junior.
        referee: The referee, if any.
        wire: What goes in and out.
        room: Bytes that the line takes in the next control period, as far as whoever serves it knows; None: any number.
        networks: How many networks it has: the second, if any, is that of a second Junior.

    Raises:
        ValueError: There is no opponent of this name, or the image has a wrong size.
    """

    def __init__(self, settings: WorldSettings | None = None) -> None:
        self._settings = settings = settings if settings is not None else WorldSettings()
        self.period = settings.period
        self.wire = settings.wire
        self.room: int | None = None
        self.networks = 2 if settings.hosted else 1
        self._ticks = 0
        self._match = Match(
            settings.opponent,
            settings.seed,
            settings.profile,
            period=settings.period,
            conditions=settings.conditions,
            vary=settings.vary,
        )
        self._late = Late() if settings.vary or settings.conditions.delay else None
        self._prepare()
        self.device = self._device(self._match.robot)
        signing = None
        if settings.signing_key is not None:
            self.device.give_key(settings.signing_key)
            signing = Signing(settings.signing_key, lambda: virtual_time(self.now()))
        self.referee = self._make_referee(signing) if settings.referee else None
        self._second: VirtualDevice | None = None
        self._keeper = Keeper()
        self._for_second = self._of_second = b""
        self._placed()

    def _prepare(self) -> None:
        """Bodies stand in the ring, and there is no board in them yet."""

    def _make_referee(self, signing: Signing | None) -> Referee:
        """Make the referee."""
        return Referee(self._match, self._placed, wire=self.wire, signing=signing)

    def _device(self, robot: JuniorHardware) -> VirtualDevice:
        """Put a board into a robot; a second Junior has one of the usual kind."""
        settings = self._settings
        identity = int(stream(settings.seed, Purpose.IDENTITY).integers(1, 2**62))
        if robot is self._match.robot:
            return self._make_device(robot, settings.profile.uid or identity, settings)
        if settings.hosted:
            return self._make_device(robot, identity + 1, WorldSettings(nvm=image_of(SECOND_SYSTEM), wire=settings.wire))
        return self._make_device(robot, identity + 1, WorldSettings())

    def _make_device(self, robot: JuniorHardware, uid: int, settings: WorldSettings) -> VirtualDevice:
        """Make a robot.

        Args:
            robot: Its hardware on the match.
            uid: Unique id of its board.
            settings: What is said there of its board.
        """
        return VirtualDevice(
            robot,
            uid=uid,
            nvm=settings.nvm,
            host=settings.host,
            wire=settings.wire,
            faults=settings.faults,
            board=settings.board,
            start_held=settings.start_held,
        )

    def _placed(self) -> None:
        """Everybody has been put down: see who meets whom, and send a second Junior off."""
        match = self._match
        self.device.others = match.arena.others(match.robot.body)
        if match.second is None or not self._second_plays:
            self._keeper.rest()
            return
        if self._second is None:
            self._second = self._device(match.second)
        self._second.others = match.arena.others(match.second.body)
        if not self._settings.hosted:
            self._keeper.begin()

    @property
    def _second_plays(self) -> bool:
        """A second Junior is on the table."""
        second = self._match.second
        return second is not None and self._match.opponent is second.body

    @property
    def _delay(self) -> int:
        """By how many control periods what the host says is late in this bout."""
        return round(self._match.conditions.delay / self.period)

    @property
    def match(self) -> Match:
        """Bodies and rules."""
        return self._match

    def now(self) -> float:
        """Time of the emulation, in s."""
        return self._ticks * self.period

    @property
    def nvm(self) -> bytes:
        """Image of Junior's EEPROM."""
        return self.device.nvm

    def switch_off(self) -> None:
        """Cut Junior's power: its wheels are off and nothing is heard of it; the world goes on, and the EEPROM is kept."""
        self.device.switch_off()

    def switch_on(self) -> None:
        """Give Junior its power back, if it has none: it boots."""
        self.device.switch_on()

    def lift(self) -> None:
        """Hold the robots up: nothing is sensed, wheels touch nothing, and the bout stands still, until they are put down.

        A bout that begins puts them down as well.
        """
        self._hold_up(HELD_UP)

    def put_down(self) -> None:
        """Put the robots back where they were lifted."""
        self._hold_up(PUT_DOWN)

    def _hold_up(self, periods: int) -> None:
        """Hold the robots up for so many control periods."""
        self._match.lifted = periods

    def run(self, inbound: bytes, periods: int) -> list[Stamped]:
        """Live for at most so many control periods, until something is sent, decided or rebooted; see `Emulation.run`."""
        check_periods(periods)
        undecided = self._match.outcome
        for _ in range(periods):
            sent = self.step(inbound)
            inbound = b""
            if sent:
                return [(self.now(), sent)]
            if self._match.outcome is not undecided or not self.device.uptime or self._of_second:
                break  # decided or rebooted, or something for another host
        return []

    def run_networks(self, inbound: Sequence[bytes], periods: int) -> list[bytes]:
        """Live for at most so many control periods, until something is sent on a network, decided or rebooted.

        Args:
            inbound: Bytes from the hosts that have arrived by now, of Junior's and of the second one's.
            periods: How many, 1 or more.

        Returns:
            What has been sent in the last of them, by network.

        Raises:
            ValueError: It is asked for no period at all.
        """
        junior, *second = inbound
        self._for_second, self._of_second = b"".join(second), b""
        said = b"".join([data for _, data in self.run(junior, periods)])
        return [said, self._of_second]

    def step(self, inbound: bytes) -> bytes:
        """One control period for everything: sensors, firmware, wheels, physics, referee.

        Args:
            inbound: Bytes from the host that have arrived by now.

        Returns:
            Everything sent to the host in this period.
        """
        if self._late is not None:
            inbound = self._late.arriving(inbound, self._ticks, self._delay)
        device = self.device
        referee = self.referee if device.powered else None
        answers = referee.receive(inbound, self._ticks * self.period) if inbound and referee is not None else b""
        lifted = self._match.lifted > 0
        if self.room is not None:
            device.limit(self.room)
        sent = device.step(inbound, lifted=lifted)
        if self._second is not None and self._second_plays:
            self._step_second(self._second, lifted=lifted)
        self._match.step()
        self._ticks += 1
        if referee is None:
            return sent
        referee.follow(device.system)
        sent += answers
        return sent + referee.report(self._ticks * self.period, None if self.room is None else self.room - len(sent))

    def _step_second(self, second: VirtualDevice, *, lifted: bool) -> None:
        """One control period for the second Junior, which hears its host, or its keeper."""
        if self._settings.hosted:
            self._of_second = second.step(self._for_second, lifted=lifted)
            self._for_second = b""
        else:
            second.step(self._keeper.due(), lifted=lifted)
