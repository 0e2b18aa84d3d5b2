"""Logs that other replays stumbled over: robots that restart, several networks, ends that are missing, holes, and versions."""

from __future__ import annotations

import json
import signal
from dataclasses import fields
from itertools import pairwise
from math import isnan, nan
from pathlib import Path
from time import monotonic
from typing import Final

import pytest
from at_night import all_at_night_but
from edited_logs import RECORDS, RX, STEP, TX, EditedLog, encoded
from hypothesis import given, settings
from hypothesis import strategies as st
from processes import PATIENCE, Hil
from serving import served

import hil
from firmware_protocol.errors import AddressError
from hil.cli.app import run as run_hil
from hil.mcaplog.errors import LogError
from hil.mcaplog.making.recovery import recover
from hil.mcaplog.making.slimming import slim
from hil.mcaplog.reading.reader import LogReader
from hil.mcaplog.records import EventRecord
from hil.mcaplog.writing.writer import CUT
from hil.recording.recorder import Recorder
from hil.replaying.comparison import decides
from hil.replaying.difference import same
from hil.replaying.tape import ReplayError
from hil.versions import versions

LOGS: Final = Path(__file__).parents[1] / "replay_logs"
GOLDEN: Final = Path(__file__).parents[1] / "golden" / "small.mcap"
COACH: Final = ("--runs", "1", "--budget", "12", "--held-out", "0", "--no-report", "--quiet")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of many chunks, with all that a run leaves in one."""
    folder = tmp_path_factory.mktemp("whole")
    assert run_hil(["coach", *COACH, "--out", str(folder / "run")]) == 0
    return EditedLog.of(folder / "run" / "log.mcap").write(folder / "log.mcap")


def replayed(path: Path, *, strict: bool = True) -> hil.ReplayReport:
    """What comes of a log that is to come out the same."""
    report = hil.replay(path, strict=strict)
    assert report.same, str(report)
    return report


def refused(path: Path, capsys: pytest.CaptureFixture[str], *options: str) -> str:
    """What is said of a log that can't be replayed."""
    capsys.readouterr()
    assert run_hil(["replay", str(path), *options]) == 2
    said = capsys.readouterr()
    assert not said.out
    assert "Traceback" not in said.err
    return " ".join(said.err.split())


# --- what happens in a run -----------------------------------------------------------------------------------------------


def test_a_robot_that_restarts(tmp_path: Path) -> None:
    log = tmp_path / "log.mcap"
    robot = "sim://junior?seed=3&faults=brownout:4+0.5"
    assert run_hil(["coach", robot, *COACH, "--no-report", "--out", str(tmp_path / "run"), "--log", str(log)]) == 0
    times = [entry.value.time for entry in LogReader(log).entries({"/junior/sensors"})]
    assert any(later < before - 3 for before, later in pairwise(times))  # its clock begins anew
    replayed(log)
    replayed(log, strict=False)


def test_entries_of_one_stamp(whole: Path) -> None:
    log = EditedLog.of(whole)
    stamps = [(entry.topic, entry.log_time) for entry in log.entries]
    assert len(set(stamps)) < len(stamps) - 10
    replayed(whole)


def test_time_that_stands_still(whole: Path, tmp_path: Path) -> None:
    """The order of a log is that of the file, and no stamp has a say in it."""
    log = EditedLog.of(whole)
    log.entries = [entry.later(-entry.log_time) for entry in log.entries]
    replayed(log.write(tmp_path / "log.mcap"), strict=False)


def both(*urls: str, taps: tuple[Recorder, ...] = ()) -> tuple[list[str], float]:
    """A program for several networks: what it gets to hear, and when it ends."""
    with hil.connect_all(*urls, taps=taps, timeout=5.0) as robots:
        robots.ask(lambda junior: junior.peer.arm())
        heard = [str(junior.perform(["F", "S"], period=0.1)) for junior in robots]
        robots.wait(0.5)
        return heard, robots.now()


def recorded(log: Path, *urls: str, lockstep: bool) -> tuple[list[str], float]:
    """Have it recorded."""
    with Recorder(log, run={}, config={}, link=urls[0], lockstep=lockstep) as recorder:
        return both(*urls, taps=(recorder,))


def test_several_networks_in_one_log(tmp_path: Path) -> None:
    log = tmp_path / "log.mcap"
    heard = recorded(log, "sim://junior?seed=1", "sim://junior?seed=2&wire=can", lockstep=True)
    assert {entry.value.network for entry in LogReader(log).entries({STEP})} == {
        "sim://junior?seed=1",
        "sim://junior?seed=2&wire=can",
    }
    assert both(f"replay://{log}") == heard
    with pytest.raises(AddressError, match="2 networks"):
        hil.connect(f"replay://{log}")
    with pytest.raises(ReplayError, match="by a program of your own"):
        hil.replay(log)


@pytest.mark.nightly
def test_several_networks_in_real_time_take_no_time_again(tmp_path: Path) -> None:
    log = tmp_path / "log.mcap"
    with served("tcp://127.0.0.1:0") as one, served("udp://127.0.0.1:0") as other:
        heard = recorded(log, one, other, lockstep=False)
    assert both(f"replay://{log}") == heard


def test_another_program_is_told_at_which_step_of_which_network_it_parts(tmp_path: Path) -> None:
    log = tmp_path / "log.mcap"
    recorded(log, "sim://junior?seed=1", "sim://junior?seed=2", lockstep=True)
    with hil.connect_all(f"replay://{log}") as robots:
        robots.ask(lambda junior: junior.peer.arm())
        junior = next(iter(robots))
        with pytest.raises(hil.ReplayDiverged) as told:
            junior.perform(["B", "S"], period=0.1)
    assert told.value.difference.topic == TX
    assert "actions" in told.value.difference.field


def test_a_number_that_is_none_equals_itself(tmp_path: Path) -> None:
    """Nobody saw how far the opponent was moved: NaN stands for that."""
    log = tmp_path / "log.mcap"
    options = ["--opponent", "flat-light", "--out", str(tmp_path / "run"), "--log", str(log)]
    assert run_hil(["coach", "sim://junior?referee=0&seed=2", *COACH, *options]) == 0
    trials = [entry.value for entry in LogReader(log).entries({"/pal/trial"})]
    assert trials
    assert all(trial.progress is None or isnan(trial.progress) for trial in trials)
    replayed(log)
    replayed(log, strict=False)
    assert same(nan, float("nan"))
    assert same((1.0, nan), (1.0, nan))
    assert not same((1.0, nan), (nan, 1.0))
    assert not same(nan, None)


def test_a_run_that_ends_before_any_robot_has_answered(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "log.mcap"
    assert run_hil(["bout", "sim://junior?faults=drop:1", "--controller", "chase", "--trials", "1", "--log", str(log)]) == 3
    capsys.readouterr()
    report = replayed(log)
    assert "answer" in report.ended
    assert run_hil(["replay", str(log), "--strict"]) == 0
    assert report.ended.split(".")[0] in " ".join(capsys.readouterr().out.split())


# --- a comparison that could not fail ------------------------------------------------------------------------------------


def decision_topics() -> list[str]:
    """All topics that tell of decisions, as far as the kept logs have them."""
    found = {entry.topic for log in LOGS.glob("*.mcap") for entry in LogReader(log).raw_entries()}
    return sorted(topic for topic in found if decides(topic))


def altered(value: object) -> object:
    """Another value of the same type, as near as can be; None where there is none."""
    other: object = None
    match value:
        case bool():
            other = not value
        case float() | None:
            other = 1.0 if value is None or isnan(value) else value + 1e-9
        case int():
            other = value + 1
        case bytes():
            other = value[:-3] + bytes((value[-3] ^ 1,)) + value[-2:]
        case str():
            other = json.dumps({**json.loads(value), "more": 1}) if value.startswith("{") else value + "x"
        case tuple() if value:
            other = (*value[:-1], altered(value[-1]))
    return other


def cases() -> list[tuple[str, str]]:
    """Every field of every decision, but for those that only name the link or word an event."""
    left_out = {(TX, "direction"), (TX, "link"), ("/events", "text")}
    return [
        (topic, field)
        for topic in decision_topics()
        if topic in RECORDS
        for field in [each.name for each in fields(RECORDS[topic])]
        if (topic, field) not in left_out
    ]


@pytest.fixture(scope="module")
def lockstep() -> EditedLog:
    """The kept log that has every kind of decision, but for bytes that were not taken."""
    log = EditedLog.of(LOGS / "lockstep.mcap")
    assert {topic for topic in decision_topics() if topic not in {entry.topic for entry in log.entries}} <= {"/wire/unsent"}
    return log


@pytest.mark.parametrize(("topic", "field"), cases())
def test_every_field_of_every_decision_is_compared(topic: str, field: str, lockstep: EditedLog, tmp_path: Path) -> None:
    log = EditedLog(list(lockstep.entries), lockstep.metadata, lockstep.attachments)
    place, other = next(
        (place, other)
        for place in log.places(topic)
        if (other := altered(getattr(log.entries[place].value, field))) is not None
    )
    log.change(place, **{field: other})
    report = hil.replay(log.write(tmp_path / "log.mcap"))
    assert report.difference is not None
    assert (report.difference.step, report.difference.topic) == (log.step_of(place), topic)
    assert field in report.difference.field


@pytest.mark.parametrize("topic", ["/pal/advice", "/events", "/wire/tx", "/pal/trial"])
def test_one_byte_of_every_decision_is_compared(topic: str, lockstep: EditedLog, tmp_path: Path) -> None:
    log = EditedLog(list(lockstep.entries), lockstep.metadata, lockstep.attachments)
    place = log.places(topic)[-1]
    entry = log.entries[place]
    data = bytearray(entry.data)
    data[-1] ^= 1
    log.entries[place] = type(entry)(entry.topic, entry.schema, entry.encoding, entry.log_time, bytes(data))
    report = hil.replay(log.write(tmp_path / "log.mcap"))
    assert report.difference is not None
    assert (report.difference.step, report.difference.topic) == (log.step_of(place), topic)


def test_a_better_wording_is_no_difference_unless_asked_for(lockstep: EditedLog, tmp_path: Path) -> None:
    log = EditedLog(list(lockstep.entries), lockstep.metadata, lockstep.attachments)
    log.change(log.places("/events")[2], text="in other words")
    path = log.write(tmp_path / "log.mcap")
    replayed(path, strict=False)
    report = hil.replay(path, strict=True)
    assert report.difference is not None
    assert (report.difference.topic, report.difference.field) == ("/events", "text")


@pytest.mark.slow
@pytest.mark.parametrize("topic", all_at_night_but({"/wire/tx", "/pal/decision"}, decision_topics()))
def test_a_decision_that_is_missing_and_one_too_many(topic: str, lockstep: EditedLog, tmp_path: Path) -> None:
    if topic == "/wire/unsent":
        pytest.skip("no kept log has one")
    place = lockstep.places(topic)[-1]
    for entries in (
        lockstep.entries[:place] + lockstep.entries[place + 1 :],
        [*lockstep.entries[: place + 1], lockstep.entries[place], *lockstep.entries[place + 1 :]],
    ):
        log = EditedLog(entries, lockstep.metadata, lockstep.attachments)
        report = hil.replay(log.write(tmp_path / "log.mcap"))
        assert report.difference is not None
        assert report.difference.step in {lockstep.step_of(place), lockstep.step_of(place) + 1}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["end/advice.toml", "end/checkpoint.json"])
def test_what_a_run_ended_with_is_compared(name: str, lockstep: EditedLog, tmp_path: Path) -> None:
    data = lockstep.attachments[name]
    for other in ({**lockstep.attachments, name: data[:-2] + b"?" + data[-1:]}, {"begin/more": b""}):
        report = hil.replay(EditedLog(lockstep.entries, lockstep.metadata, other).write(tmp_path / "log.mcap"))
        assert report.difference is not None
        assert report.difference.topic.startswith("attachment end/")
    report = hil.replay(
        EditedLog(lockstep.entries, lockstep.metadata, {**lockstep.attachments, "end/more": b"x"}).write(tmp_path / "log.mcap")
    )
    assert report.difference is not None
    assert report.difference.topic == "attachment end/more"
    assert "there is none" in report.difference.now


# --- ends and beginnings -------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_fewer_steps_more_steps_and_a_log_that_ends_early_are_told_apart(lockstep: EditedLog, tmp_path: Path) -> None:
    path, steps = tmp_path / "log.mcap", lockstep.places(STEP)
    early = EditedLog(lockstep.entries[: steps[-40]], lockstep.metadata, lockstep.attachments)
    report = hil.replay(early.write(path))
    assert report.difference is not None
    assert report.difference.recorded.startswith("nothing")  # it is whole: so the run ended there
    early.metadata = {**lockstep.metadata, CUT: {"why": "it was cut"}}
    assert hil.replay(early.write(path)).same
    assert hil.replay(path).cut_off
    more = EditedLog([*lockstep.entries, lockstep.entries[steps[-1]]], lockstep.metadata, lockstep.attachments)
    report = hil.replay(more.write(path))
    assert report.difference is not None
    assert report.difference.topic == STEP
    assert "the run ends here" in report.difference.now


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(share=st.floats(0.0, 1.0, exclude_max=True), strict=st.booleans())
def test_a_log_that_is_cut_off_anywhere_shows_no_difference(whole: Path, share: float, *, strict: bool) -> None:
    cut = whole.with_name("cut.mcap")
    data = whole.read_bytes()
    cut.write_bytes(data[: int(share * len(data))])
    try:
        report = hil.replay(cut, strict=strict)
    except (LogError, ReplayError):
        return
    assert report.same, str(report)
    assert report.cut_off


def test_a_log_that_was_cut_off_and_recovered_is_replayed_to_where_it_was_cut(whole: Path, tmp_path: Path) -> None:
    cut, recovered, small = tmp_path / "cut.mcap", tmp_path / "recovered.mcap", tmp_path / "small.mcap"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    recover(cut, recovered)
    slim(recovered, small)
    for log in (cut, recovered, small):
        report = replayed(log)
        assert report.cut_off
        assert 100 < report.steps < hil.replay(whole).steps
    again = tmp_path / "again.mcap"
    recover(whole, again)
    assert not replayed(again).cut_off


def test_a_log_with_a_hole_is_replayed_to_the_hole(whole: Path, tmp_path: Path) -> None:
    damaged, recovered = tmp_path / "damaged.mcap", tmp_path / "recovered.mcap"
    data = bytearray(whole.read_bytes())
    index = LogReader(whole).index
    assert index is not None
    with whole.open("rb") as file:
        chunks = list(index.chunks(file, 0))
    assert len(chunks) > 2
    hit = chunks[1]
    data[hit.offset + hit.length // 2] ^= 0x55
    damaged.write_bytes(data)
    recover(damaged, recovered)
    assert LogReader(recovered).path == recovered
    for log in (damaged, recovered):
        report = replayed(log)
        assert report.cut_off
        assert report.steps < hil.replay(whole).steps


def read_when_closed(log: Path) -> LogReader:
    """A log, as soon as it is whole: the process that writes it ends a moment after the one that was killed."""
    until = monotonic() + PATIENCE
    while True:
        reader = LogReader(log)
        for _ in reader.raw_entries():
            pass
        if reader.whole or monotonic() > until:
            return reader


@pytest.mark.slow
def test_a_run_that_was_killed_is_replayed_to_where_it_was_killed(tmp_path: Path) -> None:
    log = tmp_path / "log.mcap"
    with served("tcp://127.0.0.1:0") as url, Hil(tmp_path, "monitor", url, "--log", str(log), "--duration", "60") as program:
        program.until("frames")
        program.send(signal.SIGKILL)
        program.end()
    whole = read_when_closed(log)
    assert whole.whole
    assert "without closing" in whole.metadata[CUT]["why"]
    assert replayed(log).cut_off


def test_a_log_whose_beginning_is_missing(lockstep: EditedLog, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, steps = tmp_path / "log.mcap", lockstep.places(STEP)
    late = EditedLog(lockstep.entries[steps[50] :], lockstep.metadata, lockstep.attachments)
    assert "its beginning is missing" in refused(late.write(path), capsys)
    unset = {name: values for name, values in lockstep.metadata.items() if name != "config"}
    assert "does not say what was asked for" in refused(EditedLog(lockstep.entries, unset, {}).write(path), capsys)
    nothing = EditedLog([entry for entry in lockstep.entries if entry.topic != STEP], lockstep.metadata, {})
    assert "no step" in refused(nothing.write(path), capsys)
    other = EditedLog(lockstep.entries, lockstep.metadata, {})
    other.metadata = {**lockstep.metadata, "config": {**lockstep.metadata["config"], "link": "sim://junior?seed=99"}}
    assert "sim://junior?seed=99" in refused(other.write(path), capsys)


@pytest.mark.nightly
def test_bytes_that_are_missing_are_no_traceback(lockstep: EditedLog, tmp_path: Path) -> None:
    """A log in which an entry of the wire is missing differs, or can't be replayed."""
    for topic in (RX, TX, "/bridge/session"):
        places = lockstep.places(topic)
        for place in (places[0], places[len(places) // 2], places[-1]):
            entries = lockstep.entries[:place] + lockstep.entries[place + 1 :]
            log = EditedLog(entries, lockstep.metadata, lockstep.attachments).write(tmp_path / "log.mcap")
            try:
                came = str(hil.replay(log).difference)
            except ReplayError as error:
                came = str(error)
            assert came != "None"


def test_a_log_of_an_older_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert "older version" in refused(GOLDEN, capsys)


def test_what_is_no_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = tmp_path / "other.mcap"
    other.write_bytes(b"something else")
    capsys.readouterr()
    assert run_hil(["replay", str(other)]) in {2, 4}
    assert "is not a log" in " ".join(capsys.readouterr().err.split())


def test_other_versions_are_named_before_the_difference(lockstep: EditedLog, tmp_path: Path) -> None:
    log = EditedLog(list(lockstep.entries), {**lockstep.metadata}, lockstep.attachments)
    other = json.dumps({**versions(), "numpy": "1.2.3"})
    log.metadata["config"] = {**log.metadata["config"], "versions": other}
    place = log.places("/pal/decision")[0]
    log.change(place, tried=7)
    report = hil.replay(log.write(tmp_path / "log.mcap"))
    assert report.versions == {"numpy": ("1.2.3", versions()["numpy"])}
    text = str(report)
    assert text.index("numpy was 1.2.3") < text.index("recorded")


# --- a run whose frames were signed --------------------------------------------------------------------------------------


def test_a_signed_run_asks_for_its_key(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    key, other, log = tmp_path / "key", tmp_path / "other", tmp_path / "log.mcap"
    for path in (key, other):
        assert run_hil(["keygen", str(path)]) == 0
    options = ["--controller", "chase", "--trials", "1", "--quiet", "--signing-key", str(key), "--log", str(log)]
    assert run_hil(["bout", "sim://junior?seed=5", *options]) == 0
    assert "needs the key (--signing-key FILE)" in refused(log, capsys)
    assert run_hil(["replay", str(log), "--strict", "--signing-key", str(key)]) == 0
    capsys.readouterr()
    assert run_hil(["replay", str(log), "--signing-key", str(other)]) == 1
    assert "sign" in capsys.readouterr().out  # another key is told as what it is, not as a robot that is silent


def test_records_are_encoded_as_the_recorder_does(lockstep: EditedLog) -> None:
    """What these tests change is changed in the recorder's own encoding."""
    for entry in lockstep.entries[:2000]:
        if entry.topic in RECORDS:
            assert encoded(entry.value) == entry.data
    assert encoded(EventRecord("link", "", "{}"))
