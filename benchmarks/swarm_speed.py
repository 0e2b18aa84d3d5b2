"""How fast a swarm lives with everything on, 1 to 1000 robots: simulated seconds per second, against bare pymunk and PyDotBot.

On are the firmware of each robot, default noise, contacts, rings, SWARM messages with their acknowledgements, fixes, the codec
both ways, bridge with its tap, and host, in one process; without a recorder, with one in the process, and with the one in a
process of its own that commands have (whose own time is not counted). A factor is robot time by the processor time of this
process, counted from when the robots stand where the table has put them; by the wall clock it is as good only where nothing
else runs. Medians of rounds.

*moves* is one move of 80 mm after the other, each another way; *short* ten moves of 15 mm straight on a second, one after the
other's observation. The sparse table has 0.12 m^2 for a robot, that of a heap has robots that push into its middle (`--heaps`).
*bare* are the same bodies on the same table, stepped by pymunk from Python: nobody drives, senses or reads them. PyDotBot is
measured in the same run by an interpreter that has it: ten commands a second and robot, two frames up, no ring.

    python benchmarks/swarm_speed.py [--counts 1 5 20 33 100 500 1000] [--heaps 33 1000] [--rounds 3] [--pydotbot PYTHON]
    python benchmarks/swarm_speed.py --served [--seconds 20]      # over TCP, in real time: share of a core
    python benchmarks/swarm_speed.py --surround                   # 100 steps of the default case of hil swarm surround
    python benchmarks/swarm_speed.py --profile moves --counts 100 [--recorder]
"""

from __future__ import annotations

import argparse
import cProfile
import math
import os
import pstats
import re
import resource
import signal
import subprocess
import sys
import tempfile
from contextlib import ExitStack, closing
from pathlib import Path
from statistics import median
from time import perf_counter, process_time
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import hil
from firmware_protocol.vocabulary import MoveOption
from hil.recording.process import RecorderProcess
from hil.recording.recorder import Recorder
from hil.swarm.placing import put_on_table
from hil.swarm.rounds import SwarmMoves
from simdevice.swarm.table import SwarmTable

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from hil.swarm.handle import Swarm

AREA: Final = 0.12
"""Of a sparse table for each robot, in m^2."""
PACKED: Final = 0.05
"""Between robots that are to become a heap, in m."""
ONE_NETWORK: Final = 253
"""Most robots of a network."""
PERIOD: Final = 0.005
STRAIGHT: Final = 20
"""So many short moves go straight on before one goes back."""
ROBOT_SECONDS: Final = 2000.0
"""Of a measurement: as many as are reached within 2 to 20 s of robot time."""
PORT: Final = 24600
HIL: Final = (sys.executable, "-c", "from hil.cli import main; main()")


class Setting:
    """Robots on a table, and where they stand.

    Args:
        count: How many; one of four is a WILD.
        heap: They stand side by side, instead of all over the table.
    """

    def __init__(self, count: int, *, heap: bool = False) -> None:
        self.count = count
        self.heap = heap
        self.wilds = count // 4
        self.networks = -(-count // ONE_NETWORK)
        self.side = math.sqrt(AREA * max(count, 33))
        options = f"rangers={count - self.wilds}&wilds={self.wilds}&size={self.side:.3f},{self.side:.3f}&wall=1"
        self.url = f"sim://swarm?{options}" + (f"&networks={self.networks}" if self.networks > 1 else "")

    def poses(self) -> NDArray[np.float64]:
        """x, y in m and heading in rad, by row."""
        columns = math.ceil(math.sqrt(self.count))
        chance = np.random.default_rng(1)
        cells = chance.permutation(columns * columns)[: self.count]
        pitch = PACKED if self.heap else (self.side - 0.1) / columns
        loose = 0.0 if self.heap else max(0.0, pitch / 2 - 0.03)
        x_y = (np.stack(np.divmod(cells, columns), axis=1) + 0.5) * pitch - columns * pitch / 2
        x_y = x_y + chance.uniform(-loose, loose, x_y.shape)
        return np.column_stack((x_y, chance.uniform(-math.pi, math.pi, self.count)))

    def seconds(self) -> float:
        """Robot time of a measurement, in s."""
        return min(20.0, max(2.0, ROBOT_SECONDS / self.count))


class Load:
    """What robots are told, round by round.

    Args:
        name: `moves` or `short`.
        setting: Of which robots.
    """

    def __init__(self, name: str, setting: Setting) -> None:
        self._short = name == "short"
        self._heap = setting.heap
        self._chance = np.random.default_rng(2)
        self._all = np.ones(setting.count, bool)
        self._heading = self._chance.uniform(-math.pi, math.pi, setting.count)
        self._number = 0

    def next(self, position: NDArray[np.float64]) -> SwarmMoves:
        """The next moves.

        Args:
            position: Of each robot, in m.
        """
        number, self._number = self._number, self._number + 1
        if self._heap:
            middle = np.arctan2(-position[:, 1], -position[:, 0])
            return SwarmMoves(
                self._all, 0.015 if self._short else 0.08, heading=middle, options=MoveOption.PUSH | MoveOption.SENSE
            )
        if self._short:
            if number % STRAIGHT == STRAIGHT - 1:  # a robot that stands at a wall would answer at once, and not after its way
                self._heading = (self._heading + math.tau) % math.tau - math.pi
            return SwarmMoves(self._all, 0.015, heading=self._heading)
        if number % 2 == 0:
            self._heading = self._chance.uniform(-math.pi, math.pi, len(self._all))
        else:
            self._heading = (self._heading + math.tau) % math.tau - math.pi  # back again
        return SwarmMoves(self._all, 0.08, heading=self._heading)


class Run:
    """A swarm that is connected, placed and armed.

    Args:
        setting: Which one.
        name: What it is told: `moves` or `short`.
        recorder: Makes what records it; None: nothing does.
    """

    def __init__(self, setting: Setting, name: str, recorder: Callable[[], Recorder] | None = None) -> None:
        self._setting = setting
        self._name = name
        self._stack = ExitStack()
        taps = [self._stack.enter_context(recorder())] if recorder else []
        self.swarm = self._stack.enter_context(hil.connect_swarm(setting.url, taps=taps, expect=setting.count, timeout=20.0))
        self.swarm.arm()

    def factors(self, seconds: float, profile: cProfile.Profile | None = None) -> tuple[float, float]:
        """Let it live.

        Args:
            seconds: At least so long, of robot time.
            profile: Takes down where the time goes.

        Returns:
            Robot time by processor time, and by the wall clock.
        """
        setting = self._setting
        side = max(setting.side, math.ceil(math.sqrt(setting.count)) * PACKED + 0.1)
        put_on_table(self.swarm, dict(enumerate(setting.poses())), seed=1, size=(side, side), wall=True)
        load = Load(self._name, setting)
        position = self.swarm.observe().position
        for _ in range(8 if setting.heap else 0):
            position = self.swarm.move(load.next(position)).position
        since, used, wall = self.swarm.now(), process_time(), perf_counter()
        if profile is not None:
            profile.enable()
        missing = 0
        while self.swarm.now() < since + seconds:
            took_place = self.swarm.move(load.next(position))
            missing += len(took_place.missing)
            position = np.where(took_place.there[:, None], took_place.position, position)
        if profile is not None:
            profile.disable()
        used, wall = process_time() - used, perf_counter() - wall
        if missing:
            print(f"  {missing} observations of {setting.count} robots were missing")
        lived = self.swarm.now() - since
        return lived / used, lived / wall

    def close(self) -> None:
        """Stop the robots, and finish the log."""
        self._stack.close()


def about(setting: Setting) -> dict[str, Any]:
    """What a recorder is made with, but for the path."""
    return {"run": {}, "config": {}, "link": setting.url, "lockstep": True, "overwrite": True}


def bare(setting: Setting, seconds: float) -> float:
    """Factor of pymunk's step of the same bodies, called from Python."""
    table = SwarmTable([int(row >= setting.count - setting.wilds) for row in range(setting.count)], period=PERIOD)
    side = max(setting.side, math.ceil(math.sqrt(setting.count)) * PACKED + 0.1)
    table.reset(1, size=(side, side), wall=True)
    for row, (x, y, heading) in enumerate(setting.poses().tolist()):
        table.place(row, x, y, heading)
    space = table.bodies.space
    for body in table.bodies.robots:
        body.velocity = 0.15 * body.rotation_vector
    steps = math.ceil(seconds / PERIOD)
    begun = process_time()
    for _ in range(steps):
        space.step(PERIOD)
    return steps * PERIOD / (process_time() - begun)


def pydotbot(python: str, setting: Setting) -> float:
    """Factor of PyDotBot's simulator."""
    script = Path(__file__).with_name("pydotbot_rate.py")
    arguments = [python, str(script), f"{min(5.0, setting.seconds()):g}", str(setting.count)]
    own = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(arguments, check=True, capture_output=True, text=True, env=own)  # noqa: S603 - as we were told
    return float(re.findall(r"^\d+ ([\d.]+)$", done.stdout, re.MULTILINE)[0])


def speed(options: argparse.Namespace) -> None:
    """The table of factors."""
    settings = [Setting(count) for count in options.counts] + [Setting(count, heap=True) for count in options.heaps]
    print(f"simulated seconds per second of processor time (wall clock), medians of {options.rounds}")
    print("robots          load      recorder off        in the process   %   its own process   %    bare    PyDotBot")
    for setting in settings:
        for name in ("moves",) if setting.heap else options.loads:
            found, floor = measured(setting, name, options)
            cells = [f"{cpu:8.1f} ({wall:7.1f})" for cpu, wall in found.values()]
            off = found["off"][0]
            costs = ["", *(f"{100 * (off / cpu - 1):4.0f}" for cpu, _ in list(found.values())[1:])]
            line = " ".join(f"{cell} {share}" for cell, share in zip(cells, costs, strict=True))
            last = "       -"
            if options.pydotbot and not setting.heap and name == "moves":
                last = f"{median(pydotbot(options.pydotbot, setting) for _ in range(2)):8.2f}"
            what = f"{setting.count}{' in a heap' if setting.heap else ''}"
            print(f"{what:15} {name:6} {line} {floor:8.1f} {last}", flush=True)


def measured(setting: Setting, name: str, options: argparse.Namespace) -> tuple[dict[str, tuple[float, float]], float]:
    """Factors by recorder, measured by turns, each (processor time, wall clock); and that of the bare world."""
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        path = Path(folder)
        kinds: dict[str, Callable[[], Recorder] | None] = {
            "off": None,
            "here": lambda: Recorder(path / "here.mcap", **about(setting)),
            "beside": lambda: RecorderProcess(path / "beside.mcap", **about(setting)),
        }
        runs = {kind: stack.enter_context(closing(Run(setting, name, make))) for kind, make in kinds.items()}
        found: dict[str, list[tuple[float, float]]] = {kind: [] for kind in kinds}
        floors = []
        for _ in range(options.rounds):
            for kind, run in runs.items():
                found[kind].append(run.factors(options.seconds or setting.seconds()))
            floors.append(bare(setting, setting.seconds()))
    factors = {kind: (median(cpu for cpu, _ in rounds), median(wall for _, wall in rounds)) for kind, rounds in found.items()}
    return factors, median(floors)


def children() -> float:
    """Processor time of all processes that have ended, in s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def used_by(process: int) -> float:
    """Processor time of another process so far, in s (Linux)."""
    fields = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def served(options: argparse.Namespace) -> None:
    """Share of a core that server and host take in real time, over TCP."""
    for count in options.counts:
        setting = Setting(count)
        robots = ["--rangers", str(count - setting.wilds), "--wilds", str(setting.wilds)]
        links = ["--networks", str(setting.networks), "--link", f"tcp://127.0.0.1:{PORT}"]
        command = [*HIL, "emulate", "swarm", *robots, *links, "--wall", "--size", f"{setting.side:.3f}"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as server:  # noqa: S603 - ourselves
            try:
                assert server.stdout is not None
                server.stdout.readline()
                urls = [f"tcp://127.0.0.1:{PORT + number}" for number in range(setting.networks)]
                with hil.connect_swarm(*urls, expect=count, timeout=20.0) as swarm:
                    swarm.arm()
                    put_on_table(swarm, dict(enumerate(setting.poses())), seed=1, size=(setting.side, setting.side), wall=True)
                    _share(swarm, setting, server.pid, options.seconds or 20.0)
            finally:
                server.send_signal(signal.SIGINT)


def _share(swarm: Swarm, setting: Setting, server: int, seconds: float) -> None:
    load, position = Load("moves", setting), swarm.observe().position
    since, ours, theirs = perf_counter(), process_time(), used_by(server)
    rounds, missing = 0, 0
    while (took := perf_counter() - since) < seconds:
        took_place = swarm.move(load.next(position))
        position = np.where(took_place.there[:, None], took_place.position, position)
        rounds, missing = rounds + 1, missing + len(took_place.missing)
    host, table = (process_time() - ours) / took, (used_by(server) - theirs) / took
    print(
        f"{setting.count:5} robots on {setting.networks} sockets, {took:.1f} s, {rounds} rounds, {missing} missing: "
        f"{host + table:.1%} of a core, host {host:.1%}, server {table:.1%}",
        flush=True,
    )


def surround(options: argparse.Namespace) -> None:
    """How long 100 steps of the default case take, as a command, with log and without report."""
    for _ in range(options.rounds):
        with tempfile.TemporaryDirectory() as folder:
            for name, more in (("log", ["--out", str(Path(folder, "run"))]), ("no log", ["--no-log"])):
                command = [*HIL, "swarm", "surround", "--steps", "100", "--no-report", "--json", *more]
                begun, used = perf_counter(), children()
                subprocess.run(command, check=True, capture_output=True)  # noqa: S603 - ourselves
                print(
                    f"100 steps, {name}: {perf_counter() - begun:.2f} s, of processor time {children() - used:.2f} s",
                    flush=True,
                )


def profiled(options: argparse.Namespace) -> None:
    """Where the time goes."""
    with tempfile.TemporaryDirectory() as folder:
        for setting in [Setting(count) for count in options.counts] + [Setting(count, heap=True) for count in options.heaps]:
            make = (lambda s=setting: Recorder(Path(folder, "log.mcap"), **about(s))) if options.recorder else None
            with closing(Run(setting, options.profile, make)) as run:
                profile = cProfile.Profile()
                run.factors(options.seconds or setting.seconds(), profile)
            pstats.Stats(profile).sort_stats("tottime").print_stats(40)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--counts", type=int, nargs="*", default=[1, 5, 20, 33, 100, 500, 1000])
    parser.add_argument("--heaps", type=int, nargs="*", default=[])
    parser.add_argument("--loads", nargs="+", choices=("moves", "short"), default=["moves", "short"])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=0.0, help="of robot time; 0: by the number of robots")
    parser.add_argument("--pydotbot", metavar="PYTHON", help="interpreter that has the package pydotbot")
    parser.add_argument("--served", action="store_true")
    parser.add_argument("--surround", action="store_true")
    parser.add_argument("--profile", choices=("moves", "short"))
    parser.add_argument("--recorder", action="store_true", help="of what is profiled, with a recorder in the process")
    options = parser.parse_args()
    if options.profile:
        profiled(options)
    elif options.served:
        served(options)
    elif options.surround:
        surround(options)
    else:
        speed(options)


if __name__ == "__main__":
    main()
