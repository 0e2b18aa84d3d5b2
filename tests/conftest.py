"""Options of the test suite, and the one place that looks for optional tools; `--hil-link` comes with the package's own plugin.

What the README asks for is there: Python with the packages of the extra `dev`, and a C compiler. A test that needs more than
that bears a marker that says so. Whether this machine has it is decided here, once; where it has not, the test is skipped,
and the reason names what is missing and how to get it.
"""

from __future__ import annotations

import os
import shutil
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

import simdevice.boards  # noqa: F401 - refuses a firmware that was built from other sources than are tested
from simdevice.avr import build as avr_build

if TYPE_CHECKING:
    from collections.abc import Callable

BROWSERS: Final = ("chromium", "chromium-browser", "google-chrome")
ARDUINO: Final = {"arduino-builder": "arduino-builder", "arduino-ctags": "arduino-ctags", "avr-g++": "gcc-avr"}
"""Debian's packages by the command that shows whether they are there."""
ARDUINO_CORE: Final = Path("/usr/share/arduino/hardware/arduino/avr")


def install(packages: list[str]) -> str:
    """What is missing, and what to type; empty where nothing is.

    Args:
        packages: Names of Debian's packages; `pymavlink` is one of pip's.
    """
    debian = " ".join(package for package in packages if package != "pymavlink")
    steps = [f"sudo apt install {debian}"] if debian else []
    steps += ["pip install pymavlink"] if "pymavlink" in packages else []
    return f"{', '.join(packages)} (on Debian or Ubuntu: {'; '.join(steps)})" if packages else ""


def avr() -> str:
    """A compiler and an emulator for the ATmega328P, and make."""
    return install(avr_build.missing())


def arduino() -> str:
    """Arduino's own builder, with its core for the AVR."""
    packages = sorted({package for tool, package in ARDUINO.items() if shutil.which(tool) is None})
    return install(packages + ([] if ARDUINO_CORE.is_dir() else ["arduino-core-avr"]))


def node() -> str:
    """Node.js."""
    return install([] if shutil.which("node") else ["nodejs"])


def browser() -> str:
    """A web browser that can be driven by its debugging pipe."""
    return install([] if any(map(shutil.which, BROWSERS)) else ["chromium"])


def clients() -> str:
    """Other people's programs: no package has them."""
    return "" if os.environ.get("HIL_CLIENTS") else "other people's programs (run .ci/clients, which installs them)"


OPTIONAL: Final[dict[str, Callable[[], str]]] = {
    "avr": avr,
    "arduino": arduino,
    "node": node,
    "browser": browser,
    "clients": clients,
}
"""By marker: what of it this machine lacks, and how to get it; empty for nothing."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--require-tools", action="store_true", help="where an optional tool is missing, fail and skip nothing")


def pytest_configure() -> None:
    """Let an interrupt reach the programs that tests start: a shell's job in the background begins with it ignored."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(trylast=True)  # what is left out anyway needs nothing
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if "nightly" not in (config.getoption("-m") or ""):
        left = [item for item in items if item.get_closest_marker("nightly")]
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if not item.get_closest_marker("nightly")]
    for marker, missing in OPTIONAL.items():
        marked = [item for item in items if item.get_closest_marker(marker)]
        if marked and (lacking := missing()):
            if config.getoption("--require-tools"):
                raise pytest.UsageError(f"{len(marked)} tests marked {marker} need {lacking}")
            for item in marked:
                item.add_marker(pytest.mark.skip(reason=f"{marker}: needs {lacking}"))
    if not config.getoption("--hil-link"):
        for item in items:
            if item.get_closest_marker("hardware"):
                item.add_marker(pytest.mark.skip(reason="needs a robot: --hil-link URL"))


@pytest.fixture
def hil_link(request: pytest.FixtureRequest) -> str:
    """Address of the robot under test."""
    return str(request.config.getoption("--hil-link"))
