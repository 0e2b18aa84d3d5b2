"""Log files: the same bytes for the same calls, readable by stock tools, and up to the damage when damaged."""

from __future__ import annotations

import random
import zlib
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from google.protobuf import descriptor_pb2
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import SummaryOffset
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory
from report_logs import FullDisk

from firmware_protocol.messages import JuniorSensors, Ping
from hil.mcaplog import LogError, LogReader, LogWriter, differences
from hil.mcaplog.records import EventRecord
from hil.mcaplog.schemas import message_schema, record_schema
from hil.mcaplog.writing.encode import compile_encoder, sender_suffix
from hil.mcaplog.writing.writer import CHUNK_SIZE, MAGIC

if TYPE_CHECKING:
    from collections.abc import Mapping

SENSORS = message_schema(JuniorSensors)


def sensors(index: int) -> JuniorSensors:
    """Different for each index."""
    return JuniorSensors(index * 0.02, (index * 1e-3, -index * 1e-3), (index % 1024, 5), (7, 9), 7.4, index % 512)


def write(path: Path, count: int, *, run: Mapping[str, str] = {}, flush_every: float = 0.5, dt: float = 0.02) -> LogWriter:
    """A log of `count` sensor messages and an event after every tenth, not closed."""
    writer = LogWriter(path, run=run, flush_every=flush_every)
    writer.metadata("config", {"seed": "1"})
    encode, encode_event = compile_encoder(SENSORS), compile_encoder(record_schema(EventRecord))
    for index in range(count):
        writer.write(
            writer.channel("/junior/sensors", SENSORS), index * dt, encode(sensors(index)) + sender_suffix(1, 1, index & 255)
        )
        if index % 10 == 9:
            channel = writer.channel("/events", record_schema(EventRecord))
            writer.write(channel, index * dt, encode_event(EventRecord("link", f"event {index}", "{}")))
    return writer


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "log.mcap"
    write(path, 200).close()
    return path


def test_what_was_written_is_read(log: Path) -> None:
    reader = LogReader(log)
    entries = list(reader.entries(["/junior/sensors"]))
    assert [entry.value for entry in entries] == [sensors(index) for index in range(200)]
    assert [entry.frame for entry in entries] == [index & 255 for index in range(200)]
    assert {entry.sender for entry in entries} == {(1, 1)}
    assert [entry.time for entry in entries] == pytest.approx([index * 0.02 for index in range(200)])
    assert reader.metadata["config"] == {"seed": "1"}
    assert (reader.truncated, reader.damage, reader.bytes_read, reader.messages_read) == (False, [], log.stat().st_size, 200)
    assert reader.health().startswith("whole")


def test_topics_can_be_asked_for_and_left_out(log: Path) -> None:
    reader = LogReader(log)
    assert {entry.topic for entry in reader.entries(["/events"])} == {"/events"}
    assert {entry.topic for entry in reader.entries(leave_out=["/events"])} == {"/junior/sensors"}
    assert not list(reader.entries([]))
    assert reader.metadata["config"] == {"seed": "1"}


def test_stock_tools_read_it_too(log: Path) -> None:
    with log.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 220
        assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (0, 3_980_000_000)
        assert sorted(channel.topic for channel in summary.channels.values()) == ["/events", "/junior/sensors"]
        decoded = [item.decoded_message for item in reader.iter_decoded_messages(topics=["/junior/sensors"])]
        assert [list(message.eye) for message in decoded] == [[index % 1024, 5] for index in range(200)]
        late = list(reader.iter_messages(topics=["/events"], starting_at=3_000_000_000))  # by the index of messages
        assert len(late) == 5
        assert {record.name for record in reader.iter_metadata()} == {"run", "config", "sizes"}


def test_messages_are_numbered_by_topic(log: Path) -> None:
    numbers: dict[str, list[int]] = {}
    with log.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages(log_time_order=False):
            numbers.setdefault(channel.topic, []).append(message.sequence)
    assert numbers == {"/junior/sensors": list(range(1, 201)), "/events": list(range(1, 21))}


def test_a_log_closes_with_what_each_topic_takes(log: Path) -> None:
    sizes = {"/junior/sensors": 0, "/events": 0}
    with log.open("rb") as file:
        reader = make_reader(file)
        for _, channel, message in reader.iter_messages():
            sizes[channel.topic] += 9 + 22 + len(message.data)
        told = [record.metadata for record in reader.iter_metadata() if record.name == "sizes"]
    assert told == [{topic: str(size) for topic, size in sizes.items()}]


def test_the_same_calls_give_the_same_bytes_but_for_the_run(tmp_path: Path) -> None:
    one, two = tmp_path / "one.mcap", tmp_path / "two.mcap"
    write(one, 500, run={"command": "hil coach", "started": "now"}).close()
    write(two, 500, run={"command": "hil coach --log somewhere/else.mcap", "started": "later"}).close()
    assert differences(one, two) == []
    first, second = one.read_bytes(), two.read_bytes()
    assert len(first) == len(second)
    changed = [at for at, (a, b) in enumerate(zip(first, second, strict=True)) if a != b]
    assert changed
    assert changed[-1] - changed[0] < 4096
    assert LogReader(one).metadata == {}
    reader = LogReader(two)
    list(reader.entries([]))
    assert reader.metadata["run"] == {"command": "hil coach --log somewhere/else.mcap", "started": "later"}


def test_attachments_are_indexed_and_counted_and_say_nothing_of_the_wall_clock(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    writer = write(path, 20)
    writer.attachment("faults.toml", b"loss = 0.05", media_type="application/toml", time=0.4)
    writer.attachment("advice.json", b"{}", media_type="application/json", time=0.5)
    writer.close()
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        attached = list(reader.iter_attachments())
    assert [(one.name, one.media_type, one.data) for one in attached] == [
        ("faults.toml", "application/toml", b"loss = 0.05"),
        ("advice.json", "application/json", b"{}"),
    ]
    assert [(one.log_time, one.create_time) for one in attached] == [(400_000_000, 0), (500_000_000, 0)]
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.attachment_count == 2
    data = path.read_bytes()
    for index in summary.attachment_indexes:
        record = data[index.offset : index.offset + index.length]
        assert (record[0], int.from_bytes(record[1:9], "little")) == (Opcode.ATTACHMENT, index.length - 9)
        assert zlib.crc32(record[9:-4]) == int.from_bytes(record[-4:], "little")
        assert index.data_size == len(attached[summary.attachment_indexes.index(index)].data)
    groups = [record for record in StreamReader(BytesIO(data)).records if isinstance(record, SummaryOffset)]
    assert Opcode.ATTACHMENT_INDEX in {group.group_opcode for group in groups}


def test_differences_are_told(tmp_path: Path, log: Path) -> None:
    other = tmp_path / "other.mcap"
    writer = write(other, 199)
    writer.write(writer.channel("/events", record_schema(EventRecord)), 3.98, b"")
    writer.close()
    assert differences(log, other, limit=3)
    shorter = tmp_path / "shorter.mcap"
    shorter.write_bytes(log.read_bytes()[:-30])
    assert "goes on" in differences(log, shorter)[0]


def test_a_log_that_was_never_closed_is_readable_up_to_the_last_flush(tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    unfinished = write(path, 1000, flush_every=0.25)
    reader = LogReader(path)
    times = [entry.time for entry in reader.entries()]
    assert reader.truncated
    assert times[-1] >= 999 * 0.02 - 0.25 - 0.02
    assert reader.health().startswith("cut off")
    unfinished.close()


def test_chunks_are_cut_by_size_too(tmp_path: Path) -> None:
    path = tmp_path / "big.mcap"
    writer = LogWriter(path, run={}, flush_every=1e6)
    channel = writer.channel("/events", record_schema(EventRecord))
    encode = compile_encoder(record_schema(EventRecord))
    for index in range(100):
        writer.write(channel, index, encode(EventRecord("link", "x" * 10_000, "{}")))
    written = path.stat().st_size
    writer.close()
    assert written > 4096 + 100
    assert LogReader(path).size > written
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    sizes = [index.uncompressed_size for index in summary.chunk_indexes]
    assert len(sizes) == 4
    assert max(sizes) < CHUNK_SIZE + 11_000


def test_a_log_cut_at_any_place_is_read_up_to_there(log: Path) -> None:
    data = log.read_bytes()
    whole = [entry.value for entry in LogReader(log).entries()]
    seen = []
    for length in [*range(40), *range(40, len(data), 97), *range(len(data) - 40, len(data))]:
        log.write_bytes(data[:length])
        reader = LogReader(log)
        values = [entry.value for entry in reader.entries()]
        assert values == whole[: len(values)]
        assert reader.truncated
        assert reader.bytes_read <= length
        assert f"of {length:,} bytes" in reader.health()
        seen.append(len(values))
    assert seen == sorted(seen)
    assert seen[-1] == len(whole)


def test_damage_is_told_and_never_raises(log: Path) -> None:
    data = log.read_bytes()
    whole = {entry.time for entry in LogReader(log).entries()}
    dice = random.Random(5)
    told = 0
    for _ in range(150):
        damaged = bytearray(data)
        for _ in range(dice.choice([1, 3, 50])):
            damaged[dice.randrange(len(MAGIC), len(data))] ^= 1 << dice.randrange(8)
        log.write_bytes(damaged)
        reader = LogReader(log)
        times = {entry.time for entry in reader.entries()}
        told += bool(reader.damage or reader.truncated)
        assert not reader.damage or reader.health()
        assert len(times) <= len(whole) + 1
    assert told > 100


def test_one_damaged_chunk_costs_that_chunk(log: Path) -> None:
    data = bytearray(log.read_bytes())
    whole = [entry.time for entry in LogReader(log).entries()]
    chunks = [record for record in LogReader(log).records() if record.opcode == 6]
    middle = chunks[len(chunks) // 2]
    data[middle.offset + 9 + len(middle.content) // 2] ^= 0xFF
    log.write_bytes(data)
    reader = LogReader(log)
    times = [entry.time for entry in reader.entries()]
    assert len(reader.damage) == 1
    assert "left out" in reader.damage[0]
    assert len(whole) - 40 < len(times) < len(whole)
    assert times[-1] == whole[-1]


@pytest.mark.parametrize("content", [b"not a log at all", b"\x89MCAP1\r\n"])
def test_something_else_is_refused_in_words(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "else.mcap"
    path.write_bytes(content)
    with pytest.raises(LogError, match="is not a log"):
        LogReader(path)


def test_a_log_that_is_not_there_is_told_of(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="cannot read the log"):
        LogReader(tmp_path / "nowhere.mcap")


def test_an_empty_file_is_a_log_cut_off_at_once(tmp_path: Path) -> None:
    path = tmp_path / "empty.mcap"
    path.write_bytes(b"")
    reader = LogReader(path)
    assert list(reader.entries()) == []
    assert reader.truncated


def test_logs_of_others_are_read_as_their_descriptors_say(tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("hil.JuniorSensors", "protobuf", _renamed("JuniorSensors"))
        channel = writer.register_channel("/junior/sensors", "protobuf", schema)
        writer.add_message(channel, 5, compile_encoder(message_schema(Ping))(Ping(1, 2)), 5)
        text = writer.register_channel("/text", "json", writer.register_schema("Text", "jsonschema", b"{}"))
        writer.add_message(text, 6, b"{}", 6)
        writer.finish()  # type: ignore[no-untyped-call]
    reader = LogReader(path)
    entry, other = reader.entries()
    assert entry.value.seq == 2
    assert other.value == b"{}"
    assert reader.damage == []


def _renamed(name: str) -> bytes:
    """The descriptor of Ping under another name: a message of ours as another version may have had it."""
    found = descriptor_pb2.FileDescriptorSet.FromString(message_schema(Ping).data)
    found.file[0].message_type[0].name = name
    return found.SerializeToString()


def test_a_place_that_cannot_be_written_is_told_of(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(LogError, match="cannot write the log"):
        LogWriter(tmp_path / "file" / "log.mcap", run={})


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_is_told_once_and_then_the_log_is_silent() -> None:
    with pytest.raises(LogError, match="cannot be written any further"):
        LogWriter(Path("/dev/full"), run={})


def test_a_disk_that_fills_up_is_told_once_and_then_the_log_is_silent(tmp_path: Path) -> None:
    writer = write(tmp_path / "log.mcap", 5)
    writer._output.file.close()
    writer._output.file = FullDisk()  # type: ignore[assignment]
    with pytest.raises(LogError, match="No space left"):
        writer.flush()
    writer.write(1, 100.0, b"x")
    writer.write(1, 200.0, b"x")
    writer.metadata("robot", {})
    writer.flush()
    writer.close()
    writer.close()


def test_a_log_that_was_to_replace_another_and_can_t_be_finished_is_named_and_the_other_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, told = tmp_path / "log.mcap", list[tuple[str, Path | None]]()
    path.write_bytes(b"old")
    writer = LogWriter(path, run={}, overwrite=True, on_failure=lambda text, kept: told.append((text, kept)))
    writer.metadata("robot", {"id": "1"})

    def full(_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("hil.files.outputs.Output.finish", full)
    writer.close()
    ((text, kept),) = told
    assert kept == tmp_path / "log.unfinished.mcap"
    assert f"what there is of it is in {kept}, and {path} is as it was" in text
    assert path.read_bytes() == b"old"
    reader = LogReader(kept)
    assert list(reader.entries()) == []
    assert "robot" in reader.metadata


def test_closing_twice_does_nothing(log: Path, tmp_path: Path) -> None:
    path = tmp_path / "again.mcap"
    writer = write(path, 200)
    writer.close()
    writer.close()
    assert differences(log, path) == []
