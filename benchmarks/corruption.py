"""How often heavier damage than three bits gets past the checksum: per million frames, by the host's codec and by the firmware.

Run `python benchmarks/corruption.py [--frames N]`. The payload of one JUNIOR_WHEELS frame is damaged in each of several
ways. A 16-bit checksum lets 1 in 65,536 random patterns through, 15 per million. The polynomial of CRC-16/MCRF4XX has the
factor x + 1, so an odd number of flipped bits is always told, and of the patterns with an even number twice as many pass, 31
per million; a few more or less where few bits are flipped, which the column `expected` has exactly. One, two or three bits
are always told (see tests/integration/test_corruption.py). Behind the checksum stand ranges (the codec refuses a frame
with a value out of range; the firmware takes the frame and refuses the command), target, session and sequence: the last
column counts frames that did turn a wheel of an armed robot.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from math import comb
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np
from fastcrc.crc16 import mcrf4xx

from firmware_protocol.events import Received
from firmware_protocol.messages import Command, CommandLong, JuniorWheels, RobotSession, RobotStatus
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice._host import ffi, lib

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from firmware_protocol.wire.fields import Message

HEADER, TRAILER = 10, 2
BATCH: Final = 10_000
MILLION: Final = 1_000_000
SESSION: Final = 7
PUSH: Final = JuniorWheels(SESSION, 900, (0.5, -0.25), 0.5, 1, 1)
WAYS: Final = ("3 bits", "4 bits", "5 bits", "6 bits", "8 bits", "16 bits", "random payload")


def expected(way: str, frame: bytes) -> float:
    """Share of the damaged frames that pass the checksum, in theory, per million.

    The checksum is linear, so patterns that pass are the words of a code; how many there are of each weight follows
    from the weights of the dual code's 65,536 words (MacWilliams 1963).

    Args:
        way: One of `WAYS`.
        frame: What is damaged.
    """
    bits = way.partition(" ")[0]
    if not bits.isdigit():
        return MILLION / 65536
    body = frame[1:-TRAILER]
    payload = range((HEADER - 1) * 8, len(body) * 8)
    zero = mcrf4xx(bytes(len(body) + 1))
    weights = np.zeros(65536, int)
    for place in payload:
        one = bytearray(len(body) + 1)
        one[place >> 3] = 1 << (place & 7)
        weights += _parity(np.arange(65536) & (mcrf4xx(bytes(one)) ^ zero))
    n, k = len(payload), int(bits)
    words = sum(
        int(count) * sum((-1) ** j * comb(weight, j) * comb(n - weight, k - j) for j in range(k + 1))
        for weight, count in enumerate(np.bincount(weights))
    )
    return float(MILLION * words / 65536 / comb(n, k))


def _parity(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """1 where an odd number of bits is set."""
    for shift in (8, 4, 2, 1):
        values = values ^ (values >> shift)
    return values & 1


def damaged(frame: bytes, way: str, count: int, rng: np.random.Generator) -> Iterator[bytes]:
    """The frame, damaged in so many independent ways, none of which leaves it as it was.

    Args:
        frame: A good frame.
        way: One of `WAYS`.
        count: How many.
        rng: Source of chance.
    """
    good = np.frombuffer(frame, np.uint8)
    span = slice(HEADER, len(frame) - TRAILER)
    bits = way.partition(" ")[0]
    while count > 0:
        size = min(count, BATCH)
        batch = np.tile(good, (size, 1))
        if bits.isdigit():
            batch[:, span] ^= _patterns(size, (len(frame) - HEADER - TRAILER) * 8, int(bits), rng)
        else:
            batch[:, span] = rng.integers(256, size=(size, len(frame) - HEADER - TRAILER), dtype=np.uint8)
        for row in batch[(batch != good).any(axis=1)]:
            yield row.tobytes()
            count -= 1


def _patterns(size: int, places: int, bits: int, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Rows of bytes with exactly so many bits set."""
    chosen = rng.random((size, places)).argpartition(bits, axis=1)[:, :bits]
    flags = np.zeros((size, places), np.uint8)
    np.put_along_axis(flags, chosen, 1, axis=1)
    return np.packbits(flags, axis=1)


class Robot:
    """An armed robot in memory, and how many frames it takes for good."""

    def __init__(self) -> None:
        self._robot = ffi.new("host_robot *")
        self._io: Any = cast("Any", self._robot).io
        ffi.buffer(self._io.nvm)[:] = b"\xff" * 1024
        self._io.battery_mv = 7400
        self._codec = MavlinkCodec(system=255, component=190)
        self._now = self._sent = 0
        lib.host_power_on(self._robot, 0)
        self.send(RobotSession(SESSION, 0, 7, 1, 1, 2, 0))
        self.send(CommandLong(1, 1, Command.ARM_DISARM, param1=1.0, param3=7.0))

    def tick(self, data: bytes) -> bytes:
        """One control period."""
        self._now += 5000
        length = lib.host_tick(self._robot, self._now, data, len(data))
        return bytes(ffi.buffer(self._io.tx, length))

    def send(self, message: Message) -> bytes:
        """Deliver a good message."""
        self._sent += 1
        return self.tick(self._codec.encode(message))

    @property
    def moving(self) -> bool:
        """A wheel is turned on."""
        return bool(self._io.wheel[0] or self._io.wheel[1])

    def good(self) -> int:
        """Frames it has taken for good, but for those sent by `send`."""
        out = self.send(CommandLong(1, 1, Command.REQUEST_MESSAGE, param1=float(RobotStatus.ID)))
        events = MavlinkCodec(system=254, component=1).receive(out, 0.0)
        total = next(one.message.good for one in events if isinstance(one, Received) and isinstance(one.message, RobotStatus))
        return total - self._sent


@dataclass
class Result:
    """What came through."""

    frames: int = 0
    codec: int = 0
    firmware: int = 0
    moved: int = 0


def measure(way: str, frame: bytes, count: int, seed: int) -> Result:
    """Send damaged frames to both ends.

    Args:
        way: One of `WAYS`.
        frame: What is damaged.
        count: How many.
        seed: Seed of the damage.
    """
    result, robot, codec = Result(), Robot(), MavlinkCodec(system=1, component=1)
    for one in damaged(frame, way, count, np.random.default_rng(seed)):
        result.frames += 1
        result.codec += any(isinstance(event, Received) for event in codec.receive(one, result.frames * 0.03))
        robot.tick(one)
        if robot.moving:
            result.moved += 1
            result.firmware += robot.good()
            robot = Robot()
    result.firmware += robot.good()
    return result


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=200_000, help="per kind of damage")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    frame = MavlinkCodec(system=255, component=190).encode(PUSH)
    print(f"{options.frames:,} frames of JUNIOR_WHEELS per kind of damage; accepted per million frames:")
    print(f"{'damage':16}{'expected':>10}{'codec':>10}{'firmware':>10}{'turned a wheel':>16}")
    for way in WAYS:
        result = measure(way, frame, options.frames, options.seed)
        share = MILLION / result.frames
        rates = f"{result.codec * share:10.1f}{result.firmware * share:10.1f}{result.moved * share:16.1f}"
        print(f"{way:16}{expected(way, frame):10.1f}{rates}", flush=True)


if __name__ == "__main__":
    main()
