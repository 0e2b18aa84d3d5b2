"""Every door, with thousands of damaged files: a valid object comes out, or the door's own error, at a small cost."""

from __future__ import annotations

import random
import shutil
import time
import tracemalloc
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pytest
from damaged import as_json, as_toml, damaged_bytes, damaged_document, damaged_log, damaged_text, log_of, records_of
from report_logs import coaching_log

from firmware_protocol.errors import FaultSpecError
from firmware_protocol.vocabulary import ActionTally
from hil.files.config_file import ConfigFileError, load_config
from hil.files.fault_file import load_faults
from hil.files.memory_file import MemoryFileError, load_memory
from hil.files.parameter_loading import ParameterLoadError, read_parameters
from hil.mcaplog import LogError, compare_logs
from hil.mcaplog.checking import check_log
from hil.mcaplog.checking.rules import OURS
from hil.mcaplog.making.recovery import recover
from hil.mcaplog.making.slimming import slim
from hil.mcaplog.reading.flattening import write_tables
from hil.mcaplog.reading.overview import overview
from hil.report.gather import gather
from hil.report.happened.words import happenings_table, states_table, stops_said
from hil.report.words import bout_table, effort_table, learnt_table, link_table, metadata_tables, summary, title_of
from hil.signing.key_file import KeyFileError, load_key
from hil.sumo.advice_file import AdviceFileError, load_advice, save_advice
from hil.sumo.coaching import CheckpointError, load_checkpoint
from pal_advisor.maneuvers import Pal, PalSettings, Performance

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

MOST_MEMORY: Final = 100_000_000
"""What a damaged file may cost, in bytes."""
MOST_TIME: Final = 5.0
"""And in CPU time in s, with memory traced and on a slow machine: a backstop. Untraced none takes a second."""
TRACED: Final = 8
"""Of so many files the memory of one is traced: it makes everything slow."""
SETTINGS: Final = PalSettings(budget=60, population=6, pairs=True)


@dataclass(frozen=True)
class Kind:
    """One kind of file.

    Attributes:
        suffix: Of its files.
        error: The door's own error.
        damage: Makes a damaged file.
        load: Reads it, and uses what came out as the program would.
        weight: How much more that takes than with others: so much fewer are tried.
    """

    suffix: str
    error: type[Exception]
    damage: Callable[[random.Random], bytes]
    load: Callable[[Path], object]
    weight: int = 1


def learning(tells: int = 40) -> Pal:
    """An adviser in the middle of its work."""
    pal = Pal(SETTINGS, np.random.default_rng(5))
    practise(pal, tells)
    return pal


def practise(pal: Pal, tells: int) -> None:
    """Ask and tell, as a run would."""
    rng = np.random.default_rng(7)
    previous = None
    for _ in range(tells):
        if pal.finished:
            return
        current = int(rng.integers(4))
        trial = pal.ask(current, previous)
        tally = ActionTally(30, (20 * (current & 1), 20 * (current >> 1)), (1, 0), (0.1, 0.0), 0.01)
        over = bool(rng.random() < 0.2)
        count = len(trial.maneuver.actions)
        performance = Performance((tally,) * count, count, won=over, progress=0.01, over=over, duration=0.7)
        pal.tell(trial, performance)
        previous = None if over else current


def _advice(path: Path) -> None:
    advice = load_advice(path)
    for current in range(16):
        for previous in (None, *range(16)):
            advice.choose(current, previous)
    again = path.with_name("again.advice.json")
    save_advice(advice, again, overwrite=True)
    assert load_advice(again) == advice


def _checkpoint(path: Path) -> None:
    saved = load_checkpoint(path)
    assert 0 <= saved.progress.robot_seconds < float("inf")
    if saved.pal.settings.population <= 100:  # else it is right, and long
        practise(saved.pal, 12)
    entries = saved.pal.advice(opponent=saved.opponent, seed=saved.seed).to_dict()
    assert entries["version"] == 1


def _log(path: Path) -> None:
    data = gather(path)
    summary(data)
    title_of(data)
    for table in (
        bout_table,
        effort_table,
        happenings_table,
        states_table,
        stops_said,
        learnt_table,
        link_table,
        metadata_tables,
    ):
        table(data)


def _log_verbs(path: Path) -> None:
    """All that is done with a log besides reporting on it."""
    check_log(path)
    made = path.with_name("made")
    try:
        overview(path, sizes=True)
        recover(path, made / "whole.mcap")
        broken = {name for name, rule in check_log(made / "whole.mcap").rules.items() if not rule.passed}
        assert broken <= {"entries", *OURS}  # what is in entries is as it was
        compare_logs(path, made / "whole.mcap")
        slim(path, made / "slim.mcap")
        write_tables(path, made / "tables")
    finally:
        shutil.rmtree(made, ignore_errors=True)


def _whole(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError("expected a whole number")  # noqa: TRY004 - as a door of options asks for
    return value


def _config(path: Path) -> None:
    found = load_config(path, "coach", {"budget": _whole, "seed": _whole, "held_out": _whole, "config": _whole})
    assert all(type(value) is int for value in found.values())


@pytest.fixture(scope="module")
def kinds(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Kind]:
    folder = tmp_path_factory.mktemp("good")
    coaching_log(folder / "good.mcap", budget=6)
    log, records = (folder / "good.mcap").read_bytes(), records_of(folder / "good.mcap")
    pal = learning()
    advice = pal.advice(opponent="flat-light", seed=3).to_dict()
    checkpoint = {
        "version": 1, "seed": 3, "opponent": "flat-light", "bouts": 9, "wins": 4, "losses": 2, "robot_seconds": 31.5,
        "pal": pal.state_dict(),
    }  # fmt: skip
    faults = {
        "drop": 0.05, "rate": 900.0, "stuck": [{"sensor": "eye_left", "at": 5, "lasts": 3.0, "value": 60}],
        "wheel": [{"side": "left", "at": 40}], "unplug": [20, {"at": 30, "lasts": float("inf")}], "battery": [{"voltage": 6.2}],
    }  # fmt: skip
    config = {"seed": 7, "coach": {"budget": 9, "held-out": 0}}
    parameters = {"SYS_ID": 1.0, "EYE_L_ON": 250.0, "TRIM_LEFT": 0.97, "MEM_SLOTS": 32.0}
    memory = bytes(range(256)) * 4

    def document(good: Any, write: Callable[[Any], bytes]) -> Callable[[random.Random], bytes]:  # noqa: ANN401 - plain values
        return lambda rng: damaged_document(good, write, rng)

    return {
        "advice": Kind(".toml", AdviceFileError, document(advice, as_toml), _advice),
        "advice in JSON": Kind(".json", AdviceFileError, document(advice, as_json), _advice),
        "checkpoint": Kind(".json", CheckpointError, document(checkpoint, as_json), _checkpoint),
        "configuration": Kind(".toml", ConfigFileError, document(config, as_toml), _config),
        "faults": Kind(".toml", FaultSpecError, document(faults, as_toml), load_faults),
        "faults in JSON": Kind(".json", FaultSpecError, document(faults, as_json), load_faults),
        "parameters": Kind(".toml", ParameterLoadError, document(parameters, as_toml), read_parameters),
        "key": Kind(".key", KeyFileError, lambda rng: damaged_text(b"0123456789abcdef" * 4 + b"\n", rng), load_key),
        "memory": Kind(".bin", MemoryFileError, lambda rng: damaged_bytes(memory, rng), load_memory),
        "log": Kind(".mcap", LogError, lambda rng: damaged_log(log, records, rng), _log),
        "log, by its verbs": Kind(".mcap", LogError, lambda rng: damaged_log(log, records, rng), _log_verbs, weight=4),
    }


NAMES: Final = (
    "advice", "advice in JSON", "checkpoint", "configuration", "faults", "faults in JSON", "parameters", "key", "memory", "log",
    "log, by its verbs",
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("count", [200, pytest.param(2000, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("name", NAMES)
def test_a_damaged_file_costs_little_and_gives_nothing_but_the_doors_error(
    kinds: dict[str, Kind], name: str, count: int, tmp_path: Path
) -> None:
    kind = kinds[name]
    count //= kind.weight
    path = tmp_path / f"damaged{kind.suffix}"
    refused = 0
    try:
        for number in range(count):
            if number % TRACED == 0:
                tracemalloc.start()
            data = kind.damage(random.Random(f"{name} {number}"))
            path.write_bytes(data)
            path.chmod(0o600)
            begun = time.process_time()
            try:
                kind.load(path)
            except kind.error as error:
                refused += 1
                said = str(error)
                assert str(path) in said, number
                assert len(said) < len(str(path)) + 600, (number, said)
                assert said.isprintable(), (number, said)
            assert time.process_time() - begun < MOST_TIME, number
            assert tracemalloc.get_traced_memory()[1] < MOST_MEMORY, number
            tracemalloc.stop()
    finally:
        tracemalloc.stop()
    if not name.startswith("log"):  # whose damage is told and not raised
        assert refused > count // 4
    assert refused < count
    assert {one.name for one in tmp_path.iterdir()} <= {path.name, "again.advice.json"}


def test_what_is_not_damaged_comes_in(kinds: dict[str, Kind], tmp_path: Path) -> None:
    assert set(kinds) == set(NAMES)
    pal = learning()
    (tmp_path / "good.json").write_bytes(as_json(pal.advice().to_dict()))
    _advice(tmp_path / "good.json")
    state = {"bouts": 1, "wins": 0, "losses": 0, "robot_seconds": 2, "version": 1, "seed": 1, "opponent": "unknown"}
    (tmp_path / "checkpoint").write_bytes(as_json({**state, "pal": pal.state_dict()}))
    _checkpoint(tmp_path / "checkpoint")
    (tmp_path / "empty.mcap").write_bytes(log_of([b""]))
    _log(tmp_path / "empty.mcap")
