"""Whether the tests of the C core notice a slip: `python tests/adequacy/core_mutation.py --count 60 --seed 1`.

Changes operators and constants of the core at random, one at a time, builds the host extension with each change and runs
the tests of the core on it until the first one fails. A change that no test notices survives: either a test is missing, or
the change makes no difference; then `core_equivalent_mutants.toml` says why, and it is not tried again.
"""

from __future__ import annotations

import argparse
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Final

from core_build import CORE, BuildError, CoreBuild, pytest_command, pytest_environment
from core_mutants import Mutant, known, mutants

from firmware_protocol.firmware.build_host import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

PATIENCE: Final = 4.0
"""A mutant whose tests take this many times as long as they should counts as noticed: it does not end."""


class Mutation:
    """Mutants, built and tried.

    Args:
        folder: Where builds go.
        arguments: More arguments of pytest.
    """

    def __init__(self, folder: Path, arguments: Sequence[str]) -> None:
        self._folder = folder
        self._command = [sys.executable, *pytest_command(["-x", *arguments])]
        self._build = CoreBuild(folder / "build", ["-O1"])
        self._timeout: float | None = None
        self._original = {name: path.read_bytes() for name, path in self._build.objects.items()}

    def passes(self, extension: Path) -> bool:
        """Whether every test passes on an extension."""
        scratch = extension.parent / "hypothesis"
        try:
            done = subprocess.run(  # noqa: S603
                self._command,
                cwd=ROOT,
                env=pytest_environment(extension, scratch),
                check=False,
                capture_output=True,
                timeout=self._timeout,
            )
        except subprocess.TimeoutExpired:
            return False
        return done.returncode == 0

    def unchanged_passes(self) -> bool:
        """Whether the tests pass on the core as it is; how long they take says how long to wait for a mutant."""
        begun = time.monotonic()
        passed = self.passes(self._build.link(self._folder / "_host.so"))
        self._timeout = PATIENCE * (time.monotonic() - begun) + 10.0
        return passed

    def build(self, mutant: Mutant, number: int) -> Path | None:
        """Build a mutant.

        Args:
            mutant: Which.
            number: Its folder is called so.

        Returns:
            The extension; None where the mutant does not compile, or is the same code.
        """
        folder = self._folder / str(number)
        folder.mkdir()
        source = folder / mutant.source
        source.write_text(mutant.text, encoding="utf-8")
        try:
            changed = self._build.compile(source, source.with_suffix(".o"))
            if changed.read_bytes() == self._original[mutant.source]:
                return None
            return self._build.link(folder / "_host.so", {mutant.source: changed})
        except BuildError:
            return None


def drawn(seed: int, sources: Sequence[str]) -> Iterator[Mutant]:
    """Every mutant of these sources that is not known to make no difference, in random order."""
    paths = [path for path in CORE if path.name in sources]
    everything = [mutant for path in paths for mutant in mutants(path.name, path.read_text(encoding="utf-8"))]
    random.Random(seed).shuffle(everything)
    equivalent = known()
    return (mutant for mutant in everything if mutant.key not in equivalent)


def try_some(mutation: Mutation, candidates: Iterator[Mutant], count: int, jobs: int) -> tuple[int, list[Mutant]]:
    """Try mutants.

    Args:
        mutation: Builds and tries.
        candidates: Mutants, some of which may not compile or be the same code; those do not count.
        count: How many to try.
        jobs: How many at a time.

    Returns:
        How many were tried, and which survived.
    """
    tried, survivors = 0, []
    lock = threading.Lock()
    numbered = enumerate(candidates)

    def work() -> None:
        nonlocal tried
        while True:
            with lock:
                if tried >= count or (pair := next(numbered, None)) is None:
                    return
                tried += 1  # unless it is none, below
            number, mutant = pair
            extension = mutation.build(mutant, number)
            survived = extension is not None and mutation.passes(extension)
            with lock:
                tried -= extension is None
                if survived:
                    survivors.append(mutant)
                    sys.stdout.write(f"survived: {mutant}\n")
                    sys.stdout.flush()

    with ThreadPoolExecutor(jobs) as pool:
        for worker in [pool.submit(work) for _ in range(jobs)]:
            worker.result()
    return tried, survivors


def main() -> int:
    """Try mutants; the exit status is 1 when one survived, 2 when the tests fail without any."""
    parser = argparse.ArgumentParser(description="Whether the tests of the C core notice a slip.")
    parser.add_argument("--count", type=int, default=60, help="how many changes to try")
    parser.add_argument("--seed", type=int, default=1, help="which ones")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="how many at a time")
    parser.add_argument("--source", action="append", help="only in this file of the core; may be given again")
    parser.add_argument("pytest", nargs="*", help="more arguments of pytest, behind --")
    options = parser.parse_args()
    sources = options.source or sorted(path.name for path in CORE)
    with tempfile.TemporaryDirectory() as name:
        mutation = Mutation(Path(name), options.pytest)
        if not mutation.unchanged_passes():
            sys.stdout.write("The tests of the core fail without any change.\n")
            return 2
        tried, survivors = try_some(mutation, drawn(options.seed, sources), options.count, options.jobs)
    sys.stdout.write(f"{tried} mutants (seed {options.seed}): {tried - len(survivors)} killed, {len(survivors)} survived\n")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
