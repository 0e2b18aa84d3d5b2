"""Documents that people write."""

from __future__ import annotations

import json
import tomllib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def read_document(path: Path, failed: Callable[[str], Exception], *, kind: str, named: str = "") -> tuple[str, Any]:
    """Read a file of TOML, or of JSON where its name ends so.

    Args:
        path: The file.
        failed: Makes the error of what is wrong with it.
        kind: What it should have been, for one that is nested too deeply.
        named: What it is called when it can't be read, before its path.

    Returns:
        Its text, in which a wrong field can be found, and what it says.

    Raises:
        Exception: What `failed` made: it can't be read, or is no text, no TOML or JSON.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise failed(f"cannot read {named}{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise failed(f"{path} is no text file: {error}") from error
    try:
        return text, json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except (json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
        raise failed(f"{path}: {error}") from error
    except RecursionError as error:
        raise failed(f"{path} is no {kind}: it is nested too deeply") from error
