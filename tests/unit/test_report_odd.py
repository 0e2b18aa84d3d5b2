"""Reports of logs that hold what nobody expects: shown as such, and never the end of the report."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import pytest
from report_logs import bout_log, coaching_log, driving_log, open_recorder

from firmware_protocol.messages import BoutOutcome, JuniorSensors, OpponentCode, Phase, RefereeState
from firmware_protocol.vocabulary import Action
from hil.mcaplog.records import AdviceRecord, EventRecord, RejectedInput, StepRecord, TrialRecord
from hil.mcaplog.schemas import message_schema, record_schema
from hil.mcaplog.writing.encode import compile_encoder, sender_suffix
from hil.mcaplog.writing.writer import LogWriter
from hil.report import write as writing
from hil.report import write_report
from hil.report.learnt import read_learnt
from hil.report.report_table import LONGEST_CELL, MOST_ROWS, ReportTable
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from firmware_protocol.wire.fields import Message

pytestmark = pytest.mark.slow  # pictures are drawn

NAN = math.nan
GOOD = Advice(PalSettings(), (AdviceEntry(255, 3, (Action.FF,) * 4, 2.5, 7), AdviceEntry(255, 0, (Action.L,), 1.5, 3)))


def log_of(path: Path, entries: Sequence[tuple[float, Message | object]]) -> None:
    """A log of messages from robot 1 and of records, as they are."""
    writer = LogWriter(path, run={})
    topics = {TrialRecord: "/pal/trial", StepRecord: "/pal/generation", AdviceRecord: "/pal/advice", EventRecord: "/events"}
    for number, (time, entry) in enumerate(entries):
        if isinstance(entry, RefereeState | JuniorSensors):
            schema = message_schema(type(entry))
            data = compile_encoder(schema)(entry) + sender_suffix(1, 1, number & 0xFF)
            writer.write(writer.channel(schema.topic, schema), time, data)
        else:
            record = record_schema(type(entry))
            writer.write(
                writer.channel(topics.get(type(entry), "/wire/rejected"), record), time, compile_encoder(record)(entry)
            )
    writer.close()


def state(elapsed: float, *, x: float = 0.1, phase: int = Phase.RUNNING, outcome: int = 0, opponent: int = 1) -> RefereeState:
    return RefereeState(elapsed, 1, elapsed, (x, 0.0), 0.1, (0.2, x), 0.2, 0.1, phase, outcome, opponent)


def trial(number: int, current: str, previous: str = "any", **changes: Any) -> TrialRecord:  # noqa: ANN401 - any field
    values: dict[str, Any] = {
        "id": number, "previous": previous, "current": current, "phase": 1, "exam": False, "actions": "F F F F", "period": 0.15,
        "fitness": 1.0, "performed": 4, "won": False, "lost": False, "progress": 0.0, "duration": 0.6, "ended": "completed",
    }  # fmt: skip
    return TrialRecord(**{**values, **changes})


def step(current: str, generation: int, **changes: Any) -> StepRecord:  # noqa: ANN401 - any field
    values: dict[str, Any] = {
        "previous": "any", "current": current, "phase": 1, "generation": generation, "used": 10 * generation, "evaluations": 3,
        "best": 2.0 + generation, "mean": 1.0, "actions": "F F F F",
    }  # fmt: skip
    return StepRecord(**{**values, **changes})


def test_an_outcome_and_a_phase_that_nobody_knows_are_told(tmp_path: Path) -> None:
    states = [(0.1 * n, state(0.1 * n, phase=9 if n == 3 else Phase.RUNNING, opponent=77)) for n in range(20)]
    log_of(tmp_path / "odd.mcap", [*states, (2.1, state(2.1, phase=Phase.OVER, outcome=9, opponent=77))])
    report = write_report(tmp_path / "odd.mcap", tmp_path / "report")
    page = report.page.read_text("utf-8")
    assert "1 times: outcome 9 of a bout, which this program does not know" in page
    assert "1 times: phase 9 of a bout" in page
    assert "number 77" in report.title
    assert "bouts" in {path.stem for path in report.pictures}


@pytest.mark.parametrize("x", [NAN, math.inf, -math.inf, 1e300, 5e5])
def test_poses_that_are_no_place_are_counted_and_left_out(tmp_path: Path, x: float) -> None:
    states = [(0.1 * n, state(0.1 * n, x=x if n % 3 == 1 else 0.1)) for n in range(20)]
    log_of(tmp_path / "odd.mcap", [*states, (2.1, state(2.1, phase=Phase.OVER, outcome=BoutOutcome.WIN))])
    report = write_report(tmp_path / "odd.mcap", tmp_path / "report")
    assert "7 times: poses that are no place in an arena" in report.page.read_text("utf-8")
    assert "bouts" in {path.stem for path in report.pictures}


def test_bouts_of_such_poses_alone_and_of_endless_time(tmp_path: Path) -> None:
    entries: list[tuple[float, object]] = []
    for number in range(8):
        entries += [(number + 0.1 * n, state(NAN if n else 0.0, x=NAN)) for n in range(5)]
        entries.append((number + 0.9, state(1e9 if number % 2 else NAN, phase=Phase.OVER, outcome=BoutOutcome.WIN)))
    log_of(tmp_path / "odd.mcap", entries)
    report = write_report(tmp_path / "odd.mcap", tmp_path / "report")
    assert "8 of 8 won" in " ".join(report.summary)


def test_trials_and_steps_of_situations_and_phases_that_nobody_knows(tmp_path: Path) -> None:
    names = ("both", "sideways", "", "any", "$x^{", "_left")
    entries: list[tuple[float, object]] = [(0.1 * n, trial(n, name, phase=n - 2)) for n, name in enumerate(names)]
    entries += [(1.0, trial(9, "left", previous="nowhere", fitness=NAN, duration=math.inf))]
    for number in range(40):
        odd = {"phase": number + 3} if number % 2 else {}
        entries.append((2.0, step("both", number, best=NAN if number == 4 else 1e305, used=-(2**62), **odd)))
        entries.append((2.0, step("sideways", 2**62, used=1)))
    log_of(tmp_path / "odd.mcap", entries)
    report = write_report(tmp_path / "odd.mcap", tmp_path / "report")
    page = report.page.read_text("utf-8")
    assert "any, sideways (not known)" in page
    assert "Trials of situations that this program does not know" in page
    assert {"fitness", "learning"} <= {path.stem for path in report.pictures}
    assert report.title == "Pal coached Junior"


def with_advice(path: Path, text: str) -> str:
    log_of(path, [(0.0, trial(1, "both")), (0.1, AdviceRecord("{}")), (0.2, AdviceRecord(text))])
    return write_report(path, path.with_suffix("")).page.read_text("utf-8")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[" * 100_000, "The advice can't be read"),
        ("{" * 5, "no valid JSON"),
        ('{"entries": ' + "9" * 5000 + "}", "too many digits"),
        ('{"a": NaN}', "NaN is no number"),
        ("[1, 2]", "expected a table"),
        ('{"entries": 7}', "has no list of entries, but 7"),
        ('{"entries": [], "settings": {"period": "x"}}', "settings.period is"),
        ("x" * 2_000_000, "2,000,000 letters"),
    ],
)
def test_advice_that_is_none_is_told_and_costs_nothing_else(tmp_path: Path, text: str, said: str) -> None:
    page = with_advice(tmp_path / "odd.mcap", text)
    assert said.replace("'", "&#x27;") in page or said in page
    assert "How much was practised" in page


def test_one_wrong_entry_leaves_the_others(tmp_path: Path) -> None:
    data = GOOD.to_dict()
    data["entries"] += [{**data["entries"][0], "current": "left", "fitness": "much"}, data["entries"][1]] + [{"a": 1}] * 5
    page = with_advice(tmp_path / "odd.mcap", json.dumps(data))
    assert "entries[2].fitness: expected a number" in page
    assert "entries[3]: a second entry" in page
    assert "and 4 more" in page
    assert "fast forward, 4 times" in page
    assert (tmp_path / "odd" / "maneuvers.svg").is_file()
    learnt, said = read_learnt(json.dumps(data))
    assert learnt is not None
    assert learnt.entries == GOOD.entries
    assert len(said) == 1


def test_names_with_signs_of_markup_are_drawn_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "odd.mcap"
    with open_recorder(tmp_path / "series.mcap") as recorder:
        recorder.series("$x^{ [bold] <b> & \\frac")
    outcomes = [(BoutOutcome.WIN, 2.0)] * 6
    bout_log(tmp_path / "bouts.mcap", outcomes, [OpponentCode.FLAT_HEAVY] * 6)
    entries: list[tuple[float, object]] = [(0.0, EventRecord("series", "$x^{ [bold] <b> & \\frac", "{}"))]
    for number in range(6):
        entries += [(number + 0.1 * n, state(0.1 * n)) for n in range(5)]
        entries.append((number + 0.9, state(0.9, phase=Phase.OVER, outcome=BoutOutcome.WIN)))
    log_of(path, entries)
    report = write_report(path, tmp_path / "report")
    assert {"bouts", "times"} <= {path.stem for path in report.pictures}
    assert "$x^{ [bold] &lt;b&gt; &amp; \\frac" in report.page.read_text("utf-8")


def test_a_log_of_very_many_things_is_told_in_a_page_that_can_be_read(tmp_path: Path) -> None:
    entries: list[tuple[float, object]] = [(0.01 * n, EventRecord("link", f"event {n}", "{}")) for n in range(2000)]
    entries += [(0.01 * n, trial(n, f"situation {n}")) for n in range(2000)]
    entries += [(0.01 * n, RejectedInput(f"reason {n}", "", b"")) for n in range(1000)]
    for number in range(400):
        entries.append((number, EventRecord("series", f"series {number}", "{}")))
        entries += [(number, state(0.0)), (number, state(0.5, phase=Phase.OVER, outcome=BoutOutcome.WIN))]
    log_of(tmp_path / "odd.mcap", entries)
    report = write_report(tmp_path / "odd.mcap", tmp_path / "report")
    page = report.page.read_text("utf-8")
    assert len(report.summary) < 20
    assert page.count("<tr>") < 5 * MOST_ROWS
    assert "… and 1,700 more" in page


def test_a_table_has_the_first_of_many_rows_and_the_beginning_of_a_long_text() -> None:
    table = ReportTable("many", ("a", "b"), tuple((str(n), "x" * 10_000) for n in range(MOST_ROWS + 5)))
    assert len(table.rows) == MOST_ROWS + 1
    assert table.rows[-1] == ("… and 5 more", "")
    assert len(table.rows[0][1]) == LONGEST_CELL


def test_sensors_that_are_no_numbers(tmp_path: Path) -> None:
    readings = [
        (0.02 * n, JuniorSensors(0.02 * n, (NAN, math.inf), (2**32 - 1, 0), (5, 5), NAN if n % 2 else 1e300, 2**32 - 1))
        for n in range(50)
    ]
    log_of(tmp_path / "odd.mcap", readings)
    report = write_report(tmp_path / "odd.mcap", tmp_path / "report")
    assert "50 readings" in " ".join(report.summary)


def test_a_picture_that_cannot_be_drawn_is_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: object) -> None:
        raise ValueError("[no] picture")

    driving_log(tmp_path / "drive.mcap", seconds=2.0)
    monkeypatch.setattr(writing, "link_quality", fail)
    report = write_report(tmp_path / "drive.mcap", tmp_path / "report")
    assert "The picture “link” can’t be drawn from what the log holds: [no] picture." in report.page.read_text("utf-8")
    assert [path.stem for path in report.pictures] == ["sensors"]


def test_a_good_log_has_nothing_odd(tmp_path: Path) -> None:
    coaching_log(tmp_path / "coach.mcap", budget=60)
    report = write_report(tmp_path / "coach.mcap", tmp_path / "report")
    assert report.health == ""
    assert "could make nothing of" not in report.page.read_text("utf-8")
