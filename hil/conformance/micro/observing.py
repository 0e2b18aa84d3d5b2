"""Observations: repeated until somebody has them, and those that are asked for."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.messages import ROBOT_COMPONENT, CommandAck, Reason, RobotResultAck, SwarmObservation, SwarmRanges
from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.vocabulary import MoveOption, ObservationFlag, SwarmOutcome
from hil.conformance.micro.drives import BODY
from hil.conformance.probe import PATIENCE, TRIES
from hil.conformance.registry import Group, given, require

if TYPE_CHECKING:
    from hil.conformance.subject import Subject

GROUP: Final = Group("observations", role=MICRO_ROBOT.name)
_INTERVALS: Final = (0.25, 0.5, 1.0, 1.0)
_JITTER: Final = 0.06
"""How much later or earlier than its interval something may be heard, in s."""
_QUIET: Final = 1.3
"""What is repeated comes again within this, in s."""
_LARGE, _SMALL = 0.5, 0.3
"""Two radii, in m."""


@GROUP.check("observation-repeated", rule="A move")
def repeated(robot: Subject) -> str:
    """The observation of a move is repeated after 250 ms, after 500 ms, and then every second."""
    robot.arm()
    robot.expect(robot.brief(), Reason.NONE)
    robot.spend(sum(_INTERVALS) + 0.3)
    stamps = [event.time for event in robot.heard if isinstance(event.message, SwarmObservation)]
    gaps = [after - before for before, after in pairwise(stamps)]
    found = ", ".join(f"{gap * 1e3:.0f}" for gap in gaps)
    right = len(gaps) == len(_INTERVALS) and all(abs(a - b) <= _JITTER for a, b in zip(gaps, _INTERVALS, strict=True))
    require(right, f"it was repeated after {found or 'no'} ms")
    return f"after {found} ms"


def _again(robot: Subject) -> int:
    """How often an observation of a move is heard from now on."""
    robot.spend(0.1)
    robot.forget()
    robot.spend(_QUIET)
    return len(robot.results())


@GROUP.check("observation-acknowledged", rule="A move", needs=("observation-repeated",))
def acknowledged(robot: Subject) -> str:
    """ROBOT_RESULT_ACK that names it ends the repetition; one that names another does not."""
    robot.arm()
    move = robot.brief()
    robot.expect(move, Reason.NONE)
    robot.spend(0.1)
    (result, *_) = given(robot.results() or None, "no observation came")
    for session, sequence in ((result.session, result.sequence ^ 1), (result.session ^ 1, result.sequence)):
        robot.send(RobotResultAck(session, sequence, robot.system, ROBOT_COMPONENT))
        require(_again(robot) > 0, "it ended with the acknowledgement of another one")
    robot.acknowledge(result)
    count = _again(robot)
    require(count == 0, f"it came {count} times more after it was acknowledged")
    return "silent from then on"


@GROUP.check("observation-superseded", rule="A move", needs=("observation-repeated",))
def superseded(robot: Subject) -> str:
    """The next numbered message ends the repetition."""
    robot.arm()
    robot.expect(robot.brief(1), Reason.NONE)
    robot.spend(0.1)
    require(robot.results(), "no observation came")
    robot.told_to_sense = True
    robot.expect(robot.examples.other(robot, 2), Reason.NONE)
    count = _again(robot)
    require(count == 0, f"it came {count} times more after another numbered message")
    return "silent after SWARM_SENSE"


@GROUP.check("observation-on-request", rule="Asking for an observation")
def on_request(robot: Subject) -> str:
    """What is asked for names the asking's count and the open session, with outcome NONE, and the asking is acknowledged."""
    for host in (0, robot.host):
        request = robot.asking(SwarmObservation, host=host)
        start = len(robot.heard)
        seen = given(
            robot.ask(request, SwarmObservation, lambda m, count=request.param2: m.sequence == count),  # type: ignore[misc]
            "it did not come with the count of the asking",
        )
        require(seen.outcome == SwarmOutcome.NONE, f"its outcome is {robot.outcome(seen)}")
        require(seen.session == robot.session, f"its session is {seen.session}, and {robot.session} is open")
        acks = [ack for ack in robot.got(CommandAck, start) if ack.command == request.command]
        require(acks and acks[0].result == 0, "the asking was not accepted by COMMAND_ACK")
    return "of a watcher, of the host"


@GROUP.check("observation-on-request-of-all", rule="Asking for an observation", needs=("observation-on-request",))
def of_all(robot: Subject) -> str:
    """Asked of all, the observations alone answer: there is no COMMAND_ACK."""
    request = robot.asking(SwarmObservation, system=0)
    start = len(robot.heard)
    for _ in range(TRIES):
        robot.send(request)
        seen = robot.wait(SwarmObservation, lambda m: m.sequence == request.param2, timeout=PATIENCE, start=start)
        if seen is not None:
            break
    require(seen is not None, "asked of all, it did not come")
    robot.spend(0.1)
    require(not robot.got(CommandAck, start), "what was asked of all was answered by COMMAND_ACK")
    return "no COMMAND_ACK"


@GROUP.check("observation-requests-kept-apart", rule="Asking for an observation", needs=("observation-on-request",))
def apart(robot: Subject) -> str:
    """A watcher's asking and the host's, at once, are both answered, each with its count."""
    for _ in range(TRIES):
        start = len(robot.heard)
        requests = robot.asking(SwarmObservation, host=robot.host), robot.asking(SwarmObservation)
        robot.send(*requests)
        robot.spend(PATIENCE)
        found = {seen.sequence for seen in robot.got(SwarmObservation, start)}
        if found >= {round(request.param2) for request in requests}:
            return "both"
    require(condition=False, detail="only one of two askings was answered")
    return ""


@GROUP.check("sense-option-reads-ring", rule="SWARM_MOVE_OPTION")
def sense_option(robot: Subject) -> str:
    """With SENSE the ring is read for a move's observation; without, its flag says that it was not."""
    robot.need_ring()
    robot.arm()
    for option, flag in ((0, ObservationFlag.RING_NOT_READ), (MoveOption.SENSE, 0)):
        move = robot.brief(options=BODY | option)
        robot.expect(move, Reason.NONE)
        found = robot.reported(move, 0.5).flags & ObservationFlag.RING_NOT_READ
        require(found == flag, f"with options {BODY | option}, the flag RING_NOT_READ is {'set' if found else 'not set'}")
    return "only when asked for"


@GROUP.check("ranges-measured", rule="SWARM_RANGES")
def ranges(robot: Subject) -> str:
    """Ranges are measured in as many directions as SWARM_SENSE says: asked for, and with a move that has RANGES."""
    robot.need_ring()
    robot.arm()
    for count in (1, 5, 32):
        robot.sense(0.2, ranges=count)
        asked = robot.asked(SwarmRanges)
        require(asked.count == count, f"told to measure {count} ranges, it says that it has measured {asked.count}")
        require(not any(asked.ranges[count:]), "ranges that were not measured are not 0")
        start = len(robot.heard)
        move: Any = robot.brief(options=BODY | MoveOption.RANGES)
        robot.expect(move, Reason.NONE)
        told = robot.wait(SwarmRanges, lambda m, number=move.sequence: m.sequence == number, start=start)  # type: ignore[misc]
        robot.reported(move, 0.5, start=start)
        require(told is not None, "SWARM_RANGES did not come with the move's observation")
    return "1, 5 and 32 directions"


@GROUP.check("watcher-moves-nothing", rule="Asking for an observation", needs=("observation-on-request",))
def watcher(robot: Subject) -> str:
    """Who only watches changes no `radius_before`; what the session's holder asks for does."""
    robot.need_ring()
    robot.sense(_LARGE)
    robot.observe(host=robot.host)
    robot.sense(_SMALL)
    other = robot.host ^ 1 or 2
    for host in (0, other, 0):
        seen = robot.observe(host=host)
        found = (seen.radius, seen.radius_before)
        words = "radius and radius_before are %g and %g m, not %g and %g m"
        require(found == (_SMALL, _LARGE), f"asked by host {host}, {words % (*found, _SMALL, _LARGE)}")
    for before in (_LARGE, _SMALL):
        found_before = robot.observe(host=robot.host).radius_before
        require(found_before == before, f"asked by the session's host, radius_before is {found_before:g} m, not {before:g} m")
    return "0 and another host, then the session's own"


@GROUP.check("move-that-sensed-moves-before", rule="Asking for an observation", needs=("watcher-moves-nothing",))
def sensed(robot: Subject) -> str:
    """The observation of a move changes `radius_before` where the ring was read for it, and else does not."""
    robot.need_ring()
    robot.arm()
    robot.sense(_LARGE)
    robot.observe(host=robot.host)
    robot.sense(_SMALL)
    for option, before in ((0, _LARGE), (MoveOption.SENSE, _SMALL)):
        move = robot.brief(options=BODY | option)
        robot.expect(move, Reason.NONE)
        robot.reported(move, 0.5)
        found = robot.observe().radius_before
        require(found == before, f"after a move with options {BODY | option}, radius_before is {found:g} m, not {before:g} m")
    return "with SENSE only"


@GROUP.check("sense-kept-until-reboot", rule="SWARM_SENSE", needs=("watcher-moves-nothing",))
def kept(robot: Subject) -> str:
    """What SWARM_SENSE says holds in the next session too, and until the robot restarts; then its parameters do."""
    robot.need_ring()
    with robot.parameters(SENSE_R0=0.125, SENSE_DR=0.0):
        robot.sense(_LARGE)
        robot.open_session()
        found = robot.observe().radius
        require(found == _LARGE, f"in the next session the radius is {found:g} m, not {_LARGE:g} m")
        robot.reboot()
        robot.told_to_sense = False
        found = robot.observe().radius
        require(found == 0.125, f"after a reboot the radius is {found:g} m, and SENSE_R0 is 0.125 m")
    return f"{_LARGE:g} m, and SENSE_R0 after a reboot"
