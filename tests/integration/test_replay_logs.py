"""The logs that are kept in the repository come out the same: what was decided, and every byte of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

import hil
from hil.mcaplog.reading.reader import LogReader

if TYPE_CHECKING:
    from hil.mcaplog.records import BridgeStep

FOLDER: Final = Path(__file__).parents[1] / "replay_logs"
LOGS: Final = sorted(FOLDER.glob("*.mcap"))
TEN: Final = {
    "lockstep", "lockstep_can", "pty", "can_real_time", "faults", "unplugged", "lost", "interrupted", "resumed", "bout",
}  # fmt: skip
ENDED: Final = {"interrupted": "interrupted", "lost": "closed the connection; it did not come back within 1 s"}
"""Of those that did not come to their own end: what is said of it."""
MOST: Final = 3_000_000
"""Bytes that they may take together."""
LONGEST: Final = 75.0
"""So long may one be, in s: a robot minute, and what comes before and after it."""


@pytest.mark.parametrize("strict", [False, True], ids=["decisions", "all entries"])
@pytest.mark.parametrize("log", LOGS, ids=lambda log: log.stem)
def test_a_log_comes_out_the_same(log: Path, *, strict: bool) -> None:
    report = hil.replay(log, strict=strict)
    assert report.same, str(report)
    assert not report.cut_off
    assert report.duration <= LONGEST
    assert report.compared > report.steps
    if strict:
        assert report.compared == sum(1 for _ in LogReader(log).raw_entries())
    assert ENDED.get(log.stem, "") in report.ended
    assert bool(report.ended) == (log.stem in ENDED)


def test_the_ten_are_there_and_small() -> None:
    assert {log.stem for log in LOGS} >= TEN
    assert sum(log.stat().st_size for log in LOGS) <= MOST


def test_what_they_are_for_is_in_them() -> None:
    def met(name: str) -> list[BridgeStep]:
        return [entry.value for entry in LogReader(FOLDER / f"{name}.mcap").entries({"/bridge/step"})]

    assert any(step.back for step in met("unplugged"))
    assert not any(step.back for step in met("lost"))
    assert any(step.ended for step in met("lost"))
    assert [step.inputs for step in met("interrupted") if step.inputs] == [("interrupt",)]
    assert {"key a", "key e", "key q"} <= {key for step in met("extra_monitor") for key in step.inputs}
    for name in ("faults", "resumed"):
        reader = LogReader(FOLDER / f"{name}.mcap")
        topics = {entry.topic for entry in reader.raw_entries()}
        assert name != "faults" or "/wire/rejected" in topics
        assert name != "resumed" or "begin/checkpoint.json" in reader.attachments
