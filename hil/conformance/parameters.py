"""Parameters: the list, and what is taken and refused at the limits of each."""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import PARAM_TYPE_REAL32, ROBOT_COMPONENT, ParamRequestRead, ParamSet, ParamValue
from firmware_protocol.wire.can.layout import LAST_NODE
from firmware_protocol.wire.fields import CAN
from hil.conformance.orders import single
from hil.conformance.probe import QUIET
from hil.conformance.registry import Group, require

if TYPE_CHECKING:
    from firmware_protocol.parameters import Parameter
    from hil.conformance.subject import Subject

GROUP: Final = Group("parameters")
_NO_INDEX: Final = 65_535
_NOBODY: Final = "NO_SUCH_NAME"


def _writable(robot: Subject) -> tuple[Parameter, ...]:
    return tuple(parameter for parameter in robot.examples.parameters if not parameter.read_only)


def _beyond(parameter: Parameter) -> tuple[float, float]:
    """The values next to the limits, outside."""
    if parameter.whole:
        return parameter.minimum - 1, parameter.maximum + 1
    low, high = (struct.unpack("<i", struct.pack("<f", limit))[0] for limit in (parameter.minimum, parameter.maximum))
    above = struct.unpack("<f", struct.pack("<i", high + 1))[0]
    below = -1e-9 if parameter.minimum == 0 else struct.unpack("<f", struct.pack("<i", low - 1))[0]
    return below, above


@GROUP.check("parameters-listed", rule="PARAM_REQUEST_LIST")
def listed(robot: Subject) -> str:
    """PARAM_REQUEST_LIST gives every parameter once, in order, with index and count."""
    values = robot.list_parameters()
    names = [value.param_id for value in values]
    known = [parameter.name for parameter in robot.examples.parameters]
    missing = [name for name in known if name not in names]
    require(not missing, f"missing: {', '.join(missing)}")
    require([name for name in names if name in known] == known, "they come twice, or in another order")
    require([value.param_index for value in values] == list(range(len(values))), "the indices do not count up from 0")
    require({value.param_count for value in values} == {len(values)}, "param_count is not the number of parameters")
    require({value.param_type for value in values} == {PARAM_TYPE_REAL32}, "a type is not REAL32")
    return f"{len(values)} parameters"


@GROUP.check("parameter-read-by-name-and-index", rule="PARAM_REQUEST_READ")
def read(robot: Subject) -> str:
    """A parameter is read by its name and by its index."""
    for index, parameter in enumerate(robot.examples.parameters):
        by_name = robot.parameter(parameter.name)
        question = ParamRequestRead(robot.system, ROBOT_COMPONENT, "", index)
        by_index = robot.ask(question, ParamValue, lambda value, index=index: value.param_index == index)  # type: ignore[misc]
        require(by_index == by_name, f"{parameter.name}: by name {by_name}, by index {by_index}")
    return f"{len(robot.examples.parameters)} parameters"


@GROUP.check("unknown-parameter-told", rule="PARAM_VALUE")
def unknown(robot: Subject) -> str:
    """Asking for a parameter that is not there is answered with index 65535; setting it sets nothing."""
    answer = robot.ask(ParamRequestRead(robot.system, ROBOT_COMPONENT, _NOBODY), ParamValue, lambda v: v.param_id == _NOBODY)
    require(answer is not None and answer.param_index == _NO_INDEX, f"asking was answered by {answer}")
    robot.forget()
    robot.send(ParamSet(robot.system, ROBOT_COMPONENT, _NOBODY, 1.0))
    robot.spend(QUIET)
    taken = [value for value in robot.got(ParamValue) if value.param_index != _NO_INDEX]
    require(not taken, f"setting was answered by {taken}")
    return f"{_NOBODY}"


@GROUP.check("parameters-take-their-limits", rule="Parameters")
def limits(robot: Subject) -> str:
    """A parameter takes its least and its greatest value."""
    for parameter in _writable(robot):
        before = robot.parameter(parameter.name).param_value
        try:
            greatest = LAST_NODE if parameter.name == "SYS_ID" and robot.wire == CAN else parameter.maximum
            for value in (parameter.minimum, greatest):
                found = robot.set_parameter(parameter.name, value)
                require(found == single(value), f"{parameter.name} did not take {value:g} and has {found:g}")
        finally:
            robot.set_parameter(parameter.name, before)
    return f"{len(_writable(robot))} parameters"


@GROUP.check("parameters-keep-their-range", rule="What is not understood")
def beyond(robot: Subject) -> str:
    """A value beyond a parameter's limits is refused, not clipped."""
    for parameter in _writable(robot):
        before = robot.parameter(parameter.name).param_value
        for value in (*_beyond(parameter), -1e9, 1e9):
            found = robot.set_parameter(parameter.name, value)
            if found != before:
                robot.set_parameter(parameter.name, before)
            require(found == before, f"{parameter.name} took {value:g} and has {found:g}")
    return f"{len(_writable(robot))} parameters"


@GROUP.check("parameters-refuse-nan", rule="What is not understood")
def not_a_number(robot: Subject) -> str:
    """NaN and infinity are refused."""
    for parameter in _writable(robot):
        before = robot.parameter(parameter.name).param_value
        for value in (math.nan, math.inf, -math.inf):
            message = ParamSet(robot.system, ROBOT_COMPONENT, parameter.name, 0.0)
            robot.raw(robot.forged(message, "param_value", value))
            robot.spend(0.01)
            question = ParamRequestRead(robot.system, ROBOT_COMPONENT, parameter.name)
            answer = robot.ask(question, ParamValue)  # one that says NaN is no good message: it counts as none
            kept = answer is not None and answer.param_value == before
            if not kept:
                robot.set_parameter(parameter.name, before)
            require(kept, f"{parameter.name} took {value}")
    return f"{len(_writable(robot))} parameters"


@GROUP.check("parameters-whole", rule="Parameters")
def whole(robot: Subject) -> str:
    """Where only whole numbers are accepted, a fraction is refused."""
    counted = [parameter for parameter in _writable(robot) if parameter.whole]
    for parameter in counted:
        before = robot.parameter(parameter.name).param_value
        found = robot.set_parameter(parameter.name, parameter.minimum + 0.5)
        if found != before:
            robot.set_parameter(parameter.name, before)
        require(found == before, f"{parameter.name} took {parameter.minimum + 0.5:g} and has {found:g}")
    return f"{len(counted)} parameters"


@GROUP.check("parameters-read-only", rule="Parameters")
def read_only(robot: Subject) -> str:
    """A parameter that is the firmware's own is not set."""
    own = [parameter for parameter in robot.examples.parameters if parameter.read_only]
    for parameter in own:
        before = robot.parameter(parameter.name).param_value
        found = robot.set_parameter(parameter.name, parameter.minimum if before != parameter.minimum else parameter.maximum)
        require(found == before, f"{parameter.name} was {before:g} and is {found:g}")
    return ", ".join(parameter.name for parameter in own)


@GROUP.check("parameters-survive-reboot", rule="PARAM_SET")
def survive(robot: Subject) -> str:
    """Parameters survive power-off."""
    kept = {name: single(value) for name, value in robot.examples.kept.items()}
    with robot.parameters(**robot.examples.kept):
        robot.reboot()
        for name, value in kept.items():
            found = robot.parameter(name).param_value
            require(found == value, f"{name} was set to {value:g} and is {found:g} after a reboot")
    return ", ".join(kept)
