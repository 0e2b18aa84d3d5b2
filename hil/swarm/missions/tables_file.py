"""Tables files: what RANGERs and WILDs have learnt, for people to read, and to go on from (`tables.toml`, or `.json`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import HilError
from hil.doors import Document, Door
from hil.files.documents import document_text, save_document
from pal_advisor.surround import ConditionalError, Tables, TablesError, read_conditional

if TYPE_CHECKING:
    from pathlib import Path

    from firmware_protocol.vocabulary import RobotClass

HEADER = """\
# What RANGERs and WILDs have learnt: for every stimulus how much each behaviour, B1 first, is worth to them.
# "pattern" is the stimulus: in which sectors there are robots of the other class. What is left out has not been learnt.
"""


class TablesFileError(HilError):
    """A file of tables can't be read or written, or a field of it is wrong; the text names the file, the line and the field."""


DOOR: Final = Door("tables file", TablesFileError, largest=8 << 20)
"""An entry takes 250 bytes; rings of 16 sectors have 4,116 stimuli."""
CONDITIONAL_DOOR: Final = Door("table of conditional motion", TablesFileError, largest=1 << 20)


def tables_text(tables: Tables, *, as_json: bool = False) -> str:
    """Tables as a file holds them.

    Args:
        tables: What was learnt.
        as_json: JSON; else TOML.
    """
    return document_text(tables.to_dict(), HEADER, as_json=as_json)


def save_tables(tables: Tables, path: Path, *, overwrite: bool = False) -> None:
    """Write a tables file, whole or not at all.

    Args:
        tables: What was learnt.
        path: Where to; `.json` writes JSON, anything else TOML.
        overwrite: One that exists is replaced.

    Raises:
        OutputExistsError: There is one, and it may not be replaced.
        TablesFileError: It can't be written.
    """
    save_document(tables.to_dict(), HEADER, path, TablesFileError, overwrite=overwrite)


def tables_of(data: bytes, name: str = "the tables", *, as_json: bool = False) -> Tables:
    """The tables that a file, or a log, holds.

    Args:
        data: What it holds.
        name: What it is called in errors.
        as_json: It is JSON.

    Raises:
        TablesFileError: They are none.
    """
    return _tables(DOOR.document_of(data, name, json=as_json))


def load_tables(path: Path) -> Tables:
    """Read and validate a tables file.

    Args:
        path: The file.

    Raises:
        TablesFileError: It can't be read, is no TOML or JSON, or a field is missing, unknown or wrong.
    """
    return _tables(DOOR.document(path))


def _tables(document: Document) -> Tables:
    try:
        return Tables.from_dict(document.data)
    except TablesError as error:
        raise document.wrong(error.path, str(error)) from error


def load_conditional(path: Path, sectors: int) -> dict[RobotClass, dict[int, int]]:
    """Read a table of conditional motion.

    Args:
        path: The file.
        sectors: How many sectors the rings have.

    Returns:
        Behaviours by class and number of the stimulus.

    Raises:
        TablesFileError: It can't be read, is no TOML or JSON, or a field is unknown or wrong.
    """
    document = CONDITIONAL_DOOR.document(path)
    try:
        return read_conditional(document.data, sectors)
    except ConditionalError as error:
        raise document.wrong(error.path, str(error)) from error
