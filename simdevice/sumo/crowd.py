"""Several Juniors on one line, each in a ring of its own: one clock, worlds stepped in turn.

Everybody hears what the host says, and what all say goes to the host, as on a bus or behind a radio. Robots can be
unplugged from the line (they live on, and hear nothing) or lose their power, and come back.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from firmware_protocol.wire.can.layout import LAST_NODE
from firmware_protocol.wire.fields import CAN
from simdevice.boards import NVM_SIZE
from simdevice.emulation import check_periods, run_single_periods
from simdevice.kernel.arrays import MANY, Arrays
from simdevice.kernel.world import KernelWorld
from simdevice.sumo.eeprom import NEW_SYSTEM, image_of
from simdevice.sumo.settings import WorldSettings
from simdevice.sumo.world import World

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.links.memory import Stamped

LAST_SYSTEM: Final = 254
"""Greatest system id of a robot on a MAVLink network."""
_STAGGER: Final = 37
_STAGGER_WITHIN: Final = 200
"""Robot n is switched on 37 n control periods after the first, modulo a second: nobody switches ten on in one instant, and
their heartbeats and streams do not come in one burst for ever after."""


@dataclass
class Member:
    """One robot of a crowd.

    Attributes:
        number: Which it is, from 0.
        world: Its ring.
        begins: Control period of the crowd at which it is switched on first.
        plugged: It hears the host, and is heard.
    """

    number: int
    world: World
    begins: int
    plugged: bool = True


class Crowd:
    """Juniors with system ids (on CAN: node ids) 1 to N. It is a `Clock`, and what a link or server can step.

    The first robot lives as it would alone with the same seed; robot n has the seed that many further on. Whatever is done
    to a robot from outside takes effect at the next control period; it may be asked for in any thread.

    Args:
        count: How many.
        settings: What each begins with; `nvm` holds their images one after the other. None are the defaults.

    Attributes:
        period: One control period, in s.
        members: The robots by the id they were made with.
        wire: What goes in and out.

    Raises:
        ValueError: So many can't share a line, there is no opponent of this name, or the images have a wrong size.
    """

    def __init__(self, count: int, settings: WorldSettings | None = None) -> None:
        settings = settings if settings is not None else WorldSettings()
        self.period, self.wire = settings.period, settings.wire
        nvm = settings.nvm
        if settings.vary or settings.conditions.delay:
            raise ValueError("several robots share one line, which has no delay: conditions vary for one robot alone")
        most = LAST_NODE if self.wire == CAN else LAST_SYSTEM
        if not 1 <= count <= most:
            raise ValueError(f"1 to {most} robots can share this line, not {count}")
        if nvm is not None and len(nvm) != count * NVM_SIZE:
            raise ValueError(f"the EEPROMs of {count} robots hold {count * NVM_SIZE} bytes, the image {len(nvm)}")
        self._stepped = 0
        self._orders: deque[Callable[[], None]] = deque()
        self.members: dict[int, Member] = {}
        self._arrays = Arrays(count) if settings.board is None and settings.host is None else None
        for number in range(count):
            system = NEW_SYSTEM + number
            image = nvm[number * NVM_SIZE : (number + 1) * NVM_SIZE] if nvm is not None else None
            if image is None and system != NEW_SYSTEM:
                image = image_of(system)
            own = replace(settings, seed=settings.seed + number, nvm=image)
            world = World(own) if self._arrays is None else KernelWorld(own, self._arrays, number)
            self.members[system] = Member(number, world, number * _STAGGER % _STAGGER_WITHIN)
        self._waiting = sorted(self.members.values(), key=lambda member: -member.begins)
        if self._arrays is not None:
            for member in self._waiting:
                self._arrays.loop.living[member.number] = 0

    @property
    def nvm(self) -> bytes:
        """Images of all EEPROMs, one after the other."""
        return b"".join(member.world.nvm for member in self.members.values())

    @property
    def _ticks(self) -> int:
        """Control periods that the first robot has lived for."""
        return int(self._arrays.loop.ticks[0]) if self._arrays is not None else self._stepped

    def now(self) -> float:
        """Time of the emulation, in s."""
        return self._ticks * self.period

    def run(self, inbound: bytes, periods: int) -> list[Stamped]:
        """Live for at most so many control periods, until somebody sends something; see `Emulation.run`."""
        if self._arrays is None:
            return run_single_periods(self, inbound, periods)
        check_periods(periods)
        end = self._ticks + periods
        while True:
            self._obey()
            now = self._ticks
            self._switch_on_whose_time_has_come(now)
            until = min(end, self._waiting[-1].begins) if self._waiting else end
            said = self._arrays.live(inbound, min(until - now, MANY))
            if said:
                return [(self.now(), said)]
            if self._ticks < until or until == end:
                return []
            inbound = b""

    def step(self, inbound: bytes) -> bytes:
        """One control period for everybody.

        Args:
            inbound: Bytes from the host that have arrived by now.

        Returns:
            Everything sent to the host in this period.
        """
        if self._arrays is not None:
            return b"".join([data for _, data in self.run(inbound, 1)])
        self._obey()
        self._switch_on_whose_time_has_come(self._stepped)
        sent = []
        for member in self.members.values():
            if member.begins > self._stepped:
                continue
            out = member.world.step(inbound if member.plugged else b"")
            if member.plugged and out:
                sent.append(out)
        self._stepped += 1
        return b"".join(sent)

    def _obey(self) -> None:
        """Do as was asked from outside."""
        while self._orders:
            self._orders.popleft()()

    def _switch_on_whose_time_has_come(self, now: int) -> None:
        """Let time begin for those who are switched on in this control period."""
        while self._waiting and self._waiting[-1].begins <= now:
            member = self._waiting.pop()
            if self._arrays is not None:
                self._arrays.loop.living[member.number] = 1

    def unplug(self, system: int) -> None:
        """Take a robot off the line: it lives on and hears nothing.

        Args:
            system: The id it was made with.
        """
        self._order(self.members[system], plugged=False)

    def plug(self, system: int) -> None:
        """Put a robot back on the line; see `unplug`."""
        self._order(self.members[system], plugged=True)

    def _order(self, member: Member, *, plugged: bool) -> None:
        def carry_out() -> None:
            member.plugged = plugged
            if self._arrays is not None:
                self._arrays.loop.plugged[member.number] = plugged

        self._orders.append(carry_out)

    def switch_off(self, system: int) -> None:
        """Cut a robot's power.

        Args:
            system: The id it was made with.
        """
        self._orders.append(self.members[system].world.switch_off)

    def switch_on(self, system: int) -> None:
        """Give a robot its power back: it boots; see `switch_off`."""
        self._orders.append(self.members[system].world.switch_on)

    def lift(self, system: int) -> None:
        """Hold a robot up, and who is in the ring with it; see `World.lift`.

        Args:
            system: The id it was made with.
        """
        self._orders.append(self.members[system].world.lift)

    def put_down(self, system: int) -> None:
        """Put it back; see `lift`."""
        self._orders.append(self.members[system].world.put_down)
