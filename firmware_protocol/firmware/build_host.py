"""What the host version of the firmware is built of, for whoever builds it into an extension (`simdevice/build_host.py`).

Paths are relative to the folder of setup.py. It runs before the package is installed and therefore imports nothing of it.
"""

from __future__ import annotations

import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = Path("firmware_protocol/firmware")
ROLES = ("junior", "micro")
"""Folders of the roles: all of them are in it."""
PARTS = ("core", *ROLES)
"""Folders of what is on a board: no two of their files have one name."""
FOLDERS = (*PARTS, "targets/host")
"""And of the host's hardware."""

_HEADER = runpy.run_path(str(ROOT / FIRMWARE / "host_header.py"))
DECLARATIONS: str = _HEADER["declarations"](_HEADER["HOST_H"].read_text(encoding="utf-8"))
"""What cffi is told, as targets/host/host.h has it."""

_BUILT_FROM = runpy.run_path(str(ROOT / FIRMWARE / "built_from.py"))["digest"]()
PREAMBLE = f"""
#include "host.h"
static const uint64_t HOST_BUILT_FROM = {_BUILT_FROM:#x}ULL;
"""
"""The head of the extension's own source: with the number in it, another one is another source, which is compiled again."""

SOURCES = [
    *sorted(path.relative_to(ROOT).as_posix() for part in PARTS for path in (ROOT / FIRMWARE / part).glob("*.c")),
    (FIRMWARE / "targets/host/host.c").as_posix(),
]
DEPENDS = [
    "firmware_protocol/dialect/junior.xml",
    (FIRMWARE / "roles.h").as_posix(),
    *sorted(path.relative_to(ROOT).as_posix() for folder in FOLDERS for path in (ROOT / FIRMWARE / folder).glob("*.h")),
]
MACROS = [("FIRMWARE_CAN", "1"), ("FIRMWARE_SIGNING", "1")]
INCLUDES = [FIRMWARE.as_posix(), *((FIRMWARE / folder).as_posix() for folder in ("targets/host", "_build"))]
