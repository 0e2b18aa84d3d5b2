"""Several Juniors on one line, each in a ring of its own: one clock, worlds stepped in turn.

Everybody hears what the host says, and what all say goes to the host, as on a bus or behind a radio. Robots can be
unplugged from the line (they live on, and hear nothing) or lose their power, and come back.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM, ROBOT_COMPONENT, ParamSet
from firmware_protocol.wire.can_layout import LAST_NODE
from firmware_protocol.wire.fields import CAN
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.boards import NVM_SIZE
from simdevice.emulation import run_single_periods
from simdevice.junior.device import VirtualDevice
from simdevice.sumo.settings import WorldSettings
from simdevice.sumo.table import Table
from simdevice.sumo.world import junior_world

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.links.memory import Stamped
    from simdevice.sumo.world import World

LAST_SYSTEM: Final = 254
"""Greatest system id of a robot on a MAVLink network."""
NEW_SYSTEM: Final = 1
"""System id of a new robot."""
_STAGGER: Final = 37
_STAGGER_WITHIN: Final = 200
"""Robot n is switched on 37 n control periods after the first, modulo a second: nobody switches ten on in one instant, and
their heartbeats and streams do not come in one burst for ever after."""
_WRITING: Final = 80
"""Control periods in which a parameter is surely in the EEPROM."""


@dataclass
class Member:
    """One robot of a crowd.

    Attributes:
        world: Its ring.
        begins: Control period of the crowd at which it is switched on first.
        plugged: It hears the host, and is heard.
    """

    world: World
    begins: int
    plugged: bool = True


@cache
def image_of(system: int) -> bytes:
    """The EEPROM of a new robot that was given a system id, the way a person does it: SYS_ID set over the wire.

    Args:
        system: The id, 1..254.

    Returns:
        An image of the EEPROM.
    """
    device = VirtualDevice(Table().robot, uid=1)
    host = MavlinkCodec(system=HOST_SYSTEM, component=HOST_COMPONENT)
    device.step(host.encode(ParamSet(NEW_SYSTEM, ROBOT_COMPONENT, "SYS_ID", float(system))))
    for _ in range(_WRITING):
        device.step(b"")
    return device.nvm


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
        most = LAST_NODE if self.wire == CAN else LAST_SYSTEM
        if not 1 <= count <= most:
            raise ValueError(f"1 to {most} robots can share this line, not {count}")
        if nvm is not None and len(nvm) != count * NVM_SIZE:
            raise ValueError(f"the EEPROMs of {count} robots hold {count * NVM_SIZE} bytes, the image {len(nvm)}")
        self._ticks = 0
        self._orders: deque[Callable[[], None]] = deque()
        self.members: dict[int, Member] = {}
        for number in range(count):
            system = NEW_SYSTEM + number
            image = nvm[number * NVM_SIZE : (number + 1) * NVM_SIZE] if nvm is not None else None
            if image is None and system != NEW_SYSTEM:
                image = image_of(system)
            world = junior_world(replace(settings, seed=settings.seed + number, nvm=image))
            self.members[system] = Member(world, number * _STAGGER % _STAGGER_WITHIN)

    @property
    def nvm(self) -> bytes:
        """Images of all EEPROMs, one after the other."""
        return b"".join(member.world.nvm for member in self.members.values())

    def now(self) -> float:
        """Time of the emulation, in s."""
        return self._ticks * self.period

    def run(self, inbound: bytes, periods: int) -> list[Stamped]:
        """Live for at most so many control periods, until somebody sends something; see `Emulation.run`."""
        return run_single_periods(self, inbound, periods)

    def step(self, inbound: bytes) -> bytes:
        """One control period for everybody.

        Args:
            inbound: Bytes from the host that have arrived by now.

        Returns:
            Everything sent to the host in this period.
        """
        while self._orders:
            self._orders.popleft()()
        sent = []
        for member in self.members.values():
            if self._ticks < member.begins:
                continue
            out = member.world.step(inbound if member.plugged else b"")
            if member.plugged and out:
                sent.append(out)
        self._ticks += 1
        return b"".join(sent)

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
