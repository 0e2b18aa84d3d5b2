"""Tables of conditional motion: behaviours given for stimuli (Liu & Wu 2001, 6.1.7), as people write them."""

from __future__ import annotations

import re

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.fields import FieldError, Fields, shown
from pal_advisor.surround.stimuli import Stimuli, stimuli_of


class ConditionalError(FieldError):
    """A table of conditional motion has a field that is unknown or wrong."""


def read_conditional(data: object, sectors: int) -> dict[RobotClass, dict[int, int]]:
    """Behaviours given for stimuli.

    Args:
        data: A table `ranger`, `wild` or both. In each a stimulus, as `STIMULUS2` or by its canonical pattern, as `00000001`,
            has a behaviour, as `B8`.
        sectors: N.

    Returns:
        For each class that has a table: behaviour 1..N by number of the stimulus.

    Raises:
        ConditionalError: A class, stimulus or behaviour is unknown, or a stimulus is there twice.
    """
    fields = Fields(data, "", ConditionalError)
    found = {
        kind: _read_table(fields.table(kind.name.lower()), stimuli_of(sectors))
        for kind in RobotClass
        if fields.has(kind.name.lower())
    }
    fields.done()
    return found


def _read_table(fields: Fields, stimuli: Stimuli) -> dict[int, int]:
    found: dict[int, int] = {}
    for name in fields.names:
        stimulus = _stimulus(fields, str(name), stimuli)
        behaviour = fields.text(name)
        number = re.fullmatch("B([0-9]{1,2})", behaviour)
        if number is None or not 1 <= int(number[1]) <= stimuli.sectors:
            raise fields.wrong(name, f"expected a behaviour, B1 to B{stimuli.sectors}, not {shown(behaviour)}")
        if stimulus in found:
            raise fields.wrong(name, f"STIMULUS{stimulus} is there twice")
        found[stimulus] = int(number[1])
    return found


def _stimulus(fields: Fields, name: str, stimuli: Stimuli) -> int:
    """The number of a stimulus that is named by number or by pattern."""
    number = re.fullmatch("STIMULUS([0-9]{1,4})", name)
    if number is not None and 1 <= int(number[1]) <= len(stimuli):
        return int(number[1])
    if len(name) != stimuli.sectors or not set(name) <= {"0", "1"}:
        raise fields.wrong(
            name,
            f"expected STIMULUS1 to STIMULUS{len(stimuli)}, or a canonical pattern as {stimuli.text(min(2, len(stimuli)))}",
        )
    stimulus = int(stimuli.number[int(name, 2)])
    if stimuli.text(stimulus) != name:
        raise fields.wrong(
            name, f"behaviours are counted in the canonical frame, where this is {stimuli.text(stimulus)} (STIMULUS{stimulus})"
        )
    return stimulus
