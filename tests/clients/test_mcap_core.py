"""Logs between this program and MCAP's JavaScript library: theirs are read here, ours there, every entry of every topic."""

from __future__ import annotations

import json
import shutil
from collections import Counter
from pathlib import Path
from typing import Any, Final

import pytest
from client_programs import Program
from mcap.reader import NonSeekingReader
from report_logs import coaching_log

from hil.mcaplog import LogReader
from hil.mcaplog.checking import check_log
from hil.mcaplog.making.recovery import recover
from hil.mcaplog.making.slimming import slim
from hil.mcaplog.writing.joints import PLOTS

pytest_plugins = ["client_fixtures"]
pytestmark = [pytest.mark.clients, pytest.mark.node]

HERE: Final = Path(__file__).parent


def node(clients: Path, folder: Path, script: str, *arguments: str) -> dict[str, Any]:
    """Run a script of this folder; what it prints, as JSON."""
    (folder / "node_modules").symlink_to(clients / "node_modules")
    shutil.copy(HERE / script, folder)
    with Program(["node", script, *arguments], folder) as program:
        status = program.end()
        assert status == 0, program.text
        found: dict[str, Any] = json.loads(program.text)
    return found


def test_every_form_of_a_file_gives_what_both_stock_readers_count(clients: Path, tmp_path: Path) -> None:
    counts = node(clients, tmp_path, "mcap_variants.mjs", "files")
    assert len(counts) == 416
    for name, count in counts.items():
        path = tmp_path / "files" / name
        reader = LogReader(path)
        given = len(list(reader.entries()))
        assert given + sum(reader.not_read.values()) == count, name
        assert reader.whole, name
        assert len(list(reader.entries(["example"]))) == given, name
        with path.open("rb") as file:
            assert sum(1 for _ in NonSeekingReader(file).iter_messages(log_time_order=False)) == count, name
        assert check_log(path).passed, name


def test_nothing_of_this_package_is_needed_to_read_a_log(clients: Path, tmp_path: Path) -> None:
    logs = {name: tmp_path / f"{name}.mcap" for name in ("log", "slim", "cut", "recovered")}
    coaching_log(logs["log"], budget=60)
    slim(logs["log"], logs["slim"])
    logs["cut"].write_bytes(logs["log"].read_bytes()[:-10_000])
    recover(logs["cut"], logs["recovered"])
    del logs["cut"]
    found = node(clients, tmp_path, "mcap_read.mjs", *(path.name for path in logs.values()))
    for path in logs.values():
        there = {topic: told["entries"] for topic, told in found[path.name].items()}
        assert there == Counter(entry.topic for entry in LogReader(path).raw_entries())
    last = {topic: told["last"] for topic, told in found["log.mcap"].items()}
    assert {topic: last[topic]["name"] for topic in PLOTS} == {topic: list(names) for topic, names in PLOTS.items()}
    sensors = list(LogReader(logs["log"]).entries(["/junior/sensors"]))[-1].value
    assert (last["/junior/sensors"]["eye"], last["/junior/sensors"]["battery"]) == (list(sensors.eye), sensors.battery)
