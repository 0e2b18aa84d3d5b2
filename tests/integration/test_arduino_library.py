"""The firmware as an Arduino library: assembled, whole, and compiled with its example by Arduino's own builder."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from firmware_protocol.generate.outputs import ROOT

FIRMWARE = Path(ROOT) / "firmware_protocol" / "firmware"
ARDUINO = Path("/usr/share/arduino/hardware")
FLASH = 30720
"""What a Nano has for a sketch, in bytes."""
VARIABLES = 1500
"""Leaves 548 of its 2048 bytes for the stack."""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The library, made as `make library` does."""
    folder = tmp_path_factory.mktemp("libraries")
    command = [sys.executable, str(FIRMWARE / "library.py"), str(folder)]
    made, archive = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()  # noqa: S603
    assert Path(archive).is_file()
    return Path(made)


def test_it_has_the_layout_that_both_tools_want(library: Path) -> None:
    properties = dict(
        line.split("=", 1) for line in (library / "library.properties").read_text(encoding="utf-8").splitlines() if line
    )
    manifest = json.loads((library / "library.json").read_text(encoding="utf-8"))
    assert properties["name"] == manifest["name"] == library.name
    assert properties["version"] == manifest["version"] == metadata.version("junior-hil")
    assert (library / "src" / properties["includes"]).is_file()
    assert manifest["headers"] == properties["includes"]
    for example in manifest["examples"]:
        assert all((library / example["base"] / name).is_file() for name in example["files"])
    assert (library / "LICENSE").is_file()


def test_everything_that_it_includes_is_in_it(library: Path) -> None:
    source = library / "src"
    for path in (*source.glob("core/*"), *source.glob("junior/*"), source / "JuniorHIL.h"):
        for name in re.findall(r'^#include "([^"]+)"', path.read_text(encoding="utf-8"), re.MULTILINE):
            assert (path.parent / name).is_file() or (source / name).is_file(), f"{path.name} includes {name}"


@pytest.mark.parametrize("part", ["core", "junior"])
def test_it_is_the_core_and_junior_as_they_are(library: Path, part: str) -> None:
    for path in (FIRMWARE / part).iterdir():
        assert (library / "src" / part / path.name).read_bytes() == path.read_bytes()


def test_junior_is_the_only_role_in_it(library: Path) -> None:
    made = (library / "src" / "roles.h").read_text(encoding="utf-8")
    head = "/* The only role in this library. */\n#define ROLE junior\n\n"
    assert made == head + (FIRMWARE / "roles.h").read_text(encoding="utf-8")


@pytest.mark.arduino
@pytest.mark.slow
def test_arduino_builds_the_example_without_a_warning_of_ours(library: Path, tmp_path: Path) -> None:
    command = [
        "arduino-builder", "-compile", "-hardware", str(ARDUINO), "-hardware", "/usr/share/arduino-builder",
        "-tools", "/usr/bin", "-libraries", str(library.parent), "-fqbn", "arduino:avr:nano:cpu=atmega328",
        "-build-path", str(tmp_path), "-warnings", "all", "-prefs=compiler.path=/usr/bin/",
        "-prefs=compiler.cpp.extra_flags=-DDECIMAL_DIG=17",  # Arduino's core wants a newer compiler than Debian's
        str(library / "examples" / "Junior" / "Junior.ino"),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    assert done.returncode == 0, done.stderr
    ours = [line for line in done.stderr.splitlines() if "warning" in line and not line.startswith(str(ARDUINO))]
    assert ours == []
    used = re.search(r"uses (\d+) bytes", done.stdout)
    variables = re.search(r"variables use (\d+) bytes", done.stdout)
    assert used is not None
    assert variables is not None
    assert int(used[1]) < FLASH
    assert int(variables[1]) < VARIABLES
