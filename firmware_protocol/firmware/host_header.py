"""Reads `targets/host/host.h`, the one definition of what a host build of the firmware shares with Python.

What cffi is told, the stub `simdevice/_host.pyi` and the layout in `host_io.py` are made from it. It runs before the package is
installed and therefore imports nothing of it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

HOST_H: Final = Path(__file__).resolve().parent / "targets" / "host" / "host.h"
STRUCT: Final = "host_io"
"""The struct that Python reads and writes."""
OPAQUE: Final = "host_robot"
"""The struct of which Python knows only that it begins with the other one."""
CODES: Final = {
    "uint8_t": "B", "uint16_t": "H", "uint32_t": "I", "uint64_t": "Q", "int8_t": "b", "int16_t": "h",
    "int32_t": "i", "int64_t": "q",
}  # fmt: skip
"""What module `struct` calls the types that there may be."""

_COMMENT: Final = re.compile(r"/\*.*?\*/", re.DOTALL)
_DIRECTIVE: Final = re.compile(r"^#.*\n", re.MULTILINE)
_STRUCT: Final = re.compile(r"typedef struct \{([^{}]*)\} (\w+);")
_FIELD: Final = re.compile(r"(\w+) (\w+)(?:\[(\d+)\])?")
_FUNCTION: Final = re.compile(r"(\w+) (\w+)\(([^()]*)\)")
_PARAMETER: Final = re.compile(r"((?:const )?\w+) (\*?)(\w+)")


class HeaderError(Exception):
    """The header holds something that is not understood here."""


@dataclass(frozen=True)
class Field:
    """A field of `host_io`.

    Attributes:
        name: Its name.
        type: Its type in C, or that of its elements.
        count: Number of elements; 0 where it is no array.
    """

    name: str
    type: str
    count: int

    @property
    def code(self) -> str:
        """As module `struct` writes it: `2H`."""
        return f"{self.count or ''}{CODES[self.type]}"


@dataclass(frozen=True)
class Function:
    """A function.

    Attributes:
        name: Its name.
        returns: Type of its result in C.
        parameters: Name, and type in C with its `const` and `*`, of each.
    """

    name: str
    returns: str
    parameters: tuple[tuple[str, str], ...]


def _plain(header: str) -> str:
    """The header without comments and directives."""
    return _DIRECTIVE.sub("", _COMMENT.sub("", header))


def fields(header: str) -> tuple[Field, ...]:
    """The fields of `host_io`.

    Args:
        header: Text of host.h.

    Raises:
        HeaderError: There is no such struct, or a field is no integer of a known size and no array of them.
    """
    bodies = {name: body for body, name in _STRUCT.findall(_plain(header))}
    if STRUCT not in bodies:
        raise HeaderError(f"host.h has no struct {STRUCT}")
    found = []
    for piece in bodies[STRUCT].split(";")[:-1]:
        match = _FIELD.fullmatch(piece.strip())
        if match is None or match[1] not in CODES:
            raise HeaderError(f"host.h: in {STRUCT}, {piece.strip()!r} is no integer or array of them")
        found.append(Field(match[2], match[1], int(match[3] or 0)))
    return tuple(found)


def functions(header: str) -> tuple[Function, ...]:
    """The functions.

    Args:
        header: Text of host.h.

    Raises:
        HeaderError: A declaration is not understood.
    """
    found = []
    for piece in _STRUCT.sub("", _plain(header)).split(";")[:-1]:
        match = _FUNCTION.fullmatch(" ".join(piece.split()))
        parameters = [_PARAMETER.fullmatch(text.strip()) for text in match[3].split(",")] if match else []
        if match is None or not all(parameters):
            raise HeaderError(f"host.h: {piece.strip()!r} is no declaration of a function")
        found.append(Function(match[2], match[1], tuple((p[3], f"{p[1]} {p[2]}".strip()) for p in parameters if p)))
    return tuple(found)


def declarations(header: str) -> str:
    """What cffi is told: of the robot only that it begins with `host_io`.

    Args:
        header: Text of host.h.

    Raises:
        HeaderError: Something is not understood.
    """
    lines = [f"    {field.type} {field.name}{f'[{field.count}]' if field.count else ''};" for field in fields(header)]
    prototypes = [
        f"{function.returns} {function.name}({', '.join(f'{kind} {name}' for name, kind in function.parameters)});"
        for function in functions(header)
    ]
    return "\n".join(
        ["typedef struct {", *lines, f"}} {STRUCT};", f"typedef struct {{ {STRUCT} io; ...; }} {OPAQUE};", *prototypes, ""]
    )
