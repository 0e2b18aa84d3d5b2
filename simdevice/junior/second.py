"""The second Junior's keeper: loads hand-written reflexes over the wire and starts a contest, then leaves it alone.

The opponent is a robot like the first, with the same firmware. It has no host while it plays.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    PROTOCOL_MAJOR,
    PROTOCOL_MINOR,
    ROBOT_COMPONENT,
    Command,
    CommandLong,
    ContestCommand,
    JuniorContest,
    JuniorMemoryWrite,
    ManeuverOption,
    ParamSet,
    RobotSession,
)
from firmware_protocol.vocabulary import ANY_STIMULUS, MAX_ACTIONS, Action, Stimulus
from firmware_protocol.wire.mavlink import MavlinkCodec

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

_SYSTEM: Final = 1
_HOST: Final = 1
"""Number of this host: there is no other on its wire."""
_PERIOD: Final = 0.1
"""Time an action lasts, in s."""
_OPTIONS: Final = ManeuverOption.FLOOR_REFLEX | ManeuverOption.END_ON_CHANGE | ManeuverOption.EYES

REFLEXES: Final[dict[Stimulus, tuple[Action, ...]]] = {
    Stimulus.NONE: (Action.LBRF,) * MAX_ACTIONS,
    Stimulus.EYE_LEFT: (Action.LSRF, Action.LBRF),
    Stimulus.EYE_RIGHT: (Action.LFRS, Action.LFRB),
    Stimulus.EYE_LEFT | Stimulus.EYE_RIGHT: (Action.FF,) * 4,
}
"""Look round; turn to what is seen; charge at what both eyes see."""


class Keeper:
    """Sets the second Junior up at the start of each bout, each time in the same way and the same number of periods."""

    def __init__(self) -> None:
        self._codec = MavlinkCodec(system=HOST_SYSTEM, component=HOST_COMPONENT)
        self._session = 0
        self._frames: list[bytes] = []

    def rest(self) -> None:
        """The second Junior is off the table."""
        self._frames.clear()

    def begin(self) -> None:
        """A bout begins: open a session, teach, end the contest of the bout before, and start one without a countdown.

        A robot in a contest takes no notice of a new session, and would go on with the maneuver it was performing; only
        disarming ends it. It is taught every time, so that the first bout begins as any other.
        """
        self._session = self._session % 0xFFFF + 1
        session = self._session
        robot = (_SYSTEM, ROBOT_COMPONENT)
        messages: list[Message] = [RobotSession(session, 0, _HOST, *robot, PROTOCOL_MAJOR, PROTOCOL_MINOR)]
        messages += [CommandLong(*robot, Command.ARM_DISARM, param1=0.0), ParamSet(*robot, "CONTEST_MAX", 0.0)]
        sequence = 0
        for stimulus, actions in REFLEXES.items():
            sequence += 1
            codes = tuple(int(action) for action in actions) + (0,) * (MAX_ACTIONS - len(actions))
            messages.append(
                JuniorMemoryWrite(
                    session=session,
                    sequence=sequence,
                    period=_PERIOD,
                    options=_OPTIONS,
                    target_system=_SYSTEM,
                    target_component=ROBOT_COMPONENT,
                    previous=ANY_STIMULUS,
                    current=int(stimulus),
                    count=len(actions),
                    actions=codes,
                )
            )
        messages += [
            CommandLong(*robot, Command.ARM_DISARM, param1=1.0, param3=float(_HOST)),
            JuniorContest(session, sequence + 1, 0.0, *robot, ContestCommand.START),
        ]
        self._frames = [self._codec.encode(message) for message in messages]

    @property
    def speaking(self) -> bool:
        """There is something to send in the next control period."""
        return bool(self._frames)

    def due(self) -> bytes:
        """What to send in this control period: one frame at a time."""
        if not self._frames:
            return b""
        return self._frames.pop(0)
