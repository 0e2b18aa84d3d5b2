"""Nothing of this package is needed to read a log: the stock libraries decode every entry of every topic."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from report_logs import coaching_log

from firmware_protocol.events import Received
from firmware_protocol.messages import JuniorSensors
from hil.mcaplog import LogReader
from hil.mcaplog.making.slimming import slim
from hil.mcaplog.writing.joints import PLOTS
from hil.recording.recorder import Recorder

if TYPE_CHECKING:
    from pathlib import Path


def test_every_entry_is_decoded_by_the_factories_that_the_page_names(tmp_path: Path) -> None:
    ros2 = pytest.importorskip("mcap_ros2.decoder", reason="mcap-ros2-support is not installed")
    path = tmp_path / "log.mcap"
    coaching_log(path, budget=20)
    seen: Counter[str] = Counter()
    plotted: dict[str, list[str]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory(), ros2.DecoderFactory()])
        for _, channel, _, decoded in reader.iter_decoded_messages():
            seen[channel.topic] += 1
            assert decoded is not None
            if channel.topic in PLOTS:
                plotted[channel.topic] = list(decoded.name)
                assert len(decoded.position) == len(decoded.name)
    assert seen == Counter(entry.topic for entry in LogReader(path).raw_entries())
    assert plotted == {topic: list(names) for topic, names in PLOTS.items()}


def test_wheels_have_positions_and_velocities(tmp_path: Path) -> None:
    ros2 = pytest.importorskip("mcap_ros2.decoder", reason="mcap-ros2-support is not installed")
    path = tmp_path / "log.mcap"
    with Recorder(path, run={}, config={}, link="memory:", lockstep=True) as recorder:
        for number in range(11):
            time = number * 0.2
            sensors = JuniorSensors(time, (0.5 * time, -0.25 * time), (1, 2), (3, 4), 7.4, 0)
            recorder.received(Received(sensors, 1, 1, number, time, b""))
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[ros2.DecoderFactory()])
        states = [state for *_, state in reader.iter_decoded_messages(["/junior/plot/wheels"])]
    assert [list(state.position) for state in states[::5]] == [
        pytest.approx([0.5 * second, -0.25 * second]) for second in (0.0, 1.0, 2.0)
    ]
    assert all(list(state.velocity) == pytest.approx([0.5, -0.25]) for state in states[1:])
    assert [(state.header.stamp.sec, state.header.stamp.nanosec) for state in states[5:11:5]] == [(1, 0), (2, 0)]


def test_slim_logs_are_read_by_them_too(tmp_path: Path) -> None:
    path, out = tmp_path / "log.mcap", tmp_path / "slim.mcap"
    coaching_log(path, budget=20)
    slim(path, out)
    with out.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        seen = Counter(channel.topic for _, channel, _, _ in reader.iter_decoded_messages())
    assert seen == Counter(entry.topic for entry in LogReader(out).raw_entries())
