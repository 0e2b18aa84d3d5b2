"""The small log that is checked in, and its readable twin.

`python tests/support/golden_log.py` writes both again, for when the format is changed on purpose.
"""

from __future__ import annotations

from dataclasses import is_dataclass
from io import BytesIO
from pathlib import Path

from google.protobuf import descriptor_pb2
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from firmware_protocol.errors import LinkClosedError, LinkTimeoutError
from firmware_protocol.events import PeerFound, Received, Rejected, RejectReason
from firmware_protocol.messages import (
    BoutOutcome,
    JuniorManeuverResult,
    JuniorSensors,
    JuniorWheels,
    OpponentCode,
    Phase,
    RefereeState,
    Statustext,
)
from firmware_protocol.vocabulary import ANY_STIMULUS
from hil.bridge.operator import INTERRUPT, OperatorInput
from hil.bridge.taps import Circumstances, Opening
from hil.mcaplog import LogReader
from hil.recording.recorder import Recorder
from pal_advisor.maneuvers import GenerationRecord

MET = Circumstances(
    inputs=(OperatorInput("key w", "1"), OperatorInput(INTERRUPT)),
    lost=LinkClosedError("memory:", "pulled"),
    ended=LinkClosedError("memory:2", "it did not come back"),
    back="memory:3",
    news=("slower now",),
    dropped=7,
)
"""More than one step can meet: one of each."""
GOLDEN = Path(__file__).parent.parent / "golden" / "small.mcap"
TWIN = GOLDEN.with_suffix(".txt")


def write_small_log(path: Path) -> None:
    """One of each kind of entry."""
    run = {"command": "hil coach", "started": "2025-01-01T00:00:00+00:00"}
    with Recorder(path, run=run, config={"seed": "1", "version": "0.1.0"}, link="memory:", lockstep=True) as recorder:
        recorder.metadata("robot", {"SPD_FAST": "1"})
        recorder.opened(Opening("memory:", "memory:", "mavlink", lockstep=True, clock=0.0))
        recorder.session_drawn(7)
        recorder.event(PeerFound(1, 0.0))
        recorder.step(0.005, [(0.005, b"\xfd\x01")])
        recorder.wire_rx(0.005, b"\xfd\x01")
        sensors = JuniorSensors(1.5, (0.001, -0.002), (250, 0), (1, 1023), 7.4, 0x1F)
        recorder.received(Received(sensors, 1, 1, 255, 0.005, b""))
        nothing = (0,) * 8
        result = JuniorManeuverResult(
            session=7,
            sequence=65535,
            samples=(50, 50, *nothing[:6]),
            eye_left=nothing,
            eye_right=(50, *nothing[:7]),
            press_left=(0.1,) * 8,
            press_right=(0.0,) * 8,
            travel=(0.005, None, *((0.0,) * 6)),
            edges_left=nothing,
            edges_right=nothing,
            target_system=255,
            target_component=190,
            outcome=2,
            reason=0,
            done=1,
            stimulus_before=3,
            stimulus_after=0,
        )
        recorder.received(Received(result, 1, 1, 0, 0.01, b""))
        recorder.received(Rejected(RejectReason.BAD_CHECKSUM, b"\xfd\x00", 0.01, "47100"))
        recorder.received(Received(Statustext(4, "battery low"), 1, 1, 1, 0.01, b""))
        recorder.step(0.02, [], MET)
        recorder.unsent(0.02, b"\xfd\x03", LinkTimeoutError("memory:", "nobody reads"))
        recorder.wire_tx(0.02, b"\xfd\x02")
        recorder.sent(0.02, JuniorWheels(7, 1, (1.0, -1.0), 0.25, 1, 1))
        state = RefereeState(
            time=1.0,
            bout=1,
            elapsed=1.0,
            junior=(0.1, -0.1),
            junior_heading=1.0,
            opponent=(-0.1, 0.1),
            opponent_heading=-1.0,
            clearance=0.11,
            phase=Phase.OVER,
            outcome=BoutOutcome.WIN,
            opponent_code=OpponentCode.POINT_LIGHT,
        )
        recorder.received(Received(state, 1, 25, 9, 0.02, b""))
        recorder.generation(GenerationRecord((ANY_STIMULUS, 3), 2, 4, 320, 90, 21.5, 12.25, "FF FF LBRF S"))
        recorder.advice({"version": 1, "entries": []})
        recorder.note("safety", "emergency stop", by="operator")


def describe(path: Path) -> str:
    """What a log holds, one line a record; our own schemas by their fields, entries for viewers by their presence."""
    reader = LogReader(path)
    lines, schemas = [], {}
    for record in reader.records():
        if record.opcode == Opcode.SCHEMA and record.offset < 0:
            schema = Schema.read(ReadDataStream(BytesIO(record.content)))
            schemas[schema.id] = schema.name
            fields = f": {_fields(schema.data)}" if schema.name.startswith("hil.") else ""
            lines.append(f"schema {schema.id} {schema.name}{fields}")
        elif record.opcode == Opcode.CHANNEL and record.offset < 0:
            channel = Channel.read(ReadDataStream(BytesIO(record.content)))
            lines.append(f"channel {channel.id} {channel.topic} of {schemas[channel.schema_id]}")
    for entry in reader.entries():
        value = repr(entry.value) if is_dataclass(entry.value) else "for viewers"
        sender = "" if entry.sender is None else f" from {entry.sender} in frame {entry.frame}"
        lines.append(f"{entry.time:.3f} {entry.topic}{sender}: {value}")
    lines += [f"metadata {name}: {values}" for name, values in sorted(reader.metadata.items())]
    lines.append(reader.health().split(",", maxsplit=1)[0])
    return "\n".join(lines) + "\n"


def _fields(descriptor: bytes) -> str:
    message = descriptor_pb2.FileDescriptorSet.FromString(descriptor).file[0].message_type[0]
    kinds = descriptor_pb2.FieldDescriptorProto.Type
    return ", ".join(
        f"{field.name} {kinds.Name(field.type)[5:].lower()}{'[]' * (field.label == field.LABEL_REPEATED)} = {field.number}"
        for field in message.field
    )


if __name__ == "__main__":
    GOLDEN.unlink(missing_ok=True)
    write_small_log(GOLDEN)
    TWIN.write_text(describe(GOLDEN), "utf-8")
