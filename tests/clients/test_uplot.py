"""The curves' code in this tree is the published release's, byte for byte."""

from __future__ import annotations

import json
import tomllib
from importlib.resources import files
from typing import TYPE_CHECKING, Final

import pytest

import hil.look

if TYPE_CHECKING:
    from pathlib import Path

pytest_plugins = ["client_fixtures"]
pytestmark = pytest.mark.clients

PUBLISHED: Final = {
    "uPlot.iife.min.js": "dist/uPlot.iife.min.js",
    "uPlot.min.css": "dist/uPlot.min.css",
    "uPlot.LICENSE": "LICENSE",
}


def test_it_is_what_was_published(clients: Path) -> None:
    vendor = files(hil.look).joinpath("vendor")
    told = tomllib.loads(vendor.joinpath("uPlot.toml").read_text("utf-8"))
    package = clients / "node_modules" / "uplot"
    about = json.loads((package / "package.json").read_text("utf-8"))
    assert (about["version"], about["license"]) == (told["version"], told["license"])
    assert set(told["sha256"]) == set(PUBLISHED)
    for ours, theirs in PUBLISHED.items():
        assert vendor.joinpath(ours).read_bytes() == (package / theirs).read_bytes(), ours
