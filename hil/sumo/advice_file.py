"""Advice files: what was learnt, for people to read and for robots to play by (`*.advice.toml` or `.json`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import HilError
from hil.doors import Document, Door
from hil.files.documents import document_text, save_document
from pal_advisor.maneuvers import Advice, AdviceError

if TYPE_CHECKING:
    from pathlib import Path

HEADER = """\
# Advice for Junior: for every situation the maneuver that Pal found best.
# "current" is what the eyes (and arms) sense now, "previous" what they sensed when the last maneuver began.
"""


class AdviceFileError(HilError):
    """An advice file can't be read, or a field of it is wrong; the text names the file, the line and the field."""


DOOR: Final = Door("advice file", AdviceFileError, largest=1 << 20)
"""An entry takes 300 bytes, and there are 272 situations."""


def advice_text(advice: Advice, *, as_json: bool = False) -> str:
    """An advice as a file holds it.

    Args:
        advice: What was learnt.
        as_json: JSON; else TOML.
    """
    return document_text(advice.to_dict(), HEADER, as_json=as_json)


def save_advice(advice: Advice, path: Path, *, overwrite: bool = False) -> None:
    """Write an advice file, whole or not at all.

    Args:
        advice: What was learnt.
        path: Where to; `.json` writes JSON, anything else TOML.
        overwrite: One that exists is replaced.

    Raises:
        OutputExistsError: There is one, and it may not be replaced.
        AdviceFileError: It can't be written.
    """
    save_document(advice.to_dict(), HEADER, path, AdviceFileError, overwrite=overwrite)


def advice_of(data: bytes) -> Advice:
    """The advice that TOML holds, as a file or a log has it.

    Args:
        data: The TOML.

    Raises:
        AdviceFileError: It is none.
    """
    return _advice(DOOR.document_of(data, "the advice"))


def load_advice(path: Path) -> Advice:
    """Read and validate an advice file.

    Args:
        path: The file.

    Returns:
        The advice.

    Raises:
        AdviceFileError: It can't be read, is no TOML or JSON, or a field is missing, unknown or wrong.
    """
    return _advice(DOOR.document(path))


def _advice(document: Document) -> Advice:
    try:
        return Advice.from_dict(document.data)
    except AdviceError as error:
        raise document.wrong(error.path, str(error)) from error
