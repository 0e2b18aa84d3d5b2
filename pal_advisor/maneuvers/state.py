"""The saved state of the learner: read back, and its first wrong field named."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import ANY_STIMULUS
from pal_advisor.fields import FieldError, Fields, shown
from pal_advisor.maneuvers.advice import EYES
from pal_advisor.maneuvers.decisions import DIGEST_BYTES, START, GenerationRecord
from pal_advisor.maneuvers.settings import PalSettings, SettingsError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pal_advisor.maneuvers.population import Category

STATE_VERSION: Final = 2
"""2: the digest, and the numbers of trials that wait for credit, and in which generation a maneuver arose."""
OLDEST_VERSION: Final = 1
BIT_GENERATORS: Final = ("PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64")
_MT_WORDS: Final = 624
_STATE_LIMITS: Final = {"has_uint32": 1, "uinteger": 2**32 - 1, "pos": _MT_WORDS, "buffer_pos": 4}
"""Greatest values in the state of a generator."""


class StateError(FieldError):
    """A saved state can't be gone on from: a field is missing, unknown or wrong."""


def read_version(fields: Fields) -> int:
    """The version of a state, one of those that this program goes on from."""
    version = fields.take("version")
    if type(version) is not int or not OLDEST_VERSION <= version <= STATE_VERSION:
        known = f"{OLDEST_VERSION} to {STATE_VERSION}"
        raise fields.wrong("version", f"{shown(version)} is not known; this program goes on from {known}")
    return version


def read_digest(fields: Fields, version: int) -> str:
    """The digest of all decisions; in a state of version 1 it begins anew."""
    if version < 2:
        return START
    digest = fields.text("digest")
    if re.fullmatch(f"[0-9a-f]{{{2 * DIGEST_BYTES}}}", digest) is None:
        raise fields.wrong("digest", f"expected {2 * DIGEST_BYTES} hexadecimal digits, not {shown(digest)}")
    return digest


def read_settings(data: object) -> PalSettings:
    """How a run was coached."""
    if not isinstance(data, dict):
        raise StateError("settings", f"expected a table, not {shown(data)}")
    try:
        return PalSettings.from_dict(data)
    except SettingsError as error:
        raise StateError(f"settings.{error.field}", str(error).partition(": ")[2]) from error


def read_category(fields: Fields, *, arms: bool = True) -> Category:
    """The situation that a field `category` names."""
    value = fields.take("category")
    most = 15 if arms else EYES
    if not isinstance(value, list) or len(value) != 2 or any(type(code) is not int for code in value):
        raise fields.wrong("category", f"expected [previous, current], as codes of stimuli, not {shown(value)}")
    for index, code in enumerate(value):
        if not 0 <= code <= most and (index or code != ANY_STIMULUS):
            or_any = "" if index else f", or {ANY_STIMULUS} for any"
            raise fields.wrong(f"category[{index}]", f"expected a stimulus, 0 to {most}{or_any}, not {shown(code)}")
    return value[0], value[1]


def read_step(data: object, path: str) -> GenerationRecord:
    """A GP step that was made."""
    fields = Fields(data, path, StateError)
    record = GenerationRecord(
        category=read_category(fields),
        phase=fields.integer("phase", 1, 2),
        generation=fields.integer("generation"),
        used=fields.integer("used"),
        evaluations=fields.integer("evaluations"),
        best=fields.number("best"),
        mean=fields.number("mean"),
        maneuver=fields.text("maneuver"),
    )
    fields.done()
    return record


def read_generator(state: object) -> np.random.Generator:
    """A source of chance that goes on where another stood.

    Every part of its state is compared with that of a new one: numpy believes whatever it is given.
    """
    fields = Fields(state, "rng", StateError)
    name = fields.take("bit_generator")
    if name not in BIT_GENERATORS:
        raise fields.wrong("bit_generator", f"no generator is called {shown(name)}")
    bits = getattr(np.random, name)(0)  # without a seed it would draw one from the system
    given = {"bit_generator": name, **_numbers(fields, plain(bits.state))}
    try:
        bits.state = given
    except (OverflowError, ValueError) as error:
        raise fields.wrong("state", f"no state of {name}: {shown(str(error))}") from error
    return np.random.Generator(bits)


def _numbers(fields: Fields, like: Mapping[str, Any]) -> dict[str, Any]:
    """The state of a generator, whole numbers of the right count and size."""
    found: dict[str, Any] = {}
    for name, value in like.items():
        if name == "bit_generator":
            continue
        if isinstance(value, dict):
            found[name] = _numbers(fields.table(name), value)
        elif isinstance(value, list):
            item = fields.elements(name)
            if len(item.names) != len(value):
                raise fields.wrong(name, f"expected {len(value)} numbers, not {len(item.names)}")
            word = np.iinfo(np.uint32 if len(value) == _MT_WORDS else np.uint64)
            found[name] = np.array([item.integer(at, 0, int(word.max)) for at in item.names], dtype=word.dtype)
        else:
            found[name] = fields.integer(name, 0, _STATE_LIMITS.get(name, 2**128 - 1))
    fields.done()
    return found


def plain(value: Any) -> Any:  # noqa: ANN401
    """Arrays (which some generators keep in their state) as lists."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else value
