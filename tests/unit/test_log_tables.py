"""Tables of a log's topics, and what differs between two logs, by topic and field."""

from __future__ import annotations

import csv
import json
from typing import TYPE_CHECKING, Any

import pytest
from google.protobuf.timestamp_pb2 import Timestamp
from google.protobuf.type_pb2 import Option
from mcap.writer import Writer
from mcap_protobuf.schema import build_file_descriptor_set
from report_logs import coaching_log

from firmware_protocol.messages import JuniorSensors
from hil.cli.app import run
from hil.mcaplog import LogError, LogReader, LogWriter, UnreadableLogError, compare_logs
from hil.mcaplog.making.slimming import slim
from hil.mcaplog.reading.flattening import flatten, write_tables
from hil.mcaplog.records import WireBytes
from hil.mcaplog.schemas import message_schema, record_schema
from hil.mcaplog.writing.encode import compile_encoder, sender_suffix

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

SENSORS = message_schema(JuniorSensors)


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def sensors(path: Path, values: Sequence[tuple[float, float]], topic: str = "/junior/sensors") -> Path:
    """A log of readings: log time and battery."""
    writer = LogWriter(path, run={"command": path.name}, overwrite=True)
    writer.metadata("config", {"seed": "1"})
    encode = compile_encoder(SENSORS)
    for time, battery in values:
        reading = JuniorSensors(time, (0.5, 0.25), (1, 2), (3, 4), battery, 0)
        writer.write(writer.channel(topic, SENSORS), time, encode(reading) + sender_suffix(1, 1, 7))
    writer.close()
    return path


def other_program(path: Path, content: Any, text: bytes = b"{}") -> Path:  # noqa: ANN401 - a protobuf message
    """A log of another program: protobuf and JSON."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        data = build_file_descriptor_set(type(content)).SerializeToString()
        schema = writer.register_schema(content.DESCRIPTOR.full_name, "protobuf", data)
        writer.add_message(writer.register_channel("/a b/=c", "protobuf", schema), 1, content.SerializeToString(), 1)
        writer.add_message(writer.register_channel("/text", "json", 0), 2, text, 2)
        writer.add_attachment(1, 2, "file", "text/plain", text)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def test_a_table_has_a_line_an_entry_and_a_column_a_field(tmp_path: Path) -> None:
    log = sensors(tmp_path / "log.mcap", [(0.5, 7.5), (1.0, 7.25)])
    assert write_tables(log, tmp_path / "tables") == {tmp_path / "tables" / "junior_sensors.csv": 2}
    first, second = table(tmp_path / "tables" / "junior_sensors.csv")
    assert first == {
        "log_time": "0.500000000", "system": "1", "component": "1", "frame": "7", "time": "0.5", "travel[0]": "0.5",
        "travel[1]": "0.25", "eye[0]": "1", "eye[1]": "2", "floor[0]": "3", "floor[1]": "4", "battery": "7.5", "flags": "0",
    }  # fmt: skip
    assert second["battery"] == "7.25"


def test_every_topic_of_a_run_becomes_a_table(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    coaching_log(path, budget=20)
    written = write_tables(path, tmp_path)
    counts: dict[str, int] = {}
    for entry in LogReader(path).entries():
        counts[entry.topic] = counts.get(entry.topic, 0) + 1
    assert sorted(written.values()) == sorted(counts.values())
    assert all(len(table(out)) == count for out, count in written.items())
    trial = table(tmp_path / "pal_trial.csv")[0]
    assert (trial["exam"], trial["id"]) == ("False", "1")
    assert bytes.fromhex(table(tmp_path / "wire_rx.csv")[0]["data"])


def test_others_protobuf_is_flattened_by_its_own_descriptor(tmp_path: Path) -> None:
    option = Option(name="=cmd")
    option.value.type_url = "x"
    path = other_program(tmp_path / "log.mcap", option)
    written = write_tables(path, tmp_path)
    assert [out.name for out in written] == ["a_b_c.csv", "text.csv"]
    (line,) = table(tmp_path / "a_b_c.csv")
    assert line == {"log_time": "0.000000001", "name": "'=cmd", "value.type_url": "x", "value.value": ""}
    assert table(tmp_path / "text.csv")[0]["data"] == b"{}".hex()


def test_long_lists_are_one_cell_and_short_ones_a_column_each() -> None:
    assert flatten((1, 2)) == {"[0]": 1, "[1]": 2}
    reading = JuniorSensors(0.0, (0.5, 0.25), tuple(range(30)), (), 7.5, 0)
    assert json.loads(str(flatten(reading, most=16)["eye"])) == list(range(30))
    assert flatten(reading)["eye[29]"] == 29
    assert flatten(b"\x01\xff") == {"data": "01ff"}
    assert flatten(Timestamp(seconds=5)) == {"seconds": 5, "nanos": 0}


def test_tables_that_are_there_stay_and_topics_that_are_not_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, out = sensors(tmp_path / "log.mcap", [(0.5, 7.5)]), tmp_path / "tables"
    assert run(["log", "csv", str(log), "-o", str(out)]) == 0
    assert "junior_sensors.csv: 1 entries" in capsys.readouterr().out
    assert run(["log", "csv", str(log), "-o", str(out)]) == 2
    assert "is there already" in capsys.readouterr().err
    assert run(["log", "csv", str(log), "-o", str(out), "--overwrite", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == [{"table": str(out / "junior_sensors.csv"), "entries": 1}]
    assert run(["log", "csv", str(log), "-o", str(out), "--topic", "/nowhere"]) == 2
    assert "has no entries of /nowhere" in capsys.readouterr().err
    assert run(["log", "csv", str(log), "-o", str(log)]) == 2
    with pytest.raises(LogError):
        write_tables(log, tmp_path / "log.mcap" / "x")


def test_logs_of_the_same_entries_do_not_differ(tmp_path: Path) -> None:
    one = sensors(tmp_path / "one.mcap", [(0.5, 7.5), (1.0, float("nan"))])
    two = sensors(tmp_path / "two.mcap", [(0.5, 7.5), (1.0, float("nan"))])
    found = compare_logs(one, two)
    assert found.same
    assert [(topic.topic, topic.first, topic.second, topic.differing) for topic in found.topics] == [
        ("/junior/sensors", 2, 2, 0)
    ]


def test_the_first_difference_of_each_topic_is_told_with_time_and_field(tmp_path: Path) -> None:
    one = sensors(tmp_path / "one.mcap", [(0.5, 7.5), (1.0, 7.5), (1.5, 7.5)])
    two = sensors(tmp_path / "two.mcap", [(0.5, 7.5), (1.0, 7.25), (1.5, 7.0)])
    found = compare_logs(one, two)
    (topic,) = found.topics
    assert not found.same
    assert (topic.differing, topic.fields) == (2, {"battery": 2})
    at = topic.difference
    assert at is not None
    assert (at.number, at.time, at.field, at.first, at.second) == (1, 1.0, "battery", 7.5, 7.25)


def test_times_counts_and_topics_count(tmp_path: Path) -> None:
    one = sensors(tmp_path / "one.mcap", [(0.5, 7.5), (1.0, 7.5)])
    late = compare_logs(one, sensors(tmp_path / "two.mcap", [(0.5, 7.5), (1.25, 7.5)])).topics[0]
    assert late.fields == {"log time": 1, "publish time": 1, "time": 1}
    short = compare_logs(one, sensors(tmp_path / "two.mcap", [(0.5, 7.5)])).topics[0]
    assert (short.first, short.second, short.differing) == (2, 1, 0)
    assert short.difference is not None
    assert (short.difference.field, short.difference.second) == ("entry", None)
    elsewhere = compare_logs(one, sensors(tmp_path / "two.mcap", [(0.5, 7.5), (1.0, 7.5)], "/other"))
    assert [topic.topic for topic in elsewhere.topics] == ["/junior/sensors", "/other"]
    assert not elsewhere.same
    assert compare_logs(one, tmp_path / "two.mcap", ["/nowhere"]).same
    assert compare_logs(one, tmp_path / "two.mcap", leave_out=["/junior/sensors", "/other"]).same


def test_metadata_and_attachments_count_but_for_the_run(tmp_path: Path) -> None:
    one = sensors(tmp_path / "one.mcap", [(0.5, 7.5)])
    writer = LogWriter(tmp_path / "two.mcap", run={"command": "other"})
    writer.metadata("config", {"seed": "2", "more": "x"})
    writer.close()
    found = compare_logs(one, tmp_path / "two.mcap")
    assert found.metadata == [("config", "more", None, "x"), ("config", "seed", "1", "2")]
    a = other_program(tmp_path / "a.mcap", Timestamp(seconds=1), b"{}")
    b = other_program(tmp_path / "b.mcap", Timestamp(seconds=1), b"[]")
    found = compare_logs(a, b)
    assert found.attachments == ["file"]
    assert [(topic.topic, topic.fields) for topic in found.topics if topic.difference] == [("/text", {"data": 1})]


def test_the_verb_prints_a_table_and_ends_with_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = sensors(tmp_path / "one.mcap", [(0.5, 7.5), (1.0, 7.5)])
    two = sensors(tmp_path / "two.mcap", [(0.5, 7.5), (1.0, 7.25)])
    assert run(["log", "diff", str(one), str(one)]) == 0
    assert "No difference in 2 entries of 1 topics" in capsys.readouterr().out
    assert run(["log", "diff", str(one), str(two)]) == 1
    printed = capsys.readouterr().out
    assert "battery (1)" in printed
    assert "/junior/sensors, entry 1 at 1.000000 s, battery: 7.5 in A, 7.25 in B" in printed
    assert run(["log", "diff", str(one), str(two), "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert (told["same"], told["topics"][0]["difference"]["field"]) == (False, "battery")
    assert run(["log", "diff", str(one), str(two), "--quiet"]) == 1
    assert capsys.readouterr().out == ""
    two.write_bytes(one.read_bytes()[:-40])
    assert run(["log", "diff", str(one), str(two)]) == 0
    assert "B is cut off" in capsys.readouterr().out


def test_nothing_is_not_the_same_as_nothing_readable(tmp_path: Path) -> None:
    one = sensors(tmp_path / "one.mcap", [(0.5, 7.5)])
    two = tmp_path / "two.mcap"
    two.write_bytes(one.read_bytes()[:20])
    with pytest.raises(UnreadableLogError):
        compare_logs(one, two)


def test_what_was_cut_off_is_no_difference_and_is_counted(tmp_path: Path) -> None:
    whole = tmp_path / "whole.mcap"
    coaching_log(whole, budget=40)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    lacking = sum(1 for _ in LogReader(whole).raw_entries()) - sum(1 for _ in LogReader(cut).raw_entries())
    for one, two in ((cut, whole), (whole, cut)):
        found = compare_logs(one, two)
        assert found.same
        assert (found.compared > 0, found.behind_cut) == (True, lacking)


def test_a_log_without_a_readable_entry_is_not_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = tmp_path / "whole.mcap"
    coaching_log(whole, budget=20)
    head = tmp_path / "head.mcap"
    head.write_bytes(whole.read_bytes()[:9000])
    assert not list(LogReader(head).raw_entries())
    for pair in ((head, whole), (whole, head)):
        assert run(["log", "diff", *map(str, pair)]) == 4
        assert "no entry could be read of" in capsys.readouterr().err
    assert run(["log", "diff", str(whole), str(whole), "--topic", "/nowhere"]) == 2
    assert "nothing to compare" in capsys.readouterr().err


def test_only_what_slim_logs_have_is_compared_with_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole, small = tmp_path / "whole.mcap", tmp_path / "small.mcap"
    coaching_log(whole, budget=20)
    slim(whole, small)
    found = compare_logs(whole, small)
    assert found.same
    assert "/junior/sensors" in found.left_out
    assert {topic.topic for topic in found.topics} >= {"/wire/tx", "/pal/trial"}
    assert run(["log", "diff", str(whole), str(small)]) == 0
    assert f"Slim logs never have {len(found.left_out)} of the topics" in capsys.readouterr().out


def test_what_is_sent_comes_first_then_the_topics_as_they_part(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    logs = [tmp_path / "one.mcap", tmp_path / "two.mcap"]
    for log, sent, late in zip(logs, ("x" * 150 + "left", "x" * 150 + "right"), (7.5, 7.25), strict=True):
        writer = LogWriter(log, run={"command": "x"})
        encode = compile_encoder(SENSORS)
        reading = encode(JuniorSensors(2.0, (0.5, 0.25), (1, 2), (3, 4), late, 0)) + sender_suffix(1, 1, 7)
        writer.write(writer.channel("/a/topic/of/a/long/name", SENSORS), 2.0, reading)
        wire = record_schema(WireBytes)
        writer.write(writer.channel("/wire/tx", wire), 1.0, compile_encoder(wire)(WireBytes("tx", sent, b"")))
        writer.close()
    assert run(["log", "diff", *map(str, logs)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "What is sent to the robot (/wire/tx) DIFFERS"
    rows = [line.split()[1] for line in lines if line.startswith("\N{BOX DRAWINGS LIGHT VERTICAL} /")]
    assert rows == ["/wire/tx", "/a/topic/of/a/long/name"]
    (told,) = (line for line in lines if line.startswith("/wire/tx, entry 0"))
    assert "left' in A" in told
    assert "right' in B" in told
    assert "..." in told
