"""What was learnt, as a file for people to read and to go on from: TOML under a few words of what it is, or JSON."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import tomli_w

from hil.files.outputs import write_output

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from firmware_protocol.errors import HilError


def document_text(data: Mapping[str, Any], header: str, *, as_json: bool) -> str:
    """A document as a file holds it.

    Args:
        data: What it holds.
        header: What TOML begins with, as comments.
        as_json: JSON; else TOML.
    """
    return json.dumps(data, indent=2) + "\n" if as_json else header + tomli_w.dumps(data)


def save_document(data: Mapping[str, Any], header: str, path: Path, failure: type[HilError], *, overwrite: bool) -> None:
    """Write a document, whole or not at all.

    Args:
        data: What it holds.
        header: What TOML begins with, as comments.
        path: Where to; `.json` writes JSON, anything else TOML.
        failure: Raised, with words, where it can't be written.
        overwrite: One that exists is replaced.

    Raises:
        OutputExistsError: There is one, and it may not be replaced.
    """
    try:
        write_output(path, document_text(data, header, as_json=path.suffix == ".json").encode(), overwrite=overwrite)
    except OSError as error:
        raise failure(f"cannot write {path}: {error.strerror}") from error
