"""What the entries of our enumerations mean, in words for the dialect and the protocol page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.faults.failures import FailureType, FailureUnit
from firmware_protocol.messages import (
    AckResult,
    BoutOutcome,
    BoxShape,
    ContestCommand,
    ManeuverOption,
    Phase,
    Reason,
    SensorFlag,
    State,
    TableKind,
)
from firmware_protocol.vocabulary import (
    ACTIONS,
    Action,
    MoveOption,
    ObservationFlag,
    Outcome,
    RobotClass,
    Stimulus,
    SwarmOutcome,
)

if TYPE_CHECKING:
    from enum import IntEnum, IntFlag

    from firmware_protocol.wire.fields import EnumType

_MEANINGS: Final[dict[EnumType, dict[int, str]]] = {
    State: {
        State.DISARMED: "The wheels stand still; arm it first",
        State.READY: "Armed, standing still",
        State.DRIVING: "Turning the wheels as JUNIOR_WHEELS or MANUAL_CONTROL said, or a maneuver that is over (HOLD)",
        State.PERFORMING: "Performing a maneuver, or a micro-robot's move",
        State.COUNTDOWN: "A contest is about to begin",
        State.CONTEST: "Playing from memory, with no host",
        State.STOPPED: "Emergency stop, latched: disarm, then arm",
    },
    SensorFlag: {
        SensorFlag.EYE_LEFT: "The left eye sees something",
        SensorFlag.EYE_RIGHT: "The right eye sees something",
        SensorFlag.ARM_LEFT: "The left arm's switch is pressed",
        SensorFlag.ARM_RIGHT: "The right arm's switch is pressed",
        SensorFlag.HELD_LEFT: "The left arm has been pressed for ARM_HOLD without a break",
        SensorFlag.HELD_RIGHT: "The right arm likewise",
        SensorFlag.OFF_RING_LEFT: "The left floor sensor is off the ring",
        SensorFlag.OFF_RING_RIGHT: "The right floor sensor is off the ring",
        SensorFlag.TRAVEL_FROM_ENCODERS: "Travel was measured by encoders; otherwise it is added up from commands",
        SensorFlag.GROUND_ODOMETER: "A ground odometer is fitted: pressed travel is known",
    },
    ManeuverOption: {
        ManeuverOption.FLOOR_REFLEX: "Back off and turn at the border; this ends the maneuver",
        ManeuverOption.END_ON_CHANGE: "End when the stimulus is another than at the beginning",
        ManeuverOption.EYES: "The eyes are part of the stimulus",
        ManeuverOption.ARMS: "The arms are part of the stimulus",
        ManeuverOption.HOLD: "When it is over, the last action goes on until the next command, for MAN_HOLD at most",
    },
    Stimulus: {
        Stimulus.EYE_LEFT: "The left eye sees",
        Stimulus.EYE_RIGHT: "The right eye sees",
        Stimulus.ARM_LEFT: "The left arm touches",
        Stimulus.ARM_RIGHT: "The right arm touches",
    },
    Outcome: {
        Outcome.COMPLETED: "All actions were performed",
        Outcome.STIMULUS_CHANGED: "Ended early: the stimulus changed (only where asked for)",
        Outcome.FLOOR_REFLEX: "Ended by the floor reflex at the border",
        Outcome.STOPPED: "Stopped; the reason says by what",
        Outcome.REPLACED: "Another command took over",
        Outcome.REFUSED: "Never begun; the reason says why",
    },
    Reason: {
        Reason.NONE: "No reason needed",
        Reason.DISARMED: "The robot is not armed, or has been disarmed",
        Reason.EMERGENCY_STOP: "The emergency stop is latched",
        Reason.WRONG_SESSION: "Not the session that is open",
        Reason.BAD_VALUE: "A value is out of range, or a place beyond the fence",
        Reason.BUSY: "Something else goes on, as a contest",
        Reason.MEMORY_FULL: "No slot is free",
        Reason.NOT_FOUND: "There is no such slot; a fence, but no position fix",
        Reason.WATCHDOG: "The host fell silent",
        Reason.BY_COMMAND: "A command ended it",
        Reason.STORAGE_FAILED: "The memory would not take it",
        Reason.OLD_SEQUENCE: "Older than what has been accepted",
        Reason.NO_REFEREE: "Nobody here can place robots",
    },
    FailureUnit: {
        FailureUnit.SENSOR_DISTANCE_SENSOR: "1 and 2 left and right eye, 3 and 4 floor sensors, 5 and 6 arms",
        FailureUnit.SYSTEM_BATTERY: "The battery's measurement",
        FailureUnit.SYSTEM_MOTOR: "1 and 2 left and right wheel",
        FailureUnit.SYSTEM_MAVLINK_SIGNAL: "Hearing the host, as the watchdog does; commands still arrive",
    },
    FailureType: {
        FailureType.OK: "Not at all: ends a failure",
        FailureType.OFF: "Reads 0; turns no wheel; hears no host",
        FailureType.STUCK: "Reads what it read last",
        FailureType.GARBAGE: "Reads anything",
        FailureType.WRONG: "Junior knows no such failure",
        FailureType.SLOW: "A wheel gets half of its effort",
        FailureType.DELAYED: "Junior knows no such failure",
        FailureType.INTERMITTENT: "Junior knows no such failure",
    },
    AckResult: {AckResult.ACCEPTED: "Done, or begun", AckResult.REFUSED: "Not done; the reason says why"},
    ContestCommand: {ContestCommand.STOP: "Stop playing", ContestCommand.START: "Count down, then play"},
    Phase: {Phase.IDLE: "No bout", Phase.RUNNING: "A bout is on", Phase.OVER: "The bout is decided"},
    BoutOutcome: {
        BoutOutcome.UNDECIDED: "Not yet",
        BoutOutcome.WIN: "The opponent left the ring",
        BoutOutcome.LOSS: "Junior left the ring",
        BoutOutcome.DRAW: "Time ran out, or both left it together",
    },
    RobotClass: {RobotClass.RANGER: "One of those that surround", RobotClass.WILD: "One of those that are surrounded"},
    MoveOption: {
        MoveOption.BODY: "The heading is measured from the nose",
        MoveOption.STOP_ON_CONTACT: "End when something is touched ahead, or when the wheels stand although they are driven",
        MoveOption.PUSH: "Contact does not end it",
        MoveOption.BACKWARD: "Turn the tail to the heading, and drive in reverse",
        MoveOption.SENSE: "Read the ring before the observation",
        MoveOption.RANGES: "Send SWARM_RANGES, too",
    },
    ObservationFlag: {
        ObservationFlag.CONTACT_AHEAD: "It touches something ahead: within 60 degrees of its way",
        ObservationFlag.CONTACT: "It touches something",
        ObservationFlag.TOUCHES_BOX: "It touches the box",
        ObservationFlag.DEAD_RECKONING: "The position comes from the encoders alone: the last fix is older than FIX_AGE",
        ObservationFlag.RING_NOT_READ: "The ring was not read: near, seen and the counts are 0",
    },
    SwarmOutcome: {
        SwarmOutcome.NONE: "It ends no move: it was asked for",
        SwarmOutcome.ARRIVED: "The whole way was driven",
        SwarmOutcome.BLOCKED: "Contact ahead, or wheels that stand although they are driven",
        SwarmOutcome.STOPPED: "Stopped; the reason says by what",
        SwarmOutcome.REFUSED: "After it had been accepted; the reason says why: beyond the fence, or no position fix",
        SwarmOutcome.TIMED_OUT: "It took longer than it may",
        SwarmOutcome.REPLACED: "Another move took over",
    },
    TableKind: {
        TableKind.PLAIN: "Nothing but robots",
        TableKind.BOX: "A box and a goal",
        TableKind.OBSTACLES: "The walls of a room",
    },
    BoxShape: {BoxShape.NONE: "No box", BoxShape.CYLINDER: "A round one", BoxShape.CUBE: "A square one"},
}


def meaning(member: IntEnum | IntFlag) -> str:
    """What an entry means; empty where its name says it all.

    Args:
        member: An entry of one of our enumerations.
    """
    if isinstance(member, Action):
        return ACTIONS[member].meaning
    return _MEANINGS.get(type(member), {}).get(member, "")
