"""What a swarm costs its host alone: robots whose bytes are made as arrays, in lock-step, on several networks.

Every robot says HEARTBEAT, SYS_STATUS and ROBOT_STATUS once a second, each at a moment of its own, and makes one move after the
other: 80 mm, or with --short ten of 15 mm a second, straight on. Half of a round's moves turn first, each as far as chance
has it, so that observations trickle in. The time inside of these robots is measured, and taken off.

    python benchmarks/swarm_host.py --robots 1000 --networks 4 --seconds 20
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
from time import process_time
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.events import Received
from firmware_protocol.links.gathering import GatheringLink
from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.messages import (
    AutopilotVersion,
    Command,
    CommandAck,
    CommandLong,
    Heartbeat,
    ParamRequestRead,
    ParamValue,
    RobotAck,
    RobotResultAck,
    RobotSession,
    RobotStatus,
    SwarmMove,
    SwarmObservation,
    SwarmSense,
    SysStatus,
)
from firmware_protocol.wire.crc import checksums
from firmware_protocol.wire.mavlink_batch import MavlinkBatchCodec
from firmware_protocol.wire.mavlink_layout import MARKER, crc_extra
from firmware_protocol.wire.rows import ROWS, column, row_bytes, rows_of, rows_of_messages
from hil.bridge.fleet_bridge import FleetBridge
from hil.bridge.networks import Networks
from hil.connecting.connecting_all import GATHER
from hil.swarm.connecting import open_fleet
from hil.swarm.handle import Swarm
from hil.swarm.rounds import SwarmMoves

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.rows import Rows

PERIOD: Final = 0.005
STREAMS: Final = 200
"""Periods between two of a steady message."""


class ArrayRobots:
    """Robots of one network, which answer as arrays; ids from 1.

    Args:
        count: How many.
        seed: Of their turns.

    Attributes:
        spent: Time spent in here, in s.
        period: One control period, in s.
    """

    def __init__(self, count: int, seed: int) -> None:
        self.spent = 0.0
        self.period = PERIOD
        self._ticks = 0
        kinds = (SwarmMove, SwarmSense, RobotResultAck)
        self._codec = MavlinkBatchCodec(system=250, component=1, kinds=kinds)
        self._frame = np.zeros(256, np.int64)
        self._session = np.zeros(256, np.int64)
        self._armed = np.zeros(256, bool)
        self._ends = np.full(256, -1)
        self._sequence = np.zeros(256, np.int64)
        self._systems = np.arange(1, count + 1)
        self._phase = (self._systems * 37) % STREAMS
        self._chance = np.random.default_rng(seed)
        self._out: list[bytes] = []

    def now(self) -> float:
        """Time in s."""
        return self._ticks * PERIOD

    def run(self, inbound: bytes, periods: int) -> list[tuple[float, bytes]]:
        """See `firmware_protocol.links.memory.Runnable`."""
        begun = process_time()
        for _ in range(periods):
            self._ticks += 1
            if inbound:
                self._take(inbound)
                inbound = b""
            self._live()
            if self._out:
                break
        out, self._out = b"".join(self._out), []
        self.spent += process_time() - begun
        return [(self.now(), out)] if out else []

    def step(self, inbound: bytes) -> bytes:
        """See `firmware_protocol.links.memory.Steppable`."""
        return b"".join(data for _, data in self.run(inbound, 1))

    def _say(self, kind: type[Message], rows: Rows, systems: NDArray[np.int64]) -> None:
        """Frames of many robots; no zeros are trimmed but by the last byte, as any MAVLink end may."""
        width = ROWS[kind].itemsize
        frames = np.zeros((len(rows), width + 12), np.uint8)
        frames[:, :10] = (MARKER, width, 0, 0, 0, 0, 1, kind.ID & 255, kind.ID >> 8 & 255, kind.ID >> 16)
        frames[:, 4], frames[:, 5] = self._frame[systems] & 255, systems
        self._frame[systems] += 1
        frames[:, 10:-2] = row_bytes(rows)
        body = frames[:, 10:-2]
        filled = body[:, ::-1] != 0
        length = np.where(filled.any(axis=1), width - filled.argmax(axis=1), 1)
        frames[:, 1] = length
        crc = checksums(frames[:, 1:-2], length + 9, crc_extra(kind))
        each = np.arange(len(rows))
        frames[each, length + 10], frames[each, length + 11] = crc & 255, crc >> 8
        self._out.append(frames[np.arange(width + 12) < (length + 12)[:, None]].tobytes())

    def _tell(self, message: Message, system: int) -> None:
        self._say(type(message), rows_of_messages(type(message), [message]), np.array([system]))

    def _live(self) -> None:
        if (due := self._systems[self._phase == self._ticks % STREAMS]).size:
            count = len(due)
            state = {"base_mode": 128 * self._armed[due], "custom_mode": 1, "type": 10, "mavlink_version": 3}
            self._say(Heartbeat, rows_of(Heartbeat, count, state), due)
            self._say(SysStatus, rows_of(SysStatus, count, {"onboard_control_sensors_health": 0x2000000}), due)
            known = {"time": self.now(), "boot_count": 1, "session": self._session[due], "sequence": self._sequence[due]}
            self._say(RobotStatus, rows_of(RobotStatus, count, known), due)
        ended = np.flatnonzero(self._ends == self._ticks)
        if ended.size:
            self._observe(ended, self._sequence[ended], 1)

    def _observe(self, systems: NDArray[np.int64], sequence: NDArray[np.int64], outcome: int) -> None:
        columns: dict[str, ArrayLike] = {
            "time": self.now(), "session": self._session[systems], "sequence": sequence, "position": (0.1, 0.2), "fix_age": 0.0,
            "heading": 0.3, "radius": 0.3, "radius_before": 0.25, "near": (0, 1), "seen": (3, 1), "outcome": outcome,
        }  # fmt: skip
        self._say(SwarmObservation, rows_of(SwarmObservation, len(systems), columns), systems)

    def _take(self, inbound: bytes) -> None:
        came = self._codec.receive_batches(inbound, self.now())
        for kind in (SwarmMove, SwarmSense):
            batch = came.batches.get(kind)
            if batch is None:
                continue
            systems = batch.rows["target_system"].astype(np.int64)
            sequence = batch.rows["sequence"].astype(np.int64)
            answer: dict[str, ArrayLike] = {
                "message": kind.ID, "session": batch.rows["session"], "sequence": sequence, "target_system": 255,
                "target_component": 190, "result": 0, "reason": 0,
            }  # fmt: skip
            self._say(RobotAck, rows_of(RobotAck, len(systems), answer), systems)
            self._sequence[systems] = sequence
            if kind is SwarmMove:
                turns = np.where(column(SwarmMove, batch.rows, "heading") == 0, 0, self._chance.integers(0, 100, len(systems)))
                drive = np.rint(column(SwarmMove, batch.rows, "distance") / 0.2 / PERIOD).astype(np.int64)
                self._ends[systems] = self._ticks + turns + drive + 1
        for event in came.events:
            if isinstance(event, Received):
                self._answer(event.message)

    def _answer(self, message: Message) -> None:
        match message:
            case RobotSession():
                self._session[message.target_system] = message.session
                self._tell(RobotAck(message.ID, message.session, 0, 255, 190, 0, 0), message.target_system)
            case ParamRequestRead():
                self._tell(ParamValue(message.param_id, 0.0, 9, 20, 3), message.target_system)
            case CommandLong(command=Command.REQUEST_MESSAGE, target_system=0):
                count = np.full(len(self._systems), int(message.param2))
                self._observe(self._systems, count, 0)
            case CommandLong():
                system = message.target_system
                self._tell(CommandAck(message.command, 0, target_system=255, target_component=190), system)
                if message.command == Command.ARM_DISARM:
                    self._armed[system] = bool(message.param1)
                elif message.param1 == AutopilotVersion.ID:
                    self._tell(AutopilotVersion(0, 1, 2 << 24, uid=system, product_id=2), system)
                elif message.param1 == Heartbeat.ID:
                    self._tell(Heartbeat(10, 0, 128 * int(self._armed[system]), 1, 3), system)
            case _:
                pass


def main() -> None:
    """Print what it costs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=1000)
    parser.add_argument("--networks", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=20.0, help="of robot time")
    parser.add_argument("--short", action="store_true", help="ten moves of 15 mm a second, straight on")
    parser.add_argument("--ask", action="store_true", help="ask everybody before each move, as a surround step does")
    parser.add_argument("--profile", action="store_true")
    chosen = parser.parse_args()
    networks = Networks()
    worlds = [ArrayRobots(chosen.robots // chosen.networks, number) for number in range(chosen.networks)]
    swarm = Swarm(networks)
    for number, world in enumerate(worlds):
        sessions = iter(range(1 + 1000 * number, 60000))
        link = GatheringLink(MemoryLink(world, f"memory:{number}"), world, GATHER)
        networks.add(link.url, FleetBridge(link, world, fleet=open_fleet(None), session=sessions.__next__))
    begun = process_time()
    swarm.find(expect=chosen.robots, timeout=20.0)
    print(f"found after {process_time() - begun:.2f} s, of robot time {swarm.now():.2f} s")
    begun = process_time()
    swarm.arm()
    print(f"armed within {process_time() - begun:.2f} s")
    count = len(swarm.addresses_by_row)
    moves = SwarmMoves(np.ones(count, bool), 0.015 if chosen.short else 0.08, heading=0.0 if chosen.short else 1.0)
    profile = cProfile.Profile()
    spent, begun, start, rounds, missing = sum(world.spent for world in worlds), process_time(), swarm.now(), 0, 0
    if chosen.profile:
        profile.enable()
    while swarm.now() < start + chosen.seconds:
        if chosen.ask:
            swarm.observe()
        missing += len(swarm.move(moves).missing)
        rounds += 1
    profile.disable()
    took, robots = process_time() - begun, sum(world.spent for world in worlds) - spent
    host, seconds = took - robots, swarm.now() - start
    print(f"{count} robots, {chosen.networks} networks, {seconds:.1f} s of robot time, {rounds} rounds, {missing} missing")
    print(f"host {host / seconds * 1e3:.1f} ms a second, {host / seconds / count * 1e6:.1f} us a robot and second, ", end="")
    print(f"{host / rounds / count * 1e6:.1f} us a robot and round; robots {robots / seconds * 1e3:.1f} ms a second")
    if chosen.profile:
        pstats.Stats(profile).sort_stats("cumtime").print_stats(75)


if __name__ == "__main__":
    main()
