"""The kernel's arrays of micro-robots that run their firmware on a table, and its loop over all of them: see `swarm_loop.h`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol, cast

import numpy as np

from firmware_protocol.messages import MESSAGES
from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.roles.swarm_table import table_system
from firmware_protocol.wire.fields import CAN, Direction
from firmware_protocol.wire.mavlink_layout import crc_extra, target_offsets

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from simdevice.boards import Host
    from simdevice.kernel.table import TableArrays

MANY: Final = 2**24 - 1
"""Control periods: the most that can be asked of the loop at a time."""
_WHY: Final = 56
_LIVED: Final = 32
_LENGTH: Final = 2**32 - 1
"""Where in the loop's answer it says why it came back, and how many periods were lived; what of it are bytes said."""
_WORDS: Final = 2048
"""Bytes that a robot says at most in a control period."""
_LEAST_FRAME: Final = {True: 16, False: 12}
"""Length of the shortest frame, on CAN or not."""
_EACH: Final[Mapping[str, type]] = {
    "micros": np.uint64,
    "running": np.uint8,
    "plugged": np.uint8,
    "system": np.uint8,
    "battery": np.uint16,
    "rx_at": np.uint32,
    "rx_length": np.uint32,
    "next_of": np.uint32,
    "seen_group": np.uint8,
    "seen_bearing": np.uint16,
    "seen_um": np.uint32,
}
"""Type of the value that each robot has in an array."""


class SwarmLibrary(Protocol):
    """What the kernel can do with robots on a table; `swarm_loop.h` tells."""

    ROUTE_SENDERS: int
    SWARM_REBOOTED: int
    SWARM_TOUCHED: int

    def swarm_cut(self, route: object, data: bytes, length: int) -> int:
        """Cut bytes into frames."""
        ...

    def swarm_wanted(self, loop: object, route: object, network: int) -> int:
        """How much room the frames take where they arrive."""
        ...

    def swarm_deliver(self, loop: object, route: object, network: int, data: bytes) -> None:
        """Hand them out."""
        ...

    def swarm_pass(self, loop: object, network: int, data: bytes, length: int) -> None:
        """Hand bytes to the only robot of a network."""
        ...

    def swarm_power_on(self, loop: object, row: int) -> None:
        """Give a robot its power."""
        ...

    def swarm_power_off(self, loop: object, row: int) -> None:
        """Take it away."""
        ...

    def swarm_run(self, loop: object, periods: int) -> int:
        """Live for at most so many control periods."""
        ...


class MicroBoard(NamedTuple):
    """What is set of a robot's board before it boots.

    Attributes:
        uid: Unique id burnt into it.
        nvm: Image of its EEPROM.
    """

    uid: int
    nvm: bytes


class Life(NamedTuple):
    """What came of some control periods.

    Attributes:
        periods: How many it were.
        said: What each network's robots have said in the last of them.
        rebooted: Somebody has reset itself.
        touched: Others touch the box now, of the first 16 rows.
    """

    periods: int
    said: list[bytes]
    rebooted: bool
    touched: bool


class SwarmArrays:
    """Robots with their firmware, by row, and the loop that lets them live. They have no power at first.

    Args:
        host: The build of the firmware and the kernel.
        table: The table that they stand on.
        boards: Their boards.
        first: The first row of each network, and once more the number of robots.
        wire: What they speak.
        full_speed: Speed of a wheel at full command, in m/s.
        track: Distance between the wheels, in m.
        period: Control period, in s.
        fixes: They find their position themselves.
        ring: A ring of sensors is fitted.

    Attributes:
        loop: The struct `swarm_loop`.
        running: Each robot has power.
        plugged: It hears the host, and is heard.
        system: Id that it has on its network.
        battery: Voltage of its battery, in mV.
        micros: Time since its power-on, in us.
    """

    running: NDArray[np.uint8]
    plugged: NDArray[np.uint8]
    system: NDArray[np.uint8]
    battery: NDArray[np.uint16]
    micros: NDArray[np.uint64]

    def __init__(
        self,
        host: Host,
        table: TableArrays,
        boards: Sequence[MicroBoard],
        first: Sequence[int],
        *,
        wire: str,
        full_speed: float,
        track: float,
        period: float,
        fixes: bool,
        ring: bool,
    ) -> None:
        self._ffi = ffi = host.ffi
        self.lib = cast("SwarmLibrary", host.lib)
        self._kept: dict[str, Any] = {}
        self.loop: Any = ffi.new("swarm_loop *")
        self._route: Any = ffi.new("swarm_route *")
        self._can = wire == CAN
        self._first = list(first)
        self._table = table
        loop = self.loop
        loop.table, loop.networks, loop.period_us = table.struct, len(first) - 1, round(period * 1e6)
        loop.full_speed = full_speed
        for name, kind in _EACH.items():
            self._lend(loop, name, np.zeros(len(boards), kind))
        self._lend(loop, "number", np.zeros(self.lib.ROUTE_SENDERS * len(boards), np.uint8))
        self._senders = loop.senders = ffi.new("swarm_senders[]", len(first) - 1)
        self._lend(loop, "first", np.array(first, np.uint32))
        self._ends = self._lend(loop, "end", np.zeros(len(first) - 1, np.uint32))
        self._said = self._lend(loop, "said", np.empty(_WORDS * len(boards), np.uint8))
        self._room = 0
        self._make_room(1 << 16)
        self._describe_wire(wire)
        self._robots = loop.robot = ffi.new("host_robot[]", len(boards))
        for row, board in enumerate(boards):
            io = self._robots[row].io
            io.uid, io.can, io.role = board.uid, self._can, MICRO_ROBOT.product
            io.has_encoders, io.has_pose, io.has_ring = 1, fixes, ring
            io.full_speed, io.track_um = round(full_speed * 1e3), round(track * 1e6)
            ffi.buffer(io.nvm)[:] = board.nvm
        self.plugged[:] = 1

    def _lend(self, struct: Any, name: str, array: NDArray[Any]) -> NDArray[Any]:  # noqa: ANN401 - a struct of cffi
        """Have a pointer of a struct point to an array, which is kept; those of the robots are attributes."""
        kinds = {1: "uint8_t[]", 2: "uint16_t[]", 4: "uint32_t[]", 8: "uint64_t[]"}
        self._kept[name] = array
        setattr(struct, name, self._ffi.from_buffer(kinds[array.itemsize], array))
        if name in _EACH:
            setattr(self, name, array)
        return array

    def _describe_wire(self, wire: str) -> None:
        """Tell the router which messages there are, and what the shortest frame is."""
        route = self._route
        route.can, route.table_system = self._can, table_system(wire)
        down = [message for message in MESSAGES.values() if message.DIRECTION is not Direction.UP]
        targets = [target_offsets(message)[0] for message in down]
        route.kinds = len(down)
        self._lend(route, "kind_id", np.array([message.ID for message in down], np.uint16))
        self._lend(route, "kind_seed", np.array([crc_extra(message) for message in down], np.uint8))
        self._lend(route, "kind_system_at", np.array([255 if at is None else at for at in targets], np.uint8))
        self._make_frames(1 << 14)

    def _make_frames(self, length: int) -> None:
        """Have room for the frames of so many bytes."""
        self._longest = length
        most = length // _LEAST_FRAME[self._can] + 1
        self._frame_at = self._lend(self._route, "frame_at", np.empty(most, np.uint32))
        self._frame_length = self._lend(self._route, "frame_length", np.empty(most, np.uint32))
        self._frame_to = self._lend(self._route, "frame_to", np.empty(most, np.uint8))

    def _make_room(self, length: int) -> None:
        """Have room where things arrive; what is there is kept."""
        if length <= self._room:
            return
        self._room = 2 * length
        arrived = np.zeros(self._room, np.uint8)
        if (before := self._kept.get("arrived")) is not None:
            arrived[: len(before)] = before
        self._lend(self.loop, "arrived", arrived)

    @property
    def bad(self) -> int:
        """Bytes so far that were in no good frame, and went to nobody."""
        return int(self._route.bad)

    def take(self, network: int, data: bytes) -> tuple[int, bytes]:
        """Cut bytes into frames, and hand each to those it is for: it arrives in the next control period.

        Args:
            network: On which network, from 0.
            data: What has come; it begins where a frame may begin.

        Returns:
            How many bytes are done with: what follows may be the beginning of a frame; and the frames for the table.
        """
        if len(data) > self._longest:
            self._make_frames(2 * len(data))
        lib, route = self.lib, self._route
        done = lib.swarm_cut(route, data, len(data))
        if route.frames and self._first[network + 1] - self._first[network] > 1:
            self._make_room(lib.swarm_wanted(self.loop, route, network))
            lib.swarm_deliver(self.loop, route, network, data)
        if not route.for_table:
            return done, b""
        mine = np.flatnonzero(self._frame_to[: route.frames] == route.table_system)
        starts, lengths = self._frame_at[mine].tolist(), self._frame_length[mine].tolist()
        return done, b"".join([data[at : at + length] for at, length in zip(starts, lengths, strict=True)])

    def pass_on(self, network: int, data: bytes) -> None:
        """Hand bytes as they are to the only robot of a network; to several nothing is handed like that."""
        if self._first[network + 1] - self._first[network] == 1:
            self._make_room(self.loop.arrived_length + len(data))
            self.lib.swarm_pass(self.loop, network, data, len(data))

    def run(self, periods: int) -> Life:
        """Live for at most so many control periods, until somebody says something, has rebooted, or needs noise."""
        why = self.lib.swarm_run(self.loop, min(periods, MANY))
        lived, reason = why >> _LIVED & MANY, why >> _WHY
        lib, said = self.lib, self._words() if why & _LENGTH else []
        return Life(lived, said, bool(reason & lib.SWARM_REBOOTED), bool(reason & lib.SWARM_TOUCHED))

    def _words(self) -> list[bytes]:
        """What has been said, by network."""
        ends = self._ends.tolist()
        said = self._said[: ends[-1]].tobytes()
        return [said[start:end] for start, end in zip([0, *ends[:-1]], ends, strict=True)]

    def nvm(self, row: int) -> bytes:
        """Image of a robot's EEPROM."""
        return bytes(self._ffi.buffer(self._robots[row].io.nvm)[:])

    def switch_on(self, row: int) -> None:
        """Give a robot its power: it boots."""
        self.lib.swarm_power_on(self.loop, row)

    def switch_off(self, row: int) -> None:
        """Cut a robot's power."""
        self.lib.swarm_power_off(self.loop, row)
