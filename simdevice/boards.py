"""The boards of emulated robots: they run the C firmware itself, and stand where the drivers would.

Every board is a `BoardInterface` to the device that it sits in: `Board` in this process, `AvrBoard` on an emulated ATmega328P.
One `Board` is one micro-controller: its working memory is a C struct, its EEPROM an image of bytes that survives a power
cycle. It lives by itself, a control period at a time (`tick`), or as one of many whose structs the kernel is given
(`kernel/devices.h`). Loading the firmware's build is done here and in `avr.board` only.
"""

from __future__ import annotations

import importlib
import struct
from typing import TYPE_CHECKING, Any, Final, Protocol, cast

from firmware_protocol.firmware.fit import check_digest, check_layout, check_sources
from firmware_protocol.firmware.host_io import FIELDS
from simdevice.kernel.built_from import digest

if TYPE_CHECKING:
    from simdevice.junior.faults import Readings
    from simdevice.junior.motors import Motors

NVM_SIZE: Final = 1024
"""Size of the EEPROM, in bytes (as on an ATmega328P)."""

_LAST_INPUT: Final = [name for name, _ in FIELDS].index("start")
_INPUTS: Final = struct.Struct("@" + "".join(code.upper() for _, code in FIELDS[: _LAST_INPUT + 1]))
"""The first fields of the C struct `host_io`, as the C compiler lays them out: eyes, floor, battery, arms, what is fitted,
travel, ground, start. Counters of way are signed there; here their bits count, since they wrap."""
_WRAP: Final = 0xFFFFFFFF
"""Encoders and ground odometer count micrometres in 32 bits: after 2147 m they go on from the other end."""


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


class HostLibrary(Protocol):
    """The functions of a host build of the firmware."""

    def host_power_on(self, robot: object, micros: int) -> None:
        """Boot, at this time in us."""
        ...

    def host_restart(self, robot: object) -> None:
        """Cut the power and give it back: only the EEPROM and what is set before power-on is kept; the clock starts at 0."""
        ...

    def host_tick(self, robot: object, micros: int, rx: bytes, rx_len: int) -> int:
        """Run one control period at this time in us, in which these bytes arrive; returns how many are sent."""
        ...

    def host_slow_down(self, robot: object, nvm_per_tick: int, tx_buffer: int, tx_per_tick: int) -> None:
        """From now on, non-volatile memory and the line take so many bytes; 0: any number."""
        ...

    def host_give_key(self, robot: object, key: bytes) -> None:
        """Put a signing key of 32 bytes into non-volatile memory."""
        ...


class Host(Protocol):
    """A host build of the firmware, as cffi hands it over: the extension module, or another build of the same sources."""

    @property
    def ffi(self) -> Any:  # noqa: ANN401 - cffi's own, which has no stubs for what it makes
        """Makes the C structs."""
        ...

    @property
    def lib(self) -> HostLibrary:
        """Its functions."""
        ...


def _load() -> Host:
    """Import the extension module, and see that it is made from this version's sources and has its struct."""
    host = cast("Host", importlib.import_module("simdevice._host"))
    check_sources(host.lib)
    check_digest(host.lib, "KERNEL_BUILT_FROM", digest())
    check_layout(host.ffi)
    return host


_HOST: Final[Host] = _load()


def board_host() -> Host:
    """The build of firmware and kernel that comes with the package."""
    return _HOST


class Board:
    """A micro-controller that runs the firmware.

    Args:
        uid: Unique id burnt into it.
        nvm: Image of its EEPROM; None is blank.
        encoders: Wheel encoders are fitted.
        ground_odometer: A ground odometer is fitted.
        host: Build of the firmware that it runs; None is the one that comes with the package.
        can: It is on a CAN bus: what it receives and sends are CAN frames in serial form.

    Attributes:
        wheel_left: Effort the firmware commands, in permille, -1000..1000.
        wheel_right: Likewise.
        start: The start module says go.
        reboot: The firmware asks for a reset.

    Raises:
        ValueError: The image has another size than the EEPROM.
        FirmwareBuildError: The build is of another version.
    """

    def __init__(
        self,
        *,
        uid: int,
        nvm: bytes | None = None,
        encoders: bool = True,
        ground_odometer: bool = True,
        host: Host | None = None,
        can: bool = False,
    ) -> None:
        if nvm is not None and len(nvm) != NVM_SIZE:
            raise ValueError(f"the EEPROM holds {NVM_SIZE} bytes, the image {len(nvm)}")
        if host is not None:
            check_layout(host.ffi)
        self._host = host if host is not None else _HOST
        self._fitted = (int(encoders), int(ground_odometer))
        self.start = False
        ffi = self._host.ffi
        self._robot = ffi.new("host_robot *")
        io = self._robot.io
        io.uid = uid
        io.can = can
        io.has_encoders, io.has_ground = self._fitted  # looked at when the firmware boots
        ffi.buffer(io.nvm)[:] = nvm if nvm is not None else b"\xff" * NVM_SIZE
        self._nvm = ffi.buffer(io.nvm)
        self._inputs = ffi.buffer(ffi.addressof(io), _INPUTS.size)
        self._tx = ffi.buffer(io.tx)
        self._wheel = io.wheel
        self._io = io
        self.wheel_left = self.wheel_right = 0
        self.reboot = False

    @property
    def robot(self) -> Any:  # noqa: ANN401 - a struct of cffi, which has no stubs for it
        """Its working memory, EEPROM and drivers: the struct `host_robot`."""
        return self._robot

    @property
    def host(self) -> Host:
        """The build of the firmware that it runs."""
        return self._host

    @property
    def nvm(self) -> bytes:
        """Image of the EEPROM."""
        return bytes(self._nvm[:])

    def give_key(self, secret: bytes) -> None:
        """Put a signing key into the EEPROM, as who holds the board can; the firmware finds it when it boots.

        Args:
            secret: 32 bytes.
        """
        self._host.lib.host_give_key(self._robot, secret)

    def power_on(self) -> None:
        """Cut the power and give it back: only the EEPROM is kept, and the clock starts at 0."""
        self._io.start = self.start  # on at power-on is no start
        self._host.lib.host_restart(self._robot)
        self.wheel_left = self.wheel_right = 0
        self.reboot = False

    def power_off(self) -> None:
        """Cut the power: nothing drives the wheels. `power_on` gives it back."""
        self.wheel_left = self.wheel_right = 0

    def limit(self, room: int) -> None:
        """Let the firmware find no more room than this on its line in the next control period.

        Args:
            room: In bytes.
        """
        self._host.lib.host_slow_down(self._robot, 0, max(room, 1), 0)  # 0 would be any room, and 1 holds no frame

    def restart(self) -> None:
        """Boot after the reset that it has asked for; here that is the same as after a power cut."""
        self.power_on()

    def tick(self, micros: int, rx: bytes, sensors: Readings, motors: Motors, ground: float) -> bytes:
        """Run one control period of the firmware.

        Args:
            micros: Time since power-on, in us.
            rx: Bytes that have arrived.
            sensors: What the drivers read.
            motors: Encoders and battery.
            ground: Ground odometer, in m.

        Returns:
            Bytes that the firmware sends.
        """
        _INPUTS.pack_into(
            self._inputs,
            0,
            sensors.eye_left,
            sensors.eye_right,
            sensors.floor_left,
            sensors.floor_right,
            int(motors.voltage * 1e3),
            sensors.arm_left,
            sensors.arm_right,
            *self._fitted,
            int(motors.travel_left * 1e6) & _WRAP,
            int(motors.travel_right * 1e6) & _WRAP,
            int(ground * 1e6) & _WRAP,
            self.start,
        )
        count = self._host.lib.host_tick(self._robot, micros, rx, len(rx))
        self.wheel_left, self.wheel_right = self._wheel
        if self._io.reboot:
            self.reboot = True
        return self._tx[:count] if count else b""
