"""A door: how one kind of file comes in.

    read -> not too large -> text -> TOML or JSON -> nothing monstrous in it -> (the caller) valid -> an object

Whatever is wrong on the way is the door's own error, with the file, the line or the field, and what was expected.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from hil.doors.parsing import DocumentError, decode, parse_json, parse_toml
from hil.files.field_lines import line_of

if TYPE_CHECKING:
    from collections.abc import Callable

LONGEST: Final = 400
"""Letters that are said of what is wrong."""


@dataclass(frozen=True)
class Door:
    """How one kind of file comes in.

    Attributes:
        kind: What such a file is called, as `advice file`.
        error: Makes the door's error from its text.
        largest: No such file is larger, in bytes.
        missing: Said where there is no such file, with `{path}`; empty where there is nothing to add to "no such file".
        infinite: Numbers in it may be infinite.
    """

    kind: str
    error: Callable[[str], Exception]
    largest: int
    missing: str = ""
    infinite: bool = False

    def read(self, path: Path, *, allowed: Callable[[os.stat_result], str] | None = None) -> bytes:
        """What a file holds.

        Args:
            path: The file; what is no regular file (a pipe, a device) is read up to the size that is allowed.
            allowed: Says what is wrong with the file's status; empty where nothing is.

        Raises:
            Exception: The door's: it can't be read, or is too large.
        """
        try:
            with path.open("rb") as file:
                wrong = allowed(os.fstat(file.fileno())) if allowed else ""
                data = b"" if wrong else file.read(self.largest + 1)
        except FileNotFoundError as error:
            told = self.missing.format(path=path) if self.missing else f"cannot read the {self.kind} {path}: {error.strerror}"
            raise self.error(told) from error
        except OSError as error:
            raise self.error(f"cannot read the {self.kind} {path}: {error.strerror}") from error
        except ValueError as error:  # a zero byte in its name
            raise self.error(f"cannot read the {self.kind} {str(path)!r}: no file has this name") from error
        if wrong:
            raise self.error(wrong)
        if len(data) > self.largest:
            raise self.error(f"{path} is no {self.kind}: it is larger than {self.largest:,} bytes")
        return data

    def text(self, path: Path, *, allowed: Callable[[os.stat_result], str] | None = None) -> str:
        """The text that a file holds.

        Args:
            path: The file.
            allowed: As in `read`.

        Raises:
            Exception: The door's: it can't be read, is too large, or is no text in UTF-8.
        """
        data = self.read(path, allowed=allowed)
        try:
            return decode(data)
        except DocumentError as error:
            raise self.wrong(path, error.line, str(error)) from None

    def document(self, path: Path, *, json: bool | None = None) -> Document:
        """What a file of TOML or JSON says.

        Args:
            path: The file.
            json: It is JSON; None: where its name ends so.

        Raises:
            Exception: The door's: it can't be read, is too large, no text, no TOML or JSON, or holds what no file of ours does.
        """
        return self._parsed(path, self.text(path), json=path.suffix == ".json" if json is None else json)

    def document_of(self, data: bytes, name: str, *, json: bool = False) -> Document:
        """What TOML or JSON says that is held in memory.

        Args:
            data: As a file would hold it.
            name: What it is called in errors.
            json: It is JSON.

        Raises:
            Exception: The door's, as by `document`.
        """
        path = Path(name)
        if len(data) > self.largest:
            raise self.error(f"{name} is no {self.kind}: it is larger than {self.largest:,} bytes")
        try:
            text = decode(data)
        except DocumentError as error:
            raise self.wrong(path, error.line, str(error)) from None
        return self._parsed(path, text, json=json)

    def _parsed(self, path: Path, text: str, *, json: bool) -> Document:
        parse = parse_json if json else parse_toml
        try:
            return Document(self, path, text, parse(text, infinite=self.infinite))
        except DocumentError as error:
            line = error.line or (line_of(text, error.path) if error.path else 0)
            raise self.wrong(path, line, f"{error.path}: {error}" if error.path else str(error)) from None

    def wrong(self, path: Path, line: int, what: str) -> Exception:
        """The door's error of a place in a file.

        Args:
            path: The file.
            line: Where, from 1; 0 where that can't be told.
            what: What is wrong there; of a long text the beginning is said.
        """
        what = what if len(what) <= LONGEST else what[: LONGEST - 1] + "…"
        return self.error(f"{path}{f', line {line}' if line else ''}: {what}")


@dataclass(frozen=True)
class Document:
    """What a file says, in plain values.

    Attributes:
        door: The door it came in by.
        path: The file.
        text: Its text, in which a wrong field can be found.
        data: What it says.
    """

    door: Door
    path: Path
    text: str
    data: Any

    def wrong(self, field: str, what: str) -> Exception:
        """The door's error of a field.

        Args:
            field: Which, as `entries[3].actions[1]`; empty for the whole.
            what: What is wrong with it, its name included.
        """
        return self.door.wrong(self.path, line_of(self.text, field) if field else 0, what)


def checkpoint_door(error: Callable[[str], Exception], *, largest: int) -> Door:
    """How checkpoints of one kind of run come in.

    Args:
        error: Makes the door's error from its text.
        largest: No such file is larger, in bytes.
    """
    return Door("checkpoint", error, largest, "there is no checkpoint {path} to resume from: run without --resume first")
