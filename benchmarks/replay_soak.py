"""Does every run in real time replay to the byte? Many short ones on a busy machine, with all that may befall them.

Each run is drawn by its seed: a verb, a link (pty, TCP, UDP, CAN), faults of the line and of the robot, and what happens at a
random moment: SIGINT, SIGTERM, Ctrl-Z and fg, a robot that is killed and started again, or that never returns. Beside them run
loops that keep all processors busy. Each log is replayed with every entry compared; those that differ are kept.

    python benchmarks/replay_soak.py [--runs 100] [--first 1] [--at-once 4] [--busy 2] [--keep soak_logs]
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from shutil import copy
from time import perf_counter, sleep
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

PATIENCE: Final = 90.0
"""A run that takes longer is killed, in s; its log is replayed all the same."""
HIL: Final = (sys.executable, "-c", "from hil.cli import main; main()")
FAULTS: Final = (
    "",
    "",
    "drop:0.05,corrupt:0.01,jitter:0.02",
    "duplicate:0.05,reorder:0.02",
    "unplug:{moment}+1",
    "drop:0.02,unplug:{moment}+0.3,unplug:{later}+1",
)
AT_THE_ROBOT: Final = ("", "", "", "", "brownout:{moment}+0.4", "stuck:eye_left@{moment}+2", "battery:6.2@{moment}")
EVENTS: Final = ("", "", "SIGINT", "SIGTERM", "SIGTSTP", "restart", "SIGKILL", "gone")


@dataclass(frozen=True)
class Plan:
    """One run.

    Attributes:
        seed: What it was drawn by.
        verb: Name of the sub-command.
        options: Its options.
        link: Where the robot is served.
        faults: Of the line.
        at_the_robot: Faults of the robot.
        event: What happens.
        moment: When, in s from when its log was begun.
    """

    seed: int
    verb: str
    options: tuple[str, ...]
    link: str
    faults: str
    at_the_robot: str
    event: str
    moment: float

    def __str__(self) -> str:
        parts = [
            f"{self.seed:4} {self.verb:8}{self.link.split(':')[0]:5}",
            self.faults and f"line {self.faults}",
            self.at_the_robot and f"robot {self.at_the_robot}",
            self.event and f"{self.event} at {self.moment:.2f} s",
        ]
        return "  ".join(filter(None, parts))


def drawn(seed: int) -> Plan:
    """A run by its seed."""
    chance = random.Random(seed)  # noqa: S311 - it draws what is tried
    port = 21000 + os.getpid() % 300 * 100 + seed % 100
    links = (
        "pty",
        f"tcp://127.0.0.1:{port}",
        f"udp://127.0.0.1:{port}",
        f"can://udp_multicast/239.74.163.2?port={port}&hop_limit=0",
    )
    times = {name: f"{chance.uniform(1.0, 5.0):.3f}" for name in ("moment", "later")}
    times["later"] = f"{float(times['moment']) + 2.5:.3f}"
    verbs: dict[str, tuple[str, ...]] = {
        "coach": ("--runs", "1", "--budget", "14", "--held-out", "1", "--period", "0.1", "--no-report", "--reconnect", "4"),
        "bout": ("--trials", "1", "--controller", chance.choice(["chase", "random"]), "--reconnect", "4"),
        "monitor": ("--duration", "6", "--reconnect", "4"),
        "deploy": ("--contest", "--countdown", "0.5"),
        "check": ("--timeout", "3", *(["--moving"] if chance.random() < 0.3 else [])),
        "param": (),
    }
    verb = chance.choices(list(verbs), weights=[5, 4, 3, 2, 1, 1])[0]
    link = chance.choice(links)
    return Plan(
        seed,
        verb,
        (*verbs[verb], "--seed", str(seed)) if verb != "param" else (),
        link,
        "" if verb in {"check", "param"} else chance.choice(FAULTS).format(**times),
        "" if verb in {"check", "param"} else chance.choice(AT_THE_ROBOT).format(**times),
        chance.choice(EVENTS if link.startswith("tcp") else [event for event in EVENTS if event != "restart"]),
        chance.uniform(0.0, 6.0),
    )


class Robot:
    """An emulated robot in a process of its own.

    Attributes:
        url: Its address.
    """

    def __init__(self, plan: Plan, link: str | None = None) -> None:
        faults = ["--faults", plan.at_the_robot] if plan.at_the_robot else []
        self._process = subprocess.Popen(  # noqa: S603 - our own program
            [*HIL, "emulate", "--link", link or plan.link, "--seed", str(plan.seed), "--json", *faults],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        assert self._process.stdout is not None
        text = ""
        while line := self._process.stdout.readline():
            text += line
            with contextlib.suppress(ValueError):
                self.url = str(json.loads(text)["url"])
                return
        raise RuntimeError(f"no robot for {plan}: {text}")

    def kill(self) -> None:
        """Have it gone at once."""
        self._process.kill()
        self._process.wait()


def with_faults(url: str, plan: Plan) -> str:
    """The address of a robot, with what goes wrong on the way."""
    if not plan.faults:
        return url
    return f"{url}{'&' if '?' in url else '?'}faults={plan.faults}&seed={plan.seed}"


def happen(plan: Plan, program: subprocess.Popen[bytes], robots: list[Robot], folder: Path) -> None:
    """What happens in the midst of a run."""
    while program.poll() is None and not any(folder.glob("*log.mcap*")):
        sleep(0.05)
    sleep(plan.moment)
    match plan.event:
        case "":
            return
        case "restart":
            robots[-1].kill()
            sleep(0.3)
            robots.append(Robot(plan))
        case "gone":
            robots[-1].kill()
        case _ if program.poll() is None:
            program.send_signal(getattr(signal, plan.event))
            if plan.event == "SIGTSTP":
                sleep(1.0)
                program.send_signal(signal.SIGCONT)


def performed(plan: Plan, folder: Path, advice: Path) -> Path:
    """Make a run, and give its log."""
    robots = [Robot(plan)]
    own = folder / str(plan.seed)
    log = own / "log.mcap"
    own.mkdir()
    where = [*([str(advice)] if plan.verb == "deploy" else []), with_faults(robots[0].url, plan)]
    program = subprocess.Popen(  # noqa: S603 - our own program
        [*HIL, plan.verb, *where, *plan.options, "--log", str(log)],
        stdout=subprocess.DEVNULL,
        stderr=(own / "words").open("wb"),
        cwd=own,
        process_group=0,
    )
    try:
        happen(plan, program, robots, own)
        program.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        program.kill()
    finally:
        program.wait()
        for robot in robots:
            robot.kill()
    return log


def replayed(log: Path) -> tuple[str, str]:
    """`same`, `other`, `cannot` or `broken`, and the words."""
    command = [*HIL, "replay", str(log), "--strict"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - our own program
    words = {0: "same", 1: "other", 2: "cannot"}
    if "Traceback" in done.stderr:
        return "broken", done.stderr
    return words.get(done.returncode, "broken"), done.stdout + done.stderr


def tried(plan: Plan, folder: Path, advice: Path, keep: Path) -> tuple[str, Plan]:
    """Make a run, and replay it."""
    began = perf_counter()
    try:
        log = performed(plan, folder, advice)
        found = log if log.exists() else next(log.parent.glob("*log.mcap*"), log)  # one of a run that was killed
        what, words = replayed(found) if found.exists() else ("no log", (log.parent / "words").read_text()[-300:])
    except (OSError, RuntimeError) as error:
        what, words, found = "broken", str(error), folder / "none"
    print(f"{what:7} {perf_counter() - began:5.1f} s  {plan}", flush=True)
    if what != "same":
        print(words, flush=True)
        if found.exists():
            keep.mkdir(exist_ok=True)
            copy(found, keep / f"{plan.seed}.mcap")
    else:
        found.unlink()
    return what, plan


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the runs, and count those that come out the same."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--first", type=int, default=1, help="seed of the first run")
    parser.add_argument("--at-once", type=int, default=4)
    parser.add_argument("--busy", type=int, default=2, help="loops beside them")
    parser.add_argument("--keep", type=Path, default=Path("soak_logs"), help="where logs go that differ")
    asked: Any = parser.parse_args(arguments)
    loops = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(asked.busy)]
    counts: Counter[str] = Counter()
    try:
        with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(asked.at_once) as pool:
            folder = Path(name)
            advice = folder / "advice.toml"
            coach = [*HIL, "coach", "--runs", "1", "--budget", "40", "--held-out", "0", "--no-report", "--no-log", "--quiet"]
            coach += ["--advice-out", str(advice), "--out", str(folder / "coach")]
            subprocess.run(coach, check=True)  # noqa: S603 - our own program
            plans = [drawn(seed) for seed in range(asked.first, asked.first + asked.runs)]
            for what, _ in pool.map(lambda plan: tried(plan, folder, advice, asked.keep), plans):
                counts[what] += 1
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()
    print(", ".join(f"{count} {what}" for what, count in counts.most_common()), f"of {asked.runs}")
    return 0 if counts["same"] == asked.runs else 1


if __name__ == "__main__":
    sys.exit(main())
