"""What recording costs: processor time of the control process and of all, bytes a robot minute, jitter, random kills.

`cost` plays bouts by the chase in lock-step without a recorder, with one in the same process, and with the one in a process of
its own, by turns. `size` coaches and plays, and measures the logs. `jitter` steps a robot that is served by another process
every 5 ms in real time (of a swarm: every 20 ms), with and without the recorder, with one that shows the run to four who look
on, and with one that shares the link with four guests. `kills` kills one of the two processes at a random moment, and looks at
what the stock reader reads of the log.

    python benchmarks/recorder_process.py cost|size|jitter|kills [--bouts 100] [--rounds 5] [--kills 200] [--seconds 20]
                                            [--robots 1]
"""

from __future__ import annotations

import argparse
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from time import perf_counter, process_time, sleep
from typing import TYPE_CHECKING, Any

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader

import hil
from hil.recording.process import LinkSharing, Live, RecorderProcess
from hil.recording.recorder import Recorder
from hil.sumo.bouts import play
from hil.sumo.controllers import ChaseController
from hil.sumo.ring import open_ring
from hil.swarm.connecting import connect_swarm

if TYPE_CHECKING:
    from collections.abc import Callable

URL = "sim://junior?opponent=flat-light&seed=1"
ABOUT: dict[str, Any] = {"run": {}, "config": {}, "link": URL, "lockstep": True}
PERIOD, SWARM_PERIOD = 0.005, 0.02
HIL = [sys.executable, "-c", "from hil.cli import main; main()"]
SERVED = "tcp://127.0.0.1:24551"


def children() -> float:
    """Processor time of all processes that have ended, in s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def bouts(count: int, make: Callable[[], Recorder | None]) -> tuple[float, float, float]:
    """Play bouts.

    Returns:
        Robot seconds, the control process's time for them (s), and that of all processes with what begins and ends a log.
    """
    ours, others = process_time(), children()
    recorder = make()
    with hil.connect(URL, taps=[recorder] if recorder else []) as junior:
        junior.arm()
        ring = open_ring(junior)
        since, begun = junior.now(), process_time()
        for _ in play(ring, ChaseController(), range(1, count + 1)):
            pass
        seconds, used = junior.now() - since, process_time() - begun
    if recorder is not None:
        recorder.close()
    return seconds, used, process_time() - ours + children() - others


def cost(options: argparse.Namespace) -> None:
    """Processor time, by turns."""
    with tempfile.TemporaryDirectory() as folder:
        kinds: dict[str, Callable[[Path], Recorder | None]] = {
            "no recorder": lambda _: None,
            "in the same process": lambda path: Recorder(path, **ABOUT),
            "in a process of its own": lambda path: RecorderProcess(path, **ABOUT),
        }
        found: dict[str, list[tuple[float, float]]] = {name: [] for name in kinds}
        for number in range(options.rounds):
            for kind, (name, make) in enumerate(kinds.items()):
                path = Path(folder, f"{number}-{kind}.mcap")
                seconds, used, everything = bouts(options.bouts, lambda make=make, path=path: make(path))  # type: ignore[misc]
                found[name].append((used / seconds * 1e3, everything / seconds * 1e3))
    print(f"{options.bouts} bouts of {seconds:.0f} robot s, median of {options.rounds}; ms of processor time a robot second")
    alone = median(used for used, _ in found["no recorder"])
    for name, times in found.items():
        used, everything = (median(column) for column in zip(*times, strict=True))
        print(f"  {name:24} control {used:5.2f} (without / with {alone / used:4.2f})   all processes {everything:5.2f}")


def size(options: argparse.Namespace) -> None:
    """Bytes a robot minute of a coached run and of bouts."""
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in (
            ("coach", ["coach", URL, "--runs", "1", "--budget", "150"]),
            ("chase", ["bout", URL, "--controller", "chase", "--trials", str(options.bouts)]),
        ):
            out = Path(folder, name)
            subprocess.run([*HIL, *arguments, "--out", str(out)], check=True, capture_output=True)  # noqa: S603 - ourselves
            log = out / "log.mcap"
            with log.open("rb") as file:
                summary = make_reader(file).get_summary()
            assert summary is not None
            statistics = summary.statistics
            assert statistics is not None
            minutes = (statistics.message_end_time - statistics.message_start_time) / 60e9
            megabytes = log.stat().st_size / 1e6
            print(
                f"  {name:6} {minutes * 60:6.1f} robot s  {megabytes / minutes:5.3f} MB a robot minute, of which "
                f"{16 * statistics.message_count / 1e6 / minutes:5.3f} are message indexes; {statistics.chunk_count} chunks"
            )


JITTER_KINDS, SHARES = ("without", "with", "shown", "shared"), (50, 99, 99.9)
AIM = 0.2
"""In ms: so much more may the 99th percentile be while four look on."""


def jitter(options: argparse.Namespace) -> None:
    """How far from their period apart the beginnings of steps are, in real time; the kinds by turns, compared in pairs."""
    robots = options.robots
    networks = 1 if robots == 1 else -(-robots // 250)
    what = ["junior"] if robots == 1 else ["swarm", "--count", str(robots), "--networks", str(networks), "--quiet"]
    command = [*HIL, "emulate", *what, "--link", SERVED]
    found: dict[str, list[list[float]]] = {name: [] for name in JITTER_KINDS}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as served:  # noqa: S603 - ourselves
        try:
            assert served.stdout is not None
            urls = [served.stdout.readline().decode().split()[-1] for _ in range(networks)]
            for number in range(options.rounds):
                first = number % len(JITTER_KINDS)
                for name in (*JITTER_KINDS[first:], *JITTER_KINDS[:first]):
                    late = sorted(_paced(urls, options.seconds, name, swarm=robots > 1))
                    found[name].append([late[int(len(late) * share / 100)] * 1e3 for share in SHARES])
        finally:
            served.send_signal(signal.SIGINT)
    load = f"load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "load unknown"
    print(
        f"{robots} robots, {options.rounds} rounds of {options.seconds:g} s each kind, {load}; off by at most, median of rounds"
    )
    for name, rounds in found.items():
        columns = list(zip(*rounds, strict=True))
        shares = "  ".join(f"{share:g} % {median(column):.3f} ms" for share, column in zip(SHARES, columns, strict=True))
        print(f"  {name:8} recorder: {shares}  (99 %: {min(columns[1]):.3f} to {max(columns[1]):.3f})")
    for one, other in (("with", "without"), ("shared", "with"), ("shown", "with"), ("shown", "without")):
        more = sorted(a[1] - b[1] for a, b in zip(found[one], found[other], strict=True))
        print(f"  99 %, {one} less {other}: median {median(more):+.3f} ms, {more[0]:+.3f} to {more[-1]:+.3f}")
    verdict = "met" if more[-1] <= AIM else "not met" if more[0] > AIM else "not to be told: pairs differ more than that"
    print(f"  aim, shown less without at most {AIM} ms: {verdict}")


VIEWERS = """
import sys, threading, urllib.request
def look(): sum(map(len, urllib.request.urlopen(sys.argv[1] + "told")))
threads = [threading.Thread(target=look) for _ in range(4)]
for thread in threads: thread.start()
"""


GUESTS = """
import socket, sys, threading
def look():
    with socket.create_connection(("127.0.0.1", int(sys.argv[1].rpartition(":")[2]))) as link:
        while link.recv(65536): pass
threads = [threading.Thread(target=look) for _ in range(4)]
for thread in threads: thread.start()
"""


def _paced(urls: list[str], seconds: float, name: str, *, swarm: bool) -> list[float]:
    """Deviations of the period in s: 5 ms of a Junior, 20 ms of a swarm."""
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        log = Path(folder, "log.mcap")
        live = Live(lambda *_: None) if name == "shown" else None
        share = LinkSharing(lambda *_: None, "127.0.0.1", 0, "benchmark") if name == "shared" else None
        about = {**ABOUT, "link": urls[0], "lockstep": False}
        recorder = None if name == "without" else RecorderProcess(log, **about, live=live, share=share)
        if recorder is not None and (live or share):
            looking, where = (VIEWERS, recorder.page) if live else (GUESTS, recorder.shared)
            stack.enter_context(subprocess.Popen([sys.executable, "-c", looking, where]))  # noqa: S603 - ourselves
        taps = [recorder] if recorder else []
        period = SWARM_PERIOD if swarm else PERIOD
        robots = connect_swarm(*urls, taps=taps) if swarm else hil.connect(urls[0], taps=taps)
        with robots:
            robots.wait(0.5)
            begun, late, last = perf_counter(), list[float](), perf_counter()
            for number in range(1, round(seconds / period)):
                sleep(max(0.0, begun + number * period - perf_counter()))
                now = perf_counter()
                late.append(abs(now - last - period))
                last = now
                robots.step(0.0)
        if recorder is not None:
            recorder.close()
        return late


def kills(options: argparse.Namespace) -> None:
    """Kill a process at a random moment, and see how much of the log is there."""
    dice, worst, unread = random.Random(1), dict[str, float](), 0  # noqa: S311 - no secret
    program = Path(__file__).resolve()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(options.kills):
            log = Path(folder, f"{number}.mcap")
            command = [sys.executable, str(program), "run", "--log", str(log)]
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as run:  # noqa: S603 - ourselves
                assert run.stdout is not None
                pid = int(run.stdout.readline())
                sleep(dice.uniform(0.0, 1.5))
                whose = ("control", "recorder")[number % 2]
                told = log.with_suffix(".now")
                os.kill(run.pid if whose == "control" else pid, signal.SIGKILL)
                reached = float(told.read_text() or 0) if told.exists() else 0.0
                run.kill()
            for _ in range(200):
                if not Path(f"/proc/{pid}").exists():
                    break
                sleep(0.05)
            last, whole = read(log)
            unread += not whole
            worst[whose] = max(worst.get(whose, 0.0), reached - last)
            log.unlink()
    for whose, lost in worst.items():
        print(f"  {whose} process killed: at most {lost:.2f} robot s lost")
    print(f"  {options.kills} kills, {unread} logs not read to their end by the stock reader")


def read(log: Path) -> tuple[float, bool]:
    """Log time of the last entry in s, and whether what is there was read to its last whole record."""
    last, size = 0.0, log.stat().st_size
    with log.open("rb") as file:
        try:
            for record in StreamReader(file, validate_crcs=True).records:
                if isinstance(record, Message):
                    last = max(last, record.log_time / 1e9)
        except (McapError, EOFError):
            return last, size - file.tell() < 1 << 16
    return last, True


def run(options: argparse.Namespace) -> None:
    """Play bouts until killed, saying after each step how far it has come."""
    recorder = RecorderProcess(options.log, **ABOUT, on_failure=lambda text, kept: None)  # noqa: ARG005
    print(recorder.pid, flush=True)
    descriptor = os.open(options.log.with_suffix(".now"), os.O_WRONLY | os.O_CREAT)

    class Clocked:
        """Chases, and notes down what time it is."""

        def choose(self, current: Any, previous: Any) -> Any:  # noqa: ANN401 - as the chase does
            return ChaseController().choose(current, previous)

    with hil.connect(URL, taps=[recorder]) as junior:
        junior.arm()
        junior.between = lambda: os.pwrite(descriptor, f"{junior.now():12.3f}".encode(), 0)  # type: ignore[assignment]
        ring = open_ring(junior)
        for _ in play(ring, Clocked(), range(1, 100_000)):
            pass


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["cost", "size", "jitter", "kills", "run"])
    parser.add_argument("--bouts", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--robots", type=int, default=1, help="of `jitter`: one Junior, or so many micro-robots")
    parser.add_argument("--log", type=Path, help="of `run`, which `kills` starts")
    options = parser.parse_args()
    {"cost": cost, "size": size, "jitter": jitter, "kills": kills, "run": run}[options.what](options)


if __name__ == "__main__":
    main()
