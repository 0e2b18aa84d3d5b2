"""Records per second that the recorder writes and a report reads, against the `mcap` package doing the same.

The traffic is that of coaching in lock-step: for each second 65 chunks of bytes with as many steps of the bridge, 50 sensor
messages, 20 of the referee, 25 heartbeats sent. The other side builds each message as a python-protobuf object of the same
descriptor and hands it to `mcap.writer.Writer`, with the same chunks; runs are interleaved.

    python benchmarks/recorder.py [--seconds 300] [--rounds 5]
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import TYPE_CHECKING, Any

from mcap.records import Schema as SchemaRecord
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory

from firmware_protocol.events import Received
from firmware_protocol.messages import Heartbeat, JuniorSensors, RefereeState
from hil.mcaplog import LogReader
from hil.mcaplog.records import BridgeStep, WireBytes
from hil.mcaplog.schemas import Schema, message_schema, record_schema
from hil.mcaplog.writing.writer import CHUNK_SIZE
from hil.recording.recorder import Recorder

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

FRAME = bytes(range(48))


def traffic(seconds: int) -> list[tuple[float, list[tuple[Message, int]], bool]]:
    """Steps of the bridge.

    Args:
        seconds: Log time.

    Returns:
        For each: log time, what was received with its component, whether a heartbeat was sent.
    """
    steps = []
    for tick in range(seconds * 100):
        time = tick * 0.01
        came: list[tuple[Message, int]] = []
        if tick % 2 == 0:
            came.append((JuniorSensors(time, (0.1 * time, 0.1), (tick % 1000, 40), (41, 42), 7.4, tick % 512), 1))
        if tick % 5 == 0:
            x = tick % 600 / 1000 - 0.3
            came.append((RefereeState(time, tick // 800, tick % 800 / 100, (x, 0.1), 1.0, (0.1, x), -1.0, 0.1, 1, 0, 1), 25))
        if came or tick % 4 == 0:
            steps.append((time, came, tick % 4 == 0))
    return steps


def ours(path: Path, steps: list[tuple[float, list[tuple[Message, int]], bool]]) -> float:
    """Record with the recorder; wall seconds."""
    heartbeat = Heartbeat(6, 8, 0, 0, 4)
    start = perf_counter()
    with Recorder(path, run={}, config={}, link="memory:", lockstep=True) as recorder:
        for number, (time, came, beat) in enumerate(steps):
            recorder.step(time, [(time, FRAME)] if came else [])
            if came:
                recorder.wire_rx(time, FRAME)
            for message, component in came:
                recorder.received(Received(message, 1, component, number & 0xFF, time, FRAME))
            if beat:
                recorder.wire_tx(time, FRAME)
                recorder.sent(time, heartbeat)
    return perf_counter() - start


class Plain:
    """python-protobuf messages through `mcap.writer.Writer`; what a log of this kind is usually made with."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb")
        self._writer = Writer(self._file, chunk_size=CHUNK_SIZE)
        self._writer.start()
        self._known: dict[str, tuple[int, Any, tuple[str, ...]]] = {}

    def write(self, topic: str, schema: Schema, value: object, time: float, sender: tuple[int, int, int] | None = None) -> None:
        """Append an entry."""
        if topic not in self._known:
            number = self._writer.register_schema(schema.name, "protobuf", schema.data)
            parse = DecoderFactory().decoder_for("protobuf", SchemaRecord(1, schema.data, "protobuf", schema.name))
            made = type(parse(b"")) if parse else None
            names = tuple(field.name for field in schema.fields if not field.name.startswith(("sender", "frame")))
            self._known[topic] = (self._writer.register_channel(topic, "protobuf", number), made, names)
        channel, made, names = self._known[topic]
        message = made(**{name: getattr(value, name) for name in names})
        if sender:
            message.sender_system, message.sender_component, message.frame = sender
        stamp = round(time * 1e9)
        self._writer.add_message(channel, stamp, message.SerializeToString(), stamp)

    def close(self) -> None:
        """Finish."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()


def theirs(path: Path, steps: list[tuple[float, list[tuple[Message, int]], bool]]) -> float:
    """Record the same (but for drawings) in the plain way; wall seconds."""
    heartbeat = Heartbeat(6, 8, 0, 0, 4)
    step_schema, wire_schema = record_schema(BridgeStep), record_schema(WireBytes)
    start = perf_counter()
    log = Plain(path)
    for number, (time, came, beat) in enumerate(steps):
        stamps, sizes = ((time,), (len(FRAME),)) if came else ((), ())
        log.write("/bridge/step", step_schema, BridgeStep(time, stamps, sizes, ()), time)
        if came:
            log.write("/wire/rx", wire_schema, WireBytes("rx", "memory:", FRAME), time)
        for message, component in came:
            schema = message_schema(type(message))
            log.write(schema.topic, schema, message, time, (1, component, number & 0xFF))
        if beat:
            log.write("/wire/tx", wire_schema, WireBytes("tx", "memory:", FRAME), time)
            log.write("/mavlink/heartbeat", message_schema(Heartbeat), heartbeat, time, (255, 190, 256))
    log.close()
    return perf_counter() - start


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=300, help="log time a round")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    steps = traffic(options.seconds)
    with tempfile.TemporaryDirectory() as folder:
        mine, plain = Path(folder) / "ours.mcap", Path(folder) / "plain.mcap"
        walls = [(ours(mine, steps), theirs(plain, steps)) for _ in range(options.rounds)]
        start = perf_counter()
        reader = LogReader(mine)
        for _ in reader.entries():
            pass
        reading = perf_counter() - start
        counts = [_count(path) for path in (mine, plain)]
        sizes = [path.stat().st_size for path in (mine, plain)]
    for name, wall, count, size in zip(
        ("recorder", "mcap and python-protobuf"), zip(*walls, strict=True), counts, sizes, strict=True
    ):
        time = median(wall)
        print(
            f"{name:26} {count / time / 1e3:6.0f} k records/s  {time / count * 1e6:5.2f} us each  "
            f"{options.seconds / time:6.0f} x real time  {size / count:4.0f} bytes each"
        )
    print(f"{'reading it back, decoded':26} {reader.messages_read / reading / 1e3:6.0f} k records/s")
    print(f"ratio of times a record: {median(b / counts[1] / (a / counts[0]) for a, b in walls):.1f}")


def _count(path: Path) -> int:
    reader = LogReader(path)
    for _ in reader.records():
        pass
    return sum(1 for record in reader.records() if record.opcode == 5)


if __name__ == "__main__":
    main()
