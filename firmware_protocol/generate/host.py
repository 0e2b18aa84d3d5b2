"""What Python knows of the host build of the firmware, made from its header."""

from __future__ import annotations

from firmware_protocol.firmware.host_header import HOST_H, fields, functions

_LAYOUT = '''"""The struct `host_io` of targets/host/host.h. Made by `python -m firmware_protocol.generate`."""

from typing import Final

FIELDS: Final = (
{fields}
)
"""Name of each field, in order, and its type as module `struct` writes it."""
'''

_STUB = """\
# The host build of the firmware; targets/host/host.h describes it. Made by `python -m firmware_protocol.generate`.

from cffi import FFI

ffi: FFI

class _Library:
    HOST_BUILT_FROM: int
{functions}

lib: _Library
"""

_DATA = "const uint8_t *"


def host_layout() -> str:
    """Text of `firmware/host_io.py`."""
    rows = [f'    ("{field.name}", "{field.code}"),' for field in fields(HOST_H.read_text(encoding="utf-8"))]
    return _LAYOUT.format(fields="\n".join(rows))


def host_stub() -> str:
    """Text of `simdevice/_host.pyi`."""
    rows = []
    for function in functions(HOST_H.read_text(encoding="utf-8")):
        parameters = ", ".join(f"{name}: {_annotation(kind)}" for name, kind in function.parameters)
        result = "None" if function.returns == "void" else "int"
        rows.append(f"    def {function.name}(self, {parameters}) -> {result}: ...")
    return _STUB.format(functions="\n".join(rows))


def _annotation(kind: str) -> str:
    """What Python may pass for a type in C."""
    if not kind.endswith("*"):
        return "int"
    return "FFI.CData | bytes" if kind == _DATA else "FFI.CData"
