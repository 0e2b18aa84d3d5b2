"""Micro-robots that run the C firmware, on their table, and the networks they are on: all on one clock."""

from __future__ import annotations

import math
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import BoxShape, Reason, TableKind, TableState
from firmware_protocol.messages.table import THE_BOX, THE_GOAL
from simdevice.boards import board_host
from simdevice.emulation import check_periods
from simdevice.junior.faults import DeviceFaults
from simdevice.kernel.swarm import MicroBoard, SwarmArrays
from simdevice.swarm.bodies import make_way
from simdevice.swarm.component import TableComponent
from simdevice.swarm.eeprom import image_of
from simdevice.swarm.hub import NEVER, Hub
from simdevice.swarm.noise import stream
from simdevice.swarm.rooms import NAMES, built_in
from simdevice.swarm.settings import SwarmSettings
from simdevice.swarm.table import SwarmTable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.links.memory import Stamped
    from firmware_protocol.messages import TablePlace, TableReset
    from simdevice.kernel.swarm import Life
    from simdevice.swarm.rooms import Room

RANGER: Final = 0
WILD: Final = 1
_STAGGER: Final = 37
_STAGGER_WITHIN: Final = 200
"""Row n is switched on 37 n control periods after the first, modulo a second: nobody switches many on in one instant, and
their heartbeats do not come in one burst for ever after."""
_IDENTITY: Final = 100
"""What the stream of random numbers is for that unique ids come from."""
SETTING_UP: Final = 1.0
"""For so long after TABLE_RESET, a robot that has not been placed yet is in nobody's way, in s: where the others come to stand
does not depend on who is placed first."""
_BATTERY: Final = 3700
"""Voltage of a robot's battery, in mV."""
_BOXES: Final = {BoxShape.NONE: None, BoxShape.CYLINDER: "cylinder", BoxShape.CUBE: "cube"}


class SwarmWorld:
    """Robots on a table, with their firmware, and the table's own component. It is a `Clock`.

    It lives for all its networks at once (`run_networks`); where there is one only, as any `Emulation`, too. Whatever is done
    to a robot from outside takes effect at the next control period; it may be asked for in any thread. Rows, and which network
    has which, are as in `SwarmSettings`.

    Args:
        settings: What it begins with; None are the defaults.

    Attributes:
        settings: Likewise.
        period: One control period, in s.
        wire: What goes in and out.
        networks: Number of networks.
        table: What the robots stand on.
        arrays: The robots, in the kernel.

    Raises:
        ValueError: There is no room on the table for so many robots.
    """

    def __init__(self, settings: SwarmSettings | None = None) -> None:
        self.settings = settings = settings if settings is not None else SwarmSettings()
        self.period, self.wire, self.networks = settings.period, settings.wire, settings.networks
        groups = [RANGER] * settings.rangers + [WILD] * settings.wilds
        self.table = SwarmTable(groups, profile=settings.profile, period=settings.period, occlusion=settings.occlusion)
        self._room = settings.rooms[0] if settings.rooms else None
        self.table.reset(settings.seed, size=settings.size, wall=settings.wall, room=self._room)
        self.table.resets = 0
        uid = int(stream(settings.seed, 0, _IDENTITY).integers(1, 2**62))
        ids = [row % settings.per + 1 for row in range(settings.count)]
        self.arrays = SwarmArrays(
            board_host(),
            self.table.arrays,
            [
                MicroBoard(uid + row, image_of(system, group))
                for row, (system, group) in enumerate(zip(ids, groups, strict=True))
            ],
            [min(network * settings.per, settings.count) for network in range(settings.networks + 1)],
            wire=settings.wire,
            full_speed=settings.profile.full_speed,
            track=settings.profile.track,
            period=settings.period,
            fixes=settings.fixes,
            ring=settings.ring,
        )
        self.arrays.battery[:] = _BATTERY
        self.components = [
            TableComponent(self, network, wire=settings.wire, period=settings.period) for network in range(settings.networks)
        ]
        self._hubs = [Hub(self.arrays, network, settings.period) for network in range(settings.networks)]
        faults = settings.faults
        self._faults = DeviceFaults(faults, self, settings.period) if faults is not None and faults.of_device else None
        self._orders: deque[Callable[[], None]] = deque()
        self._ticks = 0
        self._set_up_at = NEVER
        self._starts = sorted(((row * _STAGGER % _STAGGER_WITHIN, row) for row in range(settings.count)), reverse=True)

    # --- time -------------------------------------------------------------------------------------------------------

    def now(self) -> float:
        """Time of the emulation, in s."""
        return self._ticks * self.period

    def run(self, inbound: bytes, periods: int) -> list[Stamped]:
        """Live for at most so many control periods, until somebody sends something; see `Emulation.run`.

        Raises:
            ValueError: It is asked for no period at all, or there are several networks.
        """
        if self.networks != 1:
            raise ValueError(f"there are {self.networks} networks: let them live together (run_networks)")
        said = self.run_networks([inbound], periods)
        return [(self.now(), said[0])] if said else []

    def step(self, inbound: bytes) -> bytes:
        """One control period for everybody, where there is one network.

        Args:
            inbound: Bytes from the host that have arrived by now.

        Returns:
            Everything sent to the host in this period.
        """
        return b"".join([data for _, data in self.run(inbound, 1)])

    def run_networks(self, inbound: Sequence[bytes], periods: int) -> list[bytes]:
        """Live for at most so many control periods, until somebody sends something on any network.

        It may return with nothing sent before the time is over; who waits asks again.

        Args:
            inbound: For each network, bytes from the host that have arrived by now.
            periods: How many, 1 or more.

        Returns:
            What has been sent in the last of them, by network; nothing where nobody has sent anything.

        Raises:
            ValueError: It is asked for no period at all.
        """
        check_periods(periods)
        while self._orders:
            self._orders.popleft()()
        answers = [self._receive(network, data) for network, data in enumerate(inbound)]
        end = self._ticks + (1 if any(answers) else periods)
        while True:
            self._switch_on_whose_time_has_come()
            life = self._live(end)
            said = self._with_table(life, answers)
            if said or life.rebooted or self._ticks >= end:
                return said

    def _receive(self, network: int, data: bytes) -> bytes:
        """Take what has come on a network; returns what the table answers."""
        for_table = self._hubs[network].take(data, self._ticks)
        return self.components[network].receive(for_table, self.now()) if for_table else b""

    def _live(self, end: int) -> Life:
        """Live until somebody says something, or something is due, or the end."""
        due = [component.due for component in self.components] + [hub.due for hub in self._hubs]
        starts = [at for at, _ in self._starts[-1:]]
        quiet = [self._ticks + self._befall(self._faults)] if self._faults is not None else []
        if self._ticks >= self._set_up_at:
            self._all_solid()
        until = max(self._ticks + 1, min([end, *due, *starts, *quiet, self._set_up_at]))
        since = self._ticks
        while True:
            if self.table.arrays.struct.wanting:
                self.table.refill()
            life = self.arrays.run(until - self._ticks)
            self._ticks += life.periods
            if life.touched:
                self._changed()
            if life.said or life.rebooted or life.touched or self._ticks >= until:
                if self._faults is not None:
                    self._faults.skip(self._ticks - since - 1)
                return life

    def _with_table(self, life: Life, answers: list[bytes]) -> list[bytes]:
        """What is said on each network: by robots, by the table when asked, and of itself."""
        of_table = [
            answer + component.say(self._ticks) if self._ticks >= component.due else answer
            for component, answer in zip(self.components, answers, strict=True)
        ]
        if not any(of_table):
            return life.said
        if not life.said:
            return of_table
        return [words + more for words, more in zip(life.said, of_table, strict=True)]

    def _switch_on_whose_time_has_come(self) -> None:
        """Switch on who is switched on in this control period, the first time."""
        while self._starts and self._starts[-1][0] <= self._ticks:
            self.arrays.switch_on(self._starts.pop()[1])

    # --- faults -----------------------------------------------------------------------------------------------------

    def _befall(self, faults: DeviceFaults) -> int:
        """What goes wrong with the first robot in the next control period. Returns for how many at least it stays like that."""
        faults.advance()
        self.table.arrays.gain[:2] = faults.effort
        if faults.dark and self.arrays.running[0]:
            self.arrays.switch_off(0)
        if faults.restored:
            self.arrays.switch_on(0)
        return faults.quiet() + 1

    def feed(self, voltage: float | None) -> None:
        """Have the first robot's battery give another voltage, in V; None is its own again."""
        self.arrays.battery[0] = _BATTERY if voltage is None else round(voltage * 1e3)

    # --- from outside ---------------------------------------------------------------------------------------------------

    @property
    def nvm(self) -> bytes:
        """Images of all EEPROMs by row, one after the other."""
        return b"".join(map(self.arrays.nvm, range(self.settings.count)))

    def row(self, system: int, network: int = 1) -> int:
        """Which row a robot was put in.

        Args:
            system: The id that it was made with.
            network: Its network, from 1.

        Raises:
            ValueError: There is no such robot.
        """
        row = (network - 1) * self.settings.per + system - 1
        if not (1 <= network <= self.networks and 1 <= system <= self.settings.per and row < self.settings.count):
            raise ValueError(f"there is no robot {network}.{system} on this table")
        return row

    def unplug(self, row: int) -> None:
        """Take a robot off its line: it lives on, hears nothing, and is not heard."""
        self._orders.append(partial(self._set_plugged, row, plugged=False))

    def plug(self, row: int) -> None:
        """Put a robot back on its line; see `unplug`."""
        self._orders.append(partial(self._set_plugged, row, plugged=True))

    def _set_plugged(self, row: int, *, plugged: bool) -> None:
        self.arrays.plugged[row] = plugged

    def switch_off(self, row: int) -> None:
        """Cut a robot's power: its wheels are off, nothing is heard of it, and its EEPROM is kept."""
        self._orders.append(partial(self._switch, row, on=False))

    def switch_on(self, row: int) -> None:
        """Give a robot its power back, if it has none: it boots."""
        self._orders.append(partial(self._switch, row, on=True))

    def _switch(self, row: int, *, on: bool) -> None:
        self._starts = [start for start in self._starts if start[1] != row]
        if not on:
            self.arrays.switch_off(row)
        elif not self.arrays.running[row]:
            self.arrays.switch_on(row)

    # --- what is asked of the table -----------------------------------------------------------------------------------

    def set_up(self, network: int, wanted: TableReset) -> Reason:
        """Set the table up anew; see `TableControl.set_up`."""
        try:
            room = self._room_of(wanted)
        except ValueError:
            return Reason.BAD_VALUE
        boxed = wanted.kind == TableKind.BOX
        size = (wanted.size[0], wanted.size[1])
        if network != 0 or boxed != (wanted.box != BoxShape.NONE) or (not all(size) and (any(size) or room is None)):
            return Reason.BAD_VALUE
        arrays = self.table.arrays  # who is picked up turns no wheel: encoders go on from a whole count
        counted = arrays.counted + (arrays.travel * 1e6).astype(np.int64).astype(np.uint32)
        try:
            self.table.reset(
                wanted.seed,
                size=size if all(size) else None,
                wall=bool(wanted.wall),
                box=_BOXES[BoxShape(wanted.box)],
                room=room,
            )
        except ValueError:
            return Reason.BAD_VALUE
        arrays.counted[:] = counted
        for body in self.table.bodies.robots:
            make_way(body, gives_way=True)
        self._set_up_at = self._ticks + round(SETTING_UP / self.period)
        self._changed()
        return Reason.NONE

    def _all_solid(self) -> None:
        """The table is set up: who was not placed stands where he was put at first."""
        self._set_up_at = NEVER
        self.table.bodies.enter_anew()

    def _room_of(self, wanted: TableReset) -> Room | None:
        """The room that is to stand on the table.

        Raises:
            ValueError: There is none of this number, or none is wanted and it is named, or the other way round.
        """
        if (wanted.kind == TableKind.OBSTACLES) != (wanted.map > 0):
            raise ValueError("a room stands on a table with obstacles, and on no other")
        if wanted.map == 0:
            return None
        if wanted.map <= len(NAMES):
            return built_in(NAMES[wanted.map - 1])
        own = wanted.map - len(NAMES) - 1
        if own >= len(self.settings.rooms):
            raise ValueError(f"there is no room {wanted.map}")
        return self.settings.rooms[own]

    def place(self, network: int, wanted: TablePlace) -> Reason:
        """Pick something up and put it there; see `TableControl.place`."""
        x, y = wanted.position
        try:
            if wanted.system in {THE_BOX, THE_GOAL} and network != 0:
                return Reason.BAD_VALUE
            if wanted.system == THE_BOX:
                self.table.place_box(x, y, wanted.heading)
            elif wanted.system == THE_GOAL:
                self.table.place_goal(x, y)
            else:
                row = self.row(wanted.system, network + 1)
                self.table.place(row, x, y, wanted.heading)
                make_way(self.table.bodies.robots[row], gives_way=False)
                return Reason.NONE
        except ValueError:
            return Reason.BAD_VALUE
        self._changed()
        return Reason.NONE

    def _changed(self) -> None:
        """Have the table's components tell of it at once."""
        for component in self.components:
            component.changed()

    def state(self) -> TableState:
        """What is to be seen of the table."""
        seen = self.table.state()
        x, y, heading = seen.box
        return TableState(
            time=self.now(),
            box=_on_wire((x, y)),
            box_heading=math.remainder(heading, math.tau),
            goal=_on_wire(seen.goal),
            contacts=seen.contacts,
            resets=seen.resets % 2**16,
        )


def _on_wire(point: tuple[float, float]) -> tuple[float, float]:
    """A point as far out as the wire can tell, in m."""
    return max(-32.767, min(32.767, point[0])), max(-32.767, min(32.767, point[1]))
