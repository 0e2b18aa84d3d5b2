"""Maneuvers that stand still: their timing, their tallies, and how they end."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import JuniorManeuverResult, ManeuverOption, ManualControl, Reason, State
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.vocabulary import MAX_ACTIONS, Outcome
from hil.conformance.examples import STAY
from hil.conformance.orders import named
from hil.conformance.registry import Group, require

if TYPE_CHECKING:
    from firmware_protocol.messages import JuniorManeuver
    from hil.conformance.subject import Subject

GROUP: Final = Group("maneuvers", role=JUNIOR.name)
_SAMPLE: Final = 0.005
"""Control period, in s."""


def _performed(robot: Subject, maneuver: JuniorManeuver, wanted: Outcome) -> JuniorManeuverResult:
    """Perform a maneuver to its end and see how it ended."""
    robot.expect(maneuver, Reason.NONE)
    result = robot.result(maneuver, maneuver.period * maneuver.count + 1.0)
    require(result.outcome == wanted, f"the outcome is {named(Outcome, result.outcome)}, not {wanted.name}")
    return result


@GROUP.check("maneuver-completes", rule="JUNIOR_MANEUVER_RESULT")
def completes(robot: Subject) -> str:
    """A maneuver goes through its actions, and its result says so."""
    robot.arm()
    for count in (1, 3, MAX_ACTIONS):
        result = _performed(robot, robot.maneuver(STAY * count, 0.05), Outcome.COMPLETED)
        require(result.done == count, f"{result.done} of {count} actions are said to be done")
        require(result.reason == Reason.NONE, f"the reason is {named(Reason, result.reason)}")
        robot.expect_state(State.READY, "after a maneuver")
    return f"1, 3 and {MAX_ACTIONS} actions"


@GROUP.check("maneuver-samples-consistent", rule="JUNIOR_MANEUVER_RESULT")
def samples(robot: Subject) -> str:
    """Each action's samples are its period in control periods, and nothing counted exceeds them."""
    robot.arm()
    for period, count in ((0.02, MAX_ACTIONS), (0.1, 4), (0.333, 2)):
        result = _performed(robot, robot.maneuver(STAY * count, period), Outcome.COMPLETED)
        total, wanted = sum(result.samples[:count]), period * count / _SAMPLE
        require(abs(total - wanted) <= count, f"{total} samples for {count} x {period * 1e3:.0f} ms, not {wanted:.0f}")
        spread = max(result.samples[:count]) - min(result.samples[:count])
        require(spread <= 2, f"the samples of equal actions are {result.samples[:count]}")
        require(not any(result.samples[count:]), f"actions that were not asked for have samples: {result.samples}")
        for seen in (result.eye_left, result.eye_right):
            require(all(a <= b for a, b in zip(seen, result.samples, strict=True)), f"{seen} of {result.samples} samples saw")
        pressed = max(*result.press_left, *result.press_right)
        require(pressed <= period + 2 * _SAMPLE, f"a press of {pressed:.3f} s in an action of {period:g} s")
    return "20, 100 and 333 ms"


@GROUP.check("result-repeated", rule="A maneuver")
def repeated(robot: Subject) -> str:
    """A result is repeated every 100 ms until it is acknowledged."""
    robot.arm()
    maneuver = robot.maneuver(STAY, 0.02)
    robot.expect(maneuver, Reason.NONE)
    robot.spend(0.75)
    count = len(robot.got(JuniorManeuverResult))
    require(6 <= count <= 9, f"it came {count} times in 0.75 s")
    return f"{count} times in 0.75 s"


@GROUP.check("result-acknowledged", rule="A maneuver", needs=("result-repeated",))
def acknowledged(robot: Subject) -> str:
    """An acknowledged result is not repeated; the acknowledgement of another one is no acknowledgement."""

    def counted(result: JuniorManeuverResult) -> int:
        robot.acknowledge(result)
        robot.spend(0.1)
        robot.forget()
        robot.spend(0.4)
        return len(robot.got(JuniorManeuverResult))

    robot.arm()
    maneuver = robot.maneuver(STAY, 0.02)
    robot.expect(maneuver, Reason.NONE)
    robot.spend(0.2)
    results = robot.got(JuniorManeuverResult)
    require(results, "no result came")
    other = JuniorManeuverResult(**{**vars(results[0]), "sequence": results[0].sequence ^ 1})
    require(counted(other) > 0, "it ended with the acknowledgement of another maneuver's result")
    count = counted(results[0])
    require(count == 0, f"it came {count} times more after it was acknowledged")
    return "silent from then on"


@GROUP.check("maneuver-replaced", rule="A maneuver")
def replaced(robot: Subject) -> str:
    """A new maneuver, or JUNIOR_WHEELS, replaces the one that is being performed."""
    robot.arm()
    for newer in (robot.maneuver, robot.wheels):
        old = robot.maneuver(STAY, 5.0)
        robot.expect(old, Reason.NONE)
        new = newer(STAY, 0.05) if newer == robot.maneuver else robot.wheels(0.0, 0.0, 0.05)
        robot.expect(new, Reason.NONE, "while a maneuver is performed")
        result = robot.result(old, 0.5)
        require(result.outcome == Outcome.REPLACED, f"the first one's outcome is {named(Outcome, result.outcome)}")
        robot.spend(0.2)
        robot.expect_state(State.READY, "when the new one is over")
        robot.forget()
    return "by JUNIOR_MANEUVER, by JUNIOR_WHEELS"


@GROUP.check("maneuver-goes-before-stick", rule="MANUAL_CONTROL")
def stick(robot: Subject) -> str:
    """MANUAL_CONTROL does not end a maneuver."""
    robot.arm()
    maneuver = robot.maneuver(STAY, 0.3)
    robot.expect(maneuver, Reason.NONE)
    robot.send(ManualControl(robot.system, x=0, r=0))
    result = robot.result(maneuver, 0.3)
    require(result.outcome == Outcome.COMPLETED, f"the outcome is {named(Outcome, result.outcome)}")
    return "it completes"


def _blinded(robot: Subject, options: int) -> JuniorManeuverResult:
    """Perform while the left eye, that sees nothing, begins to see."""
    with robot.parameters(EYE_L_ON=1023.0, EYE_HYST=0.0):
        maneuver = robot.maneuver(STAY * 2, 0.3, options)
        robot.expect(maneuver, Reason.NONE)
        robot.spend(0.1)
        robot.set_parameter("EYE_L_ON", 0.0)
        return robot.result(maneuver, 0.6)


@GROUP.check("end-on-change", rule="JUNIOR_MANEUVER", needs=("eyes-follow-threshold",))
def end_on_change(robot: Subject) -> str:
    """With END_ON_CHANGE, a maneuver ends when the stimulus changes."""
    robot.arm()
    result = _blinded(robot, ManeuverOption.END_ON_CHANGE | ManeuverOption.EYES)
    found = named(Outcome, result.outcome)
    require(result.outcome == Outcome.STIMULUS_CHANGED, f"the outcome is {found} though the left eye began to see")
    seen = (result.stimulus_before & 1, result.stimulus_after & 1)
    require(seen == (0, 1), f"the left eye before and after is {seen}, not (0, 1)")
    require(sum(result.samples) < 0.6 / _SAMPLE, "it went on to its end")
    return f"after {sum(result.samples) * _SAMPLE * 1e3:.0f} of 600 ms"


@GROUP.check("change-ignored-unasked", rule="JUNIOR_MANEUVER", needs=("eyes-follow-threshold",))
def change_ignored(robot: Subject) -> str:
    """Without END_ON_CHANGE, or with eyes that do not count, a change ends nothing."""
    robot.arm()
    for options in (ManeuverOption.EYES, ManeuverOption.END_ON_CHANGE):
        result = _blinded(robot, options)
        require(result.outcome == Outcome.COMPLETED, f"options {int(options)}: the outcome is {named(Outcome, result.outcome)}")
    return "it completes"


@GROUP.check("maneuver-holds", rule="JUNIOR_MANEUVER", needs=("maneuver-completes",))
def holds(robot: Subject) -> str:
    """With HOLD, the last action of a maneuver goes on until the next command, and for MAN_HOLD at most."""
    robot.arm()
    with robot.parameters(MAN_HOLD=250.0):
        for options, state in ((0, State.READY), (ManeuverOption.HOLD, State.DRIVING)):
            _performed(robot, robot.maneuver(STAY, 0.05, options), Outcome.COMPLETED)
            robot.expect_state(state, f"after a maneuver with options {int(options)}")
        _performed(robot, robot.maneuver(STAY, 0.05), Outcome.COMPLETED)
        robot.expect_state(State.READY, "when another maneuver has come")
        _performed(robot, robot.maneuver(STAY, 0.05, ManeuverOption.HOLD), Outcome.COMPLETED)
        robot.spend(0.3)
        robot.expect_state(State.READY, "0.3 s after a maneuver that may hold for 0.25 s")
    with robot.parameters(MAN_HOLD=0.0):
        _performed(robot, robot.maneuver(STAY, 0.05, ManeuverOption.HOLD), Outcome.COMPLETED)
        robot.expect_state(State.READY, "with MAN_HOLD 0")
    return "only when asked for, 250 ms and not at all"


@GROUP.check("floor-reflex", rule="A maneuver", needs=("floor-follows-threshold",))
def floor_reflex(robot: Subject) -> str:
    """With FLOOR_REFLEX, leaving the ring ends a maneuver by backing off and turning, for the times set."""
    robot.arm()
    with robot.still(REFLEX_BACK=100.0, REFLEX_TURN=150.0, FLOOR_INVERT=0.0, FLOOR_L_OFF=0.0, FLOOR_R_OFF=0.0):
        robot.spend(0.03)
        before = robot.clock_reading()
        result = _performed(robot, robot.maneuver(STAY, 1.0, ManeuverOption.FLOOR_REFLEX), Outcome.FLOOR_REFLEX)
        took = robot.clock_reading() - before
        require(result.done == 0, f"{result.done} actions are said to be done")
        require(0.24 <= took <= 0.9, f"it took {took:.2f} s, not 0.25 s")
        _performed(robot, robot.maneuver(STAY, 0.1), Outcome.COMPLETED)
    return "only when asked for"
