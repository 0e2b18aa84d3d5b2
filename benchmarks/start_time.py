"""How long the command line takes to say anything, against what the library that takes it apart takes to be imported.

    python benchmarks/start_time.py [ROUNDS]

Each is a process of its own; rounds are interleaved, and the shortest of each counts. Exit status 1: help or completion takes
more than three times as long as `import typer`.
"""

from __future__ import annotations

import os
import subprocess
import sys
from time import perf_counter

MOST = 3.0
HIL = ("-c", "import sys; sys.argv[0] = 'hil'; from hil.cli import main; main()")


def completed(words: str) -> dict[str, str]:
    """What bash says to a program that is to complete a command line.

    Args:
        words: The line so far.
    """
    return {"_HIL_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}


FLOOR = "import typer"
BOUNDED = ("hil --help", "hil TAB", "hil emulate TAB", "hil coach --o TAB")
CASES: dict[str, tuple[tuple[str, ...], dict[str, str]]] = {
    FLOOR: (("-c", "import typer"), {}),
    "hil --help": ((*HIL, "--help"), {}),
    "hil TAB": (HIL, completed("hil ")),
    "hil emulate TAB": (HIL, completed("hil emulate ")),
    "hil coach --o TAB": (HIL, completed("hil coach --o")),
    "hil coach --help": ((*HIL, "coach", "--help"), {}),
    "hil swarm surround --help": ((*HIL, "swarm", "surround", "--help"), {}),
    "hil log info --help": ((*HIL, "log", "info", "--help"), {}),
    "import hil": (("-c", "import hil"), {}),
}


def seconds(arguments: tuple[str, ...], variables: dict[str, str]) -> float:
    """How long a process takes.

    Args:
        arguments: Of the interpreter.
        variables: Added to the environment.
    """
    begun = perf_counter()
    subprocess.run([sys.executable, *arguments], env={**os.environ, **variables}, capture_output=True, check=True)  # noqa: S603
    return perf_counter() - begun


def main() -> int:
    """Measure, and print; the exit status."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 15
    best = dict.fromkeys(CASES, float("inf"))
    for _ in range(rounds):
        for name, (arguments, variables) in CASES.items():
            best[name] = min(best[name], seconds(arguments, variables))
    for name, took in best.items():
        print(f"{name:28} {took * 1000:6.0f} ms  {took / best[FLOOR]:5.2f} times")
    return int(any(best[name] > MOST * best[FLOOR] for name in BOUNDED))


if __name__ == "__main__":
    sys.exit(main())
