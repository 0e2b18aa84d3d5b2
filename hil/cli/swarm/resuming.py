"""The run of a swarm that is to be gone on with, if one is."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

from firmware_protocol.errors import HilError
from hil import runs
from hil.cli import common
from hil.swarm.missions.evolving.checkpoint import DOOR as EVOLUTION_DOOR
from hil.swarm.missions.evolving.checkpoint import EvolutionCheckpoint, load_evolution
from hil.swarm.missions.surround_checkpoint import DOOR, SurroundCheckpoint, load_checkpoint

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import typer

    from hil.doors import Door
    from hil.runs import Run

C = TypeVar("C")


@dataclass(frozen=True)
class CutKind(Generic[C]):
    """A kind of run that can be gone on with.

    Attributes:
        verb: What such runs are called in their records.
        command: The command that begins one.
        door: How its checkpoints come in.
        load: Reads a checkpoint.
        finished: Says whether nothing is left to be done.
    """

    verb: str
    command: str
    door: Door
    load: Callable[[Path], C]
    finished: Callable[[C], bool]


SURROUND: Final[CutKind[SurroundCheckpoint]] = CutKind(
    "surround", "hil swarm surround", DOOR, load_checkpoint, lambda saved: len(saved.finished) >= saved.seeds
)
EVOLVE: Final[CutKind[EvolutionCheckpoint]] = CutKind(
    "evolve", "hil swarm surround --evolve", EVOLUTION_DOOR, load_evolution, lambda saved: saved.finished
)


class CutRun(Generic[C]):
    """The run that is to be gone on with, if one is.

    Args:
        kind: What runs these are.
        context: The command line, which knows what was given and what is a default.
        link: Addresses of the links as a record has them; empty for a table of this process.
        resume: The newest that fits.
        resume_from: This one.
        checkpoint: Where the new run's checkpoint goes: one that is there is gone on from.

    Attributes:
        source: Its checkpoint; None: a run is begun anew.
        content: What that file holds.
        saved: What it says.

    Raises:
        HilError: It can't be read, or is none.
        RunError: There is none.
    """

    def __init__(
        self,
        kind: CutKind[C],
        context: typer.Context,
        *,
        link: str,
        resume: bool,
        resume_from: Path | None,
        checkpoint: Path | None,
    ) -> None:
        self._kind = kind
        self._context = context
        self.source: Path | None = None
        if resume_from is not None:
            self.source = runs.file_of(resume_from, runs.CHECKPOINT)
        elif resume:
            self.source = checkpoint or _newest(kind, link).saved_to
        self.content = None if self.source is None else kind.door.read(self.source)
        self.saved: C | None = None if self.source is None else kind.load(self.source)

    def goes_on_in(self, checkpoint: Path) -> bool:
        """The named checkpoint is the one that is gone on from, and is kept up to date; any other is somebody's file.

        Args:
            checkpoint: Where the new run's checkpoint goes.
        """
        return self.source is not None and self.source.resolve() == checkpoint.resolve()

    def check(self, wanted: Mapping[str, Any], begun: Mapping[str, Any]) -> None:
        """See that nothing is asked of a resumed run that it was not begun with: mixed, it would be neither run.

        Args:
            wanted: What is asked for, by name of the option.
            begun: What it was begun with, likewise.

        Raises:
            UsageError: Something else is asked for.
        """
        for name, value in wanted.items():
            if common.was_given(self._context, name) and value != begun[name]:
                raise common.UsageError(
                    f"the run to be resumed was begun with {name.replace('_', '-')} {begun[name]}, not {value}: leave that "
                    "out, or begin anew without --resume"
                )


def _newest(kind: CutKind[C], link: str) -> Run:
    """The newest run on these links that did not finish, and that no other has gone on from."""
    found = [run for run in runs.all_runs() if run.record.verb == kind.verb and run.record.link == link]
    for run in found:
        if run.state == runs.RUNNING:
            raise runs.RunError(f"the run in {run.folder} goes on already, in process {run.record.pid}")
        if _unfinished(kind, run) and not _gone_on(run, found):
            return run
    where = f"on {link}" if link else "of an emulated table"
    raise runs.RunError(
        f"there is no run of {kind.command} {where} in {runs.RUNS} that did not finish: begin one without --resume, or "
        "name a run's folder or a checkpoint with --resume-from (hil runs lists the runs)"
    )


def _unfinished(kind: CutKind[C], run: Run) -> bool:
    try:
        return not kind.finished(kind.load(run.saved_to))
    except HilError:
        return False


def _gone_on(run: Run, found: Sequence[Run]) -> bool:
    """Another run has gone on from this one, and saved something."""
    source = run.saved_to.resolve()
    for later in found:
        if later.folder == run.folder:
            return False
        if later.source is not None and later.source.resolve() == source and later.saved_to.is_file():
            return True
    return False
