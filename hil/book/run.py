"""`python -m hil.book.run [NAME...]`: make the results that are not there; those that are named, anew."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import HilError
from hil.book.experiments import EXPERIMENTS
from hil.book.places import RESULTS
from hil.book.reduction import reduced
from hil.book.results import StoredResults, save
from hil.versions import versions

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hil.book.experiments import Experiment

LAST_WORDS = 5
"""Lines of a command that failed which are told."""


class ExperimentError(HilError):
    """A command failed, or what it printed lacks what claims need."""


def printed(experiment: Experiment) -> str:
    """What an experiment's command prints.

    Args:
        experiment: The experiment.

    Raises:
        ExperimentError: It failed.
    """
    with tempfile.TemporaryDirectory() as folder:  # where it leaves its run
        done = subprocess.run(  # noqa: S603 - our own program, with arguments of our own
            (sys.executable, "-m", "hil", *experiment.arguments),
            cwd=folder,
            capture_output=True,
            stdin=subprocess.DEVNULL,
            text=True,
            encoding="utf-8",
            check=False,
        )
    if done.returncode:
        last = "\n".join(done.stderr.strip().splitlines()[-LAST_WORDS:])
        raise ExperimentError(f"{experiment.name}: {experiment.command} ended with exit status {done.returncode}:\n{last}")
    return done.stdout


def make(experiment: Experiment, folder: Path, *, play: Callable[[Experiment], str]) -> None:
    """Make an experiment, and store what claims need of it.

    Args:
        experiment: The experiment.
        folder: Where to.
        play: Gives what its command prints.

    Raises:
        ExperimentError: Its command failed, or printed something else.
        OSError: The result can't be written.
    """
    try:
        result = reduced(experiment.kind, json.loads(play(experiment)))
    except (ValueError, KeyError, IndexError, TypeError) as error:
        raise ExperimentError(
            f"{experiment.name}: what {experiment.command} printed lacks what claims need: {error!r}"
        ) from error
    save(folder, experiment, versions(), result)


def main(arguments: Sequence[str] | None = None, *, play: Callable[[Experiment], str] = printed) -> int:
    """Make what is not there, or what is named.

    Args:
        arguments: Command line without the program's name; None takes the process's own.
        play: Gives what an experiment's command prints.

    Returns:
        Exit status: 0 all are there, 1 some could not be made, 130 interrupted.
    """
    parser = argparse.ArgumentParser(prog="python -m hil.book.run", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="make these anew; default: all that are not there")
    parser.add_argument("--results", type=Path, default=RESULTS, metavar="FOLDER", help="where results are stored")
    parser.add_argument("--list", action="store_true", help="say what there is, and make nothing")
    options = parser.parse_args(arguments)
    if unknown := [name for name in options.names if name not in EXPERIMENTS]:
        parser.error(f"there is no experiment {', '.join(unknown)}; there are {', '.join(EXPERIMENTS)}")
    results = StoredResults(options.results)
    failed = 0
    for name, experiment in EXPERIMENTS.items():
        if options.list:
            sys.stdout.write(f"{name}: {'made' if results.has(name) else 'not made'}: {experiment.command}\n")
        elif name in options.names if options.names else not results.has(name):
            sys.stdout.write(f"{name}: {experiment.command}\n")
            sys.stdout.flush()
            try:
                make(experiment, options.results, play=play)
            except KeyboardInterrupt:
                return 130
            except (HilError, OSError) as error:
                sys.stderr.write(f"{error}\n")
                failed += 1
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
