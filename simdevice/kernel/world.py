"""A world whose control periods run in the kernel, as many in a call as nobody has to look at.

Every byte that it sends, and when, is that of `simdevice.sumo.world.World`, which is its oracle.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from simdevice.emulation import check_periods
from simdevice.kernel.arrays import ANY_ROOM, MANY, Arrays
from simdevice.kernel.device import KernelDevice
from simdevice.kernel.referee import KernelReferee
from simdevice.kernel.ring import KernelRing
from simdevice.sumo.world import World

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.links.memory import Stamped
    from firmware_protocol.wire.signing import Signing
    from simdevice.junior.hardware import JuniorHardware
    from simdevice.sumo.match import Match
    from simdevice.sumo.settings import WorldSettings


class KernelWorld(World):
    """Junior, its opponent and the referee, in the kernel; without a choice of board.

    Who has asked for `match` once sees everything on it move and may move it, at the price of most of the speed. While one
    thread lets it live, others may look at its wheels and do nothing to it.

    Args:
        settings: What it begins with; None are the defaults.
        arrays: The kernel's arrays, where it shares them with others of like settings: who made them lets all live together.
            None: it has its own.
        number: Which of their rings is this one's.

    Attributes:
        period: One control period, in s.
        device: Junior.
        arrays: The kernel's arrays that it is in.
        number: Which of their rings is its own.
        referee: The referee, if any.
        wire: What goes in and out.
        room: Bytes that the line takes in the next control period, as far as whoever serves it knows; None: any number.

    Raises:
        ValueError: There is no opponent of this name, or the image has a wrong size.
    """

    device: KernelDevice

    def __init__(self, settings: WorldSettings | None = None, arrays: Arrays | None = None, number: int = 0) -> None:
        self.arrays = arrays if arrays is not None else Arrays(1)
        self.number = number
        self._clock, self._live = self.arrays.loop.ticks, self.arrays.live if arrays is None else self._not_alone
        super().__init__(settings)
        self.arrays.rings.append(self)
        self._attend()

    @property
    def match(self) -> Match:
        """Bodies and rules, as of now."""
        self._ring.watch()
        return self._match

    def _prepare(self) -> None:
        """Find its place in the kernel's arrays."""
        self._ring = KernelRing(self.arrays, self.number, self._match, self.wire)

    def _make_referee(self, signing: Signing | None) -> KernelReferee:
        """Make the referee, who looks at what the kernel moves."""
        ring = self._ring
        return KernelReferee(self.arrays, self.number, self._match, self._placed, ring.show, wire=self.wire, signing=signing)

    def _make_device(self, robot: JuniorHardware, uid: int, settings: WorldSettings) -> KernelDevice:
        """Make a robot that lives in the kernel."""
        piece = self._ring.first + (robot is not self._match.robot)
        return KernelDevice(
            robot,
            self._ring,
            piece,
            uid=uid,
            nvm=settings.nvm,
            wire=settings.wire,
            faults=settings.faults,
            start_held=settings.start_held,
        )

    def _placed(self) -> None:
        """Everybody has been put down: tell the kernel where."""
        super()._placed()
        self._ring.take()
        if isinstance(self._second, KernelDevice):
            self._second.set_running(running=self._second_plays)
            self.arrays.loop.hosted[self.number] = self.networks > 1
            self._attend()

    def _attend(self) -> None:
        """Have the loop ask before control periods, where faults befall Junior or a second one has a keeper."""
        if (self.device.faulty or (self._second is not None and self.networks == 1)) and self not in self.arrays.attended:
            self.arrays.attended.append(self)

    def begin_bout(self, seed: int, opponent: str | None = None) -> None:
        """Put everybody at a fresh start pose, as its referee does when asked.

        Args:
            seed: Seed of the bout.
            opponent: Another opponent; None keeps the present one.

        Raises:
            ValueError: There is no opponent of this name.
        """
        self._match.reset(seed, opponent)
        self._placed()

    def now(self) -> float:
        """Time of the emulation, in s."""
        return self._clock[self.number] * self.period  # type: ignore[no-any-return]

    def step(self, inbound: bytes) -> bytes:
        """One control period for everything; see `World.step`."""
        return b"".join([data for _, data in self.run(inbound, 1)])

    def run(self, inbound: bytes, periods: int) -> list[Stamped]:
        """Live for at most so many control periods, until something is sent, decided or rebooted; see `Emulation.run`."""
        if not 0 < periods <= MANY:
            check_periods(periods)
            periods = MANY
        if self._late is not None:
            now = self._clock[self.number]
            inbound = self._late.arriving(inbound, now, self._delay)
            periods = self._late.next(now, periods)  # whoever lives with it comes again
        said = self._live(inbound, periods) if self.room is None else self._live_within(self.room, inbound, periods)
        return [(self._clock[self.number] * self.period, said)] if said else []

    def _hold_up(self, periods: int) -> None:
        """Hold the robots up for so many control periods."""
        super()._hold_up(periods)
        self._ring.hold_up(periods)

    def run_networks(self, inbound: Sequence[bytes], periods: int) -> list[bytes]:
        """Live for at most so many control periods, until something is sent on a network; see `World.run_networks`."""
        junior, *second = inbound
        if heard := b"".join(second):
            self._ring.receive(self._ring.first + 1, heard)
        said = b"".join([data for _, data in self.run(junior, periods)])
        return [said, self._ring.said_by_second()]

    def _not_alone(self, _inbound: bytes, _periods: int) -> bytes:
        """What shares its arrays lives with the others."""
        raise RuntimeError("one robot of several can't live alone: let the crowd live")

    def _live_within(self, room: int, inbound: bytes, periods: int) -> bytes:
        """Live, and say no more than this many bytes."""
        self.device.limit(room)
        self.arrays.loop.room[self.number] = max(room, 0)
        said = self._live(inbound, periods)
        self.arrays.loop.room[self.number] = ANY_ROOM
        return said

    # --- what the loop asks now and then -----------------------------------------------------------------------------

    def begin(self) -> int:
        """Control periods begin: faults befall Junior, and a second one hears its keeper.

        Returns:
            How many may pass before this is to be asked again, 1 or more.
        """
        most = self.device.begin()
        if self._keeper.speaking:
            self._ring.receive(self._ring.first + 1, self._keeper.due())
            return 1
        return most

    def skip(self, periods: int) -> None:
        """So many control periods, 1 or more, have passed since."""
        self.device.skip(periods)

    def answer(self, inbound: bytes) -> None:
        """Let the referee look at what has arrived, and see to it that the answer follows."""
        if self.referee is not None:
            self._ring.answer(self.referee.receive(inbound, self.now()))

    def draw(self) -> None:
        """See that both Juniors have noise for a control period."""
        self._ring.draw_all()

    def report(self) -> bytes:
        """What the referee reports; it is due."""
        return self.referee.say(self.now()) if isinstance(self.referee, KernelReferee) else b""
