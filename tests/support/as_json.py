"""What a command says as JSON, for fixtures of a module too, in which nothing is captured."""

from __future__ import annotations

import contextlib
import io
import json
from typing import Any

from hil.cli.app import run


def as_json(*words: str, status: int = 0) -> dict[str, Any]:
    """What `hil` prints when it is run in this process, with these words and --json.

    Args:
        words: Command line, without `hil`, --json and --quiet.
        status: Exit code that it has to end with.
    """
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        assert run([*words, "--json", "--quiet"]) == status
    document: dict[str, Any] = json.loads(said.getvalue())
    return document
