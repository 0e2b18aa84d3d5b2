"""The contest: autonomous play from memory. Here with wheels whose speed is set to 0."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import Command, ContestCommand, JuniorContest, Reason, State, Timesync
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.vocabulary import Action
from hil.conformance.examples import STAY
from hil.conformance.orders import SLACK, named
from hil.conformance.probe import QUIET
from hil.conformance.registry import Group, given, require
from hil.conformance.stopping import LONG

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hil.conformance.subject import Subject

GROUP: Final = Group("contest", role=JUNIOR.name)
_EYES: Final = 4
"""Stimuli of the eyes alone."""


@contextmanager
def _playing(robot: Subject, countdown: float = 0.0, **parameters: float) -> Iterator[float]:
    """Inside, a contest goes on whose maneuvers stand still; gives the robot's time at which it was ordered, in s."""
    with robot.emptied_memory(), robot.still(STIM_ARMS=0.0, **parameters):
        for current in range(_EYES):
            robot.expect(robot.write(STAY, current=current), Reason.NONE)
        robot.arm()
        robot.forget()
        start = robot.contest(ContestCommand.START, countdown)
        robot.send(start, Timesync(0, 33))
        answer = given(robot.wait(Timesync, lambda m: m.ts1 == 33 and m.tc1 != 0, start=0), "TIMESYNC was not answered")
        robot.expect(start, Reason.NONE, "that starts")
        yield answer.tc1 * 1e-9


@GROUP.check("contest-needs-memory", rule="JUNIOR_CONTEST")
def needs_memory(robot: Subject) -> str:
    """A contest with an empty memory is refused by NOT_FOUND."""
    with robot.still(), robot.emptied_memory():
        robot.arm()
        robot.expect(robot.contest(ContestCommand.START, 5.0), Reason.NOT_FOUND, "with an empty memory")
        robot.expect_state(State.READY, "after a refused contest")
    return "it stays ready"


@GROUP.check("contest-needs-arming", rule="Stopping")
def needs_arming(robot: Subject) -> str:
    """A contest of a disarmed robot is refused."""
    with robot.still(), robot.emptied_memory():
        robot.expect(robot.write((Action.S,), current=0), Reason.NONE)
        robot.expect(robot.contest(ContestCommand.START, 5.0), Reason.DISARMED, "while disarmed")
        robot.expect_state(State.DISARMED, "after a refused contest")
    return "it stays disarmed"


@GROUP.check("contest-countdown", rule="JUNIOR_CONTEST")
def countdown(robot: Subject) -> str:
    """A contest begins when its countdown is over, and not before."""
    with robot.watching(), _playing(robot, 0.7) as begun:
        robot.expect_state(State.COUNTDOWN, "after a contest was started")
        seen = given(robot.entered(State.CONTEST, after=begun, timeout=LONG), "it did not begin") - begun
        require(0.69 <= seen <= 0.7 + SLACK, f"it began after {seen * 1e3:.0f} ms, not after 700 ms")
    return f"after {seen * 1e3:.0f} of 700 ms"


@GROUP.check("contest-stops", rule="JUNIOR_CONTEST")
def stops(robot: Subject) -> str:
    """A contest is stopped by command, in its countdown too, and by disarming."""
    for pause in (0.0, 60.0):
        with _playing(robot, pause):
            robot.spend(0.1)
            robot.expect(robot.contest(ContestCommand.STOP), Reason.NONE, "that stops")
            robot.expect_state(State.READY, "after the contest was stopped")
    with _playing(robot):
        robot.order(Command.ARM_DISARM, 0)
        robot.expect_state(State.DISARMED, "after disarming in a contest")
    with _playing(robot):
        robot.order(Command.FLIGHT_TERMINATION, 1)
        robot.expect_state(State.STOPPED, "after an emergency stop in a contest")
    return "in the countdown, in the contest, by disarming, by emergency stop"


@GROUP.check("contest-stopped-for-all", rule="Addresses")
def stopped_for_all(robot: Subject) -> str:
    """System 0 means all, and is honoured for the end of a contest."""
    with _playing(robot):
        robot.send(robot.numbered(JuniorContest, command=0, countdown=0.0, target_system=0, target_component=0))
        robot.spend(QUIET)
        robot.expect_state(State.READY, "after all contests were stopped")
    return "it stops"


@GROUP.check("contest-ignores-silence", rule="Stopping")
def silence(robot: Subject) -> str:
    """The watchdog does not act in a contest."""
    with _playing(robot, 0.3, WATCHDOG=100.0):
        with robot.silence():
            robot.spend(0.8)
        robot.expect_state(State.CONTEST, "after a countdown and a contest of 0.8 s in silence")
    return "0.8 s of silence with WATCHDOG at 100"


@GROUP.check("contest-refuses-commands", rule="JUNIOR_CONTEST")
def refuses(robot: Subject) -> str:
    """In a contest, what would turn the wheels or change the memory is refused by BUSY."""
    for pause, state in ((60.0, State.COUNTDOWN), (0.0, State.CONTEST)):
        with _playing(robot, pause):
            robot.spend(0.05)
            for message in (robot.wheels(0.0, 0.0, 1.0), robot.maneuver(STAY), robot.write(STAY, current=5)):
                robot.expect(message, Reason.BUSY, f"in state {state.name}")
            robot.expect_state(state, "after refused commands")
    return "in the countdown, in the contest"


@GROUP.check("contest-outlives-session", rule="ROBOT_SESSION")
def outlives_session(robot: Subject) -> str:
    """A contest goes on when a new session is opened."""
    with _playing(robot):
        robot.spend(0.05)
        robot.open_session()
        robot.expect_state(State.CONTEST, "after a new session was opened")
    return "it goes on"


@GROUP.check("contest-ends", rule="CONTEST_MAX")
def ends(robot: Subject) -> str:
    """A contest ends after CONTEST_MAX seconds."""
    with robot.watching(), _playing(robot, CONTEST_MAX=1.0) as begun:
        given(robot.entered(State.CONTEST, after=begun, timeout=LONG), "it did not begin")
        seen = given(robot.entered(State.READY, after=begun, timeout=LONG), f"it went on for {LONG:g} s") - begun
        require(0.99 <= seen <= 1.01 + SLACK, f"it ended after {seen:.3f} s, not after 1 s")
    return f"after {seen:.2f} s, into {named(State, State.READY)}"
