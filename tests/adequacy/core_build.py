"""Builds of the host extension beside the installed one: with other flags, or with one source of the core changed."""

from __future__ import annotations

import contextlib
import io
import os
import shlex
import subprocess
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Final

from firmware_protocol.firmware.build_host import FIRMWARE, PARTS, ROOT
from firmware_protocol.firmware.headers import make_headers
from simdevice.build_host import FLAGS, KERNEL, builder

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

CORE: Final = tuple(path for part in PARTS for path in sorted((ROOT / FIRMWARE / part).glob("*.c")))
"""The sources of the core and of the roles."""
SELECT: Final = "HIL_TEST_EXTENSION"
"""Environment variable by which `core_plugin` learns which extension the tests are to use."""
TESTS: Final = (
    "tests/unit/test_firmware_*.py",
    "tests/property/test_firmware_*.py",
    "tests/contract/test_can_both_ends.py",
)
"""The tests of the core: what is stepped by hand, without links, threads or a PC program."""


class BuildError(Exception):
    """The compiler refused a source; the text is what it said."""


class CoreBuild:
    """A build of the host extension in a folder of its own.

    Args:
        folder: Where to; it is made.
        flags: More flags of the compiler, to compile and to link with.

    Raises:
        BuildError: A source does not compile, or two have one name.
    """

    def __init__(self, folder: Path, flags: Sequence[str] = ()) -> None:
        self._folder = folder
        self._flags = list(flags)
        self._compiler = shlex.split(os.environ.get("CC", "")) or ["cc"]
        folder.mkdir(parents=True, exist_ok=True)
        make_headers()
        wrapper = folder / "wrapper.c"
        with contextlib.redirect_stdout(io.StringIO()):
            builder.emit_c_code(str(wrapper))
        sources = [*CORE, ROOT / FIRMWARE / "targets/host/host.c"]
        sources += [*sorted((ROOT / KERNEL).glob("*.c")), wrapper]
        if len({source.stem for source in sources}) < len(sources):
            raise BuildError("two sources have one name, and so would their objects: give one of them another")
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            made = pool.map(lambda source: self.compile(source, folder / f"{source.stem}.o"), sources)
            self.objects: Mapping[str, Path] = dict(zip((source.name for source in sources), made, strict=True))

    def compile(self, source: Path, target: Path) -> Path:
        """Compile one source.

        Args:
            source: The file. Objects of equal code are equal bytes wherever their sources lie.
            target: The object.

        Returns:
            The object.

        Raises:
            BuildError: It does not compile.
        """
        includes = [f"-I{ROOT / FIRMWARE / part}" for part in (".", "targets/host", "_build")]
        includes.append(f"-I{ROOT / KERNEL}")
        macros = ["-DFIRMWARE_CAN=1", "-DFIRMWARE_SIGNING=1", "-DPy_LIMITED_API"]
        arguments = [*includes, f"-I{sysconfig.get_path('include')}", *macros, "-fPIC", "-w", *FLAGS, *self._flags]
        self._run([*arguments, "-c", source.name, "-o", str(target)], source.parent)
        return target

    def link(self, target: Path, changed: Mapping[str, Path] | None = None) -> Path:
        """Link the extension.

        Args:
            target: The extension.
            changed: Objects that stand in for those of the sources with these names.

        Returns:
            The extension.

        Raises:
            BuildError: It does not link.
        """
        objects = {**self.objects, **(changed or {})}
        self._run(["-shared", *self._flags, *map(str, objects.values()), "-lm", "-o", str(target)], self._folder)
        return target

    def _run(self, arguments: Sequence[str], folder: Path) -> None:
        done = subprocess.run([*self._compiler, *arguments], cwd=folder, check=False, capture_output=True, text=True)  # noqa: S603
        if done.returncode != 0:
            raise BuildError(done.stderr)


def pytest_command(arguments: Sequence[str]) -> list[str]:
    """The command that runs the tests of the core.

    Args:
        arguments: More arguments of pytest.
    """
    paths = [path.relative_to(ROOT).as_posix() for pattern in TESTS for path in sorted(ROOT.glob(pattern))]
    return ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "core_plugin", *arguments, *paths]


def pytest_environment(extension: Path, scratch: Path) -> dict[str, str]:
    """The environment in which those tests use this extension.

    Args:
        extension: What stands in for the installed one.
        scratch: Where the tests' tools may leave what they remember.
    """
    path = os.pathsep.join([str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    return {**os.environ, "PYTHONPATH": path, SELECT: str(extension), "HYPOTHESIS_STORAGE_DIRECTORY": str(scratch)}
