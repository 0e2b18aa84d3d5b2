"""The emulated referee's messages: a new bout, and what is to be seen of it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated, Final

from firmware_protocol.messages.fields import AXES, Sequence, Session, Target, TargetComponent
from firmware_protocol.wire.fields import Direction, Message, Party, Wire


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


@dataclass(frozen=True)
class RefereeReset(Message, id=47300, direction=Direction.DOWN, numbered=True, party=Party.REFEREE):
    """Begin a new bout: everybody at a fresh start pose drawn from the seed. The robot's own state is not touched."""

    seed: Annotated[int, Wire("u32", text="Start poses and noise of the bout follow from it")]
    session: Session
    sequence: Sequence
    target_system: Target
    target_component: TargetComponent
    opponent: Annotated[int, Wire("u8", enum=OpponentCode, text="0 keeps the present one")]


@dataclass(frozen=True)
class RefereeState(Message, id=47301, direction=Direction.UP, party=Party.REFEREE):
    """What the referee sees, 20 Hz and on change. Poses are in the arena's frame: x right, y up, origin at the centre."""

    time: Annotated[float, Wire("u64", "s", 1e-6, text="Time of the emulation")]
    bout: Annotated[int, Wire("u32", text="Number of the bout, from 1; 0 before the first reset")]
    elapsed: Annotated[float, Wire("u32", "s", 1e-3, text="Time since the bout began")]
    junior: Annotated[
        tuple[float, ...], Wire("i16", "m", 1e-4, count=2, elements=AXES, text="Position of Junior's centre: x, y")
    ]
    junior_heading: Annotated[float, Wire("i16", "rad", 1e-4, text="-pi..pi")]
    opponent: Annotated[
        tuple[float, ...], Wire("i16", "m", 1e-4, count=2, elements=AXES, text="Position of the opponent's centre: x, y")
    ]
    opponent_heading: Annotated[float, Wire("i16", "rad", 1e-4, text="-pi..pi")]
    clearance: Annotated[float, Wire("i16", "m", 1e-4, text="From the opponent's centre to the border; negative outside")]
    phase: Annotated[int, Wire("u8", enum=Phase, text="Phase of the bout")]
    outcome: Annotated[int, Wire("u8", enum=BoutOutcome, text="How it ended, for Junior")]
    opponent_code: Annotated[int, Wire("u8", enum=OpponentCode, text="Who the opponent is")]


REFEREE_MESSAGES: Final[tuple[type[Message], ...]] = (RefereeReset, RefereeState)
