"""A pytest plugin: lets the tests use another build of the host extension, which the environment names.

It is loaded before any test imports the firmware: `-p core_plugin`.
"""

from __future__ import annotations

import importlib.util
import os
import sys

NAME = "simdevice._host"


def load(path: str) -> None:
    """Put the extension at this path in place of the installed one."""
    assert NAME not in sys.modules, "the installed extension is already in use"
    spec = importlib.util.spec_from_file_location(NAME, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.modules[NAME] = module


if selected := os.environ.get("HIL_TEST_EXTENSION"):
    load(selected)
