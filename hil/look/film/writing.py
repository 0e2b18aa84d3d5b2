"""Writes the animation of a log."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.files.outputs import check_output, write_output
from hil.look.film.course import film_of, pick
from hil.look.reading import read_scene
from hil.mcaplog.errors import LogError
from hil.mcaplog.limits import ReadLimits

if TYPE_CHECKING:
    from pathlib import Path

    from hil.look.film.course import Film
    from hil.look.scene import Scene


def write_film(
    log: Path,
    out: Path,
    *,
    which: str = "",
    limits: ReadLimits = ReadLimits(),  # noqa: B008 - frozen
    overwrite: bool = False,
    robot: int | None = None,
) -> tuple[Film, Scene]:
    """Write an animation of a bout, or of a swarm's run, as a GIF.

    Args:
        log: The log, whole or cut off.
        out: Where to.
        which: Bout; see `pick`.
        limits: What the log may unpack to.
        overwrite: A file that exists is replaced.
        robot: System id of the sumo robot to show, of several; None: the one that was taken first.

    Returns:
        What it shows, and all that the log does.

    Raises:
        LogError: The log cannot be read, or the file cannot be written.
        FilmError: There is nothing to show, or no such bout.
        OutputError: There is a file already that may not be replaced, or no folder for it.
    """
    from hil.look.film.drawing import gif_of  # noqa: PLC0415 - Pillow is loaded where something is drawn

    check_output(out, overwrite=overwrite)
    scene = read_scene(log, limits, robot)
    film = film_of(scene, pick(scene, which))
    try:
        write_output(out, gif_of(film), overwrite=overwrite)
    except OSError as error:
        raise LogError(f"cannot write {out}: {error.strerror}") from error
    return film, scene
