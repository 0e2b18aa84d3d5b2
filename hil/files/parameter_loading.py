"""Many parameters at once: everything is checked, then set, then read back; what is broken off half way is put back."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.errors import HilError, RefusedError
from firmware_protocol.near import did_you_mean
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from hil.doors import Door
from hil.files.field_lines import line_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from firmware_protocol.parameters import Parameter
    from hil.connecting.handle import RobotHandle

KNOWN: Final[dict[str, Parameter]] = {parameter.name: parameter for parameter in JUNIOR_PARAMETERS}
IDENTITY: Final = frozenset({"SYS_ID"})
"""What tells a robot from the others: not for the next one."""
_WHOLE: Final = 2**24
"""Up to here 32 bits hold every whole number."""
_GREATEST: Final = float(np.finfo(np.float32).max)


class ParameterLoadError(HilError):
    """Parameters that can't be set, or were not."""


@dataclass(frozen=True)
class Wanted:
    """What a file says.

    Attributes:
        path: The file.
        values: Values to be set, by name.
        lines: Where each stands, from 1; 0 where it can't be told.
        identity: Names left out since they tell this robot from others.
        read_only: Values that only the firmware sets, by name.
        text: The file's text.
    """

    path: Path
    values: dict[str, float]
    lines: dict[str, int]
    identity: tuple[str, ...]
    read_only: dict[str, float]
    text: str = ""

    def where(self, name: str) -> str:
        """The file, and the line of a name in it."""
        line = self.lines[name]
        return f"{self.path}, line {line}" if line else str(self.path)


@dataclass(frozen=True)
class Change:
    """One parameter that was set.

    Attributes:
        name: Its name.
        before: What it was.
        after: What it is.
    """

    name: str
    before: float
    after: float

    def __str__(self) -> str:
        return f"{self.name} {shortest(self.before)} -> {shortest(self.after)}"


def shortest(value: float) -> int | float:
    """The number with the shortest text that is the same number of 32 bits: 0.3 for 0.30000001192..., 250 for 250.0.

    Args:
        value: What a robot has said.
    """
    with np.errstate(over="ignore"):
        single = np.float32(value)
    if not math.isfinite(single):
        return float(single)
    if single == int(single) and abs(single) < _WHOLE and (single != 0 or math.copysign(1.0, single) > 0):
        return int(single)
    return float(np.format_float_scientific(single, unique=True))


DOOR: Final = Door("parameter file", ParameterLoadError, largest=1 << 16)


def read_parameters(path: Path, *, everything: bool = False) -> Wanted:
    """Read a file of parameters, and check all that can be checked without the robot.

    Args:
        path: The file.
        everything: The robot's identity is to be set too.

    Raises:
        ParameterLoadError: It can't be read or is no TOML, or an entry is no number, or one that no robot takes.
    """
    read = DOOR.document(path, json=False)
    return check_file(path, read.text, read.data, everything=everything)


def parameters_of(data: bytes, name: str, *, everything: bool) -> Wanted:
    """Likewise, of what is held in memory.

    Args:
        data: As a file would hold it.
        name: What it is called in errors.
        everything: The robot's identity is to be set too.

    Raises:
        ParameterLoadError: As by `read_parameters`.
    """
    read = DOOR.document_of(data, name)
    return check_file(read.path, read.text, read.data, everything=everything)


def check_file(path: Path, text: str, document: Any, *, everything: bool) -> Wanted:  # noqa: ANN401 - whatever a file holds
    """Check what a file says; see `read_parameters`.

    Args:
        path: The file.
        text: Its text.
        document: What it says.
        everything: The robot's identity is to be set too.

    Raises:
        ParameterLoadError: An entry is no number, or one that no robot takes.
    """
    if not isinstance(document, dict):
        raise ParameterLoadError(f"{path} must hold names and numbers, as SPD_FAST = 0.9")
    wanted = Wanted(
        path,
        {},
        {name: line_of(text, name) for name in document},
        tuple(name for name in document if name in IDENTITY and not everything),
        {},
        text,
    )
    for name, value in document.items():
        about = KNOWN.get(name)
        if problem := _problem(value, about):
            raise ParameterLoadError(f"{wanted.where(name)}: {name} {problem}")
        if about is not None and about.read_only:
            wanted.read_only[name] = float(value)
        elif name not in wanted.identity:
            wanted.values[name] = float(value)
    return wanted


def _problem(value: object, about: Parameter | None) -> str:
    """What is wrong with a value; empty where nothing is."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"must be a number, not {value!r:.60}"
    if not abs(value) <= _GREATEST:  # NaN is not
        return "must be a number that 32 bits hold"
    if about is None or about.read_only:
        return ""
    if not about.minimum <= np.float32(value) <= about.maximum:
        return f"must be {about.minimum:g} to {about.maximum:g}{' ' + about.unit if about.unit else ''}, not {value:g}"
    if about.whole and value != int(value):
        return f"must be a whole number, not {value:g}"
    return ""


def load(robot: RobotHandle, wanted: Wanted, *, tell: Callable[[str], None], warn: Callable[[str], None]) -> dict[str, float]:
    """Set what differs, and read all back. Where that does not come to its end, what was set is put back.

    Args:
        robot: The robot.
        wanted: What to set.
        tell: Tells a person what is left out and what has changed.
        warn: Tells what was put back, or could not be.

    Returns:
        All parameters of the robot, as read back.

    Raises:
        ParameterLoadError: The robot has no such parameter, refused a value, or has another afterwards.
        PeerError: It does not answer.
        LinkError: The link is gone.
    """
    before = robot.parameters()
    for name in wanted.values:
        if name not in before:
            raise ParameterLoadError(f"{wanted.where(name)}: the robot has no parameter {name}{did_you_mean(name, before)}")
    _tell_left_out(wanted, before, tell)
    changes = [Change(name, before[name], value) for name, value in wanted.values.items() if not _same(before[name], value)]
    if not changes:
        tell(f"The robot has everything as in {wanted.path}.")
        return before
    begun: list[Change] = []
    try:
        for change in changes:
            begun.append(change)
            robot.set_parameter(change.name, change.after)
        after = robot.parameters()
        _compare(wanted, after)
    except BaseException as error:
        _put_back(robot, begun, warn)
        if isinstance(error, RefusedError):
            raise ParameterLoadError(f"{wanted.where(begun[-1].name)}: {error}") from error
        raise
    for change in changes:
        tell(f"changed: {change}")
    return after


def _compare(wanted: Wanted, after: Mapping[str, float]) -> None:
    """See that what was read back is what was wanted; raises a ParameterLoadError."""
    for name, value in wanted.values.items():
        if not _same(after.get(name, math.nan), value):
            has = shortest(after[name]) if name in after else "no such parameter"
            raise ParameterLoadError(f"{wanted.where(name)}: {name} was set to {shortest(value)}, but the robot has {has}")


def _same(one: float, other: float) -> bool:
    """Whether two numbers are the same in 32 bits."""
    return bool(np.float32(one) == np.float32(other))


def _tell_left_out(wanted: Wanted, before: Mapping[str, float], tell: Callable[[str], None]) -> None:
    """Say what stands in the file and is not set."""
    for name in wanted.identity:
        tell(f"left out: {name}, which tells robots apart (--all sets it too)")
    for name, value in wanted.read_only.items():
        has = before.get(name)
        if has is None or not _same(has, value):
            says = "has none" if has is None else f"has {shortest(has)}"
            tell(f"left out: {name} = {shortest(value)}, which only the firmware sets; the robot {says}")


def _put_back(robot: RobotHandle, begun: list[Change], warn: Callable[[str], None]) -> None:
    """Undo what was set, the last one first; the last one may or may not have been."""
    left = list(begun)
    try:
        while left:
            change = left[-1]
            robot.set_parameter(change.name, change.before)
            left.pop()
    except (HilError, KeyboardInterrupt) as error:
        warn(f"Not everything could be put back: {str(error) or 'interrupted'}. The robot may have, before -> now:")
        for change in left:
            warn(f"  {change}")
        return
    warn("Everything is as it was before.")
