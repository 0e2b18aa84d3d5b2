"""The state of a source of chance as plain values, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pal_advisor.fields import shown

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pal_advisor.fields import Fields

BIT_GENERATORS: Final = ("PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64")
_MT_WORDS: Final = 624
_STATE_LIMITS: Final = {"has_uint32": 1, "uinteger": 2**32 - 1, "pos": _MT_WORDS, "buffer_pos": 4}
"""Greatest values in the state of a generator."""


def read_generator(fields: Fields) -> np.random.Generator:
    """A source of chance that goes on where another stood.

    Every part of its state is compared with that of a new one: numpy believes whatever it is given.

    Args:
        fields: Its state.

    Raises:
        FieldError: A field of it is missing, unknown or wrong; of the kind that the fields raise.
    """
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
