"""Chipmunk's own functions and structs, taken from pymunk: the one place that knows pymunk's private names.

pymunk makes bodies, joints and spaces, and the kernel steps them without Python in between. pymunk has no public way to hand
over what it wraps, so that the names are looked for when this module is loaded, and versions are pinned in pyproject.toml.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

import pymunk

from firmware_protocol.errors import PhysicsVersionError

if TYPE_CHECKING:
    from collections.abc import Mapping

_FUNCTIONS: Final = {
    "space_step": ("cpSpaceStep", "void(*)(struct cpSpace *, double)"),
    "position": ("cpBodyGetPosition", "struct cpVect(*)(struct cpBody *)"),
    "angle": ("cpBodyGetAngle", "double(*)(struct cpBody *)"),
    "rotation": ("cpBodyGetRotation", "struct cpVect(*)(struct cpBody *)"),
    "velocity": ("cpBodyGetVelocity", "struct cpVect(*)(struct cpBody *)"),
    "spin": ("cpBodyGetAngularVelocity", "double(*)(struct cpBody *)"),
    "set_force": ("cpBodySetForce", "void(*)(struct cpBody *, struct cpVect)"),
    "set_torque": ("cpBodySetTorque", "void(*)(struct cpBody *, double)"),
    "apply_force": ("cpBodyApplyForceAtLocalPoint", "void(*)(struct cpBody *, struct cpVect, struct cpVect)"),
    "set_max_force": ("cpConstraintSetMaxForce", "void(*)(struct cpConstraint *, double)"),
    "set_anchor_b": ("cpGrooveJointSetAnchorB", "void(*)(struct cpConstraint *, struct cpVect)"),
}
"""By the field of the kernel's struct `kernel_physics`: Chipmunk's name, and its type as cffi writes it."""
_VECTOR: Final = [("x", "double", 0), ("y", "double", 8)]
_ATTRIBUTES: Final[Mapping[str, str]] = {"Body": "_body", "Constraint": "_constraint", "Space": "_space"}


def _load(module: str = "pymunk._chipmunk_cffi") -> tuple[Any, dict[str, int]]:
    """The cffi of pymunk's library, and its functions' addresses.

    Args:
        module: The library's name.

    Raises:
        PhysicsVersionError: Something is not as the kernel needs it.
    """
    try:
        library = importlib.import_module(module)
        ffi, lib = library.ffi, library.lib
        functions = {field: ffi.addressof(lib, name) for field, (name, _) in _FUNCTIONS.items()}
        vector = [(name, field.type.cname, field.offset) for name, field in ffi.typeof("struct cpVect").fields]
    except (ImportError, AttributeError) as error:
        raise _unfit(str(error)) from error
    for field, (name, kind) in _FUNCTIONS.items():
        if ffi.typeof(functions[field]).cname != kind:
            raise _unfit(f"{name} is a {ffi.typeof(functions[field]).cname}")
    if vector != _VECTOR:
        raise _unfit("cpVect is not two doubles")
    probes = {"Body": pymunk.Body(1.0, 1.0), "Space": pymunk.Space()}
    for name, probe in probes.items():
        if not isinstance(getattr(probe, _ATTRIBUTES[name], None), ffi.CData):
            raise _unfit(f"a {name} has no {_ATTRIBUTES[name]}")
    return ffi, {field: int(ffi.cast("uintptr_t", function)) for field, function in functions.items()}


def _unfit(what: str) -> PhysicsVersionError:
    """The error that names pymunk's version and what to do."""
    return PhysicsVersionError(
        f"pymunk {pymunk.version} is not as the emulated robot's kernel needs it ({what}): "
        "install a version of it that this package was tested with: python -m pip install 'pymunk>=7,<8'"
    )


_FFI, FUNCTIONS = _load()
"""Address of each function, by the field of `kernel_physics`."""


def _address(thing: object, kind: str) -> int:
    """Where the struct behind an object of pymunk is."""
    return int(_FFI.cast("uintptr_t", getattr(thing, _ATTRIBUTES[kind])))


def body_address(body: pymunk.Body) -> int:
    """Where Chipmunk's struct behind a body is; it lives as long as the body."""
    return _address(body, "Body")


def joint_address(joint: pymunk.Constraint) -> int:
    """Where Chipmunk's struct behind a joint is; it lives as long as the joint."""
    return _address(joint, "Constraint")


def space_address(space: pymunk.Space) -> int:
    """Where Chipmunk's struct behind a space is; it lives as long as the space."""
    return _address(space, "Space")
