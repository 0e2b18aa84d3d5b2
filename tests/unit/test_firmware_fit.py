"""A host build of the firmware that does not fit is refused: another struct, or other sources."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import cffi
import pytest

from firmware_protocol.errors import FirmwareBuildError, HilError
from firmware_protocol.firmware.build_host import DECLARATIONS
from firmware_protocol.firmware.built_from import FIRMWARE, digest
from firmware_protocol.firmware.fit import check_layout, check_sources, expected_layout
from firmware_protocol.firmware.host_header import HOST_H, HeaderError, declarations, fields, functions
from firmware_protocol.firmware.host_io import FIELDS
from simdevice._host import ffi, lib
from simdevice.boards import Board

HEADER = HOST_H.read_text(encoding="utf-8")


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A copy of the sources, without what is made of them."""
    folder = tmp_path / "firmware_protocol" / "firmware"
    shutil.copytree(FIRMWARE, folder, ignore=shutil.ignore_patterns("_build", "__pycache__", "*.so", "*.pyd"))
    shutil.copytree(FIRMWARE.parent / "dialect", folder.parent / "dialect")
    return folder


def build(old: str = "", new: str = "") -> cffi.FFI:
    """What cffi knows of a build of a header in which something is otherwise."""
    assert old in HEADER
    changed = cffi.FFI()
    changed.cdef(declarations(HEADER.replace(old, new, 1)).replace("...;", ""))
    return changed


# --- the struct ------------------------------------------------------------------------------------------------------


def test_the_build_that_is_used_fits() -> None:
    check_layout(ffi)
    check_layout(build())
    check_sources(lib)
    places, size = expected_layout()
    assert list(places) == [name for name, _ in FIELDS] == [name for name, _ in ffi.typeof("host_io").fields]
    assert size == ffi.sizeof("host_io")


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("uint8_t arm[2];", "uint8_t tilt; uint8_t arm[2];", "arm"),
        ("uint8_t reboot;", "uint8_t reboot; uint8_t tilt;", "tilt"),
        ("uint8_t can;", "uint8_t can; uint8_t tilt;", "tilt"),
        ("uint8_t can;", "", "can"),
        ("uint8_t start;", "uint8_t begin;", "start"),
        ("int32_t ground_um;", "int16_t ground_um;", "ground_um"),
        ("int16_t wheel[2];", "int16_t wheel[4];", "wheel"),
        ("uint8_t nvm[1024];", "uint8_t nvm[512];", "nvm"),
        ("uint8_t arm[2];", "", "arm"),
    ],
)  # fmt: skip
def test_one_with_another_struct_is_refused(old: str, new: str, named: str) -> None:
    other = build(old, new)
    with pytest.raises(FirmwareBuildError, match=rf"built for another version of this package \(.*\b{named}\b.*install again"):
        check_layout(other)
    with pytest.raises(FirmwareBuildError):
        Board(uid=1, host=SimpleNamespace(ffi=other, lib=None))


# --- the sources -----------------------------------------------------------------------------------------------------


def test_what_it_is_made_from_is_compiled_in() -> None:
    assert digest() == lib.HOST_BUILT_FROM


@pytest.mark.parametrize(
    "name",
    [
        "core/numbered.c",
        "core/tables.h",
        "junior/maneuver.c",
        "junior/tables.h",
        "roles.h",
        "targets/host/host.c",
        "targets/host/host.h",
        "build_host.py",
        "../dialect/junior.xml",
    ],
)
def test_any_change_is_noticed(tree: Path, name: str) -> None:
    assert digest(tree) == digest()
    path = tree / name
    path.write_bytes(path.read_bytes() + b"\n")
    with pytest.raises(
        FirmwareBuildError, match=r"the firmware has changed since it was built: install again: .* -m pip install"
    ):
        check_sources(lib, tree)


def test_a_file_more_or_less_is_noticed(tree: Path) -> None:
    (tree / "core" / "more.c").write_text("", encoding="utf-8")
    assert digest(tree) != digest()
    (tree / "core" / "more.c").unlink()
    (tree / "core" / "time.c").rename(tree / "core" / "clock.c")
    assert digest(tree) != digest()


def test_line_ends_are_no_change_and_neither_are_other_targets(tree: Path) -> None:
    for path in tree.glob("core/*.c"):
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    (tree / "targets" / "avr" / "main.c").write_text("", encoding="utf-8")
    assert digest(tree) == digest()


@pytest.mark.parametrize("gone", ["core", "junior", "targets", "../dialect"])
def test_without_sources_there_is_nothing_to_compare(tree: Path, gone: str) -> None:
    shutil.rmtree(tree / gone)
    check_sources(lib, tree)


def test_a_build_that_does_not_say_what_it_is_made_from_is_refused() -> None:
    with pytest.raises(FirmwareBuildError, match="has changed"):
        check_sources(SimpleNamespace())


def test_the_remedy_is_that_of_the_place(tree: Path) -> None:
    (tree / "core" / "time.c").write_text("", encoding="utf-8")
    with pytest.raises(FirmwareBuildError, match=r"--force-reinstall --no-deps junior-hil$"):
        check_sources(lib, tree)
    (tree.parents[1] / "setup.py").write_text("", encoding="utf-8")
    here, python = re.escape(str(tree.parents[1])), re.escape(sys.executable)
    build, install = rf"{python} setup.py -q build_ext --inplace", rf"{python} -m pip install -e \."
    with pytest.raises(FirmwareBuildError, match=rf"in {here}, build in place \({build}\) or install again \({install}\)$"):
        check_sources(lib, tree)


STALE = """
from firmware_protocol.firmware import built_from
built_from.digest = lambda *_: 1
from hil.cli.app import run
raise SystemExit(run(["bout", "--controller", "chase", "--no-log"]))
"""


def test_the_command_line_says_so_without_a_traceback(tmp_path: Path) -> None:
    command = [sys.executable, "-c", STALE]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)  # noqa: S603
    assert done.returncode == 2
    assert done.stderr.startswith("hil: the firmware has changed since it was built: in ")
    assert issubclass(FirmwareBuildError, HilError)
    assert issubclass(FirmwareBuildError, ImportError)


# --- the header ------------------------------------------------------------------------------------------------------


def test_cffi_is_told_what_the_header_says() -> None:
    assert declarations(HEADER) == DECLARATIONS
    assert [field.code for field in fields(HEADER) if field.name in {"eye", "battery_mv", "arm"}] == ["2H", "H", "2B"]
    assert {function.name for function in functions(HEADER)} == {name for name in dir(lib) if name.startswith("host_")}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("uint8_t start;", "bool start;", "'bool start' is no integer"),
        ("uint8_t start;", "uint8_t start : 1;", "is no integer"),
        ("uint8_t start;", "uint8_t *start;", "is no integer"),
        ("} host_io;", "} host_ios;", "no struct host_io"),
        ("uint8_t host_state(const host_robot *host);", "uint8_t (*host_state)(void);", "no declaration of a function"),
    ],
)
def test_a_header_that_is_not_understood_is_said_to_be_so(old: str, new: str, said: str) -> None:
    with pytest.raises(HeaderError, match=re.escape(said)):
        declarations(HEADER.replace(old, new, 1))
