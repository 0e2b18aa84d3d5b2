"""One emulated robot: a board that runs the firmware, wired to a body on the table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.wire.can.layout import NODE_MASK
from firmware_protocol.wire.fields import CAN, MAVLINK
from simdevice.boards import Board
from simdevice.junior.faults import DeviceFaults

if TYPE_CHECKING:
    from firmware_protocol.faults.spec import FaultSpec
    from firmware_protocol.wire.signing import SigningKey
    from simdevice.arena import Piece
    from simdevice.boards import BoardInterface, BoardMaker, Host
    from simdevice.junior.faults import Battery
    from simdevice.junior.hardware import JuniorHardware

SYSTEM_BYTE: Final = {MAVLINK: 5, CAN: 0}
"""Where a frame carries the sender's system id, by wire."""
SYSTEM_MASK: Final = {MAVLINK: 255, CAN: NODE_MASK}
"""The bits of that byte that are the id."""


class VirtualDevice:
    """An emulated Junior: bytes in, one control period, bytes out.

    Args:
        robot: Its hardware on the table.
        uid: Unique id of its board.
        nvm: Image of its EEPROM; None is blank.
        host: Build of the firmware that it runs; None is the one that comes with the package.
        wire: What it speaks: MAVLink, or CAN frames in serial form.
        faults: What goes wrong with it, by its own time from now on; None is nothing.
        board: Makes its board; None is one in this process.
        start_held: The start input is held while it is switched on for the first time, and then let go.

    Attributes:
        others: What its eyes and arms may meet.
        powered: It is switched on.
    """

    def __init__(
        self,
        robot: JuniorHardware,
        *,
        uid: int,
        nvm: bytes | None = None,
        host: Host | None = None,
        wire: str = MAVLINK,
        faults: FaultSpec | None = None,
        board: BoardMaker | None = None,
        start_held: bool = False,
    ) -> None:
        profile = robot.profile
        self._robot = robot
        self._period_us = round(robot.body.period * 1e6)
        self.others: tuple[Piece, ...] = ()
        self._system = 1
        self._wire = wire
        self._faults: DeviceFaults | None = None
        if faults is not None and faults.of_device:
            self._faults = DeviceFaults(faults, self._battery(), robot.body.period)
        if board is not None:
            self._board: BoardInterface = board(uid=uid, nvm=nvm)
        else:
            odometer = profile.ground_odometer
            self._board = Board(
                uid=uid, nvm=nvm, encoders=profile.encoders, ground_odometer=odometer, host=host, can=wire == CAN
            )
        self._micros = 0
        self._fresh = True
        self.powered = True
        self.set_start(go=start_held)
        self.power_cycle()
        self.set_start(go=False)

    @property
    def robot(self) -> JuniorHardware:
        """Its hardware on the table."""
        return self._robot

    @property
    def wheels(self) -> tuple[float, float]:
        """Effort that the firmware commands of the left, right wheel, -1..1; a wheel may give less of it."""
        return self._board.wheel_left / 1000, self._board.wheel_right / 1000

    @property
    def system(self) -> int:
        """System id it uses on the wire, as its frames say."""
        return self._system

    @property
    def nvm(self) -> bytes:
        """Image of its EEPROM: parameters, memory, boot counter."""
        return self._board.nvm

    @property
    def uptime(self) -> float:
        """Time since power-on, in s."""
        return self._micros * 1e-6

    def _battery(self) -> Battery:
        """What feeds its motors."""
        return self._robot.motors

    def set_start(self, *, go: bool) -> None:
        """Switch the start module's signal, as the referee's remote control does."""
        self._board.start = go

    def give_key(self, key: SigningKey) -> None:
        """Give it a signing key, as who holds the board can, and switch it off and on.

        Raises:
            ValueError: The firmware of its board is built without signing.
        """
        if not isinstance(self._board, Board):
            raise ValueError("the firmware of this board is built without signing")  # noqa: TRY004 - the caller's choice
        self._board.give_key(key.secret)
        self.power_cycle()

    def power_cycle(self) -> None:
        """Cut the power and give it back: the EEPROM is kept, clock and encoders start at 0, the wheels are off."""
        self._board.power_on()
        self._begin()

    def _begin(self) -> None:
        """The board has booted."""
        self._robot.motors.power_on()
        self._robot.body.ground = 0.0
        self._micros = 0
        self._fresh = True

    def limit(self, room: int) -> None:
        """Say how much its line takes in the next control period; a board with a line of its own knows better.

        Args:
            room: In bytes.
        """
        if isinstance(self._board, Board):
            self._board.limit(room)

    def switch_off(self) -> None:
        """Cut the power: the wheels are off, nothing is heard, the EEPROM is kept."""
        self.powered = False
        self._robot.motors.command(0, 0)
        self._board.power_off()

    def switch_on(self) -> None:
        """Give the power back, if there is none: it boots."""
        if not self.powered:
            self.powered = True
            self.power_cycle()

    def heard(self, sent: bytes) -> None:
        """Learn its system id from what it says first.

        Args:
            sent: Bytes that it has sent in one control period.
        """
        if self._fresh:
            self._system = sent[SYSTEM_BYTE[self._wire]] & SYSTEM_MASK[self._wire]
            self._fresh = False

    def step(self, inbound: bytes, *, lifted: bool = False) -> bytes:
        """One control period: sensors, firmware, wheels. The physics is stepped by the world afterwards.

        Args:
            inbound: Bytes from the host that have arrived by now.
            lifted: Somebody holds it up: it senses nothing, and its wheels touch nothing.

        Returns:
            Bytes for the host.
        """
        if not self.powered:
            return b""
        robot = self._robot
        board = self._board
        sensors = robot.sensors
        sensors.sample(() if lifted else self.others)
        motors = robot.motors
        faults = self._faults
        if faults is None:
            sent = board.tick(self._micros, inbound, sensors, motors, robot.body.ground)
            left, right = board.wheel_left, board.wheel_right
        else:
            faults.advance()
            if faults.dark:
                motors.command(0, 0)
                board.power_off()
                return b""
            if faults.restored:
                self.power_cycle()
            sent = board.tick(self._micros, inbound, faults.read(sensors), motors, robot.body.ground)
            left, right = faults.wheels(board.wheel_left, board.wheel_right)
        self._micros += self._period_us
        if not lifted:
            motors.command(left, right)
        if sent:
            self.heard(sent)
        if board.reboot:
            board.restart()
            self._begin()
        return sent
