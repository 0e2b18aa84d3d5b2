"""The parameters of a robot, by its role, once: the firmware's tables and the documentation are generated from here.

A role's order is that of the wire, and of the robot's memory: what is new is put at the end. On the wire every parameter
is a REAL32 under its MAVLink name. Names are at most 16 characters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from firmware_protocol.wire.fields import Party


@dataclass(frozen=True)
class Parameter:
    """One parameter of the robot.

    Attributes:
        name: MAVLink name.
        default: Value of a new robot.
        minimum: Least value accepted.
        maximum: Greatest value accepted.
        unit: Unit, empty for none.
        text: What it does.
        read_only: Set by the firmware, not by the host.
        whole: Only whole numbers are accepted.
    """

    name: str
    default: float
    minimum: float
    maximum: float
    unit: str
    text: str
    read_only: bool = False
    whole: bool = False


_SYS_ID: Final = Parameter(
    "SYS_ID", 1, 1, 254, "", "System id on the network, on CAN the node (up to 127); in force after a reboot", whole=True
)
_WATCHDOG: Final = Parameter(
    "WATCHDOG", 250, 50, 2000, "ms", "Moving, and its keeper not heard for this long: stop", whole=True
)
_BATT_LOW: Final = Parameter("BATT_LOW", 0, 0, 20000, "mV", "Warn below this; 0 never", whole=True)

_FAIL_ENABLE: Final = Parameter(
    "FAIL_ENABLE", 0, 0, 1, "", "1 lets the host have parts fail (MAV_CMD_INJECT_FAILURE); 0 ends that", whole=True
)

ROBOT_PARAMETERS: Final[tuple[Parameter, ...]] = (_SYS_ID, _WATCHDOG, _BATT_LOW, _FAIL_ENABLE)
"""What any robot has, whatever its role."""

JUNIOR_PARAMETERS: Final[tuple[Parameter, ...]] = (
    _SYS_ID,
    Parameter("MEM_SLOTS", 32, 1, 254, "", "Slots of the maneuver memory", read_only=True, whole=True),
    Parameter("SPD_FAST", 1.0, 0.0, 1.0, "", "Wheel speed of fast actions, share of full"),
    Parameter("SPD_MODERATE", 0.7, 0.0, 1.0, "", "Wheel speed of moderate actions"),
    Parameter("SPD_SLOW", 0.4, 0.0, 1.0, "", "Wheel speed of slow actions"),
    Parameter("SPD_TURN", 0.35, 0.0, 1.0, "", "Wheel speed of turns"),
    Parameter("TRIM_LEFT", 1.0, 0.5, 1.0, "", "Factor on the left wheel's command, to drive straight"),
    Parameter("TRIM_RIGHT", 1.0, 0.5, 1.0, "", "Factor on the right wheel's command"),
    Parameter("EYE_L_ON", 250, 0, 1023, "counts", "Left eye sees at or above this", whole=True),
    Parameter("EYE_R_ON", 250, 0, 1023, "counts", "Right eye sees at or above this", whole=True),
    Parameter("EYE_HYST", 20, 0, 500, "counts", "An eye ceases to see this much below its threshold", whole=True),
    Parameter("FLOOR_L_OFF", 500, 0, 1023, "counts", "Left floor sensor is off the ring at or above this", whole=True),
    Parameter("FLOOR_R_OFF", 500, 0, 1023, "counts", "Right floor sensor is off the ring at or above this", whole=True),
    Parameter("FLOOR_INVERT", 0, 0, 1, "", "1: off the ring is below the threshold (white border, dark ring)", whole=True),
    Parameter("ARM_DEBOUNCE", 10, 0, 100, "ms", "An arm's switch must be steady this long", whole=True),
    Parameter("ARM_HOLD", 100, 10, 5000, "ms", "An arm pressed this long without a break holds", whole=True),
    Parameter("REFLEX_BACK", 250, 0, 2000, "ms", "Floor reflex: time backing off", whole=True),
    Parameter("REFLEX_TURN", 350, 0, 2000, "ms", "Floor reflex: time turning away from the border", whole=True),
    Parameter("REFLEX_SPEED", 0.7, 0.0, 1.0, "", "Floor reflex: wheel speed backing off"),
    _WATCHDOG,
    Parameter("STIM_ARMS", 0, 0, 1, "", "Contest: 1 counts the arms as part of the stimulus", whole=True),
    Parameter("CONTEST_MAX", 180, 0, 3600, "s", "A contest ends after this time; 0 never", whole=True),
    _BATT_LOW,
    Parameter("MAN_HOLD", 100, 0, 250, "ms", "HOLD: longest time a maneuver's last action goes on; 0 not at all", whole=True),
    Parameter("WHEEL_SPEED", 400, 1, 5000, "mm/s", "Free speed of a wheel, for travel without encoders", whole=True),
    _FAIL_ENABLE,
)
"""A Junior's, in order."""

SWARM_PARAMETERS: Final[tuple[Parameter, ...]] = (
    _SYS_ID,
    _WATCHDOG,
    _BATT_LOW,
    Parameter("CLASS", 0, 0, 1, "", "What it is among the others: 0 RANGER, 1 WILD", whole=True),
    Parameter("RING", 1, 0, 1, "", "1: a ring of sensors is fitted, 0: none", read_only=True, whole=True),
    Parameter("MOVE_SPEED", 0.20, 0.01, 2.0, "m/s", "Speed of a move that names none"),
    Parameter("TURN_SPEED", 6.28, 0.1, 31.4, "rad/s", "Speed of turning on the spot"),
    Parameter(
        "SENSE_R0", 0.2, 0.0, 65.535, "m", "Least radius of the ring; 65.535: long range; SWARM_SENSE changes it till reboot"
    ),
    Parameter("SENSE_DR", 0.05, 0.0, 65.535, "m", "Increment of the radius; 0: a fixed radius; likewise"),
    Parameter("SENSE_LIMIT", 65.535, 0.0, 65.535, "m", "Greatest radius; 65.535: none; likewise"),
    Parameter("SECTORS", 8, 1, 16, "", "Sectors of the ring; likewise", whole=True),
    Parameter("RANGES", 0, 0, 32, "", "Directions in which ranges are measured; likewise", whole=True),
    Parameter("RANGE_MAX", 2.5, 0.0, 65.534, "m", "Ranges are measured so far"),
    Parameter("CONTACT_GAP", 0.002, 0.0, 0.1, "m", "What is nearer to its edge than this is in contact"),
    Parameter("STALL_TIME", 0.1, 0.01, 5.0, "s", "Wheels that are driven and stand for this long are blocked"),
    Parameter("ARRIVE_DIST", 0.002, 0.0, 0.1, "m", "A move has arrived when no more than this is left of its way"),
    Parameter("ARRIVE_ANGLE", 0.035, 0.001, 0.5, "rad", "Likewise, of a turn"),
    Parameter("FENCE_X", 0, 0.0, 32.767, "m", "The robot stays between -FENCE_X and FENCE_X; 0: no fence"),
    Parameter("FENCE_Y", 0, 0.0, 32.767, "m", "Likewise, across"),
    Parameter("FIX_AGE", 1.0, 0.01, 65.0, "s", "A position fix that is older counts as none"),
    _FAIL_ENABLE,
)
"""A micro-robot's, in order."""

PARAMETERS_OF: Final[dict[Party, tuple[Parameter, ...]]] = {
    Party.ROBOT: ROBOT_PARAMETERS,
    Party.JUNIOR: JUNIOR_PARAMETERS,
    Party.SWARM: SWARM_PARAMETERS,
}
"""The parameters of each kind of robot; of any robot, those that all have."""
