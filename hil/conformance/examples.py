"""The messages of each role that stand for any, where a check of every robot needs an example.

What is performed, what ends it, what is a single frame on CAN, what changes nothing: a Junior has other words for it than a
micro-robot, and the rule is the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.messages import (
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorMemoryRead,
    JuniorSensors,
    JuniorWheels,
    Reason,
    RobotStatus,
    State,
    SwarmMove,
    SwarmObservation,
    SwarmSense,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS, SWARM_PARAMETERS
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.vocabulary import MAX_ACTIONS, Action, MoveOption, Outcome, SwarmOutcome

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from enum import IntEnum

    from firmware_protocol.parameters import Parameter
    from firmware_protocol.peer.role import Role
    from firmware_protocol.wire.fields import Message
    from hil.conformance.talk import Talk

    Fields = Mapping[str, Any]

STAY: Final = (Action.S,)
"""A maneuver that stands still."""
NO_SLOT: Final = 254
"""JUNIOR_MEMORY_READ.index that no memory has: asking for it changes nothing."""
SLOW_TURN: Final = 0.5
"""TURN_SPEED of a micro-robot while a check has it turn for a while, in rad/s."""
_WHOLE: Final = 0.001
"""A speed that a move names which drives nowhere, in m/s: by that it does not fit into a single frame of CAN."""


@dataclass(frozen=True)
class Examples:
    """One role's.

    Attributes:
        role: Whose.
        parameters: Its parameters, in order.
        kept: Parameters and values that are seen to survive power-off.
        stream: A stream whose interval is set and given back.
        usual: How often that comes at its own interval: seconds, least and most.
        chatter: What it says so often that it is asked for less while a state is watched.
        requested: Messages of its own that come on request.
        result: How what it performs has ended.
        outcomes: What a result's outcome is.
        completed: The outcome of what was performed to its end.
        stopped: The outcome of what was stopped.
        refusal: Why `question` is refused.
        stands: It can perform something for a while with wheels that stand.
        under_way: What sets it in motion for so many seconds, and the state that it is in then.
        briefs: What a robot that may not move refuses.
        brief: See `Talk.brief`.
        lasting: See `Talk.lasting`.
        single: See `Talk.single`.
        question: See `Talk.question`.
        other: Another numbered message, with a sequence.
    """

    role: Role
    parameters: tuple[Parameter, ...]
    kept: Mapping[str, float]
    stream: type[Message]
    usual: tuple[float, int, int]
    chatter: tuple[type[Message], ...]
    requested: tuple[type[Message], ...]
    result: type[Message]
    outcomes: type[IntEnum]
    completed: int
    stopped: int
    refusal: Reason
    stands: bool
    under_way: tuple[tuple[Callable[[Talk], Message], State], ...]
    brief: Callable[[Talk, int | None, Fields], Message]
    lasting: Callable[[Talk, float], Message]
    single: Callable[[Talk, float, Fields], Message]
    question: Callable[[Talk, Fields], Message]
    other: Callable[[Talk, int], Message]

    def ends(self, message: Message) -> bool:
        """Whether a message of the class `result` ends something; else it was asked for."""
        return self.role.is_result(message)


# --- Junior ----------------------------------------------------------------------------------------------------------


def _stay(robot: Talk, period: float, sequence: int | None, fields: Fields) -> Message:
    actions = (int(STAY[0]), *(0,) * (MAX_ACTIONS - 1))
    said: dict[str, Any] = {"period": period, "options": 0, "count": 1, "actions": actions}
    return robot.numbered(JuniorManeuver, sequence, **(said | dict(fields)))


def _wheels(robot: Talk, seconds: float, fields: Fields) -> Message:
    said: dict[str, Any] = {"speed": (0.0, 0.0), "duration": seconds}
    return robot.numbered(JuniorWheels, **(said | dict(fields)))


def _read(robot: Talk, fields: Fields) -> Message:
    said: dict[str, Any] = {"index": NO_SLOT}
    return robot.numbered(JuniorMemoryRead, **(said | dict(fields)))


# --- the micro-robot -------------------------------------------------------------------------------------------------

_NO_MOVE: Final[dict[str, Any]] = {
    "heading": 0.0, "distance": 0.0, "face": None, "speed": 0.0, "sector": 0, "sectors": 0, "effort": 0,
    "options": int(MoveOption.BODY),
}  # fmt: skip
"""A move to where it stands, as it stands."""


def _no_move(robot: Talk, sequence: int | None, fields: Fields) -> Message:
    return robot.numbered(SwarmMove, sequence, **(_NO_MOVE | {"speed": _WHOLE} | dict(fields)))


def _turn(robot: Talk, seconds: float) -> Message:
    """A turn on the spot that takes so long at `SLOW_TURN`."""
    angle = SLOW_TURN * seconds + robot.parameters_found.get("ARRIVE_ANGLE", 0.0)
    return robot.numbered(SwarmMove, **(_NO_MOVE | {"speed": _WHOLE, "heading": angle}))


def _no_move_frame(robot: Talk, _: float, fields: Fields) -> Message:
    return robot.numbered(SwarmMove, **(_NO_MOVE | dict(fields)))


def _nowhere(robot: Talk, fields: Fields) -> Message:
    """A move that says no way: neither heading nor sector."""
    return robot.numbered(SwarmMove, **(_NO_MOVE | {"speed": _WHOLE, "heading": None} | dict(fields)))


def _sense(robot: Talk, sequence: int) -> Message:
    return robot.numbered(SwarmSense, sequence, radius=0.2, increment=0.0, limit=0.0, sectors=8, ranges=0)


JUNIOR_EXAMPLES: Final = Examples(
    role=JUNIOR,
    parameters=JUNIOR_PARAMETERS,
    kept={"SPD_SLOW": 0.311, "WATCHDOG": 333.0},
    stream=JuniorSensors,
    usual=(0.5, 23, 27),
    chatter=(JuniorSensors,),
    requested=(JuniorSensors,),
    result=JuniorManeuverResult,
    outcomes=Outcome,
    completed=Outcome.COMPLETED,
    stopped=Outcome.STOPPED,
    refusal=Reason.NOT_FOUND,
    stands=True,
    under_way=(
        (lambda robot: _wheels(robot, 5.0, {}), State.DRIVING),
        (lambda robot: _stay(robot, 5.0, None, {}), State.PERFORMING),
    ),
    brief=lambda robot, sequence, fields: _stay(robot, 0.02, sequence, fields),
    lasting=lambda robot, seconds: _stay(robot, seconds, None, {}),
    single=_wheels,
    question=_read,
    other=lambda robot, sequence: robot.numbered(JuniorMemoryRead, sequence, index=NO_SLOT),
)
MICRO_EXAMPLES: Final = Examples(
    role=MICRO_ROBOT,
    parameters=SWARM_PARAMETERS,
    kept={"MOVE_SPEED": 0.311, "WATCHDOG": 333.0},
    stream=RobotStatus,
    usual=(3.3, 3, 4),
    chatter=(),
    requested=(SwarmObservation,),
    result=SwarmObservation,
    outcomes=SwarmOutcome,
    completed=SwarmOutcome.ARRIVED,
    stopped=SwarmOutcome.STOPPED,
    refusal=Reason.BAD_VALUE,
    stands=False,
    under_way=((lambda robot: _turn(robot, 5.0), State.PERFORMING),),
    brief=_no_move,
    lasting=_turn,
    single=_no_move_frame,
    question=_nowhere,
    other=_sense,
)
EXAMPLES: Final[Mapping[int, Examples]] = {
    examples.role.product: examples for examples in (JUNIOR_EXAMPLES, MICRO_EXAMPLES) if examples.role.product is not None
}
"""Those of every role, by AUTOPILOT_VERSION.product_id."""
