"""Makes the logs that are kept in tests/replay_logs anew: real runs of the command, made small.

    python tests/support/replay_logs.py [NAME...]     all, or those named; `--list` says what there is

What is served in real time is served by this process; what runs is `hil` in a process of its own.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Final

from processes import Hil
from serving import MULTICAST, Stepped, in_thread

from firmware_protocol.address import parse_address
from hil.mcaplog.making.slimming import slim
from simdevice.serving.endpoints import TcpEndpoint
from simdevice.serving.opening import open_endpoint
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from simdevice.serving.endpoints import Endpoint
    from simdevice.sumo.world import World

FOLDER: Final = Path(__file__).parents[1] / "replay_logs"
DONE, LOST, INTERRUPTED = 0, 3, 130
"""Exit statuses that a run is meant to end with."""
TRIED: Final = ("--held-out", "1", "--no-report")
COACH: Final = ("--period", "0.1", *TRIED)
ARM_AND_DRIVE: Final = b"a\x1b[A"
"""Keys that arm the robot and drive it."""


class Robot(Stepped):
    """A robot that is served, and waited for.

    Args:
        wire: What its link carries.
    """

    def __init__(self, wire: str) -> None:
        self.world: World = junior_world(WorldSettings(wire=wire, seed=4))
        super().__init__(self.world)

    @property
    def turning(self) -> bool:
        """Its wheels are powered."""
        return self.world.device.wheels != (0.0, 0.0)

    def drives(self, after: float) -> None:
        """Wait until its wheels turn.

        Args:
            after: Not before this time of its clock, in s.
        """
        self.until(lambda: self.turning and self.world.now() >= after)


@contextmanager
def served(link: str) -> Iterator[tuple[str, Robot]]:
    """A robot in real time, and its address."""
    endpoint: Endpoint = open_endpoint(link)
    robot = Robot(endpoint.wire)
    with in_thread(robot, endpoint):
        yield endpoint.url, robot


def ran(folder: Path, name: str, *arguments: str, status: int = DONE, meanwhile: Callable[[Hil], object] | None = None) -> Path:
    """Run the command, and give its log.

    Args:
        folder: Where everything goes.
        name: Name of the log.
        *arguments: What is run.
        status: How it is to end.
        meanwhile: Is done while it runs.

    Raises:
        RuntimeError: It ended otherwise.
    """
    log = folder / f"{name}.mcap"
    with Hil(folder, *arguments, "--log", str(log)) as program:
        if meanwhile is not None:
            meanwhile(program)
        ended = program.end()
        if ended != status:
            raise RuntimeError(f"{name}: exit status {ended}, not {status}\n{program.text}")
    return log


# --- the ten -------------------------------------------------------------------------------------------------------------


def lockstep(folder: Path) -> Path:
    """Coached in lock-step, over MAVLink."""
    robot = "sim://junior?opponent=curved-light&seed=7"
    options = ["--runs", "1", "--period", "0.02", "--budget", "500"]  # generations
    return ran(folder, "lockstep", "coach", robot, *options, *TRIED)


def lockstep_can(folder: Path) -> Path:
    """Coached in lock-step, over CAN."""
    return ran(folder, "lockstep_can", "coach", "sim://junior?wire=can&seed=8", "--runs", "1", *COACH, "--budget", "60")


def pty(folder: Path) -> Path:
    """Coached in real time, on a pty."""
    with served("pty") as (url, _):
        return ran(folder, "pty", "coach", url, *COACH, "--budget", "16")


def can_real_time(folder: Path) -> Path:
    """Coached in real time, over CAN frames in UDP multicast on this machine."""
    with served(f"{MULTICAST}&hop_limit=0") as (url, _):
        return ran(folder, "can_real_time", "coach", url, *COACH, "--budget", "16")


def faults(folder: Path) -> Path:
    """Coached on a bad line: of the frames 5 % are lost, 1 % damaged, all late by up to 20 ms."""
    with served("pty") as (url, _):
        line = f"{url}?faults=drop:0.05,corrupt:0.01,jitter:0.02&seed=3"
        return ran(folder, "faults", "coach", line, *COACH, "--budget", "16")


def unplugged(folder: Path) -> Path:
    """Coached over TCP, whose server is gone for a while and back."""
    robot, endpoint = Robot("mavlink"), TcpEndpoint(port=0)
    with ExitStack() as before, ExitStack() as after:
        before.enter_context(in_thread(robot, endpoint))

        def unplug(program: Hil) -> None:
            robot.drives(after=6.0)
            before.close()
            program.until("open it again")
            for _ in range(200):  # it lives on, unheard
                robot.step(b"")
            after.enter_context(in_thread(robot, TcpEndpoint(*parse_address(endpoint.url).host_port())))

        return ran(folder, "unplugged", "coach", endpoint.url, *COACH, "--budget", "16", meanwhile=unplug)


def lost(folder: Path) -> Path:
    """Coached over TCP, whose server is gone for good."""
    robot, endpoint = Robot("mavlink"), TcpEndpoint(port=0)
    with ExitStack() as serving:
        serving.enter_context(in_thread(robot, endpoint))

        def lose(_: Hil) -> None:
            robot.drives(after=6.0)
            serving.close()

        options = [*COACH, "--budget", "16", "--reconnect", "1"]
        return ran(folder, "lost", "coach", endpoint.url, *options, status=LOST, meanwhile=lose)


def interrupted(folder: Path) -> Path:
    """Coached on a pty, ended by SIGTERM in the midst of a maneuver."""
    with served("pty") as (url, robot):

        def end(program: Hil) -> None:
            robot.drives(after=8.0)
            program.send(signal.SIGTERM)

        options = ["--checkpoint", str(folder / "checkpoint.json"), *COACH, "--budget", "24"]
        return ran(folder, "interrupted", "coach", url, *options, status=INTERRUPTED, meanwhile=end)


def resumed(folder: Path) -> Path:
    """The very run that was ended by SIGTERM, gone on with: it is made with that one."""
    with served("pty") as (url, _):
        return ran(folder, "resumed", "coach", url, *COACH, "--resume-from", str(folder / "checkpoint.json"))


def bout(folder: Path) -> Path:
    """Bouts by advice, in real time over UDP."""
    advice = str(folder / "advice.toml")
    with Hil(folder, "coach", "--runs", "1", *COACH, "--budget", "60", "--no-log", "--advice-out", advice) as coach:
        if coach.end() != DONE:
            raise RuntimeError(coach.text)
    with served("udp://127.0.0.1:0") as (url, _):
        return ran(folder, "bout", "bout", url, "--advice", advice, "--trials", "2", "--quiet")


# --- and more ------------------------------------------------------------------------------------------------------------


def extra_monitor(folder: Path) -> Path:
    """Looked at and driven by keys, on a pty, from a terminal."""
    terminal, other = os.openpty()
    log = folder / "extra_monitor.mcap"
    with served("pty") as (url, robot), Hil(folder, "monitor", url, "--log", str(log), stdin=other) as program:
        robot.until(lambda: robot.world.now() > 3.0)
        while not robot.turning:
            os.write(terminal, ARM_AND_DRIVE)
            soon = robot.world.now() + 0.3
            robot.until(lambda soon=soon: robot.turning or robot.world.now() > soon)  # type: ignore[misc]
        os.write(terminal, b"e")
        robot.until(lambda: not robot.turning)
        os.write(terminal, b"dq")
        if program.end() != DONE:
            raise RuntimeError(program.text)
    os.close(terminal)
    os.close(other)
    return log


def extra_check(folder: Path) -> Path:
    """Checked against the protocol, in lock-step."""
    return ran(folder, "extra_check", "check", "sim://junior?seed=2", "--quiet")


TEN: Final = (lockstep, lockstep_can, pty, can_real_time, faults, unplugged, lost, interrupted, resumed, bout)
LOGS: Final = {make.__name__: make for make in (*TEN, extra_monitor, extra_check)}
MADE_WITH: Final = {"resumed": "interrupted"}
"""What has to be made in the same call."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Make logs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="which; all if left out")
    parser.add_argument("--list", action="store_true", help="say what there is, and make none")
    asked = parser.parse_args(arguments)
    if asked.list:
        for name, make in LOGS.items():
            print(f"{name:15}{make.__doc__}")  # noqa: T201 - a script's
        return 0
    if unknown := sorted({*asked.names} - LOGS.keys()):
        parser.error(f"there is no log {', '.join(unknown)}: known are {', '.join(LOGS)}")
    wanted = {*(asked.names or LOGS)}
    wanted |= {MADE_WITH[name] for name in wanted & MADE_WITH.keys()}
    FOLDER.mkdir(exist_ok=True)
    with TemporaryDirectory() as name:
        for each, make in LOGS.items():
            if each in wanted:
                out = FOLDER / f"{each}.mcap"
                slim(make(Path(name)), out, overwrite=True)
                print(f"{out}: {out.stat().st_size:,} bytes", flush=True)  # noqa: T201 - a script's
    together = sum(log.stat().st_size for log in FOLDER.glob("*.mcap"))
    print(f"together {together:,} bytes")  # noqa: T201 - a script's
    return 0


if __name__ == "__main__":
    sys.exit(main())
