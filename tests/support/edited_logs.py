"""Logs that are changed in one place, and otherwise the same, by MCAP's own package."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from mcap.reader import NonSeekingReader
from mcap.writer import Writer

from hil.bridge.taps import NOTHING
from hil.mcaplog.reading.decoding import decoder_of
from hil.mcaplog.records import (
    BridgeOpening,
    BridgeStep,
    CheckpointRecord,
    CreditRecord,
    DecisionRecord,
    EventRecord,
    RejectedInput,
    SessionDrawn,
    StepRecord,
    TrialRecord,
    UnsentBytes,
    WireBytes,
)
from hil.mcaplog.schemas import record_schema
from hil.mcaplog.writing.encode import compile_encoder, step_encoder

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from typing import Self

CHUNK_SIZE: Final = 64 * 1024
"""In bytes: small, so that even a short log has several."""
STEP: Final = "/bridge/step"
RX: Final = "/wire/rx"
TX: Final = "/wire/tx"
RECORDS: Final[dict[str, type]] = {
    STEP: BridgeStep,
    RX: WireBytes,
    TX: WireBytes,
    "/bridge/open": BridgeOpening,
    "/bridge/session": SessionDrawn,
    "/wire/unsent": UnsentBytes,
    "/wire/rejected": RejectedInput,
    "/events": EventRecord,
    "/pal/decision": DecisionRecord,
    "/pal/credit": CreditRecord,
    "/pal/checkpoint": CheckpointRecord,
    "/pal/trial": TrialRecord,
    "/pal/generation": StepRecord,
}


def encoded(record: object) -> bytes:
    """A record as the recorder writes it."""
    if isinstance(record, BridgeStep) and len(record.chunk_sizes) == len(record.chunk_times) <= 1 and not record.lost_link:
        chunks = [
            (time, bytes(min(max(size, 0), 1 << 20))) for time, size in zip(record.chunk_times, record.chunk_sizes, strict=True)
        ]
        if record == BridgeStep(record.clock, record.chunk_times, record.chunk_sizes, network=record.network):
            return step_encoder(record.network)(record.clock, chunks, NOTHING)
    return compile_encoder(record_schema(type(record)))(record)


@dataclass(frozen=True)
class Entry:
    """One entry.

    Attributes:
        topic: Its topic.
        schema: Its schema: name, encoding, content.
        encoding: How it is written.
        log_time: In ns.
        data: What it says.
    """

    topic: str
    schema: tuple[str, str, bytes]
    encoding: str
    log_time: int
    data: bytes

    @property
    def value(self) -> Any:  # noqa: ANN401 - whatever it says
        """What it says, taken apart."""
        name, kind, content = self.schema
        return decoder_of(name, content, kind, self.encoding)(self.data)

    def saying(self, **changes: Any) -> Entry:  # noqa: ANN401 - of whatever fields
        """It, with some fields of its record changed."""
        value = self.value
        assert isinstance(value, RECORDS[self.topic])
        return replace(self, data=encoded(replace(value, **changes)))  # type: ignore[type-var]

    def later(self, nanoseconds: int) -> Entry:
        """It, so much later."""
        return replace(self, log_time=self.log_time + nanoseconds)


@dataclass
class EditedLog:
    """A log in memory.

    Attributes:
        entries: Its entries, in order.
        metadata: Its metadata records.
        attachments: Its attachments.
    """

    entries: list[Entry]
    metadata: dict[str, dict[str, str]]
    attachments: dict[str, bytes]

    @classmethod
    def of(cls, path: Path) -> Self:
        """Read one.

        Args:
            path: A whole log.
        """
        with path.open("rb") as file:
            reader = NonSeekingReader(file)
            entries = []
            for schema, channel, message in reader.iter_messages(log_time_order=False):
                assert schema is not None
                described = (schema.name, schema.encoding, schema.data)
                entries.append(Entry(channel.topic, described, channel.message_encoding, message.log_time, message.data))
        with path.open("rb") as file:
            metadata = {record.name: dict(record.metadata) for record in NonSeekingReader(file).iter_metadata()}
        with path.open("rb") as file:
            attachments = {record.name: record.data for record in NonSeekingReader(file).iter_attachments()}
        return cls(entries, metadata, attachments)

    def write(self, path: Path) -> Path:
        """Write it, and give the path."""
        with path.open("wb") as file:
            writer = Writer(file, chunk_size=CHUNK_SIZE)
            writer.start()
            for name, values in self.metadata.items():
                writer.add_metadata(name, values)
            for name, data in self.attachments.items():
                writer.add_attachment(0, 0, name, "application/octet-stream", data)
            schemas: dict[tuple[str, str, bytes], int] = {}
            channels: dict[str, int] = {}
            for entry in self.entries:
                if entry.schema not in schemas:
                    schemas[entry.schema] = writer.register_schema(*entry.schema)
                if entry.topic not in channels:
                    channels[entry.topic] = writer.register_channel(entry.topic, entry.encoding, schemas[entry.schema])
                writer.add_message(channels[entry.topic], entry.log_time, entry.data, entry.log_time)
            writer.finish()  # type: ignore[no-untyped-call]
        return path

    def places(self, topic: str) -> list[int]:
        """Where the entries of a topic are."""
        return [place for place, entry in enumerate(self.entries) if entry.topic == topic]

    def change(self, place: int, **changes: Any) -> None:  # noqa: ANN401 - of whatever fields
        """Change fields of the record at a place."""
        self.entries[place] = self.entries[place].saying(**changes)

    def step_of(self, place: int) -> int:
        """Number of the step in which the entry at a place was written, from 0."""
        return sum(1 for entry in self.entries[: place + 1] if entry.topic == STEP) - 1

    def steps(self) -> Iterator[tuple[int, BridgeStep]]:
        """Its steps, and where they are."""
        for place in self.places(STEP):
            yield place, self.entries[place].value
