"""Micro-robots that run the firmware on a table, whole control periods of all of them at a time: see `swarm_loop.h`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol, cast

import numpy as np

from firmware_protocol.parameters import SWARM_PARAMETERS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from simdevice.boards import Host
    from simdevice.swarm.table import SwarmTable

MICRO: Final = 2
"""The role, as in AUTOPILOT_VERSION.product_id."""
SAID: Final = 1
REBOOTED: Final = 2
NOISE: Final = 4
FULL: Final = 8
"""Why a run may end before its time."""
MOST_SAID: Final = 2048
"""Most bytes that a robot says in a control period."""
SPARE_PERIODS: Final = 4
"""So many periods in which all say as much as they can have room in a run, whatever they say."""
SAYS_AT_MOST: Final = 256
"""Pieces that a robot says in a run, at most."""
FULL_BATTERY: Final = 4.0
"""In V."""
NVM_SIZE: Final = 1024
_PLACES: Final[Mapping[str, int]] = {parameter.name: place for place, parameter in enumerate(SWARM_PARAMETERS)}


class LoopLibrary(Protocol):
    """What the kernel and the firmware can do with micro-robots; `swarm_loop.h` and `host.h` tell."""

    def swarm_run(self, swarm: object, periods: int, heed: int) -> int:
        """Live for at most so many control periods."""
        ...

    def host_power_on(self, robot: object, micros: int) -> None:
        """Boot."""
        ...

    def host_store(self, robot: object, parameter: int, value: float) -> None:
        """Put a parameter into non-volatile memory."""
        ...


class Words(NamedTuple):
    """What a robot has said in a control period.

    Attributes:
        row: Which one.
        period: Of the run, from 0.
        data: The bytes.
    """

    row: int
    period: int
    data: bytes


class SwarmLoop:
    """Micro-robots on a table, one for each of its rows, switched off.

    Args:
        host: The build of the firmware and the kernel.
        table: Whereon they stand; it stays whole when it is reset.
        ring: A ring of sensors is fitted.
        pose: They find their position themselves.
        can: They are on CAN buses: what they hear and say are frames of 16 bytes.

    Attributes:
        struct: The struct `kernel_swarm`.
        running: Whether each robot is switched on.
        rebooted: Whether each has reset itself since somebody has looked, and set it to 0.
        voltage: Of each robot's battery, in V.
        stop: Why the last run has ended before its time; 0: it has not.
    """

    def __init__(self, host: Host, table: SwarmTable, *, ring: bool = True, pose: bool = True, can: bool = False) -> None:
        self._ffi = ffi = host.ffi
        self._lib = cast("LoopLibrary", host.lib)
        self._table = table
        self._count = count = table.count
        self._kept: dict[str, Any] = {}
        self._heard: dict[int, bytes] = {}
        self.struct: Any = ffi.new("kernel_swarm *")
        self.struct.table = table.arrays.struct
        self.struct.period_us = round(table.period * 1e6)
        self.struct.full_speed = table.profile.full_speed
        self._robots = [ffi.new("host_robot *") for _ in range(count)]
        self._keep("robot", ffi.new("host_robot *[]", self._robots))
        self._keep("rx", ffi.new("const uint8_t *[]", count))
        self._rx_len = self._array("rx_len", np.uint32, count)
        self._micros = self._array("micros", np.uint64, count)
        self.running = self._array("running", np.uint8, count)
        self.rebooted = self._array("rebooted", np.uint8, count)
        self.voltage = self._array("voltage", np.float64, count)
        self.voltage[:] = FULL_BATTERY
        self.struct.said_size, self.struct.most_pieces = SPARE_PERIODS * MOST_SAID * count, SAYS_AT_MOST * count
        self._said = self._array("said", np.uint8, self.struct.said_size)
        self._at, self._len, self._row, self._period = (
            self._array(name, np.uint32, self.struct.most_pieces) for name in ("said_at", "said_len", "said_row", "said_period")
        )
        self._array("near_group", np.uint8, count)
        self._array("near_bearing", np.uint16, count)
        self._array("near_um", np.uint32, count)
        for robot in self._robots:
            io = robot.io
            io.role, io.has_ring, io.has_pose, io.can = MICRO, ring, pose, can
            io.full_speed = round(table.profile.full_speed * 1e3)
            io.track_um = round(table.profile.track * 1e6)
            ffi.buffer(io.nvm)[:] = b"\xff" * NVM_SIZE

    def _keep(self, name: str, what: Any) -> None:  # noqa: ANN401 - cffi's own
        self._kept[name] = what
        setattr(self.struct, name, what)

    def _array(self, name: str, kind: type[Any], size: int) -> NDArray[Any]:
        array = np.zeros(size, kind)
        names = {np.uint8: "uint8_t[]", np.uint16: "uint16_t[]", np.uint32: "uint32_t[]", np.uint64: "uint64_t[]"}
        self._keep(name, self._ffi.from_buffer(names.get(kind, "double[]"), array))
        return array

    @property
    def stop(self) -> int:
        """Why the last run has ended before its time; 0: it has not."""
        return int(self.struct.stop)

    def store(self, row: int, **parameters: float) -> None:
        """Put parameters into a robot's non-volatile memory, while it is switched off.

        Args:
            row: Which one.
            parameters: Values by name.
        """
        for name, value in parameters.items():
            self._lib.host_store(self._robots[row], _PLACES[name], value)

    def power_on(self, rows: Sequence[int] | None = None) -> None:
        """Cut the power of these robots, or of all, and give it back."""
        for row in range(self._count) if rows is None else rows:
            robot = self._robots[row]
            robot.io.battery_mv = int(self.voltage[row] * 1e3)
            self._lib.host_power_on(robot, 0)
            self._micros[row] = 0
            self.running[row] = 1

    def power_off(self, row: int) -> None:
        """Cut the power of one: its wheels stand, and it says nothing."""
        self.running[row] = 0

    def nvm(self, row: int) -> bytes:
        """Image of a robot's EEPROM."""
        return bytes(self._ffi.buffer(self._robots[row].io.nvm))

    def hear(self, row: int, data: bytes) -> None:
        """Let a robot hear something in the next control period, after what it is to hear already.

        Args:
            row: Which one.
            data: What is for it, or for all.
        """
        data = self._heard.get(row, b"") + data
        self._heard[row] = data
        pointer = self._ffi.from_buffer("uint8_t[]", data)
        self._kept[f"rx {row}"] = pointer
        self.struct.rx[row] = pointer
        self._rx_len[row] = len(data)

    def run(self, periods: int, heed: int = 0) -> int:
        """Live for at most so many control periods.

        Args:
            periods: How many.
            heed: It ends after the first in which one of these happens: SAID, REBOOTED.

        Returns:
            How many it were; fewer where `stop` says why.
        """
        self._table.look_after_noise()
        done = self._lib.swarm_run(self.struct, periods, heed)
        if done:
            self._heard.clear()
        self._table.look_after_noise()
        return done

    def words(self) -> Iterator[Words]:
        """What was said in the last run, by period, then by row."""
        for piece in range(self.struct.pieces):
            at = int(self._at[piece])
            data = self._said[at : at + int(self._len[piece])].tobytes()
            yield Words(int(self._row[piece]), int(self._period[piece]), data)
