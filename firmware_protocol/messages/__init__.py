"""Every message on the wire, once: names, units, ranges and wire types.

Ids below 47100 are standard MAVLink. Above that are the messages of any robot (ROBOT_...) and those of a role, by the
role's name. They use SI units in Python; `scale` says what one wire unit is. Their fields are declared widest first, so
that the MAVLink payload and the CAN payload agree.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages.fields import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    REFEREE_COMPONENT,
    ROBOT_COMPONENT,
    SHARE_COMPONENT,
    TABLE_COMPONENT,
    TABLE_NODE,
    TABLE_SYSTEM,
    Asker,
    AskerComponent,
    Sequence,
    Session,
    Target,
    TargetComponent,
)
from firmware_protocol.messages.junior import (
    JUNIOR_MESSAGES,
    ContestCommand,
    JuniorContest,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorMemoryEntry,
    JuniorMemoryRead,
    JuniorMemoryWrite,
    JuniorSensors,
    JuniorWheels,
    ManeuverOption,
    SensorFlag,
)
from firmware_protocol.messages.referee import REFEREE_MESSAGES, BoutOutcome, OpponentCode, Phase, RefereeReset, RefereeState
from firmware_protocol.messages.robot import (
    ROBOT_MESSAGES,
    AckResult,
    Host,
    Reason,
    RobotAck,
    RobotAlive,
    RobotResultAck,
    RobotSession,
    RobotStatus,
    State,
)
from firmware_protocol.messages.standard import (
    ARMED_FLAG,
    GENERIC_AUTOPILOT,
    GROUND_STATION,
    PARAM_TYPE_REAL32,
    ROVER,
    SEVERITY_ERROR,
    STANDARD_MESSAGES,
    AutopilotVersion,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    ManualControl,
    MissionCount,
    MissionRequestList,
    Param7,
    ParamRequestList,
    ParamRequestRead,
    ParamSet,
    ParamValue,
    Ping,
    SetupSigning,
    Statustext,
    SysStatus,
    Timesync,
)
from firmware_protocol.messages.swarm import SWARM_MESSAGES, SwarmFix, SwarmMove, SwarmObservation, SwarmRanges, SwarmSense
from firmware_protocol.messages.table import TABLE_MESSAGES, BoxShape, TableKind, TablePlace, TableReset, TableState

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

PROTOCOL_MAJOR: Final = 2
"""A robot or host with another major version can't be spoken to."""
PROTOCOL_MINOR: Final = 1
"""A newer minor version only adds."""

MESSAGES: Final[dict[int, type[Message]]] = {
    message.ID: message
    for message in (
        *STANDARD_MESSAGES,
        *JUNIOR_MESSAGES,
        *ROBOT_MESSAGES,
        *REFEREE_MESSAGES,
        *SWARM_MESSAGES,
        *TABLE_MESSAGES,
    )
}
"""Every message by id."""
BYTE_LINKS_ONLY: Final[frozenset[type[Message]]] = frozenset({SetupSigning})
"""Messages that CAN has no place for: nothing is signed there."""

__all__ = [
    "ARMED_FLAG",
    "BYTE_LINKS_ONLY",
    "GENERIC_AUTOPILOT",
    "GROUND_STATION",
    "HOST_COMPONENT",
    "HOST_SYSTEM",
    "JUNIOR_MESSAGES",
    "MESSAGES",
    "PARAM_TYPE_REAL32",
    "PROTOCOL_MAJOR",
    "PROTOCOL_MINOR",
    "REFEREE_COMPONENT",
    "REFEREE_MESSAGES",
    "ROBOT_COMPONENT",
    "ROBOT_MESSAGES",
    "ROVER",
    "SEVERITY_ERROR",
    "SHARE_COMPONENT",
    "STANDARD_MESSAGES",
    "SWARM_MESSAGES",
    "TABLE_COMPONENT",
    "TABLE_MESSAGES",
    "TABLE_NODE",
    "TABLE_SYSTEM",
    "AckResult",
    "Asker",
    "AskerComponent",
    "AutopilotVersion",
    "BoutOutcome",
    "BoxShape",
    "Command",
    "CommandAck",
    "CommandLong",
    "CommandResult",
    "ContestCommand",
    "Heartbeat",
    "Host",
    "JuniorContest",
    "JuniorManeuver",
    "JuniorManeuverResult",
    "JuniorMemoryEntry",
    "JuniorMemoryRead",
    "JuniorMemoryWrite",
    "JuniorSensors",
    "JuniorWheels",
    "ManeuverOption",
    "ManualControl",
    "MissionCount",
    "MissionRequestList",
    "OpponentCode",
    "Param7",
    "ParamRequestList",
    "ParamRequestRead",
    "ParamSet",
    "ParamValue",
    "Phase",
    "Ping",
    "Reason",
    "RefereeReset",
    "RefereeState",
    "RobotAck",
    "RobotAlive",
    "RobotResultAck",
    "RobotSession",
    "RobotStatus",
    "SensorFlag",
    "Sequence",
    "Session",
    "SetupSigning",
    "State",
    "Statustext",
    "SwarmFix",
    "SwarmMove",
    "SwarmObservation",
    "SwarmRanges",
    "SwarmSense",
    "SysStatus",
    "TableKind",
    "TablePlace",
    "TableReset",
    "TableState",
    "Target",
    "TargetComponent",
    "Timesync",
]
