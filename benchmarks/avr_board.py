"""The firmware on an emulated ATmega328P against its host build: simulated seconds per wall second, and clock cycles a period.

Lock-step bouts with everything on but the recorder, as `lockstep_bout.py` plays them; and the boards alone, with nothing around
them, at rest and driving. Of a micro-robot the ATmega328P alone: at rest, and sent from move to move with a fix every 50 ms.

    python benchmarks/avr_board.py [--bouts 10] [--seconds 20] [--rounds 3]
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, cast

import hil
from firmware_protocol.messages import (
    Command,
    CommandLong,
    Heartbeat,
    JuniorWheels,
    RobotAlive,
    RobotSession,
    SwarmFix,
    SwarmMove,
)
from firmware_protocol.vocabulary import Action, Maneuver, MoveOption, Stimulus
from firmware_protocol.wire.mavlink import MavlinkCodec
from hil.sumo.bouts import play
from hil.sumo.ring import open_ring
from simdevice.arena import CONTROL_PERIOD
from simdevice.avr.board import AvrBoard
from simdevice.avr.micro_board import AvrMicroBoard, MicroInputs
from simdevice.boards import Board

if TYPE_CHECKING:
    from simdevice.boards import BoardInterface
    from simdevice.junior.faults import Readings
    from simdevice.junior.motors import Motors

HOST = Heartbeat(type=6, autopilot=8, base_mode=0, custom_mode=0, system_status=4)
MICRO_FULL_SPEED = 0.4
"""Of a micro-robot's wheels, in m/s: BOARD_FULL_SPEED of the firmware's board_micro.h."""


@dataclass
class Still:
    """Sensors that see nothing, and a full battery."""

    eye_left: int = 60
    eye_right: int = 60
    floor_left: int = 120
    floor_right: int = 120
    arm_left: int = 0
    arm_right: int = 0
    voltage: float = 7.5
    travel_left: float = 0.0
    travel_right: float = 0.0


class Simple:
    """Plays the same maneuver always."""

    def choose(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:  # noqa: ARG002
        """Forward, and a turn."""
        return Maneuver((Action.FF, Action.FF, Action.LBRF, Action.MF), period=0.2)


def bouts(board: str, count: int) -> float:
    """Play bouts.

    Returns:
        Simulated seconds per wall second.
    """
    with hil.connect(f"sim://junior?opponent=flat-light&seed=1&board={board}") as junior:
        junior.arm()
        ring, player = open_ring(junior), Simple()
        since, start = junior.now(), perf_counter()
        for _ in play(ring, player, range(1, count + 1)):
            pass
        return (junior.now() - since) / (perf_counter() - start)


def alone(board: BoardInterface, seconds: float, *, driving: bool) -> tuple[float, float, int]:
    """Step a board with nothing around it.

    Returns:
        Simulated seconds per wall second; clock cycles that a period's work took, on average and at most (0: not counted).
    """
    host = MavlinkCodec(system=255, component=190)
    still = Still()
    busy: list[int] = []
    board.power_on()
    start = perf_counter()
    for period in range(round(seconds / CONTROL_PERIOD)):
        say = b""
        if driving and period == 1:
            say = host.encode(RobotSession(1, 0, 7, 1, 1, 2, 0)) + host.encode(
                CommandLong(1, 1, Command.ARM_DISARM, param1=1.0, param3=7.0)
            )
        elif driving and period % 40 == 10:
            say = host.encode(JuniorWheels(1, period, speed=(0.7, -0.7), duration=1.0, target_system=1, target_component=1))
        elif driving and period % 8 == 0:
            say = host.encode(HOST)
        board.tick(round(period * CONTROL_PERIOD * 1e6), say, cast("Readings", still), cast("Motors", still), 0.0)
        if isinstance(board, AvrBoard):
            busy.append(board.busy)
    speed = seconds / (perf_counter() - start)
    return speed, sum(busy) / len(busy) if busy else 0.0, max(busy, default=0)


def micro(seconds: float, *, driving: bool) -> tuple[float, float, int, int]:
    """Step a micro-robot's board; its wheels turn as it says, without slip or delay.

    Returns:
        Simulated seconds per wall second; clock cycles that a period's work took, on average and at most; deepest stack in
        bytes.
    """
    host = MavlinkCodec(system=255, component=190)
    board, around = AvrMicroBoard(uid=1), MicroInputs()
    busy: list[int] = []
    board.power_on()
    start = perf_counter()
    for period in range(round(seconds / CONTROL_PERIOD)):
        around.travel_left += board.wheel_left / 1000 * MICRO_FULL_SPEED * CONTROL_PERIOD
        around.travel_right += board.wheel_right / 1000 * MICRO_FULL_SPEED * CONTROL_PERIOD
        say = b""
        if driving and period == 1:
            say = host.encode(RobotSession(1, 0, 7, 1, 1, 2, 1)) + host.encode(
                CommandLong(1, 1, Command.ARM_DISARM, param1=1.0, param3=7.0)
            )
        elif driving and period % 200 == 10:
            heading, face = (period // 200 % 6) - 3.0, (period // 200 % 5) - 2.0
            say = host.encode(SwarmMove(1, period, heading, 0.08, face, 0.0, 1, 1, 0, 0, 0, int(MoveOption.SENSE)))
        elif driving and period % 10 == 0:
            say = host.encode(SwarmFix(1, (0.0, 0.0), 0.0, 0.02, 1, 1))
        elif driving and period % 8 == 0:
            say = host.encode(RobotAlive(7))
        board.tick(say, around)
        busy.append(board.busy)
    return seconds / (perf_counter() - start), sum(busy) / len(busy), max(busy), board.stack


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bouts", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    print(f"simulated seconds per second, best of {options.rounds}:")
    speeds = {board: max(bouts(board, options.bouts) for _ in range(options.rounds)) for board in ("host", "avr")}
    print(f"  bouts, everything on     host {speeds['host']:7.0f}   avr {speeds['avr']:6.1f}")
    for driving in (False, True):
        name = "driving" if driving else "at rest"
        boards: dict[str, BoardInterface] = {
            "host": Board(uid=1, encoders=False, ground_odometer=False),
            "avr": AvrBoard(uid=1),
        }
        best = {
            key: max(alone(board, options.seconds, driving=driving) for _ in range(options.rounds))
            for key, board in boards.items()
        }
        _, mean, most = best["avr"]
        cycles = f"cycles a period: {mean:.0f} on average, {most} at most"
        print(f"  board alone, {name}     host {best['host'][0]:7.0f}   avr {best['avr'][0]:6.1f}   {cycles}")
    for driving in (False, True):
        name = "driving" if driving else "at rest"
        speed, mean, most, stack = max(micro(options.seconds, driving=driving) for _ in range(options.rounds))
        cycles = f"cycles a period: {mean:.0f} on average, {most} at most; stack {stack} bytes"
        print(f"  micro-robot, {name}                      avr {speed:6.1f}   {cycles}")


if __name__ == "__main__":
    main()
