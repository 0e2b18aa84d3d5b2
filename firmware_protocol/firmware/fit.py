"""Whether a host build of the firmware fits this version of the package: its struct, and the sources that it is made from."""

from __future__ import annotations

import shlex
import struct
import sys
from typing import TYPE_CHECKING, Any, Final, Protocol

from firmware_protocol.errors import FirmwareBuildError
from firmware_protocol.firmware.built_from import FIRMWARE, digest
from firmware_protocol.firmware.host_io import FIELDS

if TYPE_CHECKING:
    from pathlib import Path

_STRUCT: Final = "host_io"
_STRICTEST: Final = "0Q"
"""The alignment of the struct is that of its widest field; C leaves room for it at the end."""


class Layouts(Protocol):
    """What is asked of a cffi."""

    def typeof(self, cdecl: str) -> Any:  # noqa: ANN401 - a type of cffi, which has no stubs for it
        """A type by its name."""
        ...

    def sizeof(self, cdecl: Any) -> int:  # noqa: ANN401 - a type or its name
        """The size of a type, in bytes."""
        ...


def expected_layout() -> tuple[dict[str, tuple[int, int]], int]:
    """Where the fields of `host_io` are with the C compilers of this machine.

    Returns:
        Offset and size of each field, in bytes, and the size of the whole.
    """
    places: dict[str, tuple[int, int]] = {}
    before = "@"
    for name, code in FIELDS:
        places[name] = (struct.calcsize(f"{before}0{code[-1]}"), struct.calcsize(f"@{code}"))
        before += code
    return places, struct.calcsize(before + _STRICTEST)


def check_layout(ffi: Layouts) -> None:
    """Compare every field of `host_io`.

    Args:
        ffi: The cffi of a build.

    Raises:
        FirmwareBuildError: A field is missing, is one too many, or lies elsewhere.
    """
    places, size = expected_layout()
    found = {name: (field.offset, ffi.sizeof(field.type)) for name, field in ffi.typeof(_STRUCT).fields}
    differ = sorted(name for name in places.keys() | found.keys() if places.get(name) != found.get(name))
    if differ or ffi.sizeof(_STRUCT) != size:
        what = ", ".join(differ) or "its size"
        raise FirmwareBuildError(f"the firmware was built for another version of this package ({what}): {_remedy(FIRMWARE)}")


def check_sources(lib: object, firmware: Path = FIRMWARE) -> None:
    """See that a build is made from the sources beside it, where there are any.

    Args:
        lib: The functions and constants of the build.
        firmware: The folder of the sources.

    Raises:
        FirmwareBuildError: They have changed since.
    """
    check_digest(lib, "HOST_BUILT_FROM", digest(firmware), firmware)


def check_digest(lib: object, constant: str, now: int | None, firmware: Path = FIRMWARE) -> None:
    """See that a build is made from sources with this hash.

    Args:
        lib: The functions and constants of the build.
        constant: Name of the constant that holds the hash it was made from.
        now: The sources' hash; None where there are none.
        firmware: The folder of the firmware's sources.

    Raises:
        FirmwareBuildError: They have changed since.
    """
    if now is not None and now != getattr(lib, constant, None):
        raise FirmwareBuildError(f"the firmware has changed since it was built: {_remedy(firmware)}")


def _remedy(firmware: Path) -> str:
    """How to build it again."""
    root = firmware.parents[1]
    pip = f"{shlex.quote(sys.executable)} -m pip install"
    if (root / "setup.py").is_file():
        build = f"{shlex.quote(sys.executable)} setup.py -q build_ext --inplace"
        return f"in {root}, build in place ({build}) or install again ({pip} -e .)"
    return f"install again: {pip} --force-reinstall --no-deps junior-hil"
