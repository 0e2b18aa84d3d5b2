"""No clock, chance, file, socket, process or signal decides above the bridge without being in the log.

Each verb is run where everything of the kind that our code asks for is noted down, and who asked (`tests/support/guarded.py`):
only modules that stand here, with why it decides nothing or where it is recorded, may ask. Then its log alone is replayed,
strictly, in a folder where nothing else is, and there nothing at all may be asked for but the log.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest
from guarded import CHANCE, CLOCK, FILE, PROCESS, SIGNAL, SOCKET, Asked
from serving import served

from hil.cli.app import run as run_hil

if TYPE_CHECKING:
    from collections.abc import Iterator

GUARDED: Final = Path(__file__).parents[1] / "support" / "guarded.py"
PATIENCE: Final = 300.0
"""Longest time for a guarded run, in s."""
ADVICE: Final = "advice.toml"
CHECKPOINT: Final = "checkpoint.json"

ALLOWED: Final[dict[str, dict[str, str]]] = {
    # The floor of the links, below the bridge: what they bring is recorded as the steps' chunks and circumstances.
    "firmware_protocol.links": {
        CLOCK: "how long a read or write may take: what came of it is in the step",
        FILE: "ports and devices",
        SOCKET: "the link itself",
    },
    "hil.bridge.pump": {CLOCK: "stamps of chunks, and when a step is taken: both are in the step"},
    "hil.bridge.bridge": {CLOCK: "the step's one reading"},
    "hil.bridge.sessions": {CHANCE: "session numbers: /bridge/session"},
    "hil.conformance.probe": {CLOCK: "it is the bridge of `hil check`: its step's one reading"},
    "hil.jobs.check": {CLOCK: "the reading at opening: /bridge/open"},
    "hil.connecting.connecting": {CLOCK: "the reading at opening: /bridge/open"},
    "hil.bridge.reopening": {CLOCK: "when a lost link is tried again: that it is back is in the step"},
    "hil.signing.key_file": {CLOCK: "the calendar of signatures: /bridge/open", FILE: "the key, which no log holds"},
    # Signals and the terminal: taken in by the bridge's steps.
    "hil.terminal.interrupts": {SIGNAL: "an interrupt is an input of a step"},
    "hil.terminal.suspending": {SIGNAL: "likewise to be stopped, and to go on"},
    # What a run leaves, and what is told of it.
    "hil.cli.coach": {CLOCK: "how long the whole took, which is told and decides nothing"},
    "hil.cli.running": {CLOCK: "the run's name and record"},
    "hil.cli.stage": {
        CLOCK: "metadata run, and the clock that links are given",
        FILE: "version of the package; the option file",
    },
    "hil.processes": {FILE: "which process a run's record names"},
    "hil.runs": {FILE: "the run's folder, and earlier ones"},
    "hil.files.outputs": {FILE: "the run's outputs"},
    "hil.mcaplog": {FILE: "the log"},
    "hil.recording": {PROCESS: "who writes the log", FILE: "likewise", CLOCK: "when a batch is handed over"},
    "hil.versions": {FILE: "versions of packages, which the log names"},
    # What is read before the run, and put into the log with it.
    "hil.doors": {FILE: "what a user names: begin/ in the log"},
    # The robot that is not there: below the link.
    "simdevice": {FILE: "the emulated board"},
    "firmware_protocol.firmware": {FILE: "the firmware that it runs is the one that was built"},
}
"""Modules, or packages, that may ask; for what; and why it does not decide unrecorded."""
REPLAYED: Final[dict[str, dict[str, str]]] = {
    "hil.mcaplog": {FILE: "the log, and no other file but the program's own"},
    "hil.versions": {FILE: "versions of packages, which are told and not compared"},
    "hil.signing.key_file": {FILE: "the key of a signed run, and no other file"},
    "hil.doors": {FILE: "likewise"},
}
"""Those that may while a log is replayed."""
OWN: Final = frozenset({"hil.versions", "hil.mcaplog.writing.drawing"})
"""Those that read files of the program itself: what it was installed as, and the well-known schemas."""


def wrong(asked: list[Asked], allowed: dict[str, dict[str, str]]) -> list[Asked]:
    """What was asked for and may not be."""
    return [one for one in asked if not any(one.kind in allowed.get(name, {}) for name in _above(one.module))]


def _above(module: str) -> Iterator[str]:
    """A module and the packages that it is in."""
    while module:
        yield module
        module = module.rpartition(".")[0]


def guarded(folder: Path, *arguments: str) -> list[Asked]:
    """Run `hil`, which must succeed, and say what our modules asked for."""
    notes = folder.parent / f"{folder.name}.json"
    done = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, str(GUARDED), str(notes), *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return [Asked(*one) for one in json.loads(notes.read_text(encoding="utf-8"))["asked"]]


@dataclass(frozen=True)
class Case:
    """A run.

    Attributes:
        name: What it is called here.
        arguments: Of `hil`; LINK stands for the address of a robot that is served on `serve`.
        serve: Where the robot is served in real time; empty for one in lock-step.
        replay: Further arguments of the replay.
        files: Files that it finds, by name.
    """

    name: str
    arguments: tuple[str, ...]
    serve: str = ""
    replay: tuple[str, ...] = ()
    files: dict[str, str] = field(default_factory=dict)


KEY: Final = bytes(range(1, 33)).hex()
TCP: Final = "tcp://127.0.0.1:0"
COACH: Final = ("--no-report", "--held-out", "1")
CASES: Final = (
    Case("coach", ("coach", "sim://junior?faults=drop:0.1,jitter:0.02", "--budget", "6", *COACH)),
    Case("coach resumed", ("coach", "--resume-from", CHECKPOINT, *COACH)),
    Case("coach in real time", ("coach", "LINK", "--budget", "3", "--period", "0.05", "--no-report", "--held-out", "0"), TCP),
    Case(
        "bout by advice, options and faults from files",
        ("bout", "sim://junior?faults=@faults.toml", "--advice", ADVICE, "--config", "options.toml"),
        files={"options.toml": "[bout]\ntrials = 1\n", "faults.toml": "drop = 0.05\n"},
    ),
    Case("random bout on CAN", ("bout", "sim://junior?wire=can", "--controller", "random", "--trials", "1")),
    Case(
        "signed bout",
        ("bout", "--controller", "chase", "--trials", "1", "--signing-key", "our.key"),
        replay=("--signing-key", "our.key"),
        files={"our.key": KEY},
    ),
    Case("deploy", ("deploy", ADVICE, "sim://junior", "--contest", "--countdown", "0.5")),
    Case("deploy in real time", ("deploy", ADVICE, "LINK"), TCP),
    Case("monitor", ("monitor", "sim://junior", "--duration", "1")),
    Case("monitor in real time", ("monitor", "LINK", "--duration", "1"), "pty" if hasattr(sys, "getuid") else TCP),
    Case("check", ("check", "sim://junior", "--only", "bad-checksum-dropped")),
    Case("check in real time", ("check", "LINK", "--only", "bad-checksum-dropped"), TCP),
    Case("param", ("param", "sim://junior", "SPD_FAST", "0.9")),
    Case(
        "param loaded in real time", ("param", "LINK", "--load", "wanted.toml"), TCP, files={"wanted.toml": "SPD_FAST = 0.9\n"}
    ),
)


BY_NIGHT: Final = {
    "coach", "signed bout", "random bout on CAN", "deploy in real time", "monitor", "check in real time",
    "param loaded in real time",
}  # fmt: skip
"""Cases of which others show much the same."""


@pytest.fixture(scope="module")
def coached(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the advice of one run of coaching, and the checkpoint of another that was cut short."""
    folder = tmp_path_factory.mktemp("coached")
    common = ("--held-out", "0", "--no-report", "--quiet")
    cut = ("sim://junior?faults=unplug:4", "--budget", "8", "--reconnect", "0", "--out", str(folder / "cut"))
    assert run_hil(["coach", *cut, *common]) == 3
    assert run_hil(["coach", "--runs", "1", "--budget", "4", *common, "--out", str(folder / "whole")]) == 0
    shutil.copyfile(folder / "cut" / CHECKPOINT, folder / CHECKPOINT)
    shutil.copyfile(folder / "whole" / ADVICE, folder / ADVICE)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [pytest.param(case, id=case.name, marks=[pytest.mark.nightly] if case.name in BY_NIGHT else []) for case in CASES],
)
def test_what_decides_is_in_the_log(case: Case, coached: Path, tmp_path: Path) -> None:
    live, alone = tmp_path / "live", tmp_path / "alone"
    live.mkdir()
    alone.mkdir()
    for name in (ADVICE, CHECKPOINT):
        shutil.copyfile(coached / name, live / name)
    for folder, names in ((live, case.files), (alone, case.replay)):
        for name in set(names) & set(case.files):
            (folder / name).touch(0o600)
            (folder / name).write_text(case.files[name], encoding="utf-8")
    if case.serve:
        with served(case.serve) as link:
            arguments = [link if one == "LINK" else one for one in case.arguments]
            asked = guarded(live, *arguments, "--out", "run")
    else:
        asked = guarded(live, *case.arguments, "--out", "run")
    assert not wrong(asked, ALLOWED)
    assert {CLOCK, FILE} <= {one.kind for one in asked}, "nothing was noted: nothing is guarded"
    shutil.move(live / "run" / "log.mcap", alone / "log.mcap")
    shutil.rmtree(live)

    asked = guarded(alone, "replay", "log.mcap", "--strict", *case.replay)
    assert not wrong(asked, REPLAYED)
    opened = {one.what for one in asked if one.module not in OWN}
    assert opened == {"open log.mcap", *(f"open {name}" for name in case.replay if name in case.files)}


ASKING: Final = (
    (CLOCK, "import time; time.time()"),
    (CLOCK, "from time import perf_counter_ns as now; now()"),
    (CLOCK, "import hil.bridge.clock; hil.bridge.clock.MonotonicClock().now()"),
    (CLOCK, "from datetime import datetime, UTC; datetime.now(UTC)"),
    (CHANCE, "import random; random.random()"),
    (CHANCE, "import random; random.Random().random()"),
    (CHANCE, "import secrets; secrets.randbelow(3)"),
    (CHANCE, "import os; os.urandom(3)"),
    (CHANCE, "import uuid; uuid.uuid4()"),
    (CHANCE, "import numpy; numpy.random.default_rng()"),
    (CHANCE, "import numpy; numpy.random.standard_normal()"),
    (CHANCE, "import numpy; numpy.random.PCG64()"),
    (CHANCE, "from numpy.random import PCG64, SeedSequence; PCG64(SeedSequence())"),
    (FILE, "import pathlib, sys; pathlib.Path(sys.executable).open('rb').close()"),
    (FILE, "import os, sys; os.close(os.open(sys.executable, 0))"),
    (FILE, "import pathlib; list(pathlib.Path('.').iterdir())"),
    (SOCKET, "import socket; socket.socket().close()"),
    (SIGNAL, "import signal; signal.signal(signal.SIGTERM, signal.SIG_DFL)"),
    ("", "import random; random.Random(3).random()"),
    ("", "import numpy; numpy.random.default_rng(3).random()"),
    ("", "import rich.console; rich.console.Console().print('x')"),
)
"""What a module of ours might do, and what the guard is to note of it."""
ASK: Final = """
import guarded
guarded.install()
import json, sys
for number, code in enumerate(json.loads(sys.argv[1])):
    exec(compile(code, "x", "exec"), {"__name__": f"pal_advisor.module_{number}"})
print(json.dumps(list(guarded.NOTES)))
"""


def test_the_guard_notes_who_asks() -> None:
    done = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, "-c", ASK, json.dumps([code for _, code in ASKING])],
        cwd=GUARDED.parent,
        capture_output=True,
        text=True,
        check=True,
    )
    asked = [Asked(*one) for one in json.loads(done.stdout.splitlines()[-1])]
    for number, (kind, code) in enumerate(ASKING):
        found = [one for one in asked if one.module == f"pal_advisor.module_{number}"]
        assert {one.kind for one in found} == ({kind} if kind else set()), code
        assert wrong(found, ALLOWED) == found
