"""A run that goes on is seen, and stopped, by a viewer that is not ours."""

from __future__ import annotations

import re
import subprocess
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest
from logged import inputs_of

import hil
from hil.cli.app import run

pytest.importorskip("websockets", reason="the viewer speaks by it: pip install websockets")
from viewer_client import Shown, ViewerClient

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

PATIENCE = 60.0


@contextmanager
def running(folder: Path, *words: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A run that is shown while it goes on, and where."""
    command = [sys.executable, "-m", "hil", *words, "--live", "--viewer", "foxglove", "--out", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:  # noqa: S603
        try:
            assert process.stdout is not None
            found = re.fullmatch(r"Live: (ws://127\.0\.0\.1:\d+)\n", process.stdout.readline())
            assert found
            yield process, found[1]
        finally:
            process.kill()


@pytest.mark.slow
def test_a_viewer_sees_a_run_and_stops_it_and_the_stop_is_recorded_and_replayed(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with (
        running(folder, "coach", "--runs", "1", "--no-report", "--budget", "1000000") as (process, url),
        ViewerClient(url) as viewer,
    ):
        shown = {"/junior/sensors", "/tf", "/arena/scene", "/junior/plot/eyes"}
        viewer.until(lambda _: shown <= set(viewer.channels) and bool(viewer.services))
        assert viewer.info["capabilities"] == ["services"], "nothing can be published, set or asked for but the stop"
        assert list(viewer.services) == ["/hil/stop"]
        viewer.subscribe(["/junior/sensors", "/arena/scene"])
        topics: set[str] = set()
        times: list[int] = []
        while len(times) < 200 or len(topics) < 2:
            one = viewer.next()
            if isinstance(one, Shown):
                topics.add(one.topic)
                times += [one.time] if one.topic == "/junior/sensors" else []
        assert times == sorted(times)
        assert viewer.call("/hil/stop") == {"confirmed": True, "robots": 1, "missing": 0}
        said, _ = process.communicate(timeout=PATIENCE)
    assert "emergency stop" in said
    assert inputs_of(folder / "log.mcap") == ["stop"]
    assert hil.replay(folder).same


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--viewer", "foxglove"], "--viewer goes with --live"),
        (["--live", "--viewer", "foxglove", "--public"], "asks nobody who they are"),
        (["--live", "--viewer", "foxglove", "--open"], "start it yourself"),
    ],
)
def test_options_that_exclude_each_other(options: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bout", "--controller", "chase", *options]) == 2
    assert said in capsys.readouterr().err


def test_without_what_serves_one_line_says_how_to_have_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr("hil.look.viewers.foxglove_server.find_spec", lambda _: None)
    monkeypatch.chdir(tmp_path)
    assert run(["bout", "--controller", "chase", "--live", "--viewer", "foxglove"]) == 2
    assert "pip install 'foxglove-sdk>=0.30'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
