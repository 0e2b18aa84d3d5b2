"""Stored results: a file for each experiment, small enough for people to read, and what claims ask of it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.errors import HilError
from hil.book.experiments import EXPERIMENTS, Experiment
from hil.book.measurement import Measurement, about
from hil.doors import Door
from hil.files.outputs import replace_file
from hil.statistics import Z95
from pal_advisor.surround import Case

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

VERSION: Final = 1
ANEW: Final = "python -m hil.book.run"
"""Makes results."""
_COMMANDS: Final = {name: experiment.command for name, experiment in EXPERIMENTS.items()}


class ResultError(HilError):
    """A stored result can't be read."""


class ResultMissingError(HilError):
    """An experiment has not been made, or does not tell what is asked."""


DOOR: Final = Door("stored result", ResultError, largest=1 << 20)


@dataclass(frozen=True)
class StoredRuns:
    """Runs of one condition, or searches.

    Attributes:
        columns: By name, one value a seed.
        data: All that is stored.
    """

    columns: dict[str, list[Any]]
    data: dict[str, Any]

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.columns["seed"])

    def column(self, name: str) -> NDArray[np.float64]:
        """Numbers, one a seed.

        Args:
            name: Which.

        Raises:
            ResultMissingError: They have not been measured.
        """
        values = self.columns.get(name, [])
        known = np.array([value for value in values if value is not None], dtype=np.float64)
        if not len(known):
            raise ResultMissingError(f"{name} has not been measured")
        return known

    def rule(self, kind: str, stimulus: int) -> dict[str, Any]:
        """What was learnt for a stimulus: in how many runs (`learnt`), its mean `weight`, and each behaviour how often.

        Args:
            kind: `ranger` or `wild`.
            stimulus: Its number.

        Raises:
            ResultMissingError: No run has learnt anything for it.
        """
        found = self.data["rules"][kind].get(str(stimulus))
        if found is None:
            raise ResultMissingError(f"no {kind} has learnt anything for STIMULUS{stimulus}")
        return dict(found)


@dataclass(frozen=True)
class ConditionTable:
    """Mean fitness of every condition of chapter 9.

    Attributes:
        cases: The conditions.
        repeats: How many runs each has, shape (conditions,).
        columns: All columns.
    """

    cases: tuple[Case, ...]
    repeats: NDArray[np.int64]
    columns: dict[str, list[Any]]

    def means(self, fitness: str) -> NDArray[np.float64]:
        """Mean fitness of each condition, shape (conditions,).

        Args:
            fitness: Which, as in `FITNESSES`.
        """
        return np.array(self.columns[f"{fitness}_mean"], dtype=np.float64)

    def errors(self, fitness: str) -> NDArray[np.float64]:
        """Standard error of each mean, shape (conditions,).

        Args:
            fitness: As for `means`.
        """
        return np.array(self.columns[f"{fitness}_sd"], dtype=np.float64) / np.sqrt(self.repeats)

    def group(self, fitness: str, belongs: Callable[[Case], bool]) -> Measurement:
        """The mean over some conditions; its error is that of their runs.

        Args:
            fitness: As for `means`.
            belongs: Which conditions.
        """
        which = np.array([belongs(case) for case in self.cases])
        error = float(np.sqrt((self.errors(fitness)[which] ** 2).sum()) / which.sum())
        return about(float(self.means(fitness)[which].mean()), error, int(self.repeats[which].sum()))

    def rank(self, fitness: str, case: Case) -> int:
        """Rank of a condition; 1 is the best.

        Args:
            fitness: As for `means`.
            case: The condition.
        """
        means = self.means(fitness)
        return 1 + int((means > means[self._index[str(case)]]).sum())

    def measured_rank(self, fitness: str, case: Case) -> Measurement:
        """Rank of a condition, and the ranks that it may have: who is better or worse by more than chance stays so.

        Args:
            fitness: As for `means`.
            case: The condition.
        """
        means, errors, at = self.means(fitness), self.errors(fitness), self._index[str(case)]
        distance = (means - means[at]) / np.maximum(np.hypot(errors, errors[at]), 1e-12)
        low, high = 1 + int((distance > Z95).sum()), len(means) - int((distance < -Z95).sum())
        rank = self.rank(fitness, case)
        text = f"{rank} of {len(means)} ({low} to {high})"
        return Measurement(float(rank), float(low), float(high), int(self.repeats[at]), text)

    @cached_property
    def _index(self) -> dict[str, int]:
        return {str(case): index for index, case in enumerate(self.cases)}


class StoredResults:
    """All stored results of a folder.

    Args:
        folder: The folder.
        commands: By name of the result, the command that makes it; None: those of the experiments of chapters 6 to 9.
    """

    def __init__(self, folder: Path, commands: Mapping[str, str] | None = None) -> None:
        self._folder = folder
        self._commands = _COMMANDS if commands is None else commands
        self._anew = f"{ANEW} {{}}".format if commands is None else commands.__getitem__
        self._read: dict[str, dict[str, Any]] = {}

    def path(self, name: str) -> Path:
        """File of an experiment's result.

        Args:
            name: Name of the experiment.
        """
        return self._folder / f"{name}.json"

    def has(self, name: str) -> bool:
        """An experiment has been made, by the command that it has now.

        Args:
            name: Name of the experiment.

        Raises:
            ResultError: What is stored can't be read.
        """
        return self.path(name).is_file() and self._document(name)["command"] == self._commands[name]

    def document(self, name: str) -> dict[str, Any]:
        """What is stored of an experiment.

        Args:
            name: Name of the experiment.

        Raises:
            ResultMissingError: It has not been made.
            ResultError: What is stored can't be read.
        """
        if not self.has(name):
            raise ResultMissingError(f"{name} has not been made: {self._anew(name)}")
        return self._document(name)

    def runs(self, name: str) -> StoredRuns:
        """Runs of one condition, or searches.

        Args:
            name: Name of the experiment.

        Raises:
            ResultMissingError: It has not been made.
            ResultError: What is stored can't be read.
        """
        data = self.document(name)["result"]
        return StoredRuns(data["columns"], data)

    def table(self, name: str = "exhaustive") -> ConditionTable:
        """The table of all conditions.

        Args:
            name: Name of the experiment.

        Raises:
            ResultMissingError: It has not been made.
            ResultError: What is stored can't be read.
        """
        columns = self.document(name)["result"]["columns"]
        cases = tuple(Case.parse(case) for case in columns["case"])
        return ConditionTable(cases, np.array(columns["n"], dtype=np.int64), columns)

    def _document(self, name: str) -> dict[str, Any]:
        if name not in self._read:
            document = DOOR.document(self.path(name))
            data = document.data
            known = isinstance(data, dict) and data.get("version") == VERSION and {"command", "versions", "result"} <= set(data)
            columns = data["result"].get("columns") if known and isinstance(data["result"], dict) else None
            if not isinstance(columns, dict) or len({len(column) for column in columns.values()}) != 1:
                raise document.wrong("", f"this is no stored result of this version: make it again by {self._anew(name)}")
            self._read[name] = data
        return self._read[name]


def save(results: Path, experiment: Experiment, versions: dict[str, str], result: dict[str, Any]) -> None:
    """Store a result.

    Args:
        results: The folder.
        experiment: What was made.
        versions: By which versions.
        result: What is kept of it.

    Raises:
        OSError: It can't be written.
    """
    store(results / f"{experiment.name}.json", experiment.command, versions, result)


def store(path: Path, command: str, versions: dict[str, str], result: dict[str, Any]) -> None:
    """Write a stored result.

    Args:
        path: The file.
        command: What makes it.
        versions: By which versions.
        result: What is kept of it.

    Raises:
        OSError: It can't be written.
    """
    document = {"version": VERSION, "command": command, "versions": versions, "result": result}
    replace_file(path, (stored_text(document) + "\n").encode())


def stored_text(value: Any, depth: int = 0) -> str:  # noqa: ANN401 - plain values
    """JSON with a line for each list, so that differences of two versions are seen by column.

    Args:
        value: Plain values.
        depth: How deep it stands.
    """
    if not isinstance(value, dict) or depth > 3:
        return json.dumps(value, allow_nan=False)
    margin = "  " * depth
    rows = [f"{margin}  {json.dumps(key)}: {stored_text(item, depth + 1)}" for key, item in value.items()]
    return "{\n" + ",\n".join(rows) + f"\n{margin}}}"
