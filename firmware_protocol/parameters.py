"""The robot's parameters, once: the firmware's table and the documentation are generated from here.

On the wire every parameter is a REAL32 under its MAVLink name. Names are at most 16 characters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


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


PARAMETERS: Final[tuple[Parameter, ...]] = (
    Parameter(
        "SYS_ID", 1, 1, 254, "", "System id on the network, on CAN the node (up to 127); in force after a reboot", whole=True
    ),
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
    Parameter("WATCHDOG", 250, 50, 2000, "ms", "Moving, and its keeper not heard for this long: stop", whole=True),
    Parameter("STIM_ARMS", 0, 0, 1, "", "Contest: 1 counts the arms as part of the stimulus", whole=True),
    Parameter("CONTEST_MAX", 180, 0, 3600, "s", "A contest ends after this time; 0 never", whole=True),
    Parameter("BATT_LOW", 0, 0, 20000, "mV", "Warn below this; 0 never", whole=True),
    Parameter("MAN_HOLD", 100, 0, 250, "ms", "HOLD: longest time a maneuver's last action goes on; 0 not at all", whole=True),
    Parameter("WHEEL_SPEED", 400, 1, 5000, "mm/s", "Free speed of a wheel, for travel without encoders", whole=True),
    Parameter("FAIL_ENABLE", 0, 0, 1, "", "1 lets the host have parts fail (MAV_CMD_INJECT_FAILURE); 0 ends that", whole=True),
)
