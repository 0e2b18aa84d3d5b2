"""Reports: one page that needs nothing else, whose numbers are the log's, for every kind of log and for broken ones."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from typing import TYPE_CHECKING

import numpy as np
import pytest
from report_logs import Wire, bout_log, coaching_log, driving_log, open_recorder

from firmware_protocol.messages import BoutOutcome, OpponentCode, RobotStatus, Timesync
from firmware_protocol.vocabulary import ANY_STIMULUS, Action, spelled_out
from hil.mcaplog import LogError, LogReader
from hil.report import ReportFiles, write_report
from hil.report.bout_figures import choose, trajectories
from hil.report.curve_figures import fitness_by_generation, fitness_by_maneuvers
from hil.report.gather import gather
from hil.report.learning_figures import category_name, maneuver_strips, sort_key, wins_over_run
from hil.report.link import LinkWatcher
from hil.report.link_figures import MOST_POINTS, link_quality, sensors_over_time, with_extremes
from hil.report.page import Pictures, Section, render
from hil.report.run_data import BoutPath, RunData
from hil.report.style import EYE_STYLES, figure, png, styled, svg
from hil.report.words import bout_table, effort_table, learnt_table, link_table, summary
from pal_advisor.maneuvers import GenerationRecord

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.figure import Figure

pytestmark = pytest.mark.slow  # pictures are drawn

PNG = b"\x89PNG\r\n\x1a\n"
WIN, LOSS, DRAW = BoutOutcome.WIN, BoutOutcome.LOSS, BoutOutcome.DRAW


class Page(HTMLParser):
    """What a page asks a browser for, and its text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.wanted: list[str] = []
        self.text = ""
        self._open: list[str] = []
        self.feed(html)
        self.balanced = not self._open

    def handle_starttag(self, tag: str, attrs: Sequence[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.wanted += [value or "" for name, value in attrs if name in {"src", "href", "xlink:href", "srcset", "data"}]
        if tag not in {"meta", "img", "link", "br"}:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data + " "


@pytest.fixture(scope="module")
def coached(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("coached") / "coach.mcap"
    coaching_log(path, budget=240)
    return path


@pytest.fixture(scope="module")
def report(coached: Path) -> ReportFiles:
    return write_report(coached, coached.parent / "report")


def test_the_page_needs_nothing_else(report: ReportFiles) -> None:
    html = report.page.read_text("utf-8")
    page = Page(html)
    assert page.balanced
    assert page.wanted
    names = set(re.findall(r' id="([^"]*)"', html))
    assert all(address.startswith("#") and address[1:] in names for address in page.wanted)
    assert not {"script", "link", "iframe", "metadata"} & set(page.tags)
    assert "@import" not in html
    assert "DejaVu" not in html, "letters are the reader's own"
    assert set(re.findall(r"url\(#([^)]*)\)", html)) <= names
    assert not re.findall(r"url\((?!#)|https?://", html)


def test_no_two_pictures_of_a_page_share_a_name(report: ReportFiles) -> None:
    names: list[str] = []
    for picture in report.pictures:
        names += set(re.findall(r' id="([^"]*)"', picture.read_text("utf-8")))
    assert names
    assert len(names) == len(set(names))


def test_colours_are_the_page_s_to_change(report: ReportFiles) -> None:
    html = report.page.read_text("utf-8")
    (dark,) = re.findall(r"@media screen and \(prefers-color-scheme: dark\) \{(.*?)\n\}", html, re.DOTALL)
    drawn = re.findall(r"<svg.*?</svg>", html, re.DOTALL)
    assert len(drawn) == len(report.pictures)
    used = set(re.findall(r"var\((--c-[0-9a-f]{6}),", "".join(drawn)))
    assert "--c-0072b2" in used
    assert used <= set(re.findall(r"--c-[0-9a-f]{6}", dark)), "each has a colour of its own in the dark"
    assert not re.search(r"[ :]#[0-9a-f]{6}", "".join(drawn)), "none is fixed"
    assert all("var(" not in picture.read_text("utf-8") for picture in report.pictures), "drawing programs know no variables"


def test_every_picture_is_on_the_page_and_beside_it(report: ReportFiles) -> None:
    names = [path.stem for path in report.pictures]
    assert names == ["maneuvers", "fitness", "learning", "wins", "trajectories", "link"]
    drawings = [path.read_text("utf-8") for path in report.pictures]
    assert all(drawing.startswith("<svg ") and Page(drawing).balanced for drawing in drawings)
    html = report.page.read_text("utf-8")
    assert html.count("<svg ") == html.count('role="img"') == len(names)
    assert len(html) < 500_000
    assert json.loads(report.layout.read_text("utf-8"))["layout"]


def test_the_numbers_are_those_of_the_log(report: ReportFiles, coached: Path) -> None:
    entries = list(LogReader(coached).entries())
    bouts = [json.loads(e.value.fields) for e in entries if e.topic == "/events" and e.value.kind == "bout"]
    wins, losses, draws = (sum(bout["outcome"] == outcome for bout in bouts) for outcome in ("win", "loss", "draw"))
    page = Page(report.page.read_text("utf-8"))
    assert f"Junior performed {sum(e.topic == '/pal/trial' for e in entries):,} maneuvers" in page.text
    advice = json.loads(next(e.value.json for e in entries if e.topic == "/pal/advice"))
    for entry in advice["entries"]:
        assert " ".join(entry["actions"]) in page.text
        assert spelled_out([Action[name] for name in entry["actions"]]) in page.text
        assert f"{entry['fitness']:.2f}" in page.text
    frames = sum(e.frame is not None for e in entries)
    assert f"The link carried {frames:,} good frames" in page.text
    table = bout_table(gather(coached))
    assert table is not None
    assert table.rows[0][:6] == ("coaching", "flat-light", *map(str, (len(bouts), wins, losses, draws)))
    assert table.rows[0][3] in page.text


def test_each_category_s_curve_has_its_own_length(coached: Path) -> None:
    data = gather(coached)
    entries = [entry.value for entry in LogReader(coached).entries(["/pal/generation"])]
    with styled():
        drawn = fitness_by_generation(data)
    assert drawn is not None
    assert [axes.get_title(loc="left") for axes in drawn.axes] == ["Phase 1: basic actions", "Phase 2: fine actions"]
    for axes, phase in zip(drawn.axes, (1, 2), strict=True):
        lines = {str(line.get_label()): line for line in axes.get_lines()}
        for current in ("none", "left", "right", "both"):
            steps = [step for step in entries if step.phase == phase and step.current == current]
            if steps:
                assert list(np.asarray(lines[current].get_ydata())) == [step.best for step in steps]
        assert lines["none"].get_color() == EYE_STYLES[0]["color"]
    styles = {eyes: (style["linestyle"], style["marker"]) for eyes, style in EYE_STYLES.items()}
    assert styles == {0: ("-", ""), 1: (":", "o"), 2: ("--", "*"), 3: ("-", "")}


def test_the_phase_boundary_and_the_exam_are_marked(coached: Path) -> None:
    data = gather(coached)
    with styled():
        drawn = fitness_by_maneuvers(data)
    assert drawn is not None
    (axes,) = drawn.axes
    marks = {text.get_text(): text.xy[0] for text in axes.texts}  # type: ignore[attr-defined]
    assert marks == {"phase 2": 96, "exam": 192}


def test_the_effort_adds_up(coached: Path) -> None:
    data = gather(coached)
    table = effort_table(data)
    assert table is not None
    assert sum(int(row[1]) for row in table.rows) == 240
    assert sum(int(row[3]) for row in table.rows) == len(data.generations)


@pytest.mark.slow
def test_bouts_are_told_by_opponent_with_intervals(tmp_path: Path) -> None:
    outcomes = [(WIN, 2.0)] * 6 + [(LOSS, 3.0)] * 2 + [(DRAW, 15.0)] + [(WIN, 4.0)] * 5
    opponents = [OpponentCode.FLAT_HEAVY] * 9 + [OpponentCode.POINT_LIGHT] * 5
    bout_log(tmp_path / "bouts.mcap", outcomes, opponents)
    report = write_report(tmp_path / "bouts.mcap", tmp_path)
    assert report.title == "Junior’s bouts against flat-heavy and point-light"
    assert [path.stem for path in report.pictures] == ["bouts", "times", "link"]
    table = bout_table(gather(tmp_path / "bouts.mcap"))
    assert table is not None
    heavy, point = table.rows
    assert heavy[1:] == ("flat-heavy", "9", "6", "2", "1", "0", "0.667", "0.354 to 0.879", "2.00 s")
    assert point[1:7] == ("point-light", "5", "5", "0", "0", "0")
    assert any("6 of 9 won, 66.7% (95% interval 35.4% to 87.9%)" in text for text in report.summary)


def test_the_bouts_shown_are_the_telling_ones(tmp_path: Path) -> None:
    outcomes = [(WIN, 2.0 + index / 10) for index in range(20)] + [(LOSS, 3.0), (DRAW, 15.0)]
    bout_log(tmp_path / "bouts.mcap", outcomes)
    bouts = gather(tmp_path / "bouts.mcap").bouts
    shown = choose(bouts, learnt=False)
    assert [(bout.outcome, round(bout.duration, 1)) for bout in shown] == [
        (WIN, 2.0), (WIN, 2.1), (WIN, 3.0), (WIN, 3.9), (LOSS, 3.0), (DRAW, 15.0),
    ]  # fmt: skip
    assert [bout.number for bout in choose(bouts, learnt=True)] == [1, 2, 11, 12, 21, 22]
    assert choose(bouts[:3], learnt=False) == bouts[:3]


def test_driving_is_shown_as_sensors_and_link(tmp_path: Path) -> None:
    driving_log(tmp_path / "drive.mcap")
    data = gather(tmp_path / "drive.mcap")
    assert data.sensors is not None
    assert (len(data.sensors.times), len(data.sensors.wheel_times)) == (1000, 50)
    link = data.link
    assert (link.lost, sum(link.rejected.values()), link.retries, link.duplicates) == (40, 20, 10, 0)
    assert len(link.round_trips) == 30  # those that had to be asked twice do not count
    report = write_report(tmp_path / "drive.mcap", tmp_path)
    assert [path.stem for path in report.pictures] == ["sensors", "link"]
    page = Page(report.page.read_text("utf-8"))
    assert "40 (3.70%)" in page.text
    assert "robot 1 is lost: silent for 3 s" in page.text
    assert data.parameters["SPD_FAST"] == 0.9


def test_a_time_without_readings_is_shown_as_that(tmp_path: Path) -> None:
    driving_log(tmp_path / "drive.mcap", silent=(5.0, 8.0))
    data = gather(tmp_path / "drive.mcap")
    assert data.sensors is not None
    ((start, end),) = data.sensors.gaps.tolist()
    assert (start, end) == pytest.approx((4.98, 8.0), abs=0.07)
    drawn = sensors_over_time(data)
    assert drawn is not None
    eyes, _, _, flags, battery = drawn.axes
    for line in (*eyes.get_lines()[:2], battery.get_lines()[0]):
        times, values = line.get_data()
        assert np.isnan(np.asarray(values)[(np.asarray(times) >= start) & (np.asarray(times) < end)]).any(), (
            "the line is broken"
        )
    bars = [path.get_extents() for bar in flags.collections for path in bar.get_paths()]
    assert not [bar for bar in bars if bar.x0 < end - 0.01 and bar.x1 > start + 0.05]
    page = Page(write_report(tmp_path / "drive.mcap", tmp_path).page.read_text("utf-8"))
    assert "none came, which is grey in the picture" in page.text


def test_round_trips_and_the_robot_s_own_counters(tmp_path: Path) -> None:
    with open_recorder(tmp_path / "log.mcap") as recorder:
        wire = Wire(recorder)
        for _ in range(10):
            wire.command(round_trip=0.02)
            wire.now += 1.0
            wire.down(Timesync(0, round(wire.now * 1e9), 1, 1))
            wire.now += 0.03
            wire.up(Timesync(5, round((wire.now - 0.03) * 1e9)))
        status = {"good": 123, "bad_checksum": 4, "unknown": 5, "lost": 6, "boot_count": 7}
        wire.up(RobotStatus(**dict.fromkeys(RobotStatus.__dataclass_fields__, 0) | status))
    data = gather(tmp_path / "log.mcap")
    assert sorted(data.link.round_trips) == pytest.approx([0.02] * 10 + [0.03] * 10)
    rows = {row[0]: row[1] for row in link_table(data).rows}
    assert rows["The robot’s count of our frames: good"] == "123"
    assert rows["… with a bad checksum, unknown"] == "4, 5"
    assert rows["Starts of the robot so far"] == "7"
    assert rows["Time to an answer, of 20"] == "median 25.0 ms, 99 % 30.0 ms"


def test_the_picture_and_the_table_tell_the_same_quantiles(tmp_path: Path) -> None:
    data = RunData(tmp_path)
    data.link.arrivals = [0.0, 10.0]
    data.link.round_trips = [0.001 * number for number in range(1, 101)]
    with styled():
        drawn = link_quality(data)
    assert drawn is not None
    assert [line.get_label() for line in drawn.axes[1].get_lines()] == ["median: 50.5 ms", "99 %: 99 ms"]
    assert ("Time to an answer, of 100", "median 50.5 ms, 99 % 99.0 ms") in link_table(data).rows


def test_a_long_line_keeps_its_extremes() -> None:
    times, values = np.arange(10_000.0), np.zeros(10_000)
    values[7_777], values[1_234] = 900.0, -3.0
    shown = dict(zip(*(column.tolist() for column in with_extremes(times, values)), strict=True))
    assert len(shown) <= MOST_POINTS
    assert list(shown) == sorted(shown)
    assert (shown[7_777.0], shown[1_234.0]) == (900.0, -3.0)


def test_a_drawing_that_would_be_huge_is_pixels(monkeypatch: pytest.MonkeyPatch) -> None:
    def draw() -> Figure:
        drawn = figure(2.0, 1.0)
        drawn.subplots().plot([0, 1], [0, 1])
        return drawn

    small = Pictures().drawing("line", draw, "A line.")
    both = Pictures(png=True).drawing("line", draw, "A line.")
    monkeypatch.setattr("hil.report.page.MOST_SVG", 100)
    huge = Pictures().drawing("line", draw, "A line.")
    assert small is not None
    assert both is not None
    assert huge is not None
    assert (list(small.files()), list(both.files()), list(huge.files())) == (
        ["line.svg"],
        ["line.svg", "line.png"],
        ["line.png"],
    )
    assert huge.png.startswith(PNG)
    page = render("", "", [], numbers=[], sections=[Section("", pictures=[huge])], footer="")
    assert "data:image/png;base64," in page
    assert "<svg" not in page


@pytest.mark.parametrize(
    ("frames", "lost", "duplicates"),
    [
        ([0, 1, 2, 3], 0, 0),
        ([254, 255, 0, 1], 0, 0),
        ([0, 3, 4], 2, 0),
        ([0, 1, 1, 2], 0, 1),
        ([0, 2, 1, 3, 4], 0, 0),  # one came late
        ([250, 4], 9, 0),
    ],
)
def test_lost_frames_are_counted_by_their_numbers(frames: list[int], lost: int, duplicates: int) -> None:
    watcher = LinkWatcher()
    for frame in frames:
        watcher.came([((1, 1), frame, 0.0)])
    assert (watcher.quality.lost, watcher.quality.duplicates, watcher.quality.good) == (lost, duplicates, len(frames))


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.02, 0.3, 0.7, 0.999])
def test_a_log_cut_off_gives_a_report_of_what_there_is(coached: Path, tmp_path: Path, share: float) -> None:
    data = coached.read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: int(share * len(data))])
    report = write_report(path, tmp_path / "report")
    assert "The log is cut off" in report.summary[-1]
    assert Page(report.page.read_text("utf-8")).balanced


def test_an_empty_log_gives_a_report_too(tmp_path: Path) -> None:
    open_recorder(tmp_path / "log.mcap").close()
    report = write_report(tmp_path / "log.mcap", tmp_path)
    assert report.pictures == ()
    assert "Nothing was received from a robot." in report.summary


@pytest.mark.slow
def test_the_same_log_gives_the_same_report(coached: Path, report: ReportFiles, tmp_path: Path) -> None:
    again = write_report(coached, tmp_path)
    assert again.page.read_bytes() == report.page.read_bytes()
    assert [path.read_bytes() for path in again.pictures] == [path.read_bytes() for path in report.pictures]


def test_text_from_the_log_cannot_become_markup(tmp_path: Path) -> None:
    with open_recorder(tmp_path / "log.mcap") as recorder:
        recorder.note("link", "<script>alert(1)</script>")
        recorder.metadata("config", {"seed": "<b>1</b>"})
    html = write_report(tmp_path / "log.mcap", tmp_path).page.read_text("utf-8")
    assert "<script>" not in html
    assert "&lt;script&gt;" in html


@pytest.mark.slow
def test_a_report_that_cannot_be_written_is_told_of(coached: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(LogError, match="cannot write the report"):
        write_report(coached, tmp_path / "file")
    with pytest.raises(LogError, match="cannot read the log"):
        write_report(tmp_path / "nowhere.mcap", tmp_path)


@pytest.mark.slow
def test_a_report_that_does_not_fit_on_the_disk_leaves_no_stub(
    coached: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("hil.files.outputs.os.fsync", full)
    with pytest.raises(LogError, match="No space left"):
        write_report(coached, tmp_path / "report")
    assert not (tmp_path / "report").exists()


def test_many_categories_have_a_row_of_panels_for_what_the_eyes_see(tmp_path: Path) -> None:
    with open_recorder(tmp_path / "log.mcap") as recorder:
        for code in range(16):
            for number in range(3):
                recorder.generation(
                    GenerationRecord((ANY_STIMULUS, code), 1, number, 10 * number, 10 * number, float(code), 0.0, "F F F F")
                )
        for previous in range(4):
            recorder.generation(GenerationRecord((previous, 3), 2, 0, 40, 10, 5.0, 0.0, "FF FF FF FF"))
    data = gather(tmp_path / "log.mcap")
    with styled():
        drawn, over = fitness_by_generation(data), fitness_by_maneuvers(data)
        assert drawn is not None
        assert over is not None
        pixels = png(drawn)
        assert pixels.startswith(PNG)
        svg(drawn, "fitness")
        assert png(drawn) == pixels, "a drawing changes the picture"
        assert png(over).startswith(PNG)
    assert len(drawn.axes) == 8
    assert len(over.axes) == 4
    assert len(drawn.axes[0].get_lines()) == 4
    assert [str(line.get_label()) for line in drawn.axes[1].get_lines()] == [
        "before: none", "before: left", "before: right", "before: both",
    ]  # fmt: skip


def test_categories_have_names_and_an_order() -> None:
    assert category_name(("any", "left")) == "left"
    assert category_name(("right", "both+touch-left")) == "both, left arm touches, before: right"
    assert sorted([("any", "none"), ("any", "both"), ("left", "both")], key=sort_key) == [
        ("any", "both"), ("left", "both"), ("any", "none"),
    ]  # fmt: skip


def test_a_run_that_learnt_nothing_has_no_pictures_of_learning(tmp_path: Path) -> None:
    data = RunData(tmp_path)
    pictures = (fitness_by_generation(data), fitness_by_maneuvers(data), maneuver_strips(data), wins_over_run(data, data.bouts))
    assert pictures == (None,) * 4
    assert learnt_table(data) is None
    assert effort_table(data) is None
    assert summary(data)


def test_a_bout_of_an_opponent_nobody_knows_is_drawn_without_it() -> None:
    path = np.zeros((2, 3))
    bout = BoutPath(1, "", 99, WIN, 1.0, 0, np.array([0.0, 1.0]), path, path)
    assert bout.opponent_name == "number 99"
    with styled():
        drawn = trajectories([bout])
    assert drawn is not None
    assert len(drawn.axes[0].patches) == 3  # the ring, and Junior at the start and at the end
