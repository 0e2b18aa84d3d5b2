"""A world whose control periods run in the kernel, as many in a call as nobody has to look at.

Every byte that it sends, and when, is that of `simdevice.sumo.world.World`, which is its oracle.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.messages import BoutOutcome
from simdevice.boards import board_host
from simdevice.emulation import check_periods
from simdevice.kernel.device import KernelDevice
from simdevice.kernel.rings import Rings
from simdevice.sumo.referee import Referee
from simdevice.sumo.world import World

if TYPE_CHECKING:
    from firmware_protocol.links.memory import Stamped
    from firmware_protocol.wire.signing import Signing
    from simdevice.sumo.settings import WorldSettings
    from simdevice.sumo.table import Robot, Table

_JUNIOR = 0
_SECOND = 1


class KernelWorld(World):
    """Junior, its opponent and the referee, in the kernel; arguments and attributes as of `World`, without a choice of board.

    Who has asked for `table` once sees everything on it move and may move it, at the price of most of the speed. While one
    thread lets it live, others may look at its wheels and do nothing to it.
    """

    device: KernelDevice

    @property
    def table(self) -> Table:
        """Bodies and rules, as of now."""
        self._rings.watch()
        return self._table

    def _prepare(self) -> None:
        """Make the kernel's arrays."""
        self._rings = Rings(board_host(), self._table)

    def _make_referee(self, signing: Signing | None) -> Referee:
        """Make the referee, who looks at what the kernel moves."""
        return Referee(self._table, self._placed, look=self._rings.show, wire=self.wire, signing=signing)

    def _make_device(self, robot: Robot, uid: int, settings: WorldSettings) -> KernelDevice:
        """Make a robot that lives in the kernel."""
        piece = _JUNIOR if robot is self._table.robot else _SECOND
        return KernelDevice(
            robot,
            self._rings,
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
        self._rings.take()
        if isinstance(self._second, KernelDevice):
            self._second.set_running(running=self._keeper.playing)

    def step(self, inbound: bytes) -> bytes:
        """One control period for everything; see `World.step`."""
        return b"".join([data for _, data in self.run(inbound, 1)])

    def run(self, inbound: bytes, periods: int) -> list[Stamped]:
        """Live for at most so many control periods, until something is sent, decided or rebooted; see `Emulation.run`."""
        check_periods(periods)
        if not self._rings.watched:
            return self._run(inbound, periods)
        self._rings.take_robots()
        chunks = self._run(inbound, periods)
        self._rings.show_robots()
        return chunks

    def _run(self, inbound: bytes, periods: int) -> list[Stamped]:
        """The same, where nobody sees the table."""
        rings, device = self._rings, self.device
        referee = self.referee if device.powered else None
        if self.room is not None:
            device.limit(self.room)
        answers = self._arrive(inbound, referee) if inbound else b""
        end = self._ticks + periods
        while True:
            most = end - self._ticks
            if device.faulty:
                most = min(most, device.begin())
            quiet = most
            if referee is not None:
                quiet = 0 if answers else referee.quiet()
                most = min(most, quiet + 1)
            if self._keeper.speaking:
                most = 1
                rings.receive(_SECOND, self._keeper.due())
            done, stop = rings.run(most)
            self._ticks += done
            sent = device.end(done, stop) if stop or device.faulty else b""
            if stop & rings.decided:
                self._table.outcome = BoutOutcome(rings.outcome)
                quiet = 0
            if referee is not None:
                referee.skip(done - (done > quiet))
                if sent:
                    referee.follow(device.system)
                if done > quiet:
                    sent += answers
                    sent += referee.report(self.now(), None if self.room is None else self.room - len(sent))
                    answers = b""
            if sent:
                return [(self._ticks * self.period, sent)]
            if stop or self._ticks >= end:
                return []

    def _arrive(self, inbound: bytes, referee: Referee | None) -> bytes:
        """Take bytes from the host.

        Returns:
            The referee's answers.
        """
        answers = referee.receive(inbound, self.now()) if referee is not None else b""
        self._rings.receive(_JUNIOR, inbound)
        return answers
