"""What the wheels really do. The only checks in which they turn; most turn on the spot, slowly and not for long."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import (
    Command,
    ContestCommand,
    JuniorManeuver,
    JuniorSensors,
    ManualControl,
    Reason,
    State,
)
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.vocabulary import Action
from hil.conformance.registry import Group, given, require

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil.conformance.subject import Subject

GROUP: Final = Group("wheels", role=JUNIOR.name)
_TURN: Final = 0.35
"""Effort of a turn on the spot."""
_STILL: Final = 0.004
"""Travel of a wheel that stands, at most, in m: sensors jitter."""
_MOVED: Final = 0.006
"""Travel of a wheel that turned, at least, in m."""
_COAST: Final = 0.4
"""How long a body takes to come to rest, in s."""
_LOOK: Final = 0.3
"""How long to see whether wheels stand, in s."""


def _travel(robot: Subject) -> tuple[float, float]:
    """Travel of both wheels since boot, in m."""
    sensors = given(robot.requested(JuniorSensors), "JUNIOR_SENSORS was requested and did not come")
    return sensors.travel[0], sensors.travel[1]


def _moved(robot: Subject, act: Callable[[], None]) -> tuple[float, float]:
    """How far the wheels travel while something is done, until they rest, in m."""
    before = _travel(robot)
    act()
    robot.spend(_COAST)
    after = _travel(robot)
    return after[0] - before[0], after[1] - before[1]


def _expect_rest(robot: Subject, when: str) -> None:
    """See that the wheels stand, once the body has come to rest."""
    robot.spend(_COAST)
    left, right = _moved(robot, lambda: robot.spend(_LOOK))
    require(max(abs(left), abs(right)) <= _STILL, f"{when} the wheels travel on: {_words((left, right))}")


def _words(travel: tuple[float, float]) -> str:
    return f"left {travel[0] * 1e3:+.0f} mm, right {travel[1] * 1e3:+.0f} mm"


def _expect_signs(found: tuple[float, float], wanted: tuple[int, int], what: str) -> None:
    for travel, sign in zip(found, wanted, strict=True):
        good = abs(travel) < _MOVED if sign == 0 else travel * sign >= _MOVED
        require(good, f"{what}: {_words(found)}")


@GROUP.check("wheels-turn-as-told", rule="JUNIOR_WHEELS", moving=True)
def as_told(robot: Subject) -> str:
    """JUNIOR_WHEELS turns the left and the right wheel; positive is forward."""
    robot.arm()
    for left, right in ((-1, 1), (1, -1)):

        def drive(left: int = left, right: int = right) -> None:
            robot.expect(robot.wheels(left * _TURN, right * _TURN, 0.2), Reason.NONE)
            robot.spend(0.2)

        found = _moved(robot, drive)
        _expect_signs(found, (left, right), f"told to turn {'left' if left < 0 else 'right'}")
    return _words(found)


@GROUP.check(
    "wheels-stand-when-stopped",
    rule="Stopping",
    moving=True,
    needs=("watchdog-stops", "wheels-run-out", "emergency-stop-latched", "new-session-disarms"),
)
def stopped(robot: Subject) -> str:
    """Stopped means no effort: after any stop the wheels stand."""

    def drive(duration: float = 5.0) -> None:
        robot.order(Command.ARM_DISARM, 0)
        robot.arm()
        robot.expect(robot.wheels(-_TURN, _TURN, duration), Reason.NONE)
        robot.spend(0.15)

    drive()
    robot.order(Command.FLIGHT_TERMINATION, 1)
    _expect_rest(robot, "after an emergency stop")
    drive()
    robot.order(Command.ARM_DISARM, 0)
    _expect_rest(robot, "after disarming")
    drive()
    robot.open_session()
    _expect_rest(robot, "after a new session")
    drive(0.2)
    _expect_rest(robot, "when their time has run out")
    drive()
    with robot.silence():
        robot.spend(0.4)
    robot.expect_state(State.READY, "after 0.4 s of silence")
    _expect_rest(robot, "after the watchdog")
    robot.expect(robot.maneuver((Action.L,), 0.15), Reason.NONE)
    robot.spend(0.2)
    _expect_rest(robot, "after a maneuver")
    return "emergency stop, disarming, new session, time, watchdog, end of a maneuver"


@GROUP.check("actions-turn-wheels", rule="JUNIOR_MANEUVER", moving=True, needs=("wheels-turn-as-told",))
def actions(robot: Subject) -> str:
    """Each action turns the wheels its own way."""
    robot.arm()
    pairs = ((Action.L, Action.R), (Action.SF, Action.SB), (Action.LSRF, Action.LSRB), (Action.LFRS, Action.LBRS))
    for action in (action for pair in pairs for action in pair):

        def act(action: Action = action) -> None:
            maneuver = robot.maneuver((action,), 0.2)
            robot.expect(maneuver, Reason.NONE)
            robot.result(maneuver, 0.2)

        found = _moved(robot, act)
        wanted = action.spec.left, action.spec.right
        if 0 in wanted:  # a stalled wheel may be dragged along
            turning = wanted.index(max(wanted, key=abs))
            require(found[turning] * wanted[turning] >= _MOVED, f"{action.name}: {_words(found)}")
        else:
            _expect_signs(found, wanted, action.name)
    return f"{2 * len(pairs)} actions"


@GROUP.check(
    "repeated-maneuver-moves-once",
    rule="Numbered messages",
    moving=True,
    needs=("same-sequence-performs-once", "wheels-stand-when-stopped"),
)
def moves_once(robot: Subject) -> str:
    """A maneuver that is sent again moves the robot once."""
    robot.arm()
    maneuver: JuniorManeuver = robot.maneuver((Action.L,), 0.2)

    def repeat() -> None:
        robot.request(maneuver)

    def first() -> None:
        robot.expect(maneuver, Reason.NONE)
        robot.result(maneuver, 0.2)

    once = _moved(robot, first)
    again = _moved(robot, repeat)
    require(max(map(abs, once)) >= _MOVED, f"the first time: {_words(once)}")
    require(max(map(abs, again)) <= _STILL, f"the second time: {_words(again)}")
    return f"first {_words(once)}; then {_words(again)}"


@GROUP.check("disarmed-wheels-stand", rule="Stopping", moving=True, needs=("wheels-stand-when-stopped",))
def disarmed(robot: Subject) -> str:
    """Disarmed wheels never turn."""

    def order() -> None:
        robot.send(robot.wheels(-_TURN, _TURN, 0.5))
        robot.send(robot.maneuver((Action.L,), 0.5))
        for _ in range(5):
            robot.send(ManualControl(robot.system, x=0, r=350))
            robot.spend(0.04)

    found = _moved(robot, order)
    require(max(map(abs, found)) <= _STILL, _words(found))
    return _words(found)


@GROUP.check(
    "stick-turns-wheels",
    rule="MANUAL_CONTROL",
    moving=True,
    needs=("wheels-turn-as-told", "ground-station-obeyed", "ground-station-keeps"),
)
def stick(robot: Subject) -> str:
    """MANUAL_CONTROL: x is forward, r turns clockwise."""
    robot.order(Command.ARM_DISARM, 1)
    for x, r, wanted in ((0, 350, (1, -1)), (0, -350, (-1, 1)), (300, 0, (1, 1)), (-300, 0, (-1, -1))):

        def push(x: int = x, r: int = r) -> None:
            robot.send(ManualControl(robot.system, x=x, r=r))

        _expect_signs(_moved(robot, push), wanted, f"x {x}, r {r}")
    return "forward, backward, left, right"


@GROUP.check(
    "countdown-stands-then-plays",
    rule="JUNIOR_CONTEST",
    moving=True,
    needs=("contest-countdown", "actions-turn-wheels", "wheels-stand-when-stopped"),
)
def plays(robot: Subject) -> str:
    """In the countdown the wheels stand; then the robot plays what the memory says."""
    with robot.emptied_memory(), robot.parameters(STIM_ARMS=0.0):
        for current in range(4):
            robot.expect(robot.write((Action.R,), current=current, period=0.1), Reason.NONE)
        robot.arm()
        start = robot.contest(ContestCommand.START, 1.0)
        waited = _moved(robot, lambda: robot.expect(start, Reason.NONE))
        require(max(map(abs, waited)) <= _STILL, f"in the countdown: {_words(waited)}")

        def play() -> None:
            robot.spend(0.9)
            robot.expect(robot.contest(ContestCommand.STOP), Reason.NONE)

        played = _moved(robot, play)
        _expect_signs(played, (1, -1), "told by the memory to turn right")
        _expect_rest(robot, "after the contest")
    return "turned right, as the memory said"
