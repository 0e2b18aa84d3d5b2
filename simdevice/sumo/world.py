"""A whole emulated bout behind one `step`: match, firmware, referee, and one clock."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.wire.fields import MAVLINK
from firmware_protocol.wire.signing import Signing, virtual_time
from simdevice.emulation import check_periods
from simdevice.junior.device import VirtualDevice
from simdevice.junior.profile import JuniorProfile
from simdevice.junior.second import Keeper
from simdevice.period import PERIOD
from simdevice.sumo.match import Match, Purpose, stream
from simdevice.sumo.referee import Referee

if TYPE_CHECKING:
    from firmware_protocol.faults.spec import FaultSpec
    from firmware_protocol.links.memory import Stamped
    from firmware_protocol.wire.signing import SigningKey
    from simdevice.board_interface import BoardMaker
    from simdevice.boards import Host
    from simdevice.junior.hardware import JuniorHardware


class World:
    """Junior, its opponent and the referee; time passes only in `step`.

    It is a `Clock` (`now`), and what an in-process link can step.

    Args:
        opponent: Name of the opponent.
        seed: Seed of everything random.
        referee: There is a referee on the wire; without one it is as with a physical robot.
        profile: The device's numbers.
        nvm: Image of Junior's EEPROM, as `device.nvm` gave it; None is a new robot.
        host: Build of the firmware that Junior runs; None is the one that comes with the package.
        wire: What goes in and out: MAVLink, or CAN frames in serial form.
        faults: What goes wrong with Junior, by the world's time; faults of a line are `DisturbedWorld`'s business.
        board: Makes Junior's board, as `AvrBoard` does; None is one in this process. A second Junior always has the latter.
        signing_key: Key that Junior and the referee sign with; None: Junior has the one in `nvm`, if any.
        start_held: Junior is switched on with its start input held: it forgets the time of its signatures that is in `nvm`.

    Attributes:
        period: One control period, in s.
        device: Junior.
        referee: The referee, if any.
        wire: What goes in and out.
        room: Bytes that the line takes in the next control period, as far as whoever serves it knows; None: any number.

    Raises:
        ValueError: There is no opponent of this name, or the image has a wrong size.
    """

    period = PERIOD

    def __init__(
        self,
        *,
        opponent: str = "flat-light",
        seed: int = 1,
        referee: bool = True,
        profile: JuniorProfile | None = None,
        nvm: bytes | None = None,
        host: Host | None = None,
        wire: str = MAVLINK,
        faults: FaultSpec | None = None,
        board: BoardMaker | None = None,
        signing_key: SigningKey | None = None,
        start_held: bool = False,
    ) -> None:
        self.room: int | None = None
        self._seed = seed
        self._profile = profile if profile is not None else JuniorProfile()
        self._ticks = 0
        self._match = Match(opponent, seed, self._profile)
        self._prepare()
        self.wire = wire
        self._faults = faults
        self.device = self._device(self._match.robot, nvm, host, wire, board, start_held=start_held)
        signing = None
        if signing_key is not None:
            self.device.give_key(signing_key)
            signing = Signing(signing_key, lambda: virtual_time(self.now()))
        self.referee = self._make_referee(signing) if referee else None
        self._second: VirtualDevice | None = None
        self._keeper = Keeper()
        self._placed()

    def _prepare(self) -> None:
        """Bodies stand in the ring, and there is no board in them yet."""

    def _make_referee(self, signing: Signing | None) -> Referee:
        """Make the referee."""
        return Referee(self._match, self._placed, wire=self.wire, signing=signing)

    def _device(
        self,
        robot: JuniorHardware,
        nvm: bytes | None = None,
        host: Host | None = None,
        wire: str = MAVLINK,
        board: BoardMaker | None = None,
        *,
        start_held: bool = False,
    ) -> VirtualDevice:
        """Put a board into a robot."""
        first = robot is self._match.robot
        identity = stream(self._seed, Purpose.IDENTITY).integers(1, 2**62)
        uid = self._profile.uid if first and self._profile.uid else int(identity) + (not first)
        faults = self._faults if first else None
        if board is not None or host is not None:
            return VirtualDevice(
                robot, uid=uid, nvm=nvm, host=host, wire=wire, faults=faults, board=board, start_held=start_held
            )
        return self._make_device(robot, uid, nvm, wire, faults, start_held=start_held)

    def _make_device(
        self, robot: JuniorHardware, uid: int, nvm: bytes | None, wire: str, faults: FaultSpec | None, *, start_held: bool
    ) -> VirtualDevice:
        """Make a robot with a board in this process."""
        return VirtualDevice(robot, uid=uid, nvm=nvm, wire=wire, faults=faults, start_held=start_held)

    def _placed(self) -> None:
        """Everybody has been put down: see who meets whom, and send a second Junior off."""
        match = self._match
        self.device.other = match.opponent
        if match.second is None or match.opponent is not match.second.body:
            self._keeper.rest()
            return
        if self._second is None:
            self._second = self._device(match.second)
        self._second.other = match.robot.body
        self._keeper.begin()

    @property
    def match(self) -> Match:
        """Bodies and rules."""
        return self._match

    def now(self) -> float:
        """Time of the emulation, in s."""
        return self._ticks * PERIOD

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

    def run(self, inbound: bytes, periods: int) -> list[Stamped]:
        """Live for at most so many control periods, until something is sent, decided or rebooted; see `Emulation.run`."""
        check_periods(periods)
        undecided = self._match.outcome
        for _ in range(periods):
            sent = self.step(inbound)
            inbound = b""
            if sent:
                return [(self.now(), sent)]
            if self._match.outcome is not undecided or not self.device.uptime:
                break  # decided or rebooted
        return []

    def step(self, inbound: bytes) -> bytes:
        """One control period for everything: sensors, firmware, wheels, physics, referee.

        Args:
            inbound: Bytes from the host that have arrived by now.

        Returns:
            Everything sent to the host in this period.
        """
        device = self.device
        referee = self.referee if device.powered else None
        answers = referee.receive(inbound, self._ticks * PERIOD) if inbound and referee is not None else b""
        lifted = self._match.lifted > 0
        if self.room is not None:
            device.limit(self.room)
        sent = device.step(inbound, lifted=lifted)
        if self._second is not None and self._second.other is not None and self._keeper.playing:
            self._second.step(self._keeper.due(), lifted=lifted)
        self._match.step()
        self._ticks += 1
        if referee is None:
            return sent
        referee.follow(device.system)
        sent += answers
        return sent + referee.report(self._ticks * PERIOD, None if self.room is None else self.room - len(sent))
