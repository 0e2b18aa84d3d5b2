"""An emulated robot whose control periods run in the kernel: what remains of it in Python is what happens now and then."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from simdevice.boards import Board
from simdevice.junior.device import VirtualDevice
from simdevice.kernel.arrays import MANY

if TYPE_CHECKING:
    from firmware_protocol.faults.spec import FaultSpec
    from simdevice.junior.faults import Battery
    from simdevice.junior.hardware import JuniorHardware
    from simdevice.kernel.ring import KernelRing


@dataclass(frozen=True)
class Moment:
    """A robot as it was once: what it had in its memories, and how long it had been on.

    Attributes:
        memory: Its working memory, EEPROM and drivers: the struct `host_robot`.
        micros: Time since power-on, in us.
    """

    memory: bytes
    micros: int


class KernelDevice(VirtualDevice):
    """An emulated Junior that sits in a piece of the kernel's world; see `VirtualDevice` for the rest.

    Args:
        ring: Its ring.
        piece: Which piece of the arrays it sits in.

    Attributes:
        faulty: Faults befall it: `begin` is to be asked before control periods.
    """

    def __init__(
        self,
        robot: JuniorHardware,
        ring: KernelRing,
        piece: int,
        *,
        uid: int,
        wire: str,
        nvm: bytes | None = None,
        faults: FaultSpec | None = None,
        start_held: bool = False,
    ) -> None:
        self._ring = ring
        self._piece = piece
        self.faulty = faults is not None and bool(faults.of_device)
        super().__init__(robot, uid=uid, nvm=nvm, wire=wire, faults=faults, start_held=start_held)
        assert isinstance(self._board, Board)
        self._struct = self._board.robot
        ring.devices.robot[piece] = self._struct
        self.set_running(running=True)

    def _battery(self) -> Battery:
        """What feeds its motors: this device."""
        return self

    def feed(self, voltage: float | None) -> None:
        """Have its battery give another voltage, see `Motors.feed`."""
        self._ring.feed(self._piece, voltage)

    @property
    def robot(self) -> JuniorHardware:
        """Its hardware on the match, as of now."""
        self._ring.watch()
        return self._robot

    @property
    def wheels(self) -> tuple[float, float]:
        """Effort that the firmware commands of the left, right wheel, -1..1; a wheel may give less of it."""
        if not self.powered or self._ring.devices.dark[self._piece]:
            return 0.0, 0.0
        left, right = self._struct.io.wheel
        return left / 1000, right / 1000

    @property
    def uptime(self) -> float:
        """Time since power-on, in s."""
        return float(self._ring.devices.micros[self._piece] * 1e-6)

    @property
    def system(self) -> int:
        """System id it uses on the wire, as its frames say."""
        return int(self._ring.devices.system[self._piece])

    def set_start(self, *, go: bool) -> None:
        """Switch the start module's signal, as the referee's remote control does."""
        super().set_start(go=go)
        if isinstance(self._board, Board):
            self._board.robot.io.start = go

    def set_running(self, *, running: bool) -> None:
        """Let it live in the kernel's control periods, or not."""
        self._ring.devices.running[self._piece] = running

    def _begin(self) -> None:
        """The board has booted."""
        super()._begin()
        self._ring.power_on(self._piece)

    def switch_off(self) -> None:
        """Cut the power: the wheels are off, nothing is heard, the EEPROM is kept."""
        self.powered = False
        self._ring.stop_wheels(self._piece)
        self._board.power_off()
        self.set_running(running=False)

    def switch_on(self) -> None:
        """Give the power back, if there is none: it boots."""
        super().switch_on()
        self.set_running(running=True)

    def moment(self) -> Moment:
        """The robot as it is now; `return_to` brings it back."""
        return Moment(self._ring.memory(self._piece), self._ring.devices.micros[self._piece])

    def return_to(self, moment: Moment) -> None:
        """Be as it was once, with wheels and encoders at rest. What befalls it befalls it anew, from now on.

        Args:
            moment: When; of this very robot, since its memory knows where it lies.
        """
        self.powered = True
        self._ring.power_on(self._piece)
        self._ring.remember(self._piece, moment.memory, moment.micros)
        self.set_running(running=True)
        if self._faults is not None:
            self.feed(None)
            self._faults = self._faults.anew()
            self._ring.befall(self._piece, self._faults)

    def begin(self) -> int:
        """Control periods begin: faults befall it.

        Returns:
            How many may pass before they are to be looked at again, 1 or more.
        """
        faults = self._faults
        if faults is None or not self.powered:
            return MANY
        faults.advance()
        self._ring.befall(self._piece, faults)
        if faults.restored:
            self.power_cycle()
        return faults.quiet() + 1

    def skip(self, periods: int) -> None:
        """Control periods are over.

        Args:
            periods: How many, 1 or more.
        """
        if self._faults is not None and self.powered:
            self._faults.skip(periods - 1)
