"""A Dask cluster of this machine: the same results as here, though a worker is killed, and words for what fails."""

from __future__ import annotations

import json
import os
import signal
import socket
import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from processes import Program

from hil.cli.app import run
from hil.swarm.missions.evolving.checkpoint import EvolutionCheckpoint
from hil.swarm.missions.surround_run import play
from hil.swarm.missions.surround_settings import SurroundSettings
from hil.working import WorkerError, open_crew
from pal_advisor.surround import Case

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("default"),  # of Dask and of what it stands on
]
ASKED = ("swarm", "surround", "--case", "R6W2", "--steps", "3", "--no-report", "--quiet", "--json")
ROOT = Path(__file__).parents[2]


def free_port() -> int:
    """A port of this machine that nobody listens on."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


class Cluster:
    """A scheduler and two workers, each a process of its own.

    Args:
        folder: Where they run.
        stack: They end with it.
    """

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        pytest.importorskip("distributed", reason="Dask is not installed: pip install 'distributed>=2024.12'")
        self._folder = folder
        self._stack = stack
        self.url = f"tcp://127.0.0.1:{free_port()}"
        port = self.url.rpartition(":")[2]
        self.scheduler = self._begin("scheduler", "--port", port)
        self.scheduler.until("Scheduler at:")
        self.workers = [self.worker() for _ in range(2)]

    def worker(self, *, version: str = "") -> Program:
        """A further worker; of another version of this program, where one is given."""
        found = self._begin("worker", self.url, "--nthreads", "1", "--no-nanny", version=version)
        found.until("Registered to:")
        return found

    def _begin(self, kind: str, *arguments: str, version: str = "") -> Program:
        code = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from distributed.cli.dask_{kind} import main; "
        if version:
            code += f"import hil.versions as v; found = v.versions(); v.versions = lambda: {{**found, 'numpy': {version!r}}}; "
            code += "v.versions.__module__, v.versions.__qualname__ = 'hil.versions', 'versions'; "
        command = [sys.executable, "-c", f"{code}main()", *arguments, "--host", "127.0.0.1", "--no-dashboard"]
        return self._stack.enter_context(Program(self._folder, *command))


@pytest.fixture
def cluster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Cluster]:
    """A cluster, ended with the test."""
    monkeypatch.chdir(tmp_path)
    with ExitStack() as stack:
        yield Cluster(tmp_path, stack)


def outcome(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """What a run says as JSON."""
    assert run([*ASKED, *arguments]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_it_comes_to_the_same_as_one_process_does(cluster: Cluster, capsys: pytest.CaptureFixture[str]) -> None:
    here = outcome(capsys, "--seeds", "3", "--workers", "1", "--out", "here")
    there = outcome(capsys, "--seeds", "3", "--scheduler", cluster.url, "--out", "there")
    assert there["mean"] == here["mean"]
    for name in ("tables-1.toml", "tables-2.toml", "tables-3.toml", "checkpoint.json"):
        assert (Path("there") / name).read_bytes() == (Path("here") / name).read_bytes()
    assert run(["log", "diff", "here", "there"]) == 0


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_worker_killed_in_mid_run_costs_only_time_and_a_lost_scheduler_is_told_of(cluster: Cluster) -> None:
    task = partial(play, SurroundSettings(steps=4), Case.parse("R6W2"))
    expected = [task(seed)[1].to_dict() for seed in range(12)]
    with open_crew(1, cluster.url) as crew:
        results = crew.in_order(task, range(12))
        found = [next(results)[1].to_dict()]
        cluster.workers[0].send(signal.SIGKILL)
        found += [outcome.to_dict() for _, outcome in results]
        assert found == expected
        again = crew.in_order(task, range(200))
        assert next(again)[1].to_dict() == expected[0]
        cluster.scheduler.send(signal.SIGKILL)
        with pytest.raises(WorkerError, match=r"is lost: \d+ of 200 tasks had been done") as caught:
            list(again)
    assert caught.value.status == 3


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_an_evolution_is_the_same_though_a_worker_is_killed(
    cluster: Cluster, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = ("--evolve", "contact", "--generations", "2", "--repeats", "1")
    here = outcome(capsys, *asked, "--workers", "4", "--out", "here")
    told = EvolutionCheckpoint.to_bytes

    def to_bytes(saved: EvolutionCheckpoint) -> bytes:
        if saved.evaluations == 7:  # the first generation is over
            cluster.workers[0].send(signal.SIGKILL)
        return told(saved)

    monkeypatch.setattr(EvolutionCheckpoint, "to_bytes", to_bytes)
    there = outcome(capsys, *asked, "--scheduler", cluster.url, "--out", "there")
    assert there["generations"] == here["generations"]
    assert there["best"] == here["best"]
    assert (Path("there") / "checkpoint.json").read_bytes() == (Path("here") / "checkpoint.json").read_bytes()
    assert sorted(path.name for path in Path("there").iterdir()) == ["checkpoint.json", "log.mcap", "run.json"]
    assert run(["log", "diff", "here", "there"]) == 0


def test_a_task_that_always_kills_its_worker_is_given_up(cluster: Cluster) -> None:
    for _ in range(3):
        cluster.worker()
    with open_crew(1, cluster.url) as crew, pytest.raises(WorkerError, match="again at one task: 0 of 1 tasks") as caught:
        list(crew.in_order(os._exit, [9]))
    assert caught.value.status == 1


def test_a_worker_of_another_version_is_refused(cluster: Cluster, capsys: pytest.CaptureFixture[str]) -> None:
    cluster.worker(version="0.9")
    assert run([*ASKED, "--scheduler", cluster.url]) == 3
    said = capsys.readouterr().err
    assert "might come to other results: it has numpy 0.9 instead of" in said
    assert not Path("runs").exists()


def test_a_worker_of_another_version_that_joins_is_refused(cluster: Cluster) -> None:
    task = partial(play, SurroundSettings(steps=1), Case.parse("R3W1"))
    with open_crew(1, cluster.url) as crew:
        assert len(list(crew.in_order(task, range(2)))) == 2
        cluster.worker(version="0.9")
        with pytest.raises(WorkerError, match="other results") as caught:
            list(crew.in_order(task, range(100)))
    assert caught.value.status == 3


def test_nobody_there_is_told_with_what_to_do(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="Dask is not installed: pip install 'distributed>=2024.12'")
    url = f"tcp://127.0.0.1:{free_port()}"
    assert run([*ASKED, "--scheduler", url, "--out", str(tmp_path / "run")]) == 3
    said = capsys.readouterr().err
    assert f"no Dask scheduler answers at {url}" in said
    assert f"dask worker {url} --nworkers auto --nthreads 1" in said
    assert not list(tmp_path.iterdir())


def test_dask_that_is_not_installed_is_asked_for(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert run([*ASKED, "--scheduler", "tcp://127.0.0.1:8786", "--out", str(tmp_path / "run")]) == 2
    assert "pip install 'distributed>=2024.12'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_several_coachings_come_to_the_same_as_here(cluster: Cluster, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["coach", "--runs", "2", "--budget", "30s", "--held-out", "2", "--no-report", "--quiet"]
    for where, out in ((["--workers", "2"], "here"), (["--scheduler", cluster.url], "there")):
        assert run([*asked, *where, "--out", out]) == 0, capsys.readouterr().err
    files = ["advice.toml", "log.mcap", "run-1.json", "run-1.mcap", "run-2.json", "run-2.mcap", "run.json", "team.json"]
    assert sorted(path.name for path in Path("there").iterdir()) == files
    for name in ("advice.toml", "run-1.json", "run-2.json"):
        assert (Path("there") / name).read_bytes() == (Path("here") / name).read_bytes()
    for name in ("log.mcap", "run-1.mcap", "run-2.mcap"):
        assert run(["log", "diff", f"here/{name}", f"there/{name}"]) == 0
