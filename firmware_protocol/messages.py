"""Every message on the wire, once: names, units, ranges and wire types.

Ids below 47100 are standard MAVLink, declared field for field as in `common` so that any ground station understands
them (standard names and raw units are kept). Junior's own messages use SI units in Python; `scale` says what one wire
unit is. Junior's own fields are declared widest first, so that the MAVLink payload and the CAN payload agree.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum, IntFlag
from typing import Annotated, Final

from firmware_protocol.vocabulary import MAX_ACTIONS, Action, Outcome
from firmware_protocol.wire import Direction, Message, Wire

PROTOCOL_MAJOR: Final = 1
"""A robot or host with another major version can't be spoken to."""
PROTOCOL_MINOR: Final = 0
"""A newer minor version only adds."""

ROBOT_COMPONENT: Final = 1
"""MAV_COMP_ID_AUTOPILOT1: the robot itself."""
REFEREE_COMPONENT: Final = 25
"""MAV_COMP_ID_USER1: the emulator's referee."""
HOST_COMPONENT: Final = 190
"""MAV_COMP_ID_MISSIONPLANNER: the host."""
HOST_SYSTEM: Final = 255
"""System id of the host."""

PARAM_TYPE_REAL32: Final = 9
"""MAV_PARAM_TYPE_REAL32: every parameter of ours has this type."""


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


class State(IntEnum):
    """State of the firmware, as in HEARTBEAT.custom_mode."""

    DISARMED = 0
    READY = 1
    DRIVING = 2
    PERFORMING = 3
    COUNTDOWN = 4
    CONTEST = 5
    STOPPED = 6


class AckResult(IntEnum):
    """Answer to a numbered message."""

    ACCEPTED = 0
    REFUSED = 1


class Reason(IntEnum):
    """Why a command was refused, or a maneuver ended."""

    NONE = 0
    DISARMED = 1
    EMERGENCY_STOP = 2
    WRONG_SESSION = 3
    BAD_VALUE = 4
    BUSY = 5
    MEMORY_FULL = 6
    NOT_FOUND = 7
    WATCHDOG = 8
    BY_COMMAND = 9
    STORAGE_FAILED = 10
    OLD_SEQUENCE = 11
    NO_REFEREE = 12


class SensorFlag(IntFlag):
    """Bits of JUNIOR_SENSORS.flags. The lowest four are the stimulus."""

    EYE_LEFT = 1
    EYE_RIGHT = 2
    ARM_LEFT = 4
    ARM_RIGHT = 8
    HELD_LEFT = 16
    HELD_RIGHT = 32
    OFF_RING_LEFT = 64
    OFF_RING_RIGHT = 128
    TRAVEL_FROM_ENCODERS = 256
    GROUND_ODOMETER = 512


class ManeuverOption(IntFlag):
    """Bits of the options of a maneuver."""

    FLOOR_REFLEX = 1
    END_ON_CHANGE = 2
    EYES = 4
    ARMS = 8
    HOLD = 16


class ContestCommand(IntEnum):
    """What JUNIOR_CONTEST asks."""

    STOP = 0
    START = 1


class Phase(IntEnum):
    """Phase of a bout."""

    IDLE = 0
    RUNNING = 1
    OVER = 2


class BoutOutcome(IntEnum):
    """How a bout ended, for Junior."""

    UNDECIDED = 0
    WIN = 1
    LOSS = 2
    DRAW = 3


class OpponentCode(IntEnum):
    """Opponents that a referee can place."""

    KEEP = 0
    FLAT_LIGHT = 1
    FLAT_HEAVY = 2
    CURVED_LIGHT = 3
    CORNER_LIGHT = 4
    POINT_LIGHT = 5
    JUNIOR = 6

    @property
    def label(self) -> str:
        """Name on the command line, as `flat-light`."""
        return self.name.lower().replace("_", "-")


Target = Annotated[int, Wire("u8", text="System addressed; 0 is all, honoured only for stop and e-stop")]
TargetComponent = Annotated[int, Wire("u8", text="Component addressed; 0 is all")]
Session = Annotated[int, Wire("u16", text="Session of the host, random, opened by JUNIOR_SESSION")]
Sequence = Annotated[int, Wire("u16", text="Number of the command within the session")]
Param7 = Annotated[float, Wire("f32", nan=True, text="Depends on the command; NaN is not given")]


# --- Standard MAVLink ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Heartbeat(Message, id=0, direction=Direction.BOTH):
    """I am here, of this type, in this state. 1 Hz from a robot; from the host at least every 50 ms while armed."""

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
    """A standard command: arm, disarm, e-stop, reboot, request or schedule a message."""

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


# --- Junior ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class JuniorSensors(Message, id=47100, direction=Direction.UP):
    """Everything Junior senses, 50 Hz unless another interval was asked for."""

    time: Annotated[float, Wire("u64", "s", 1e-6, text="Time since boot")]
    travel: Annotated[tuple[float, ...], Wire("i32", "m", 1e-3, count=2, text="Travel of the left, right wheel since boot")]
    eye: Annotated[tuple[int, ...], Wire("u16", count=2, text="ADC counts of the left, right eye")]
    floor: Annotated[tuple[int, ...], Wire("u16", count=2, text="ADC counts of the left, right floor sensor")]
    battery: Annotated[float, Wire("u16", "V", 1e-3, text="Battery voltage")]
    flags: Annotated[int, Wire("u16", enum=SensorFlag, text="Switches and decisions; the lowest four bits are the stimulus")]


@dataclass(frozen=True)
class JuniorWheels(Message, id=47101, direction=Direction.DOWN, numbered=True):
    """Turn the wheels; they stop when the time runs out. On CAN a single frame, without the session."""

    session: Session
    sequence: Sequence
    speed: Annotated[tuple[float, ...], Wire("i16", "", 1e-3, -1.0, 1.0, count=2, text="Left, right wheel, share of full")]
    duration: Annotated[float, Wire("u16", "s", 1e-3, 0.0, 5.0, text="Wheels stop after this time")]
    target_system: Target
    target_component: TargetComponent


@dataclass(frozen=True)
class JuniorManeuver(Message, id=47102, direction=Direction.DOWN, numbered=True):
    """Perform a maneuver, timed on board. The same sequence again repeats the answer, never the motion."""

    session: Session
    sequence: Sequence
    period: Annotated[float, Wire("u16", "s", 1e-3, 0.02, 5.0, text="Time an action lasts")]
    options: Annotated[int, Wire("u16", enum=ManeuverOption, maximum=31, text="Reflex, end on change, what is stimulus, hold")]
    target_system: Target
    target_component: TargetComponent
    count: Annotated[int, Wire("u8", minimum=1, maximum=MAX_ACTIONS, text="Number of actions")]
    actions: Annotated[tuple[int, ...], Wire("u8", maximum=16, count=MAX_ACTIONS, enum=Action, text="Action codes")]


@dataclass(frozen=True)
class JuniorManeuverResult(Message, id=47103, direction=Direction.UP):
    """How a maneuver went; repeated every 100 ms until acknowledged (JUNIOR_RESULT_ACK) or superseded."""

    session: Session
    sequence: Sequence
    samples: Annotated[tuple[int, ...], Wire("u16", count=8, text="Control periods an action lasted")]
    eye_left: Annotated[tuple[int, ...], Wire("u16", count=8, text="Of these, periods in which the left eye saw")]
    eye_right: Annotated[tuple[int, ...], Wire("u16", count=8, text="Likewise, right eye")]
    press_left: Annotated[tuple[float, ...], Wire("u16", "s", 1e-3, count=8, text="Longest unbroken press of the left arm")]
    press_right: Annotated[tuple[float, ...], Wire("u16", "s", 1e-3, count=8, text="Likewise, right arm")]
    travel: Annotated[
        tuple[float | None, ...],
        Wire("i16", "m", 1e-3, -32.0, 32.0, count=8, invalid=-32768, text="Travel over the ground while an arm was pressed"),
    ]
    edges_left: Annotated[tuple[int, ...], Wire("u8", count=8, text="Press edges of the left arm")]
    edges_right: Annotated[tuple[int, ...], Wire("u8", count=8, text="Likewise, right arm")]
    outcome: Annotated[int, Wire("u8", enum=Outcome, maximum=5, text="How it ended")]
    reason: Annotated[int, Wire("u8", enum=Reason, text="Why, where it was refused or stopped")]
    done: Annotated[int, Wire("u8", maximum=8, text="Actions performed to the end of their period")]
    stimulus_before: Annotated[int, Wire("u8", maximum=15, text="Eyes and arms when it began")]
    stimulus_after: Annotated[int, Wire("u8", maximum=15, text="Eyes and arms when it ended")]


@dataclass(frozen=True)
class JuniorMemoryWrite(Message, id=47104, direction=Direction.DOWN, numbered=True):
    """Store a maneuver in the robot's memory; count 0 erases the slot. Survives power-off."""

    session: Session
    sequence: Sequence
    period: Annotated[float, Wire("u16", "s", 1e-3, 0.0, 5.0, text="Time an action lasts; 0.02 s or more unless erasing")]
    options: Annotated[int, Wire("u16", enum=ManeuverOption, maximum=31, text="As in JUNIOR_MANEUVER")]
    target_system: Target
    target_component: TargetComponent
    previous: Annotated[int, Wire("u8", text="Previous stimulus; 255 is any. 255 here and in current, with count 0: erase all")]
    current: Annotated[int, Wire("u8", text="Current stimulus")]
    count: Annotated[int, Wire("u8", maximum=MAX_ACTIONS, text="Number of actions; 0 erases")]
    actions: Annotated[tuple[int, ...], Wire("u8", maximum=16, count=MAX_ACTIONS, enum=Action, text="Action codes")]


@dataclass(frozen=True)
class JuniorMemoryRead(Message, id=47105, direction=Direction.DOWN, numbered=True):
    """Ask for one slot by index or by stimuli; answered by JUNIOR_MEMORY_ENTRY, or by a refusal (NOT_FOUND)."""

    session: Session
    sequence: Sequence
    target_system: Target
    target_component: TargetComponent
    index: Annotated[int, Wire("u8", text="Used slots are numbered from 0; 255: look up by the two stimuli")]
    previous: Annotated[int, Wire("u8", text="Previous stimulus to look up; 255 is any")] = 255
    current: Annotated[int, Wire("u8", text="Current stimulus to look up")] = 0


@dataclass(frozen=True)
class JuniorMemoryEntry(Message, id=47106, direction=Direction.UP):
    """One slot of the memory, and the state of the whole table."""

    session: Session
    sequence: Sequence
    checksum: Annotated[int, Wire("u16", text="CRC-16/MCRF4XX of the used slots, in order, as stored")]
    period: Annotated[float, Wire("u16", "s", 1e-3, text="Time an action lasts")]
    options: Annotated[int, Wire("u16", enum=ManeuverOption, text="As in JUNIOR_MANEUVER")]
    used: Annotated[int, Wire("u8", text="Slots in use")]
    index: Annotated[int, Wire("u8", text="Number of this slot among the used ones, from 0")]
    previous: Annotated[int, Wire("u8", text="Previous stimulus; 255 is any")]
    current: Annotated[int, Wire("u8", text="Current stimulus")]
    count: Annotated[int, Wire("u8", maximum=MAX_ACTIONS, text="Number of actions")]
    actions: Annotated[tuple[int, ...], Wire("u8", count=MAX_ACTIONS, enum=Action, text="Action codes")]


@dataclass(frozen=True)
class JuniorContest(Message, id=47107, direction=Direction.DOWN, numbered=True):
    """Start (after a countdown) or stop autonomous play from memory; it needs no host."""

    session: Session
    sequence: Sequence
    countdown: Annotated[float, Wire("u16", "s", 1e-3, 0.0, 60.0, text="Time to the first move; sumo rules ask for 5 s")]
    target_system: Target
    target_component: TargetComponent
    command: Annotated[int, Wire("u8", maximum=1, enum=ContestCommand, text="Start or stop")]


@dataclass(frozen=True)
class JuniorAck(Message, id=47108, direction=Direction.UP):
    """The answer to every numbered message."""

    message: Annotated[int, Wire("u16", text="Id of the message answered")]
    session: Session
    sequence: Sequence
    result: Annotated[int, Wire("u8", maximum=1, enum=AckResult, text="Accepted or refused")]
    reason: Annotated[int, Wire("u8", enum=Reason, text="Why it was refused")]


@dataclass(frozen=True)
class JuniorStatus(Message, id=47109, direction=Direction.UP):
    """Counters of the robot, 1 Hz and on request."""

    time: Annotated[float, Wire("u64", "s", 1e-6, text="Time since boot")]
    maneuvers: Annotated[int, Wire("u32", text="Maneuvers begun since boot")]
    good: Annotated[int, Wire("u32", text="Good frames received")]
    bad_checksum: Annotated[int, Wire("u32", text="Frames with a bad checksum")]
    unknown: Annotated[int, Wire("u32", text="Frames refused by their header: unknown id, impossible length")]
    lost: Annotated[int, Wire("u32", text="Frames missing by their sequence number")]
    boot_count: Annotated[int, Wire("u16", text="Times the robot has started; survives power-off")]
    session: Session
    sequence: Annotated[int, Wire("u16", text="Last numbered message accepted")]
    state: Annotated[int, Wire("u8", enum=State, maximum=6, text="What the robot is doing")]
    not_signed: Annotated[int, Wire("u16", extension=True, text="Frames refused for want of a signature; stops at 65535")] = 0
    bad_signature: Annotated[int, Wire("u16", extension=True, text="Likewise, for a wrong one")] = 0
    replayed: Annotated[int, Wire("u16", extension=True, text="Likewise, for the time in it: replayed, or too old")] = 0


@dataclass(frozen=True)
class JuniorSession(Message, id=47110, direction=Direction.DOWN, numbered=True):
    """Open a session: the robot stops, disarms, and from now on takes numbered messages of this session only.

    An emergency stop stays engaged and a contest goes on. The sequence of this message is 0; the same session again is only
    acknowledged.
    """

    session: Session
    sequence: Sequence
    target_system: Target
    target_component: TargetComponent
    major: Annotated[int, Wire("u8", text="Protocol version of the host")]
    minor: Annotated[int, Wire("u8", text="Likewise, the minor version")]


@dataclass(frozen=True)
class JuniorResultAck(Message, id=47111, direction=Direction.DOWN):
    """The host has the result of this maneuver: no need to repeat it."""

    session: Session
    sequence: Sequence
    target_system: Target
    target_component: TargetComponent


# --- The referee (emulators only) ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class RefereeReset(Message, id=47300, direction=Direction.DOWN, numbered=True):
    """Begin a new bout: everybody at a fresh start pose drawn from the seed. The robot's own state is not touched."""

    seed: Annotated[int, Wire("u32", text="Start poses and noise of the bout follow from it")]
    session: Session
    sequence: Sequence
    target_system: Target
    target_component: TargetComponent
    opponent: Annotated[int, Wire("u8", maximum=6, enum=OpponentCode, text="0 keeps the present one")]


@dataclass(frozen=True)
class RefereeState(Message, id=47301, direction=Direction.UP):
    """What the referee sees, 20 Hz and on change. Poses are in the arena's frame: x right, y up, origin at the centre."""

    time: Annotated[float, Wire("u64", "s", 1e-6, text="Time of the emulation")]
    bout: Annotated[int, Wire("u32", text="Number of the bout, from 1; 0 before the first reset")]
    elapsed: Annotated[float, Wire("u32", "s", 1e-3, text="Time since the bout began")]
    junior: Annotated[tuple[float, ...], Wire("i16", "m", 1e-4, count=2, text="Position of Junior's centre: x, y")]
    junior_heading: Annotated[float, Wire("i16", "rad", 1e-4, text="-pi..pi")]
    opponent: Annotated[tuple[float, ...], Wire("i16", "m", 1e-4, count=2, text="Position of the opponent's centre: x, y")]
    opponent_heading: Annotated[float, Wire("i16", "rad", 1e-4, text="-pi..pi")]
    clearance: Annotated[float, Wire("i16", "m", 1e-4, text="From the opponent's centre to the border; negative outside")]
    phase: Annotated[int, Wire("u8", maximum=2, enum=Phase, text="Phase of the bout")]
    outcome: Annotated[int, Wire("u8", maximum=3, enum=BoutOutcome, text="How it ended, for Junior")]
    opponent_code: Annotated[int, Wire("u8", maximum=6, enum=OpponentCode, text="Who the opponent is")]


STANDARD_MESSAGES: Final[tuple[type[Message], ...]] = (
    Heartbeat, SysStatus, Ping, ParamRequestRead, ParamRequestList, ParamValue, ParamSet, MissionRequestList, MissionCount,
    ManualControl, CommandLong, CommandAck, Timesync, AutopilotVersion, Statustext,
    SetupSigning,
)  # fmt: skip
JUNIOR_MESSAGES: Final[tuple[type[Message], ...]] = (
    JuniorSensors, JuniorWheels, JuniorManeuver, JuniorManeuverResult, JuniorMemoryWrite, JuniorMemoryRead,
    JuniorMemoryEntry, JuniorContest, JuniorAck, JuniorStatus, JuniorSession, JuniorResultAck,
)  # fmt: skip
REFEREE_MESSAGES: Final[tuple[type[Message], ...]] = (RefereeReset, RefereeState)
MESSAGES: Final[dict[int, type[Message]]] = {
    message.ID: message for message in (*STANDARD_MESSAGES, *JUNIOR_MESSAGES, *REFEREE_MESSAGES)
}
"""Every message by id."""

BYTE_LINKS_ONLY: Final[frozenset[type[Message]]] = frozenset({SetupSigning})
"""Messages that CAN has no place for: nothing is signed there."""
