"""`hil view`: where the page goes, what is replaced, and the exit statuses."""

from __future__ import annotations

import json
import subprocess
import sys
import webbrowser
from typing import TYPE_CHECKING

import pytest
from mcap.writer import Writer
from report_logs import bout_log, coaching_log

from firmware_protocol.messages import BoutOutcome
from hil import runs
from hil.cli.app import run
from hil.look.writing import default_path, is_view

if TYPE_CHECKING:
    from pathlib import Path

RECORD = {"verb": "bout", "what": "flat-light", "started": "2026-01-02T03:04:05+00:00", "version": 1, "state": "done"}


@pytest.fixture(autouse=True)
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What would have been shown in a browser."""
    shown: list[str] = []

    def take(url: str) -> bool:
        shown.append(url)
        return True

    monkeypatch.setattr(webbrowser, "open", take)
    return shown


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A log by itself."""
    path = tmp_path / "bouts.mcap"
    bout_log(path, [(BoutOutcome.WIN, 1.0)])
    return path


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A run's folder, in `runs`."""
    monkeypatch.chdir(tmp_path)
    made = tmp_path / "runs" / "20260102-030405-bout-flat-light"
    made.mkdir(parents=True)
    (made / runs.RECORD).write_text(json.dumps(RECORD))
    bout_log(made / runs.LOG, [(BoutOutcome.LOSS, 1.0)])
    return made


def test_the_page_of_a_log_stands_beside_it(log: Path, capsys: pytest.CaptureFixture[str], opened: list[str]) -> None:
    assert run(["view", str(log)]) == 0
    page = log.with_name("bouts-view.html")
    assert is_view(page)
    assert f"Page: {page}" in capsys.readouterr().out
    assert not opened  # no terminal, no desktop


def test_nothing_named_is_the_newest_run(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["view"]) == 0
    assert is_view(folder / "view.html")
    assert f"Log: {folder.relative_to(folder.parents[1]) / 'log.mcap'}" in capsys.readouterr().out
    assert run(["view", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "Junior’s bouts against flat-heavy"


def test_a_run_s_page_goes_with_the_run(folder: Path) -> None:
    assert run(["view"]) == 0
    runs.load_run(folder).remove()
    assert not folder.exists()


def test_its_own_page_is_made_anew_and_nobody_else_s(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = default_path(log)
    assert run(["view", str(log), "--quiet"]) == 0
    assert run(["view", str(log), "--quiet"]) == 0
    page.write_text("<p>mine</p>")
    assert run(["view", str(log)]) == 2
    assert "is there already" in capsys.readouterr().err
    assert page.read_text() == "<p>mine</p>"
    assert run(["view", str(log), "--overwrite"]) == 0
    assert is_view(page)


def test_a_place_that_is_named_is_not_written_over(log: Path, tmp_path: Path) -> None:
    out = tmp_path / "there" / "p.html"
    assert run(["view", str(log), "-o", str(out)]) == 0
    assert run(["view", str(log), "-o", str(out)]) == 2
    assert run(["view", str(log), "-o", str(out), "--overwrite"]) == 0


def test_nothing_that_draws_pictures_is_needed() -> None:
    program = "import sys, hil.look.writing; print({'matplotlib', 'foxglove', 'PIL'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)  # noqa: S603 - ours
    assert done.stdout.strip() == "set()"


def test_it_is_shown_where_that_is_asked_for(log: Path, opened: list[str]) -> None:
    assert run(["view", str(log), "--open"]) == 0
    assert opened == [default_path(log).resolve().as_uri()]
    assert run(["view", str(log), "--no-open"]) == 0
    assert len(opened) == 1


def test_without_a_browser_it_says_what_to_do(
    log: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(webbrowser, "open", lambda _: False)
    assert run(["view", str(log), "--open"]) == 0
    assert "open" in capsys.readouterr().err


def test_a_cut_log_is_told_of(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "cut.mcap"
    coaching_log(path, budget=20)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert run(["view", str(path)]) == 0
    assert "that could be read" in capsys.readouterr().err


def test_what_is_no_log_or_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["view", str(tmp_path / "none.mcap")]) == 2
    text = tmp_path / "text.mcap"
    text.write_text("hello")
    assert run(["view", str(text)]) in {2, 4}
    assert "not a log" in capsys.readouterr().err


def test_one_of_which_nothing_is_ours_is_exit_4(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "foreign.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/camera", "json", 0)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()  # type: ignore[no-untyped-call]
    assert run(["view", str(path)]) == 4
    assert "'/camera' (1)" in capsys.readouterr().err
    assert not default_path(path).exists()


def test_where_nothing_can_be_written(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("x")
    assert run(["view", str(log), "-o", str(tmp_path / "file" / "p.html")]) == 2
    assert "is no folder" in capsys.readouterr().err


@pytest.mark.skipif(sys.platform != "linux", reason="has no device that is full")
def test_a_disk_that_is_full_is_exit_4(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["view", str(log), "-o", "/dev/full"]) == 4
    assert "cannot write the page /dev/full: No space left on device" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("word", "status", "said"),
    [
        ("sim://junior", 2, "hil coach --live"),
        ("replay:///run.mcap", 2, "name the log itself"),
        ("tpc://127.0.0.1:5760", 2, "Did you mean tcp://127.0.0.1:5760?"),
        ("ttyACM0", 2, "Did you mean /dev/ttyACM0?"),
        ("127.0.0.1:5760", 2, "Did you mean tcp://127.0.0.1:5760?"),
        ("tcp://127.0.0.1:1", 3, "tcp://127.0.0.1:1"),
        ("juniper", 2, "there is no log juniper"),
    ],
)
@pytest.mark.usefixtures("folder")  # runs go below it
def test_what_is_no_link_to_robots(word: str, status: int, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["view", word]) == status
    assert said in capsys.readouterr().err


def test_a_file_that_is_called_like_a_link_is_a_file(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(log.parent)
    log.rename("auto")
    assert run(["view", "auto", "--quiet"]) == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["log.mcap", "--duration", "3"], "--duration goes with a LINK"),
        (["log.mcap", "--public"], "--public goes with a LINK"),
        (["tcp://127.0.0.1:1", "--robot", "3"], "--robot goes with a log"),
        (["tcp://127.0.0.1:1", "--max-chunk", "3"], "--max-chunk goes with a log"),
    ],
)
def test_options_of_a_log_and_of_a_link(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["view", *words]) == 2
    assert said in capsys.readouterr().err
