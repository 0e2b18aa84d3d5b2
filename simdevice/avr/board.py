"""The board of an emulated robot as an ATmega328P: the firmware's own ELF in simavr, instruction by instruction.

It has the drivers, too: sensors come as voltages on the converter's inputs and levels on pins, messages as bytes on the
serial line, and what the wheels are given is read from timer and pins, as a motor driver reads it. Junior's board has no wheel
encoders and no ground odometer. A micro-robot's board is in `micro_board`.

Power-on takes no time of the world: the processor runs until its first control period is due, some 30 ms. From then on
its control periods and the world's begin together.
"""

from __future__ import annotations

import functools
import re
from typing import TYPE_CHECKING, Any, ClassVar, Final

import cffi

from firmware_protocol.errors import LinkOpenError
from firmware_protocol.wire.mavlink import frame_size
from firmware_protocol.wire.mavlink_layout import MARKER
from simdevice.avr.build import SHIM, AvrFirmware, build, shim_hash
from simdevice.boards import NVM_SIZE
from simdevice.junior.sensors import ADC_MAX

if TYPE_CHECKING:
    from pathlib import Path

    from simdevice.junior.faults import Readings
    from simdevice.junior.motors import Motors

CYCLES: Final = 80_000
"""Clock cycles of a control period."""
BATTERY_FULL_SCALE: Final = 10.0
"""Battery voltage at 1024 counts, in V: BOARD_BATTERY_MV of the firmware's board.h."""
_STEPS: Final = ADC_MAX + 1
_RAM_END: Final = 0x08FF
_PAINT: Final = 0xC5
_CHANNELS: Final = 5
"""Inputs of the converter that something is wired to: eyes, floor, battery."""
_STRUCT: Final = re.compile(r"^typedef struct \{[^{}]*\} avr_io;$", re.MULTILINE)
_FUNCTION: Final = re.compile(r"^(?!static )\w+ \*?avr_board_\w+\([^()]*\)$", re.MULTILINE)


def declarations(shim: str) -> str:
    """What cffi is told of the shim: its struct and its functions, as they stand there.

    Args:
        shim: Text of simavr_shim.c.
    """
    struct, *more = _STRUCT.findall(shim)
    assert not more, "simavr_shim.c has one struct avr_io"
    functions = [f"{head};" for head in _FUNCTION.findall(shim)]
    return "\n".join([struct.replace("CHANNELS", str(_CHANNELS)), "typedef struct avr_board avr_board;", *functions, ""])


def battery_counts(voltage: float) -> int:
    """What the converter reads behind the board's divider.

    Args:
        voltage: Of the battery, in V.
    """
    return min(ADC_MAX, int(voltage / BATTERY_FULL_SCALE * _STEPS))


def whole_frames(data: bytes) -> int:
    """How much of what was sent is over and done with: whole frames, and what is no frame at all.

    Args:
        data: Bytes from the beginning of a frame on.

    Returns:
        Bytes up to the frame that is still being sent, or all.
    """
    at = 0
    while at < len(data):
        if data[at] != MARKER:
            following = data.find(MARKER, at)
            at = following if following >= 0 else len(data)
            continue
        size = frame_size(data, at)
        if size is None or at + size > len(data):
            break
        at += size
    return at


@functools.cache
def _load(shim: Path) -> tuple[Any, Any]:
    """Load the shim.

    Raises:
        LinkOpenError: simavr is not there any more, or is another version; or the shim is one of other sources than ours.
    """
    ffi = cffi.FFI()
    ffi.cdef(declarations(SHIM.read_text(encoding="utf-8")))
    remedy = f"Delete {shim.parent} and try again"
    try:
        lib: Any = ffi.dlopen(str(shim))
    except OSError as error:
        raise LinkOpenError("the AVR board", f"cannot load {shim}: {error}", remedy) from error
    built_from = getattr(lib, "avr_board_built_from", None)
    if built_from is None or built_from() != shim_hash(SHIM) or lib.avr_board_io_size() != ffi.sizeof("avr_io"):
        raise LinkOpenError("the AVR board", f"{shim} was built for another version of this package", remedy)
    return ffi, lib


class AvrProcessor:
    """An ATmega328P that runs the firmware: what boards have in common.

    Args:
        uid: Unique id burnt into it, as its serial number.
        nvm: Image of its EEPROM; None is blank.
        firmware: What it runs; None builds the firmware that comes with the package, of the class's role.

    Attributes:
        wheel_left: Effort that the motor driver gives, in permille, -1000..1000.
        wheel_right: Likewise.
        start: The start module says go.
        reboot: The watchdog has reset it: `restart` it.

    Raises:
        LinkOpenError: Something that it takes is not installed; the text says what to do.
        ValueError: The image has another size than the EEPROM.
    """

    _ROLE: ClassVar[str]
    """Folder of the role whose firmware is built for it."""

    def __init__(self, *, uid: int, nvm: bytes | None = None, firmware: AvrFirmware | None = None) -> None:
        if nvm is not None and len(nvm) != NVM_SIZE:
            raise ValueError(f"the EEPROM holds {NVM_SIZE} bytes, the image {len(nvm)}")
        if firmware is None:
            firmware = build(role=self._ROLE)
        self._ffi, self._lib = _load(firmware.shim)
        board = self._lib.avr_board_new(str(firmware.elf).encode(), uid)
        if board == self._ffi.NULL:
            raise LinkOpenError("the AVR board", f"simavr cannot read {firmware.elf}", "Delete it and try again")
        self._board = self._ffi.gc(board, self._lib.avr_board_free)
        self._io = self._lib.avr_board_io(board)
        self._tx = self._ffi.buffer(self._io.tx)
        self._nvm = self._ffi.buffer(self._lib.avr_board_nvm(board), NVM_SIZE)
        if nvm is not None:
            self._nvm[:] = nvm
        self._line = b""
        self._unfinished = b""
        self._cut_short = b""
        self.start = False
        self.reboot = False
        self.wheel_left = self.wheel_right = 0

    @property
    def nvm(self) -> bytes:
        """Image of the EEPROM."""
        return bytes(self._nvm[:])

    @property
    def busy(self) -> int:
        """Clock cycles of the last control period in which the processor did not sleep."""
        return int(self._io.busy)

    @property
    def stack(self) -> int:
        """Greatest depth of the stack since power-on, in bytes: how much of what was painted at the reset is painted over."""
        memory = self._ffi.buffer(self._lib.avr_board_memory(self._board), _RAM_END + 1)
        free = bytes(memory[self.address("_end") :])
        return len(free.lstrip(bytes([_PAINT])))

    def address(self, name: str) -> int:
        """Where a variable of the firmware lies in data memory.

        Raises:
            KeyError: There is no such variable.
        """
        address = self._lib.avr_board_address(self._board, name.encode())
        if address == 0:
            raise KeyError(name)
        return int(address)

    def peek(self, address: int) -> int:
        """A byte of data memory: a register or a variable."""
        return int(self._lib.avr_board_memory(self._board)[address])

    def poke(self, address: int, value: int) -> None:
        """Change a byte of data memory, as a stray cosmic ray does."""
        self._lib.avr_board_memory(self._board)[address] = value

    def power_on(self, torn: int | None = None) -> None:
        """Cut the power and give it back, and boot: only the EEPROM is kept, and the clock starts at 0.

        Args:
            torn: What becomes of a byte of the EEPROM that is being written in this moment, 0..255; None writes it whole.

        Raises:
            RuntimeError: The firmware does not come up.
        """
        self.cut(torn)
        self.restart()

    def cut(self, torn: int | None = None) -> None:
        """Cut the power and give it back, and go no further: `run` boots it as far as one likes, `power_on` again begins anew.

        Args:
            torn: As for `power_on`.
        """
        self._lib.avr_board_cut(self._board, -1 if torn is None else torn)

    def power_off(self) -> None:
        """Cut the power: nothing drives the wheels. `power_on` gives it back."""
        self.wheel_left = self.wheel_right = 0

    def restart(self) -> None:
        """Boot after a reset by the watchdog, which has kept nothing but the EEPROM either.

        Raises:
            RuntimeError: The firmware does not come up.
        """
        self._cut_short += self._unfinished
        self._line = self._unfinished = b""
        self._io.start = self.start
        self.reboot = False
        self.wheel_left = self.wheel_right = 0
        if not self._lib.avr_board_boot(self._board):
            raise RuntimeError("the firmware does not come up on the emulated ATmega328P")

    def run(self, cycles: int) -> None:
        """Run for a part of a control period; then cut the power.

        Args:
            cycles: Clock cycles.

        Raises:
            RuntimeError: The processor has crashed.
        """
        self._io.start = self.start
        self._check(self._lib.avr_board_run(self._board, cycles))

    def _period(self, rx: bytes) -> bytes:
        """Run one control period with the inputs as they stand.

        Args:
            rx: Bytes from the host; they set out on the line one after the other, 53 in a control period.

        Returns:
            What the firmware has sent: whole frames, and what a reset has cut short. Of a frame that is still on its way at
            the end of the period the bytes come with the rest of it.

        Raises:
            RuntimeError: The processor has crashed.
        """
        io = self._io
        io.start = self.start
        if self._line:
            rx = self._line + rx
        self._check(self._lib.avr_board_step(self._board, rx, len(rx)))
        self._line = rx[io.taken :]
        self.wheel_left, self.wheel_right = io.wheel
        if io.reset:
            self.reboot = True
        if not io.tx_len:
            return b""
        sent = self._unfinished + bytes(self._tx[: io.tx_len])
        whole = whole_frames(sent)
        self._unfinished = sent[whole:]
        before, self._cut_short = self._cut_short, b""
        return before + sent[:whole]

    def _check(self, alive: int) -> None:
        if not alive:
            raise RuntimeError("the emulated ATmega328P has crashed")


class AvrBoard(AvrProcessor):
    """Junior's board: eyes, floor sensors, arms."""

    _ROLE = "junior"

    def tick(self, micros: int, rx: bytes, sensors: Readings, motors: Motors, ground: float) -> bytes:  # noqa: ARG002
        """Run one control period.

        Args:
            micros: Not looked at: the processor has a clock of its own.
            rx: Bytes from the host; they set out on the line one after the other, 53 in a control period.
            sensors: What the drivers read.
            motors: The battery.
            ground: Not looked at.

        Returns:
            What the firmware has sent: whole frames, and what a reset has cut short. Of a frame that is still on its way at
            the end of the period the bytes come with the rest of it.

        Raises:
            RuntimeError: The processor has crashed.
        """
        self._io.counts = (
            sensors.eye_left,
            sensors.eye_right,
            sensors.floor_left,
            sensors.floor_right,
            battery_counts(motors.voltage),
        )
        self._io.closed = (sensors.arm_left, sensors.arm_right)
        return self._period(rx)
