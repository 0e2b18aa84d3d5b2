"""What stops a Junior's wheels by itself, and what a contest has to do with stopping; and its own answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.events import RejectReason
from firmware_protocol.messages import (
    JuniorContest,
    JuniorManeuverResult,
    JuniorMemoryEntry,
    JuniorMemoryRead,
    JuniorSensors,
    Reason,
    State,
    Timesync,
)
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.vocabulary import Action
from firmware_protocol.wire.can import layout
from firmware_protocol.wire.can.frame import CanFrame, split_records
from firmware_protocol.wire.fields import CAN
from hil.conformance.answers import askers, expect_named
from hil.conformance.can_frames import identifier
from hil.conformance.examples import STAY
from hil.conformance.probe import HOST
from hil.conformance.registry import Group, given, require
from hil.conformance.stopping import LONG, TICK, in_time

if TYPE_CHECKING:
    from hil.conformance.subject import Subject

GROUP: Final = Group("answers and stopping of a Junior", role=JUNIOR.name)
_DIGESTS: Final = (layout.SWITCHES_FUNCTION, layout.EYES_FUNCTION, layout.TRAVEL_FUNCTION)


@GROUP.check("result-addressed", rule="Answers", needs=("ack-addressed",))
def result(robot: Subject) -> str:
    """JUNIOR_MANEUVER_RESULT names who asked for the maneuver."""
    robot.need_sources()
    robot.arm()
    for who in askers(robot):
        maneuver = robot.maneuver(STAY, 0.02)

        def match(m: JuniorManeuverResult, sequence: int = maneuver.sequence) -> bool:
            return (m.session, m.sequence) == (robot.session, sequence)

        robot.acknowledge(expect_named(robot, who, maneuver, JuniorManeuverResult, match))
    return "three askers"


@GROUP.check("memory-entry-addressed", rule="Answers", needs=("ack-addressed",))
def memory_entry(robot: Subject) -> str:
    """JUNIOR_MEMORY_ENTRY names who asked."""
    robot.need_sources()
    with robot.emptied_memory():
        robot.expect(robot.write((Action.S,), current=0), Reason.NONE)
        read = robot.numbered(JuniorMemoryRead, index=0)
        for who in (*askers(robot), HOST):
            expect_named(robot, who, read, JuniorMemoryEntry, lambda m: m.sequence == read.sequence)
    return "three askers, a repetition"


@GROUP.check("watchdog-stops-driving", rule="WATCHDOG", needs=("watchdog-stops",))
def watchdog_driving(robot: Subject) -> str:
    """The watchdog stops JUNIOR_WHEELS before its time is over."""
    with robot.parameters(WATCHDOG=250.0):
        robot.arm()
        with robot.watching():
            robot.expect(robot.wheels(0.0, 0.0, 5.0), Reason.NONE)
            with robot.silence():
                last = robot.last_word()
                seen = robot.entered(State.READY, after=last, timeout=LONG)
    return in_time("it stopped", given(seen, "it went on driving with no word from its host") - last, 0.25)


@GROUP.check("wheels-run-out", rule="JUNIOR_WHEELS")
def run_out(robot: Subject) -> str:
    """JUNIOR_WHEELS holds for its time and no longer."""
    robot.arm()
    words = ""
    with robot.watching():
        for duration in (0.1, 0.4):
            robot.forget()
            robot.send(wheels := robot.wheels(0.0, 0.0, duration), Timesync(0, 66))
            reading = given(robot.wait(Timesync, lambda m: m.ts1 == 66 and m.tc1 != 0, start=0), "TIMESYNC was not answered")
            require(robot.answered(wheels, start=0) == Reason.NONE, "JUNIOR_WHEELS was not accepted")
            begun = reading.tc1 * 1e-9
            driven = given(robot.entered(State.DRIVING, after=begun - TICK, timeout=LONG), "it did not drive")
            ended = given(robot.entered(State.READY, after=driven, timeout=LONG), "it did not end")
            words = in_time("it ended", ended - begun, duration)
    return words


@GROUP.check("contest-stop-changes-nothing-else", rule="JUNIOR_CONTEST")
def idle_contest(robot: Subject) -> str:
    """Ending a contest that is not going on changes nothing."""
    robot.expect(robot.numbered(JuniorContest, command=0, countdown=0.0), Reason.NONE, "that ends no contest")
    robot.expect_state(State.DISARMED, "after the end of no contest")
    robot.arm()
    robot.expect(robot.maneuver((Action.S, Action.S), 0.3), Reason.NONE)
    robot.expect(robot.numbered(JuniorContest, command=0, countdown=0.0), Reason.NONE, "that ends no contest")
    robot.expect_state(State.PERFORMING, "after the end of no contest")
    return "disarmed, performing"


@GROUP.check("digests-together", wire=CAN, rule="The digests stand for JUNIOR_SENSORS")
def digests(robot: Subject) -> str:
    """JUNIOR_SENSORS leaves as its three digests, together and in the order of their identifiers."""
    wanted = [identifier(function, robot.system) for function in _DIGESTS]
    robot.spend(1.0)
    moments = [split_records(event.raw) for event in robot.heard if isinstance(event.message, JuniorSensors)]
    found = [[CanFrame.unpack(record).identifier for record in records] for records in moments]
    strange = [" ".join(f"{number:03X}" for number in numbers) for numbers in found if numbers != wanted]
    require(not strange, f"JUNIOR_SENSORS came as {strange[:1]}")
    apart = [
        event
        for event in robot.rejected
        if event.reason is RejectReason.INCOMPLETE and CanFrame.unpack(split_records(event.raw)[0]).identifier in wanted
    ]
    require(found and not apart, f"{len(apart)} digests came without the others of their moment, and {len(found)} with them")
    return f"{len(found)} moments"
