"""Builds `simdevice._host`: the host version of the firmware and the kernel, as one cffi extension in API mode.

setup.py hands `builder` to setuptools; paths are relative to the folder of setup.py. `CC` chooses the compiler. It runs
before the package is installed and therefore imports nothing of it.
"""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path

import cffi

ROOT = Path(__file__).resolve().parents[1]
KERNEL = Path("simdevice/kernel")
HEADERS = (
    "outline.h",
    "physics.h",
    "world.h",
    "devices.h",
    "referee.h",
    "loop.h",
    "pilot.h",
    "table.h",
    "swarm_route.h",
    "swarm_loop.h",
)
"""What Python is told of, in the order in which they need each other."""
FLAGS = (
    ["/fp:precise"]
    if sys.platform == "win32"
    else ["-ffp-contract=off", "-fno-fast-math", "-fno-builtin-sin", "-fno-builtin-cos"]
)
"""The kernel computes what the Python world computes, to the last bit: no operations are fused or reordered, and sine and
cosine are those of the C library that Python calls, each by itself."""

_FIRMWARE = runpy.run_path(str(ROOT / "firmware_protocol/firmware/build_host.py"))
_BUILT_FROM = runpy.run_path(str(ROOT / KERNEL / "built_from.py"))["digest"]()


def declarations() -> str:
    """What cffi is told of the kernel: its headers without comments and directives."""
    text = "".join((ROOT / KERNEL / name).read_text(encoding="utf-8") for name in HEADERS)
    return re.sub(r"^#.*\n", "", re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL), flags=re.MULTILINE)


builder = cffi.FFI()
builder.cdef(_FIRMWARE["DECLARATIONS"])
builder.cdef(declarations())
builder.cdef("static const uint64_t HOST_BUILT_FROM; static const uint64_t KERNEL_BUILT_FROM;")
builder.set_source(
    "simdevice._host",
    f'{_FIRMWARE["PREAMBLE"]}#include "loop.h"\n#include "pilot.h"\n#include "table.h"\n#include "swarm_loop.h"\n'
    f"static const uint64_t KERNEL_BUILT_FROM = {_BUILT_FROM:#x}ULL;\n",
    sources=[*_FIRMWARE["SOURCES"], *sorted((KERNEL / path.name).as_posix() for path in (ROOT / KERNEL).glob("*.c"))],
    depends=[*_FIRMWARE["DEPENDS"], *sorted((KERNEL / path.name).as_posix() for path in (ROOT / KERNEL).glob("*.h"))],
    define_macros=_FIRMWARE["MACROS"],
    include_dirs=[*_FIRMWARE["INCLUDES"], KERNEL.as_posix()],
    extra_compile_args=FLAGS,
)
