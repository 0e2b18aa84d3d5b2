"""Where runs of the surround task leave what: tables, checkpoint, report; and what is told of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hil.bridge.clock import MonotonicClock
from hil.cli.run_files import RunFiles
from hil.jobs.swarm.surround import tables_name
from hil.swarm.missions.surround_words import surround_document, surround_summary
from hil.swarm.missions.tables_file import TablesFileError, save_tables

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from rich.console import Console

    from hil.cli.running import ActiveRun
    from hil.swarm.missions.surround_checkpoint import SurroundCheckpoint
    from hil.swarm.missions.surround_outcome import SurroundOutcome
    from hil.swarm.missions.surround_settings import SurroundSettings
    from pal_advisor.surround import Tables


class SurroundFiles(RunFiles):
    """Where runs of the surround task leave what.

    Args:
        run: The run.
        tables: File of what is learnt, instead of the one in the run's folder.
        checkpoint: Checkpoint, likewise.
        seeds: How many seeds there are.
        console: Where to say so.
        report: A report is wanted.
    """

    def __init__(
        self, run: ActiveRun, tables: Path | None, checkpoint: Path | None, seeds: int, console: Console, *, report: bool
    ) -> None:
        super().__init__(run, checkpoint, console, report=report)
        self._named = tables
        self._seeds = seeds
        self._written: set[Path] = set()
        self._clock = MonotonicClock()
        self._since = self._clock.now()
        self._wall: dict[int, float] = {}

    def _tables(self, seed: int) -> Path:
        return self._run.place(self._named, tables_name(seed, self._seeds))

    def save_tables(self, seed: int, tables: Tables) -> None:
        """Write what was learnt; where that fails, say so once."""
        path = self._tables(seed)
        mine = path in self._written  # what this run has written before it may write anew
        try:
            save_tables(tables, path, overwrite=self._run.overwrite or mine)
            self._written.add(path)
            self._unsaved.discard(path)
        except TablesFileError as error:
            self._failed(path, str(error))

    def ended(self, outcome: SurroundOutcome) -> None:
        """The run of a seed has ended."""
        now = self._clock.now()
        self._wall[outcome.seed] = now - self._since
        self._since = now

    def tell_how_to_resume(self, reached: SurroundCheckpoint, links: Sequence[str], key: Path | None) -> None:
        """Say where the work is, and how to go on."""
        self.tell_where(f"What was learnt in {reached.steps} steps is", ["hil", "swarm", "surround", *links], key)

    def document(self, outcomes: list[SurroundOutcome], settings: SurroundSettings) -> dict[str, Any]:
        """What came of it, with the files that it has left."""
        document = surround_document(outcomes, settings.order.value)
        for facts, outcome in zip(document.get("runs", [document]), outcomes, strict=True):
            facts["wall_seconds"] = round(self._wall.get(outcome.seed, 0.0), 3)
            path = self._tables(outcome.seed)
            facts["table"] = str(path) if path.is_file() and path not in self._unsaved else None
        return {**document, "run": self._run.folder, "log": self._run.log_file, "report": None}

    def kept(self, document: dict[str, Any]) -> dict[str, Any]:
        """What the run's record keeps of it, with a word for a list of runs: not what is measured step by step."""
        shares = [facts["share_surrounded"][-1] for facts in document.get("runs", [document])]
        known = [share for share in shares if share is not None]
        of = f"{len(shares)} seeds, " if len(shares) > 1 else ""
        summary = f"{of}{sum(known) / len(known):.0%} surrounded" if known else ""
        return {**{key: value for key, value in document.items() if not isinstance(value, list | dict)}, "summary": summary}

    def tell(self, outcomes: list[SurroundOutcome], document: dict[str, Any]) -> None:
        """Say what came of it, and where the files are."""
        seconds = sum(outcome.history.seconds for outcome in outcomes)
        steps = sum(outcome.history.steps for outcome in outcomes)
        self._console.print("")
        self._console.print(
            f"{steps} steps, {seconds / 60:.1f} robot minutes, in {sum(self._wall.values()):.1f} s.", markup=False
        )
        for line in surround_summary(outcomes):
            self._console.print(line, markup=False)
        tables = [str(facts["table"]) for facts in document.get("runs", [document]) if facts["table"]]
        named = {"Tables": tables[0] if len(tables) == 1 else f"{len(tables)} files, {tables[0]} the first" if tables else ""}
        for kind, path in {**named, "Log": document["log"]}.items():
            if path:
                self._console.print(f"{kind + ':':12}{path}", markup=False)
