"""Writes the page of a log."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from hil import runs
from hil.files.outputs import check_output, write_output
from hil.look.pages import page_of
from hil.look.reading import read_scene
from hil.mcaplog.errors import LogError
from hil.mcaplog.limits import ReadLimits

if TYPE_CHECKING:
    from pathlib import Path

    from hil.look.scene import Scene

SIGNATURE: Final = b'<meta name="generator" content="hil view">'
"""Stands near the beginning of every page of ours."""
_HEAD: Final = 400


def default_path(log: Path) -> Path:
    """Where the page of a log goes if nothing is said: into the run's folder, or beside the log.

    Args:
        log: The log.
    """
    within = log.name == runs.LOG and (log.parent / runs.RECORD).exists()
    return log.with_name(runs.VIEW if within else f"{log.stem}-{runs.VIEW}")


def write_view(
    log: Path,
    out: Path | None = None,
    *,
    limits: ReadLimits = ReadLimits(),  # noqa: B008 - frozen
    overwrite: bool = False,
    robot: int | None = None,
) -> tuple[Path, Scene]:
    """Write the page of a log.

    Where no place is named, a page that was made there before is made anew; any other file is left alone.

    Args:
        log: The log, whole or cut off.
        out: Where to; None: `default_path`.
        limits: What the log may unpack to.
        overwrite: A file that exists is replaced.
        robot: System id of the sumo robot to show, of several; None: the one that was taken first.

    Returns:
        Where it is, and what it shows.

    Raises:
        LogError: The log cannot be read, has nothing that can be shown, or the page cannot be written.
        OutputError: There is a file already that may not be replaced, or no folder for it.
    """
    path = out or default_path(log)
    replaces = overwrite or (out is None and is_view(path))
    check_output(path, overwrite=replaces)
    scene = read_scene(log, limits, robot)
    try:
        write_output(path, page_of(scene), overwrite=replaces)
    except OSError as error:
        raise LogError(f"cannot write the page {path}: {error.strerror}") from error
    return path, scene


def is_view(path: Path) -> bool:
    """Whether a file is a page that this program has made.

    Args:
        path: The file; there may be none.
    """
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return SIGNATURE in file.read(_HEAD)
