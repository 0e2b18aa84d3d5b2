"""How much of the C core its own tests run: `python tests/adequacy/core_coverage.py`.

The host extension is built with gcc's coverage in a folder of its own, the tests of the core run on that build, and gcov
says which lines and branches ran. Every line must, unless it says why it cannot: `/* unreachable: the reason */` leaves
a line and its branches out. `CC` and `GCOV` choose the programs, which come together.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from core_build import CORE, CoreBuild, pytest_command, pytest_environment

from firmware_protocol.firmware.build_host import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

LINES: Final = 1.0
BRANCHES: Final = 0.97
"""Least shares that must have run."""

_UNREACHABLE = re.compile(r"/\* unreachable: \S.*\*/")


@dataclass
class Coverage:
    """What ran of one source.

    Attributes:
        name: The source.
        lines: How often each line with code ran, by number.
        branches: How often each way out of a decision was taken, by line and position in it.
    """

    name: str
    lines: dict[int, int] = field(default_factory=dict)
    branches: dict[tuple[int, int], int] = field(default_factory=dict)

    def add(self, line: dict[str, Any]) -> None:
        """Take in what gcov says of one line; a line that stands in several functions is said several times."""
        number = int(line["line_number"])
        self.lines[number] = self.lines.get(number, 0) + int(line["count"])
        for position, branch in enumerate(line["branches"]):
            key = (number, position)
            self.branches[key] = self.branches.get(key, 0) + int(branch["count"])

    def leave_out(self, numbers: Iterable[int]) -> None:
        """Forget these lines and their branches."""
        gone = set(numbers)
        self.lines = {number: count for number, count in self.lines.items() if number not in gone}
        self.branches = {key: count for key, count in self.branches.items() if key[0] not in gone}

    def missing(self) -> list[str]:
        """What did not run, as `file:line` and what is missing there."""
        found = [f"{self.name}:{number}: never ran" for number, count in sorted(self.lines.items()) if count == 0]
        for (number, position), count in sorted(self.branches.items()):
            if count == 0 and self.lines.get(number, 0) > 0:
                found.append(f"{self.name}:{number}: branch {position} never taken")
        return found


def unreachable(source: str) -> list[int]:
    """Numbers of the lines that say why they cannot run."""
    return [number for number, line in enumerate(source.splitlines(), 1) if _UNREACHABLE.search(line)]


def share(counts: Iterable[int]) -> float:
    """Which share of these ran at least once."""
    ran = [count > 0 for count in counts]
    return sum(ran) / len(ran) if ran else 1.0


def passes(found: Sequence[Coverage]) -> bool:
    """Whether enough ran."""
    lines = share(count for one in found for count in one.lines.values())
    return lines >= LINES and share(count for one in found for count in one.branches.values()) >= BRANCHES


def read(build: CoreBuild) -> list[Coverage]:
    """Ask gcov what ran of every source of the core.

    Args:
        build: A build whose tests have ended.
    """
    gcov = os.environ.get("GCOV", "gcov")
    found = []
    for source in CORE:
        counted = build.objects[source.name].with_suffix(".gcda")
        command = [gcov, "--json-format", "--stdout", "--branch-probabilities", str(counted)]
        done = subprocess.run(command, cwd=source.parent, check=True, capture_output=True, text=True)  # noqa: S603
        coverage = Coverage(source.name)
        for file in json.loads(done.stdout)["files"]:
            if (source.parent / file["file"]).resolve() == source.resolve():
                for line in file["lines"]:
                    coverage.add(line)
        coverage.leave_out(unreachable(source.read_text(encoding="utf-8")))
        found.append(coverage)
    return found


def report(found: Sequence[Coverage], *, every: bool) -> str:
    """The table, and what did not run.

    Args:
        found: Sources.
        every: Name missing branches, too, and not only lines.
    """
    rows = [f"{'source':14}{'lines':>8}{'ran':>9}{'branches':>10}{'ran':>9}"]
    whole = Coverage("core")
    for one in found:
        whole.lines |= {len(whole.lines) + i: count for i, count in enumerate(one.lines.values())}
        whole.branches |= {(0, len(whole.branches) + i): count for i, count in enumerate(one.branches.values())}
    for one in (*found, whole):
        lines, branches = share(one.lines.values()), share(one.branches.values())
        rows.append(f"{one.name:14}{len(one.lines):8}{lines:9.1%}{len(one.branches):10}{branches:9.1%}")
    missing = [text for one in found for text in one.missing() if every or text.endswith("ran")]
    return "\n".join([*rows, *missing, ""])


def measure(folder: Path, arguments: Sequence[str]) -> tuple[list[Coverage], bool]:
    """Build, run the tests of the core, and read what ran.

    Args:
        folder: Where the build goes.
        arguments: More arguments of pytest.

    Returns:
        The sources, and whether the tests passed.
    """
    build = CoreBuild(folder / "build", ["-O0", "--coverage"])
    extension = build.link(folder / "_host.so")
    done = subprocess.run(  # noqa: S603
        [sys.executable, *pytest_command(arguments)],
        cwd=ROOT,
        env=pytest_environment(extension, folder / "hypothesis"),
        check=False,
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        sys.stdout.write(done.stdout + done.stderr)
    return read(build), done.returncode == 0


def main() -> int:
    """Measure and judge; the exit status is 1 when too little ran or a test failed."""
    parser = argparse.ArgumentParser(description="How much of the C core its own tests run.")
    parser.add_argument("--branches", action="store_true", help="name every branch that was never taken")
    parser.add_argument("pytest", nargs="*", help="more arguments of pytest, behind --")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        found, passed = measure(Path(name), options.pytest)
    good = passes(found)
    sys.stdout.write(report(found, every=options.branches or not good))
    if not good:
        sys.stdout.write(f"Too little: {LINES:.0%} of the lines and {BRANCHES:.0%} of the branches must run.\n")
    return 0 if good and passed else 1


if __name__ == "__main__":
    sys.exit(main())
