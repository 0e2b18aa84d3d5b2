"""`--live`: what goes with it, and how a browser is led to the page without the token on its command line."""

from __future__ import annotations

import socket
import stat
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import pytest
from rich.console import Console

from hil.bridge.operator import Operator
from hil.cli import live
from hil.cli.app import run
from hil.cli.common import UsageError
from hil.recording.process import RecorderProcess

if TYPE_CHECKING:
    from collections.abc import Iterator

MEMORY = "memory:"


@pytest.mark.parametrize("verb", [["coach"], ["bout", "--controller", "chase"], ["swarm", "surround"]])
@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--public"], "go with --live"),
        (["--no-open"], "go with --live"),
        (["--live", "--no-log"], "leave out --no-log"),
    ],
)
def test_options_that_exclude_each_other(
    verb: list[str], options: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([*verb, *options]) == 2
    assert said in capsys.readouterr().err


def test_bouts_side_by_side_are_not_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bout", "--controller", "chase", "--workers", "2", "--live"]) == 2
    assert "leave out one of the two" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [([], "has a referee"), (["--workers", "2"], "has a referee"), (["tcp://127.0.0.1:1"], "nobody can be asked here")],
)
def test_a_judge_is_there_and_is_needed(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bout", *words, "--controller", "chase", "--judge"]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("verb", [["view"], ["coach", "--live"], ["swarm", "surround", "--live"]])
def test_nothing_is_shown_of_a_link_that_is_not_there(
    verb: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("webbrowser.open", pytest.fail)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    assert run([*verb, "--open", "--reconnect", "0", f"tcp://127.0.0.1:{port}"]) == 3
    said = capsys.readouterr()
    assert "Live" not in said.out
    assert "nothing listens" in said.err


def test_nothing_is_asked_for_by_default() -> None:
    assert live.live_page(live=False, open_page=None, public=False, no_log=True) is None
    with pytest.raises(UsageError):
        live.live_page(live=False, open_page=True, public=False, no_log=False)


@pytest.fixture
def recorder(tmp_path: Path) -> Iterator[RecorderProcess]:
    page = live.LivePage(opened=False, public=False)
    made = RecorderProcess(tmp_path / "log.mcap", run={}, config={}, link=MEMORY, lockstep=True, live=page.served(Operator()))
    yield made
    made.end()


def test_the_browser_s_command_line_does_not_have_the_token(
    recorder: RecorderProcess, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    opened: list[str] = []
    awaited: list[bool] = []

    def take(url: str) -> bool:
        opened.append(url)
        return True

    monkeypatch.setattr("webbrowser.open", take)
    monkeypatch.setattr(recorder, "await_browser", lambda: awaited.append(True))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    page = live.LivePage(opened=True, public=False)
    with (tmp_path / "said").open("w") as said:
        page.announce(recorder, Console(file=said))
    token = urlsplit(recorder.page).path.strip("/")
    assert len(token) == 22
    assert (tmp_path / "said").read_text() == f"Live: {recorder.page}\n"
    (url,) = opened
    assert awaited == [True]
    assert url.startswith("file:")
    assert token not in url
    door = Path(urlsplit(url).path)
    assert stat.S_IMODE(door.stat().st_mode) == 0o600
    assert recorder.page in door.read_text()
