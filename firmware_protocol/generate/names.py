"""Enumerations and their entries as the dialect, the DBC and the protocol page name them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import IntFlag
from typing import TYPE_CHECKING, Final

from firmware_protocol.faults.failures import FailureType, FailureUnit
from firmware_protocol.generate.meanings import meaning
from firmware_protocol.messages import (
    ARMED_FLAG,
    GENERIC_AUTOPILOT,
    GROUND_STATION,
    ROVER,
    AckResult,
    BoutOutcome,
    BoxShape,
    Command,
    CommandResult,
    ContestCommand,
    ManeuverOption,
    OpponentCode,
    Phase,
    Reason,
    SensorFlag,
    State,
    TableKind,
)
from firmware_protocol.vocabulary import Action, MoveOption, ObservationFlag, Outcome, RobotClass, Stimulus, SwarmOutcome

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import EnumType


@dataclass(frozen=True)
class Enumeration:
    """An enumeration of the dialect.

    Attributes:
        name: Its name, as MAV_RESULT.
        text: What it is.
        entries: (name, value, meaning) in order of value; the meaning may be empty.
        bitmask: The values are bits.
    """

    name: str
    text: str
    entries: tuple[tuple[str, int, str], ...]
    bitmask: bool = False


OUR_ENUMS: Final[dict[EnumType, str]] = {
    State: "ROBOT_STATE",
    Action: "JUNIOR_ACTION",
    Stimulus: "JUNIOR_STIMULUS",
    SensorFlag: "JUNIOR_SENSOR_FLAG",
    ManeuverOption: "JUNIOR_MANEUVER_OPTION",
    Outcome: "JUNIOR_OUTCOME",
    Reason: "ROBOT_REASON",
    AckResult: "ROBOT_ACK_RESULT",
    ContestCommand: "JUNIOR_CONTEST_COMMAND",
    Phase: "REFEREE_PHASE",
    BoutOutcome: "REFEREE_BOUT_OUTCOME",
    OpponentCode: "REFEREE_OPPONENT",
    RobotClass: "SWARM_CLASS",
    MoveOption: "SWARM_MOVE_OPTION",
    ObservationFlag: "SWARM_OBSERVATION_FLAG",
    SwarmOutcome: "SWARM_OUTCOME",
    TableKind: "TABLE_KIND",
    BoxShape: "TABLE_BOX",
}
"""Our enumerations under their names in the dialect."""

_COMMANDS: Final[dict[Command, tuple[str, str]]] = {
    Command.FLIGHT_TERMINATION: ("MAV_CMD_DO_FLIGHTTERMINATION", "Emergency stop, latched until disarmed; param1 1 engages"),
    Command.PREFLIGHT_REBOOT: ("MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN", "Restart the robot; param1 1"),
    Command.ARM_DISARM: ("MAV_CMD_COMPONENT_ARM_DISARM", "param1 1 arms, 0 disarms"),
    Command.INJECT_FAILURE: (
        "MAV_CMD_INJECT_FAILURE",
        "Have unit param1 fail as param2 says; param3 which one, 0 all. Only while FAIL_ENABLE is 1",
    ),
    Command.SET_MESSAGE_INTERVAL: (
        "MAV_CMD_SET_MESSAGE_INTERVAL",
        "Send message param1 every param2 us; 0 the default rate, -1 never",
    ),
    Command.REQUEST_MESSAGE: (
        "MAV_CMD_REQUEST_MESSAGE",
        "Send message param1 once; for SWARM_OBSERVATION and SWARM_RANGES param2 is the count, param3 the asking host",
    ),
}

STANDARD_ENUMS: Final[tuple[Enumeration, ...]] = (
    Enumeration(
        "MAV_TYPE",
        "Kind of vehicle or component.",
        (
            ("MAV_TYPE_GENERIC", 0, ""),
            ("MAV_TYPE_GCS", GROUND_STATION, "Ground station"),
            ("MAV_TYPE_GROUND_ROVER", ROVER, "Robot"),
        ),
    ),
    Enumeration(
        "MAV_AUTOPILOT",
        "Kind of autopilot.",
        (
            ("MAV_AUTOPILOT_GENERIC", GENERIC_AUTOPILOT, "Robot"),
            ("MAV_AUTOPILOT_INVALID", 8, "Not an autopilot: the host, the referee, the table"),
        ),
    ),
    Enumeration(
        "MAV_MODE_FLAG",
        "Bits of base_mode.",
        (
            ("MAV_MODE_FLAG_CUSTOM_MODE_ENABLED", 1, "custom_mode holds a ROBOT_STATE"),
            ("MAV_MODE_FLAG_TEST_ENABLED", 2, ""),
            ("MAV_MODE_FLAG_AUTO_ENABLED", 4, ""),
            ("MAV_MODE_FLAG_GUIDED_ENABLED", 8, ""),
            ("MAV_MODE_FLAG_STABILIZE_ENABLED", 16, ""),
            ("MAV_MODE_FLAG_HIL_ENABLED", 32, ""),
            ("MAV_MODE_FLAG_MANUAL_INPUT_ENABLED", 64, "Takes MANUAL_CONTROL"),
            ("MAV_MODE_FLAG_SAFETY_ARMED", ARMED_FLAG, "Armed: the wheels may turn"),
        ),
        bitmask=True,
    ),
    Enumeration(
        "MAV_STATE",
        "State of a system.",
        (
            ("MAV_STATE_UNINIT", 0, ""),
            ("MAV_STATE_BOOT", 1, "Starting"),
            ("MAV_STATE_CALIBRATING", 2, ""),
            ("MAV_STATE_STANDBY", 3, "Disarmed"),
            ("MAV_STATE_ACTIVE", 4, "Armed"),
            ("MAV_STATE_CRITICAL", 5, ""),
            ("MAV_STATE_EMERGENCY", 6, "Emergency stop"),
        ),
    ),
    Enumeration(
        "MAV_SYS_STATUS_SENSOR",
        "Bits of SYS_STATUS.",
        (
            ("MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS", 0x8000, "The wheels"),
            ("MAV_SYS_STATUS_SENSOR_BATTERY", 0x2000000, "The battery; healthy above BATT_LOW"),
            ("MAV_SYS_STATUS_PREARM_CHECK", 0x10000000, "It lets itself be armed: unless stopped in an emergency"),
        ),
        bitmask=True,
    ),
    Enumeration(
        "MAV_COMPONENT",
        "Component ids.",
        (
            ("MAV_COMP_ID_ALL", 0, ""),
            ("MAV_COMP_ID_AUTOPILOT1", 1, "The robot"),
            ("MAV_COMP_ID_USER1", 25, "The emulator's referee, or table"),
            ("MAV_COMP_ID_MISSIONPLANNER", 190, "The host"),
        ),
    ),
    Enumeration("MAV_CMD", "Commands of COMMAND_LONG.", tuple((_COMMANDS[c][0], int(c), _COMMANDS[c][1]) for c in Command)),
    Enumeration(
        "FAILURE_UNIT", "What may fail.", tuple((f"FAILURE_UNIT_{unit.name}", int(unit), meaning(unit)) for unit in FailureUnit)
    ),
    Enumeration(
        "FAILURE_TYPE", "How it fails.", tuple((f"FAILURE_TYPE_{kind.name}", int(kind), meaning(kind)) for kind in FailureType)
    ),
    Enumeration("MAV_RESULT", "Answer to a command.", tuple((f"MAV_RESULT_{r.name}", int(r), "") for r in CommandResult)),
    Enumeration("MAV_PARAM_TYPE", "Type of a parameter.", (("MAV_PARAM_TYPE_REAL32", 9, "Every parameter of ours"),)),
    Enumeration(
        "MAV_SEVERITY",
        "Severity of a text.",
        tuple(
            (f"MAV_SEVERITY_{name}", value, "")
            for value, name in enumerate(("EMERGENCY", "ALERT", "CRITICAL", "ERROR", "WARNING", "NOTICE", "INFO", "DEBUG"))
        ),
    ),
    Enumeration(
        "MAV_PROTOCOL_CAPABILITY",
        "Bits of AUTOPILOT_VERSION.capabilities.",
        (
            ("MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT", 2, "Parameters may be REAL32"),
            ("MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION", 2048, "Has an emergency stop"),
            ("MAV_PROTOCOL_CAPABILITY_MAVLINK2", 8192, ""),
            ("MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST", 131072, "Parameters are converted to float by value"),
        ),
        bitmask=True,
    ),
)
"""The standard enumerations, of each the entries that are used here."""

STANDARD_FIELDS: Final[dict[tuple[str, str], str]] = {
    ("HEARTBEAT", "type"): "MAV_TYPE",
    ("HEARTBEAT", "autopilot"): "MAV_AUTOPILOT",
    ("HEARTBEAT", "custom_mode"): "ROBOT_STATE",
    ("HEARTBEAT", "base_mode"): "MAV_MODE_FLAG",
    ("HEARTBEAT", "system_status"): "MAV_STATE",
    ("SYS_STATUS", "onboard_control_sensors_present"): "MAV_SYS_STATUS_SENSOR",
    ("SYS_STATUS", "onboard_control_sensors_enabled"): "MAV_SYS_STATUS_SENSOR",
    ("SYS_STATUS", "onboard_control_sensors_health"): "MAV_SYS_STATUS_SENSOR",
    ("PARAM_VALUE", "param_type"): "MAV_PARAM_TYPE",
    ("PARAM_SET", "param_type"): "MAV_PARAM_TYPE",
    ("COMMAND_LONG", "command"): "MAV_CMD",
    ("COMMAND_ACK", "command"): "MAV_CMD",
    ("COMMAND_ACK", "result"): "MAV_RESULT",
    ("AUTOPILOT_VERSION", "capabilities"): "MAV_PROTOCOL_CAPABILITY",
    ("STATUSTEXT", "severity"): "MAV_SEVERITY",
}
"""Enumeration of the standard messages' fields."""


def enumerations() -> tuple[Enumeration, ...]:
    """Every enumeration of the dialect, standard ones first."""
    ours = []
    for enum, name in OUR_ENUMS.items():
        bitmask = issubclass(enum, IntFlag)
        text = re.split(r"\n\n", enum.__doc__ or "")[0]
        entries = tuple((f"{name}_{member.name}", int(member), meaning(member)) for member in enum if member or not bitmask)
        ours.append(Enumeration(name, " ".join(text.split()), entries, bitmask))
    return (*STANDARD_ENUMS, *ours)
