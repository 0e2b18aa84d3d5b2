"""What every board offers to the device that it sits in, whatever runs the firmware."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from simdevice.junior.faults import Readings
    from simdevice.junior.motors import Motors


class BoardInterface(Protocol):
    """A micro-controller that runs the firmware: `Board` in this process, `AvrBoard` on an emulated ATmega328P.

    Attributes:
        wheel_left: Effort the motors are given, in permille, -1000..1000.
        wheel_right: Likewise.
        start: The start module says go.
        reboot: It has reset itself, or asks for it: `restart` it.
    """

    wheel_left: int
    wheel_right: int
    start: bool
    reboot: bool

    @property
    def nvm(self) -> bytes:
        """Image of the EEPROM."""
        ...

    def power_on(self) -> None:
        """Cut the power and give it back, and boot: only the EEPROM is kept, and the clock starts at 0."""
        ...

    def power_off(self) -> None:
        """Cut the power: nothing drives the wheels. `power_on` gives it back."""
        ...

    def restart(self) -> None:
        """Boot after a reset of its own; the clock starts at 0."""
        ...

    def tick(self, micros: int, rx: bytes, sensors: Readings, motors: Motors, ground: float) -> bytes:
        """Run one control period of the firmware.

        Args:
            micros: Time since power-on, in us.
            rx: Bytes that have come from the host.
            sensors: What the drivers read.
            motors: Encoders and battery.
            ground: Ground odometer, in m.

        Returns:
            Bytes for the host.
        """
        ...


class BoardMaker(Protocol):
    """Makes a board; `AvrBoard` is one."""

    def __call__(self, *, uid: int, nvm: bytes | None) -> BoardInterface:
        """Make a board.

        Args:
            uid: Unique id burnt into it.
            nvm: Image of its EEPROM; None is blank.

        Raises:
            ValueError: The image has another size than the EEPROM.
        """
        ...
