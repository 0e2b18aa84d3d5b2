"""What it costs to read and write the messages of many robots: arrays against objects, over MAVLink and over CAN.

Run `python benchmarks/batches.py [--rounds N]`. Decoded is what robots send in 100 ms that make ten moves of 15 mm a second:
an acknowledgement and two observations each. Encoded is what they are sent: a move, and the acknowledgement of its result.
Printed is processor time for one robot's 100 ms, the median of interleaved runs. A MAVLink network has at most 253 robots, a
CAN bus 126: of more there are as many as it takes.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from statistics import median
from time import process_time

import numpy as np

from firmware_protocol.messages import ROBOT_COMPONENT, RobotAck, RobotResultAck, SwarmMove, SwarmObservation
from firmware_protocol.vocabulary import MoveOption, SwarmOutcome
from firmware_protocol.wire.can.batch import CanBatchCodec
from firmware_protocol.wire.codec import Codec, open_codec
from firmware_protocol.wire.fields import CAN, MAVLINK
from firmware_protocol.wire.mavlink_batch import MavlinkBatchCodec
from firmware_protocol.wire.rows import messages_of, rows_of

KINDS = (RobotAck, SwarmObservation)
PLACES = {MAVLINK: 250, CAN: 125}
"""Robots on one network."""
HOST = (255, 190)
Work = Callable[[], object]


def batch_codec(wire: str, system: int, component: int) -> MavlinkBatchCodec | CanBatchCodec:
    """An end that takes and gives arrays."""
    make = CanBatchCodec if wire == CAN else MavlinkBatchCodec
    return make(system=system, component=component, kinds=KINDS)


def said_by(wire: str, count: int, rng: np.random.Generator) -> bytes:
    """What the robots of one network send in 100 ms."""
    said = []
    for system in range(1, count + 1):
        robot: Codec = open_codec(wire, system=system, component=ROBOT_COMPONENT)
        pose = tuple(rng.integers(-1000, 1000, 2) / 1000)
        radius, sectors, near = 0.25, (3, 128), (3, 1)
        for sequence, way, outcome in ((17, 0.015, SwarmOutcome.ARRIVED), (18, 0.0, SwarmOutcome.NONE)):
            observed = SwarmObservation(
                12.345678, 4711, sequence, pose, 1.2345, way, radius, 0.2, sectors, sectors, None, None, None, 0.02, near, near,
                0, outcome, 0,
            )  # fmt: skip
            said.append(robot.encode(observed))
        said.append(robot.encode(RobotAck(SwarmMove.ID, 4711, 17, *HOST, 0, 0)))
    return b"".join(said)


def works(wire: str, robots: int) -> dict[str, tuple[Work, Work]]:
    """What is to be done, with arrays and with objects.

    Args:
        wire: `mavlink` or `can`.
        robots: How many.
    """
    rng = np.random.default_rng(1)
    sizes = [min(PLACES[wire], robots - at) for at in range(0, robots, PLACES[wire])]
    chunks = [said_by(wire, size, rng) for size in sizes]
    arrays = [batch_codec(wire, *HOST) for _ in sizes]
    objects = [open_codec(wire, system=HOST[0], component=HOST[1]) for _ in sizes]
    turns = [rng.uniform(-3, 3, size) for size in sizes]
    options = MoveOption.STOP_ON_CONTACT | MoveOption.SENSE

    def columns(size: int) -> dict[str, object]:
        return {"session": 4711, "sequence": 18, "target_system": np.arange(1, size + 1), "target_component": ROBOT_COMPONENT}

    def decode() -> None:
        for codec, chunk in zip(arrays, chunks, strict=True):
            codec.reset()
            arrived = codec.receive_batches(chunk, 0.0)
            assert not arrived.events

    def decode_objects() -> None:
        for codec, chunk in zip(objects, chunks, strict=True):
            codec.reset()
            codec.receive(chunk, 0.0)

    def encode() -> None:
        for codec, turn in zip(arrays, turns, strict=True):
            asked = {"heading": turn, "distance": 0.015, "options": options} | columns(len(turn))
            codec.encode_batch(SwarmMove, rows_of(SwarmMove, len(turn), asked))  # type: ignore[arg-type]
            codec.encode_batch(RobotResultAck, rows_of(RobotResultAck, len(turn), columns(len(turn))))  # type: ignore[arg-type]

    def encode_objects() -> None:
        for codec, turn in zip(objects, turns, strict=True):
            for system, heading in enumerate(turn.tolist(), 1):
                to = (system, ROBOT_COMPONENT)
                codec.encode(SwarmMove(4711, 18, heading, 0.015, None, 0.0, *to, 0, 0, 0, options))
                codec.encode(RobotResultAck(4711, 17, *to))

    return {"decode": (decode, decode_objects), "encode": (encode, encode_objects)}


def check() -> None:
    """See that both find the same."""
    for wire in (MAVLINK, CAN):
        data = said_by(wire, 50, np.random.default_rng(1))
        found = batch_codec(wire, *HOST).receive_batches(data, 0.0).batches
        events = open_codec(wire, system=HOST[0], component=HOST[1]).receive(data, 0.0)
        for kind, batch in found.items():
            expected = [event.message for event in events if type(getattr(event, "message", None)) is kind]  # type: ignore[union-attr]
            assert messages_of(kind, batch.rows) == expected


def cost(work: Work, times: int) -> float:
    """Processor time of one run, in s."""
    start = process_time()
    for _ in range(times):
        work()
    return (process_time() - start) / times


def main(arguments: list[str] | None = None) -> None:
    """Measure and print.

    Args:
        arguments: Command line without the program's name.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=9, help="interleaved runs (default %(default)s)")
    rounds = parser.parse_args(arguments).rounds
    check()
    print("us of processor time for what one robot sends, or is sent, in 100 ms")
    for wire in (MAVLINK, CAN):
        for robots in (1, 5, 20, 33, 100, 250, 1000):
            for name, (arrays, objects) in works(wire, robots).items():
                times = max(1, 500 // robots)
                runs = [(cost(arrays, times), cost(objects, times)) for _ in range(rounds)]
                ours, other = (median(run[which] for run in runs) / robots * 1e6 for which in (0, 1))
                print(f"{wire:8}{robots:5} robots  {name}: arrays {ours:6.2f}, objects {other:6.2f}, ratio {other / ours:5.1f}")


if __name__ == "__main__":
    main()
