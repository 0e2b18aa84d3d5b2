"""Standard MAVLink, declared field for field as in `common`, so that any ground station understands it: raw units are kept."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Annotated, Final

from firmware_protocol.messages.fields import Target, TargetComponent
from firmware_protocol.wire.fields import Direction, Message, Wire

PARAM_TYPE_REAL32: Final = 9
"""MAV_PARAM_TYPE_REAL32: every parameter of ours has this type."""
GROUND_STATION: Final = 6
"""MAV_TYPE_GCS, of HEARTBEAT.type: a host, and no robot."""
ROVER: Final = 10
"""MAV_TYPE_GROUND_ROVER, of HEARTBEAT.type: a robot of ours."""
GENERIC_AUTOPILOT: Final = 0
"""MAV_AUTOPILOT_GENERIC, of HEARTBEAT.autopilot: a robot of ours."""
ARMED_FLAG: Final = 128
"""MAV_MODE_FLAG_SAFETY_ARMED, of HEARTBEAT.base_mode."""
SEVERITY_ERROR: Final = 3
"""MAV_SEVERITY_ERROR, of STATUSTEXT.severity; what is worse is less."""


class Command(IntEnum):
    """The standard commands (MAV_CMD) a robot honours."""

    FLIGHT_TERMINATION = 185
    PREFLIGHT_REBOOT = 246
    ARM_DISARM = 400
    INJECT_FAILURE = 420
    SET_MESSAGE_INTERVAL = 511
    REQUEST_MESSAGE = 512


class CommandResult(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5


Param7 = Annotated[float, Wire("f32", nan=True, text="Depends on the command; NaN is not given")]


@dataclass(frozen=True)
class Heartbeat(Message, id=0, direction=Direction.BOTH):
    """I am here, of this type, in this state. 1 Hz from a robot; likewise from the host."""

    type: Annotated[int, Wire("u8", text="MAV_TYPE: 10 ground rover, 6 ground station")]
    autopilot: Annotated[int, Wire("u8", text="MAV_AUTOPILOT: 0 generic, 8 none")]
    base_mode: Annotated[int, Wire("u8", text="MAV_MODE_FLAG: 128 armed, 64 manual input, 1 custom mode")]
    custom_mode: Annotated[int, Wire("u32", text="What the robot is doing")]
    system_status: Annotated[int, Wire("u8", text="MAV_STATE: 3 standby, 4 active, 6 emergency")]
    mavlink_version: Annotated[int, Wire("u8", text="MAVLink version")] = 3


@dataclass(frozen=True)
class SysStatus(Message, id=1, direction=Direction.UP):
    """Health: battery and link drops."""

    onboard_control_sensors_present: Annotated[int, Wire("u32", text="MAV_SYS_STATUS_SENSOR: wheels, battery, arming")] = 0
    onboard_control_sensors_enabled: Annotated[int, Wire("u32", text="Likewise; the wheels only while armed")] = 0
    onboard_control_sensors_health: Annotated[int, Wire("u32", text="Likewise; set for what there is not, too")] = 0
    load: Annotated[int, Wire("u16", "d%", text="Share of the control period used")] = 0
    voltage_battery: Annotated[int, Wire("u16", "mV", text="Battery voltage; 65535 is not known")] = 0xFFFF
    current_battery: Annotated[int, Wire("i16", "cA", text="-1 is not known")] = -1
    battery_remaining: Annotated[int, Wire("i8", "%", text="-1 is not known")] = -1
    drop_rate_comm: Annotated[int, Wire("u16", "c%", text="Share of the host's frames lost")] = 0
    errors_comm: Annotated[int, Wire("u16", text="Frames rejected")] = 0
    errors_count1: Annotated[int, Wire("u16")] = 0
    errors_count2: Annotated[int, Wire("u16")] = 0
    errors_count3: Annotated[int, Wire("u16")] = 0
    errors_count4: Annotated[int, Wire("u16")] = 0
    onboard_control_sensors_present_extended: Annotated[int, Wire("u32", extension=True)] = 0
    onboard_control_sensors_enabled_extended: Annotated[int, Wire("u32", extension=True)] = 0
    onboard_control_sensors_health_extended: Annotated[int, Wire("u32", extension=True)] = 0


@dataclass(frozen=True)
class Ping(Message, id=4, direction=Direction.BOTH):
    """Are you there? Answered with the same time and number, addressed to the asker."""

    time_usec: Annotated[int, Wire("u64", "us", text="Time of the question")]
    seq: Annotated[int, Wire("u32", text="Number of the question")]
    target_system: Annotated[int, Wire("u8", text="0 asks; otherwise this is the answer to that system")] = 0
    target_component: Annotated[int, Wire("u8", text="Likewise, the component")] = 0


@dataclass(frozen=True)
class ParamRequestRead(Message, id=20, direction=Direction.DOWN):
    """Ask for one parameter by name, or by index."""

    target_system: Target
    target_component: TargetComponent
    param_id: Annotated[str, Wire("char", count=16, text="Name of the parameter")] = ""
    param_index: Annotated[int, Wire("i16", text="-1: use param_id")] = -1


@dataclass(frozen=True)
class ParamRequestList(Message, id=21, direction=Direction.DOWN):
    """Ask for all parameters."""

    target_system: Target
    target_component: TargetComponent


@dataclass(frozen=True)
class ParamValue(Message, id=22, direction=Direction.UP):
    """One parameter; the answer to a read, a list and a set."""

    param_id: Annotated[str, Wire("char", count=16, text="Name of the parameter")]
    param_value: Annotated[float, Wire("f32", nan=True, text="Its value; NaN where no parameter has the name asked for")]
    param_type: Annotated[int, Wire("u8", text="MAV_PARAM_TYPE: always 9, REAL32")]
    param_count: Annotated[int, Wire("u16", text="Parameters there are")]
    param_index: Annotated[int, Wire("u16", text="65535 where no parameter has the name asked for")]


@dataclass(frozen=True)
class ParamSet(Message, id=23, direction=Direction.DOWN):
    """Set a parameter; answered by PARAM_VALUE with the value now in force."""

    target_system: Target
    target_component: TargetComponent
    param_id: Annotated[str, Wire("char", count=16, text="Name of the parameter")]
    param_value: Annotated[float, Wire("f32", text="Its value")]
    param_type: Annotated[int, Wire("u8", text="9, REAL32")] = PARAM_TYPE_REAL32


@dataclass(frozen=True)
class MissionRequestList(Message, id=43, direction=Direction.DOWN):
    """Ask how long the stored mission is: a ground station does so when it meets a vehicle, and waits for the answer."""

    target_system: Target
    target_component: TargetComponent
    mission_type: Annotated[int, Wire("u8", extension=True, text="MAV_MISSION_TYPE: mission, fence, rally points")] = 0


@dataclass(frozen=True)
class MissionCount(Message, id=44, direction=Direction.UP):
    """Answer to MISSION_REQUEST_LIST: there is none."""

    target_system: Annotated[int, Wire("u8", text="System that asked")]
    target_component: Annotated[int, Wire("u8", text="Component that asked")]
    count: Annotated[int, Wire("u16", text="Items there are: none")] = 0
    mission_type: Annotated[int, Wire("u8", extension=True, text="As in the question")] = 0


@dataclass(frozen=True)
class ManualControl(Message, id=69, direction=Direction.DOWN):
    """Teleoperation from a ground station: x forward, r turn (clockwise positive, as a stick); dead-man 250 ms."""

    target: Target
    x: Annotated[int, Wire("i16", text="Forward, -1000..1000; 32767 is not given")] = 0
    y: Annotated[int, Wire("i16")] = 0
    z: Annotated[int, Wire("i16")] = 0
    r: Annotated[int, Wire("i16", text="Turn, clockwise positive, -1000..1000; 32767 is not given")] = 0
    buttons: Annotated[int, Wire("u16")] = 0
    buttons2: Annotated[int, Wire("u16", extension=True)] = 0
    enabled_extensions: Annotated[int, Wire("u8", extension=True)] = 0
    s: Annotated[int, Wire("i16", extension=True)] = 0
    t: Annotated[int, Wire("i16", extension=True)] = 0
    aux1: Annotated[int, Wire("i16", extension=True)] = 0
    aux2: Annotated[int, Wire("i16", extension=True)] = 0
    aux3: Annotated[int, Wire("i16", extension=True)] = 0
    aux4: Annotated[int, Wire("i16", extension=True)] = 0
    aux5: Annotated[int, Wire("i16", extension=True)] = 0
    aux6: Annotated[int, Wire("i16", extension=True)] = 0


@dataclass(frozen=True)
class CommandLong(Message, id=76, direction=Direction.DOWN):
    """A standard command: arm, disarm, e-stop, reboot, request or schedule a message.

    A host that arms (400) says in `param3` the number that it opened the session with, ROBOT_SESSION.host.
    """

    target_system: Target
    target_component: TargetComponent
    command: Annotated[int, Wire("u16", text="MAV_CMD")]
    confirmation: Annotated[int, Wire("u8", text="0 first time, then counted up")] = 0
    param1: Param7 = 0.0
    param2: Param7 = 0.0
    param3: Param7 = 0.0
    param4: Param7 = 0.0
    param5: Param7 = 0.0
    param6: Param7 = 0.0
    param7: Param7 = 0.0


@dataclass(frozen=True)
class CommandAck(Message, id=77, direction=Direction.UP):
    """Answer to COMMAND_LONG."""

    command: Annotated[int, Wire("u16", text="MAV_CMD")]
    result: Annotated[int, Wire("u8", text="MAV_RESULT")]
    progress: Annotated[int, Wire("u8", extension=True)] = 0
    result_param2: Annotated[int, Wire("i32", extension=True)] = 0
    target_system: Annotated[int, Wire("u8", extension=True, text="System that asked")] = 0
    target_component: Annotated[int, Wire("u8", extension=True, text="Component that asked")] = 0


@dataclass(frozen=True)
class Timesync(Message, id=111, direction=Direction.BOTH):
    """Clock comparison: tc1 is 0 in a question; the answer carries the answerer's time in tc1 and repeats ts1."""

    tc1: Annotated[int, Wire("i64", "ns", text="Time of the answerer; 0 in a question")]
    ts1: Annotated[int, Wire("i64", "ns", text="Time of the asker")]
    target_system: Annotated[int, Wire("u8", extension=True, text="In an answer, the system that asked")] = 0
    target_component: Annotated[int, Wire("u8", extension=True, text="In an answer, the component that asked")] = 0


@dataclass(frozen=True)
class AutopilotVersion(Message, id=148, direction=Direction.UP):
    """Who the robot is: middleware_sw_version is the protocol's (major << 24 | minor << 16), flight_sw_version its own."""

    capabilities: Annotated[int, Wire("u64", text="What it can do")]
    flight_sw_version: Annotated[int, Wire("u32", text="Version of the firmware")]
    middleware_sw_version: Annotated[int, Wire("u32", text="Version of the protocol")]
    os_sw_version: Annotated[int, Wire("u32")] = 0
    board_version: Annotated[int, Wire("u32")] = 0
    flight_custom_version: Annotated[tuple[int, ...], Wire("u8", count=8)] = (0,) * 8
    middleware_custom_version: Annotated[tuple[int, ...], Wire("u8", count=8)] = (0,) * 8
    os_custom_version: Annotated[tuple[int, ...], Wire("u8", count=8)] = (0,) * 8
    vendor_id: Annotated[int, Wire("u16")] = 0
    product_id: Annotated[int, Wire("u16")] = 0
    uid: Annotated[int, Wire("u64", text="Unique id of the robot")] = 0
    uid2: Annotated[tuple[int, ...], Wire("u8", count=18, extension=True)] = (0,) * 18


@dataclass(frozen=True)
class Statustext(Message, id=253, direction=Direction.UP):
    """A line for a person."""

    severity: Annotated[int, Wire("u8", text="MAV_SEVERITY: 0 emergency .. 7 debug")]
    text: Annotated[str, Wire("char", count=50, text="The line")]
    id: Annotated[int, Wire("u16", extension=True)] = 0
    chunk_seq: Annotated[int, Wire("u8", extension=True)] = 0


@dataclass(frozen=True)
class SetupSigning(Message, id=256, direction=Direction.DOWN):
    """Give a robot its signing key, or take it away (all zero). Not answered: from then on the robot signs, or does not.

    Obeyed while disarmed, by a robot that has no key; by one that has, if signed with that. Never over CAN.
    """

    target_system: Annotated[int, Wire("u8", text="System addressed; never all")]
    target_component: TargetComponent
    secret_key: Annotated[
        tuple[int, ...], Wire("u8", count=32, secret=True, text="The key; all zero: sign and check no more")
    ] = field(repr=False)
    initial_timestamp: Annotated[int, Wire("u64", text="Time in 10 us since 2015-01-01 GMT: what was signed before is refused")]


STANDARD_MESSAGES: Final[tuple[type[Message], ...]] = (
    Heartbeat, SysStatus, Ping, ParamRequestRead, ParamRequestList, ParamValue, ParamSet, MissionRequestList, MissionCount,
    ManualControl, CommandLong, CommandAck, Timesync, AutopilotVersion, Statustext,
    SetupSigning,
)  # fmt: skip
