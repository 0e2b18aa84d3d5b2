"""Which coachings can be gone on with: those that did not finish, and that no other has gone on from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.runs import DONE, FELL_SHORT, RUNNING, TEAM_FILES
from hil.sumo.coaching import CheckpointError, load_checkpoint

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.runs import Run
    from hil.sumo.coaching import Checkpoint


def saved_by(run: Run) -> Checkpoint | None:
    """What a run has saved, where that can be read and gone on with; None otherwise.

    Args:
        run: The run.
    """
    saved = _checkpoint(run)
    return None if saved is None or saved.pal.finished else saved


def can_go_on(run: Run) -> bool:
    """A run, or several coachings together, has saved something that can be gone on with.

    Args:
        run: The run; it is not going on.
    """
    if run.team is not None:
        return run.state not in {DONE, FELL_SHORT}
    return saved_by(run) is not None


def successor(run: Run, found: Sequence[Run]) -> Run | None:
    """The run that goes on from another, or has gone on from it and saved something; one that got nowhere is none.

    Args:
        run: The run that was cut.
        found: All runs, the newest first.
    """
    source = (run.team or run.saved_to).resolve()
    for later in found:
        if later.folder == run.folder:
            return None
        goes_on = later.source is not None and later.source.resolve() == source
        if goes_on and (later.state == RUNNING or _has_saved(later)):
            return later
    return None


def _has_saved(run: Run) -> bool:
    return any(run.folder.glob(TEAM_FILES[0])) if run.team is not None else _checkpoint(run) is not None


def _checkpoint(run: Run) -> Checkpoint | None:
    try:
        return load_checkpoint(run.saved_to)
    except CheckpointError:
        return None
