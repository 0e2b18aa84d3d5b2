"""Builds what an emulated ATmega328P needs, on the machine where it is wanted: the firmware's ELF, and our shim for simavr.

simavr is GPL: it comes from the system's packages, is never part of ours, and what is compiled here stays in the user's
cache. It is kept there under a hash of everything it is made from.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from firmware_protocol.errors import LinkOpenError

FIRMWARE: Final = Path(importlib.util.find_spec("firmware_protocol").origin or "").parent / "firmware"  # type: ignore[union-attr]
"""The firmware's sources, with their Makefile."""
SHIM: Final = Path(__file__).with_name("simavr_shim.c")
_PARTS: Final = ("core", "junior", "micro", "targets/avr")
_SOURCES: Final = (*(f"{part}/*.[chS]" for part in _PARTS), "roles.h", "Makefile", "headers.py", "../dialect/junior.xml")
_TOOLS: Final = {"avr-gcc": "gcc-avr avr-libc", "make": "make", "cc": "gcc libc6-dev"}
"""Debian's packages by the command that shows whether they are there."""
_LIBRARY: Final = "libsimavr-dev libelf-dev"
_HEADERS: Final = "#include <simavr/sim_avr.h>\n#include <simavr/sim_elf.h>\n"
_SUBJECT: Final = "the AVR board"


@dataclass(frozen=True)
class AvrFirmware:
    """What an emulated ATmega328P is made of.

    Attributes:
        elf: The firmware, as it is flashed.
        shim: Our library that runs it in simavr.
    """

    elf: Path
    shim: Path


def missing() -> list[str]:
    """What this machine lacks.

    Returns:
        Names of Debian's packages (and `pymavlink`, which pip installs); none where an AVR board can be run.
    """
    packages = [package for tool, package in _TOOLS.items() if shutil.which(tool) is None]
    if shutil.which("cc") and _run("cc", "-E", "-x", "c", "-", "-o", os.devnull, text=_HEADERS).returncode != 0:
        packages.append(_LIBRARY)
    if importlib.util.find_spec("pymavlink") is None:
        packages.append("pymavlink")
    return packages


def cache_folder() -> Path:
    """Where built things are kept: `junior-hil` in the user's cache folder."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "junior-hil"


def build(source: Path = FIRMWARE, cache: Path | None = None, role: str = "junior") -> AvrFirmware:
    """Build the firmware and the shim, unless they are in the cache.

    Args:
        source: Folder of the firmware's sources.
        cache: Where to keep them; None is the user's cache folder.
        role: Folder of the role that is in it.

    Returns:
        Where they are.

    Raises:
        LinkOpenError: Something is not installed, or does not compile; the text says what to do.
    """
    folder = (cache if cache is not None else cache_folder()) / f"avr-{_fingerprint(source)}-{role}"
    made = AvrFirmware(folder / f"{role}.elf", folder / "shim.so")
    if made.elf.exists() and made.shim.exists():
        return made
    if packages := missing():
        raise LinkOpenError(_SUBJECT, "it can't be emulated: this machine lacks " + ", ".join(packages), _remedy(packages))
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as work, tempfile.TemporaryDirectory(dir=folder.parent) as near:
            done = shutil.copytree(
                _make(source, Path(work), role), Path(near) / "done"
            )  # make can't work where a path has a blank
            if not folder.exists():  # else somebody else has built it meanwhile
                done.rename(folder)
    except OSError as error:
        if not made.shim.exists():
            reason = f"cannot build it in {folder.parent}: {error.strerror}"
            raise LinkOpenError(_SUBJECT, reason, "XDG_CACHE_HOME names another folder") from error
    return made


def _fingerprint(source: Path) -> str:
    """A hash of everything that is compiled, as hexadecimal digits."""
    digest = hashlib.sha256()
    for path in [SHIM, *(path for pattern in _SOURCES for path in sorted(source.glob(pattern)))]:
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def shim_hash(shim: Path) -> int:
    """64 bits of a hash of the shim's source, compiled in and compared when it is loaded.

    Args:
        shim: The source.
    """
    return int.from_bytes(hashlib.sha256(shim.read_bytes()).digest()[:8], "big")


def _make(source: Path, folder: Path, role: str) -> Path:
    """Compile in this folder; returns where what is to be kept is."""
    done = folder / "done"
    done.mkdir()
    build_folder = folder / "build"
    _demand(
        _run("make", "-C", source, "avr", f"ROLE={role}", f"BUILD={build_folder}", f"PYTHON={sys.executable}", "MAKEFLAGS=")
    )
    (made,) = build_folder.glob(f"avr*/{role}.elf")
    made.rename(done / made.name)
    flags = ("-std=gnu11", "-O2", "-fPIC", "-shared", f"-I{source / 'targets' / 'avr'}")
    _demand(_run("cc", *flags, f"-DSHIM_HASH={shim_hash(SHIM):#x}ULL", "-o", done / "shim.so", SHIM, "-lsimavr"))
    return done


def _run(*command: object, text: str = "") -> subprocess.CompletedProcess[str]:
    environment = {key: value for key, value in os.environ.items() if key != "MAKEFLAGS"}
    arguments = [str(part) for part in command]
    return subprocess.run(arguments, input=text, capture_output=True, text=True, check=False, env=environment)  # noqa: S603


def _demand(done: subprocess.CompletedProcess[str]) -> None:
    if done.returncode != 0:
        last = "\n".join((done.stdout + done.stderr).strip().splitlines()[-8:])
        raise LinkOpenError(_SUBJECT, f"building it failed: {' '.join(done.args[:4])} said:\n{last}")


def _remedy(packages: list[str]) -> str:
    """What to type."""
    debian = " ".join(package for package in packages if package != "pymavlink")
    steps = ([f"sudo apt install {debian}"] if debian else []) + (["pip install pymavlink"] if "pymavlink" in packages else [])
    return f"On Debian or Ubuntu: {'; '.join(steps)}"
