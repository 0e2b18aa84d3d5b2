"""Files that a person names to be written: nobody's file is replaced unasked, and none is left half written.

A file that exists is refused, unless it may be replaced: then the new content is written beside it and takes its place when
it is whole. What grows for as long as a run lasts does so under a name that shows (`NAME.unfinished.EXT`), so that it is not
lost with the run; what is written at once, under a hidden one. What is no regular file (`/dev/null`, a pipe) is written as
it is.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
from typing import TYPE_CHECKING, BinaryIO, Final, Self

from firmware_protocol.errors import HilError
from hil.processes import is_running

if TYPE_CHECKING:
    from pathlib import Path

_PART: Final = re.compile(r"\.(?P<name>.+)\.(?P<pid>\d+)\.part")


class OutputError(HilError):
    """A file can't be written where it was asked for; the text says which, why, and what to do."""


class OutputExistsError(OutputError):
    """There is a file already."""


def check_output(path: Path, *, overwrite: bool = False) -> None:
    """See that a file can be written, before anything is begun; nothing is made.

    Args:
        path: Where to.
        overwrite: One that exists may be replaced.

    Raises:
        OutputExistsError: There is one, and it may not be replaced.
        OutputError: The folder that it would be in can't be made or written to.
    """
    if path.is_dir():
        raise OutputExistsError(f"{path} is a folder, not a file")
    if is_special(path):
        return
    if os.path.lexists(path) and not overwrite:
        raise OutputExistsError(f"{path} is there already: choose another name, or give --overwrite to replace it")
    folder = path.resolve().parent
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir():
        raise OutputError(f"cannot write {path}: {folder} is no folder")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"cannot write {path}: the folder {folder} may not be written to")


def check_distinct(*paths: Path | None) -> None:
    """See that no two outputs are the same file.

    Args:
        *paths: Where they go; None for one that is not wanted.

    Raises:
        OutputError: Two are.
    """
    files = [path.resolve() for path in paths if path is not None and not is_special(path)]
    if len(set(files)) < len(files):
        raise OutputError("outputs must be files of their own: two of them are the same")


class Output:
    """A file that is being written.

    Args:
        path: Where to; folders are made as needed.
        overwrite: One that exists is replaced, when this is whole (`finish`).

    Attributes:
        path: Where to.
        file: What to write to; buffered.

    Where a file is to be replaced, what is written is in `NAME.unfinished.EXT` beside it until it is whole, and stays there
    if it never is, even if the program is killed.

    Raises:
        OutputExistsError: There is one, and it may not be replaced.
        OSError: It can't be opened.
    """

    def __init__(self, path: Path, *, overwrite: bool = False) -> None:
        self.path = path
        self._beside: Path | None = None
        if is_special(path):
            self.file: BinaryIO = path.open("wb")
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        if overwrite and path.exists():
            self._target = path.resolve() if path.is_symlink() else path
            self._beside, self.file = _unfinished(self._target)
            return
        try:
            self.file = path.open("xb")
        except FileExistsError as error:
            raise OutputExistsError(
                f"{path} is there already: choose another name, or give --overwrite to replace it"
            ) from error

    def hand_over(self) -> Path | None:
        """Close it here, so that another process goes on with it (`taken_over`).

        Returns:
            The file beside the one that is to be replaced; None where none is.
        """
        self.file.close()
        return self._beside

    @classmethod
    def taken_over(cls, path: Path, beside: Path | None) -> Self:
        """Go on with what another process has begun.

        Args:
            path: Where it goes.
            beside: As `hand_over` gave it.

        Raises:
            OSError: It can't be opened.
        """
        self = cls.__new__(cls)
        self.path = path
        self._beside = beside
        if beside is not None:
            self._target = path.resolve() if path.is_symlink() else path
        self.file = (beside or path).open("r+b")
        return self

    def sync(self) -> None:
        """See that what was written is on the disk; nothing is done where it is no regular file.

        Raises:
            OSError: The disk does not take it.
        """
        self.file.flush()
        if not is_special(self.path):
            os.fsync(self.file.fileno())

    def finish(self) -> None:
        """It is whole: close it, and put it in its place.

        Raises:
            OSError: The disk does not take the rest.
        """
        self.sync()
        self.file.close()
        if self._beside is not None:
            self._beside.replace(self._target)

    def leave(self) -> Path | None:
        """It will not become whole: what there is of it stays, and a file that was to be replaced is as it was.

        Returns:
            The file that holds what there is of it; None where there is nothing of it, or it is no regular file.
        """
        with contextlib.suppress(OSError):
            self.file.close()
        if is_special(self.path):
            return None
        kept = self._beside or self.path
        with contextlib.suppress(OSError):
            if kept.stat().st_size:
                return kept
            kept.unlink()
        return None

    def discard(self) -> None:
        """It is not wanted after all: what there is of it goes. What was there before, or is no regular file, stays."""
        kept = self.leave()
        if kept is not None:
            with contextlib.suppress(OSError):
                kept.unlink()


def write_output(path: Path, data: bytes, *, overwrite: bool = False) -> None:
    """Write a file, whole or not at all.

    Args:
        path: Where to.
        data: What to write.
        overwrite: One that exists is replaced.

    Raises:
        OutputExistsError: There is one, and it may not be replaced.
        OSError: It can't be written; what was there is as it was.
    """
    if overwrite or is_special(path):
        replace_file(path, data)
        return
    output = Output(path)
    try:
        output.file.write(data)
        output.finish()
    except BaseException:
        output.discard()
        raise


def free_folder(folder: Path) -> Path:
    """The folder, or the first of its name with a number behind it, that is not there yet.

    Args:
        folder: Wanted.
    """
    free, number = folder, 2
    while os.path.lexists(free):
        free, number = folder.with_name(f"{folder.name}-{number}"), number + 1
    return free


def replace_file(path: Path, data: bytes) -> None:
    """Write a file by way of a temporary one beside it, so that a crash leaves the old file or the new one.

    For state that is meant to be kept up to date. A link's target is written, and the link kept. What a killed program has
    left of an earlier try goes.

    Args:
        path: Where to; folders are made as needed.
        data: What to write.

    Raises:
        OSError: It can't be written; the old file is as it was.
    """
    if is_special(path):
        path.write_bytes(data)
        return
    path = path.resolve()
    path.parent.mkdir(parents=True, exist_ok=True)
    _sweep(path)
    temporary = _part(path)
    try:
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise


def overwrite_file(path: Path, data: bytes) -> None:
    """Write a text over the one in a file that exists, where the disk has no room for a second file.

    The room is taken first, as blanks at the file's end: what does not fit leaves the old text. A crash while it is written may
    leave neither.

    Args:
        path: The file.
        data: A text that may end in blanks.

    Raises:
        OSError: It does not fit.
    """
    with path.open("r+b", buffering=0) as file:
        size = file.seek(0, os.SEEK_END)
        missing = len(data) - size
        try:
            while missing > 0:
                missing -= file.write(b" " * missing)
            os.fsync(file.fileno())
        except OSError:
            with contextlib.suppress(OSError):
                file.truncate(size)
            raise
        file.seek(0)
        written = file.write(data)
        if written < len(data):
            raise OSError(errno.EIO, os.strerror(errno.EIO), str(path))
        file.truncate(len(data))
        os.fsync(file.fileno())


def is_special(path: Path) -> bool:
    """A path exists and is no regular file, but a pipe or a device.

    Args:
        path: The path.
    """
    return path.exists() and not path.is_file()


def _part(path: Path) -> Path:
    return path.with_name(f".{path.name}.{os.getpid()}.part")


def _unfinished(path: Path) -> tuple[Path, BinaryIO]:
    """A new file beside this one, for what is to replace it; what others have left unfinished stays."""
    number = 1
    while True:
        mark = "unfinished" if number == 1 else f"unfinished-{number}"
        beside = path.with_name(f"{path.stem}.{mark}{path.suffix}")
        try:
            return beside, beside.open("xb")
        except FileExistsError:
            number += 1


def _sweep(path: Path) -> None:
    """Remove what programs that were killed have left of this file."""
    with contextlib.suppress(OSError):
        for other in path.parent.iterdir():
            found = _PART.fullmatch(other.name)
            if found is not None and found["name"] == path.name and not is_running(int(found["pid"])):
                other.unlink(missing_ok=True)
