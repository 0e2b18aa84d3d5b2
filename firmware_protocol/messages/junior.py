"""Junior's own messages: what a sumo robot senses, does and remembers."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Annotated, Final

from firmware_protocol.messages.fields import SIDES, Asker, AskerComponent, Sequence, Session, Target, TargetComponent
from firmware_protocol.messages.robot import Reason
from firmware_protocol.vocabulary import MAX_ACTIONS, Action, Outcome
from firmware_protocol.wire.fields import Direction, Message, Party, Wire


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


@dataclass(frozen=True)
class JuniorSensors(Message, id=47100, direction=Direction.UP, party=Party.JUNIOR):
    """Everything Junior senses, 50 Hz unless another interval was asked for."""

    time: Annotated[float, Wire("u64", "s", 1e-6, text="Time since boot")]
    travel: Annotated[
        tuple[float, ...], Wire("i32", "m", 1e-3, count=2, elements=SIDES, text="Travel of the left, right wheel since boot")
    ]
    eye: Annotated[tuple[int, ...], Wire("u16", count=2, elements=SIDES, text="ADC counts of the left, right eye")]
    floor: Annotated[tuple[int, ...], Wire("u16", count=2, elements=SIDES, text="ADC counts of the left, right floor sensor")]
    battery: Annotated[float, Wire("u16", "V", 1e-3, text="Battery voltage")]
    flags: Annotated[
        int, Wire("u16", enum=SensorFlag, newer=True, text="Switches and decisions; the lowest four bits are the stimulus")
    ]


@dataclass(frozen=True)
class JuniorWheels(Message, id=47101, direction=Direction.DOWN, numbered=True, party=Party.JUNIOR):
    """Turn the wheels; they stop when the time runs out. On CAN a single frame, without the session."""

    session: Session
    sequence: Sequence
    speed: Annotated[
        tuple[float, ...], Wire("i16", "", 1e-3, -1.0, 1.0, count=2, elements=SIDES, text="Left, right wheel, share of full")
    ]
    duration: Annotated[float, Wire("u16", "s", 1e-3, 0.0, 5.0, text="Wheels stop after this time")]
    target_system: Target
    target_component: TargetComponent


@dataclass(frozen=True)
class JuniorManeuver(Message, id=47102, direction=Direction.DOWN, numbered=True, party=Party.JUNIOR):
    """Perform a maneuver, timed on board. The same sequence again repeats the answer, never the motion."""

    session: Session
    sequence: Sequence
    period: Annotated[float, Wire("u16", "s", 1e-3, 0.02, 5.0, text="Time an action lasts")]
    options: Annotated[int, Wire("u16", enum=ManeuverOption, text="Reflex, end on change, what is stimulus, hold")]
    target_system: Target
    target_component: TargetComponent
    count: Annotated[int, Wire("u8", minimum=1, maximum=MAX_ACTIONS, text="Number of actions")]
    actions: Annotated[tuple[int, ...], Wire("u8", count=MAX_ACTIONS, enum=Action, text="Action codes")]


@dataclass(frozen=True)
class JuniorManeuverResult(Message, id=47103, direction=Direction.UP, party=Party.JUNIOR):
    """How a maneuver went; repeated every 100 ms until acknowledged (ROBOT_RESULT_ACK) or superseded."""

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
    target_system: Asker
    target_component: AskerComponent
    outcome: Annotated[int, Wire("u8", enum=Outcome, text="How it ended")]
    reason: Annotated[int, Wire("u8", enum=Reason, newer=True, text="Why, where it was refused or stopped")]
    done: Annotated[int, Wire("u8", maximum=8, text="Actions performed to the end of their period")]
    stimulus_before: Annotated[int, Wire("u8", maximum=15, text="Eyes and arms when it began")]
    stimulus_after: Annotated[int, Wire("u8", maximum=15, text="Eyes and arms when it ended")]


@dataclass(frozen=True)
class JuniorMemoryWrite(Message, id=47104, direction=Direction.DOWN, numbered=True, party=Party.JUNIOR):
    """Store a maneuver in the robot's memory; count 0 erases the slot. Survives power-off."""

    session: Session
    sequence: Sequence
    period: Annotated[float, Wire("u16", "s", 1e-3, 0.0, 5.0, text="Time an action lasts; 0.02 s or more unless erasing")]
    options: Annotated[int, Wire("u16", enum=ManeuverOption, text="As in JUNIOR_MANEUVER")]
    target_system: Target
    target_component: TargetComponent
    previous: Annotated[int, Wire("u8", text="Previous stimulus; 255 is any. 255 here and in current, with count 0: erase all")]
    current: Annotated[int, Wire("u8", text="Current stimulus")]
    count: Annotated[int, Wire("u8", maximum=MAX_ACTIONS, text="Number of actions; 0 erases")]
    actions: Annotated[tuple[int, ...], Wire("u8", count=MAX_ACTIONS, enum=Action, text="Action codes")]


@dataclass(frozen=True)
class JuniorMemoryRead(Message, id=47105, direction=Direction.DOWN, numbered=True, party=Party.JUNIOR):
    """Ask for one slot by index or by stimuli; answered by JUNIOR_MEMORY_ENTRY, or by a refusal (NOT_FOUND)."""

    session: Session
    sequence: Sequence
    target_system: Target
    target_component: TargetComponent
    index: Annotated[int, Wire("u8", text="Used slots are numbered from 0; 255: look up by the two stimuli")]
    previous: Annotated[int, Wire("u8", text="Previous stimulus to look up; 255 is any")] = 255
    current: Annotated[int, Wire("u8", text="Current stimulus to look up")] = 0


@dataclass(frozen=True)
class JuniorMemoryEntry(Message, id=47106, direction=Direction.UP, party=Party.JUNIOR):
    """One slot of the memory, and the state of the whole table."""

    session: Session
    sequence: Sequence
    checksum: Annotated[int, Wire("u16", text="CRC-16/MCRF4XX of the used slots, in order, as stored")]
    period: Annotated[float, Wire("u16", "s", 1e-3, text="Time an action lasts")]
    options: Annotated[int, Wire("u16", enum=ManeuverOption, newer=True, text="As in JUNIOR_MANEUVER")]
    target_system: Asker
    target_component: AskerComponent
    used: Annotated[int, Wire("u8", text="Slots in use")]
    index: Annotated[int, Wire("u8", text="Number of this slot among the used ones, from 0")]
    previous: Annotated[int, Wire("u8", text="Previous stimulus; 255 is any")]
    current: Annotated[int, Wire("u8", text="Current stimulus")]
    count: Annotated[int, Wire("u8", maximum=MAX_ACTIONS, text="Number of actions")]
    actions: Annotated[tuple[int, ...], Wire("u8", count=MAX_ACTIONS, enum=Action, newer=True, text="Action codes")]


@dataclass(frozen=True)
class JuniorContest(Message, id=47107, direction=Direction.DOWN, numbered=True, party=Party.JUNIOR):
    """Start (after a countdown) or stop autonomous play from memory; it needs no host."""

    session: Session
    sequence: Sequence
    countdown: Annotated[float, Wire("u16", "s", 1e-3, 0.0, 60.0, text="Time to the first move; sumo rules ask for 5 s")]
    target_system: Target
    target_component: TargetComponent
    command: Annotated[int, Wire("u8", enum=ContestCommand, text="Start or stop")]


JUNIOR_MESSAGES: Final[tuple[type[Message], ...]] = (
    JuniorSensors, JuniorWheels, JuniorManeuver, JuniorManeuverResult, JuniorMemoryWrite, JuniorMemoryRead,
    JuniorMemoryEntry, JuniorContest,
)  # fmt: skip
