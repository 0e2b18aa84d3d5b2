"""Builds the host version of the firmware, `firmware_protocol.firmware._host`, as a cffi extension in API mode.

setup.py hands `builder` to setuptools; paths are relative to the folder of setup.py. `CC` chooses the compiler.
"""

from __future__ import annotations

import runpy
from pathlib import Path

import cffi

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = Path("firmware_protocol/firmware")
FOLDERS = ("core", "targets/host")

_HEADER = runpy.run_path(str(ROOT / FIRMWARE / "host_header.py"))
DECLARATIONS: str = _HEADER["declarations"](_HEADER["HOST_H"].read_text(encoding="utf-8"))
"""What cffi is told, as targets/host/host.h has it."""

_BUILT_FROM = runpy.run_path(str(ROOT / FIRMWARE / "built_from.py"))["digest"]()
_SOURCE = f"""
#include "host.h"
static const uint64_t HOST_BUILT_FROM = {_BUILT_FROM:#x}ULL;
"""

builder = cffi.FFI()
builder.cdef(DECLARATIONS)
builder.cdef("static const uint64_t HOST_BUILT_FROM;")
builder.set_source(
    "firmware_protocol.firmware._host",
    _SOURCE,  # with the number in it, another one is another source: it is compiled again, whatever the files' times
    sources=[
        *sorted((FIRMWARE / "core" / path.name).as_posix() for path in (ROOT / FIRMWARE / "core").glob("*.c")),
        (FIRMWARE / "targets/host/host.c").as_posix(),
    ],
    depends=[
        "firmware_protocol/dialect/junior.xml",
        *sorted(path.relative_to(ROOT).as_posix() for folder in FOLDERS for path in (ROOT / FIRMWARE / folder).glob("*.h")),
    ],
    define_macros=[("JUNIOR_CAN", "1"), ("JUNIOR_SIGNING", "1")],
    include_dirs=[(FIRMWARE / folder).as_posix() for folder in (*FOLDERS, "_build")],
)
