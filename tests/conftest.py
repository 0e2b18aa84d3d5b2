"""Options of the test suite; `--hil-link` comes with the package's own pytest plugin."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import simdevice.board  # noqa: F401 - refuses a firmware that was built from other sources than are tested

if TYPE_CHECKING:
    from collections.abc import Sequence


def pytest_collection_modifyitems(config: pytest.Config, items: Sequence[pytest.Item]) -> None:
    if config.getoption("--hil-link"):
        return
    skip = pytest.mark.skip(reason="needs a robot: --hil-link URL")
    for item in items:
        if "hardware" in item.keywords:
            item.add_marker(skip)


@pytest.fixture
def hil_link(request: pytest.FixtureRequest) -> str:
    """Address of the robot under test."""
    return str(request.config.getoption("--hil-link"))
