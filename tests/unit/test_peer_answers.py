"""Whose answer it is: what is for another host settles nothing, and a stop is believed when the robot itself says so."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
from peer_bench import HOST_NUMBER, Bench, failed
from scripted_robot import result

from firmware_protocol.errors import PeerError, RefusedError
from firmware_protocol.messages import (
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    JuniorWheels,
    Ping,
    Reason,
    RobotResultAck,
    State,
    Timesync,
)
from firmware_protocol.peer.exchanges.commands import LONGEST_PROGRESS, PROGRESS_WAIT, STATE_WAIT
from firmware_protocol.roles.junior import drive, perform
from firmware_protocol.vocabulary import Action, Maneuver

if TYPE_CHECKING:
    from firmware_protocol.peer.exchanges.exchange import Ticket

QUICK = Maneuver((Action.F,), period=0.1)
OTHERS = [(254, 190), (255, 1), (254, 1), (254, 0), (0, 1)]
OURS = [(255, 190), (0, 0), (255, 0), (0, 190)]


@pytest.fixture
def bench() -> Bench:
    return Bench.connected()


def asked(bench: Bench, which: str) -> tuple[Ticket[CommandAck], int, dict[str, Any]]:
    """Ask for what is believed by state: the ticket, the command, and what the robot says when it is so."""
    match which:
        case "arm":
            return bench.peer.arm(), Command.ARM_DISARM, {"armed": True}
        case "disarm":
            return bench.peer.disarm(), Command.ARM_DISARM, {"armed": False, "state": State.DISARMED}
        case _:
            return bench.peer.emergency_stop(), Command.FLIGHT_TERMINATION, {"armed": False, "state": State.STOPPED}


# --- For whom --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("system", "component"), OTHERS)
@pytest.mark.parametrize("said", [CommandResult.ACCEPTED, CommandResult.DENIED, CommandResult.IN_PROGRESS])
def test_an_acknowledgement_for_another_is_none_of_ours(bench: Bench, system: int, component: int, said: CommandResult) -> None:
    ticket = bench.peer.reboot()
    bench.wait(0.005)
    bench.heard(CommandAck(Command.PREFLIGHT_REBOOT, said, target_system=system, target_component=component))
    assert not bool(ticket.done)
    bench.wait(0.1)
    assert len([m for m in bench.take(CommandLong) if m.command == Command.PREFLIGHT_REBOOT]) == 2, "it is asked again in time"
    bench.command_ack(Command.PREFLIGHT_REBOOT)
    assert ticket.value().result == CommandResult.ACCEPTED


@pytest.mark.parametrize(("system", "component"), OURS)
def test_an_acknowledgement_for_us_or_for_nobody_counts(bench: Bench, system: int, component: int) -> None:
    ticket = bench.peer.reboot()
    bench.wait(0.005)
    bench.heard(CommandAck(Command.PREFLIGHT_REBOOT, 0, target_system=system, target_component=component))
    assert ticket.done


def test_numbered_answers_for_another_are_none_of_ours(bench: Bench) -> None:
    ticket = drive(bench.peer, 0.1, 0.1, 0.1)
    bench.wait(0.005)
    ack = bench.answer_to(JuniorWheels, 1, result=1, reason=Reason.BUSY)
    bench.heard(replace(ack, target_system=254))
    assert not bool(ticket.done)
    bench.heard(replace(ack, target_system=254, result=0, reason=0))
    assert not bool(ticket.done)
    bench.heard(replace(ack, result=0, reason=0))
    assert ticket.done
    assert ticket.error is None


def test_a_result_for_another_is_not_acknowledged_for_it(bench: Bench) -> None:
    assert bench.peer.session is not None
    ticket = perform(bench.peer, QUICK)
    bench.wait(0.005)
    other = replace(result(bench.peer.session, 1), target_system=254)
    bench.heard(other)
    assert not bool(ticket.done)
    assert bench.take(RobotResultAck) == []
    bench.heard(replace(other, target_system=255))
    assert ticket.done
    assert len(bench.take(RobotResultAck)) == 1


def test_a_comparison_of_clocks_for_another_moves_ours_by_nothing(bench: Bench) -> None:
    bench.wait(1.01)
    asked = bench.last(Timesync)
    before = bench.peer.clock.offset
    bench.heard(Timesync(10**12, asked.ts1, target_system=254, target_component=190))
    assert bench.peer.clock.offset == before
    bench.heard(Timesync(10**12, asked.ts1, target_system=255, target_component=190))
    assert bench.peer.clock.offset != before


def test_a_pong_for_another_program_of_our_system_is_none_of_ours(bench: Bench) -> None:
    ticket = bench.peer.ping()
    bench.wait(0.005)
    asked = bench.last(Ping)
    bench.heard(Ping(asked.time_usec, asked.seq, target_system=255, target_component=1))
    assert not bool(ticket.done)
    bench.heard(Ping(asked.time_usec, asked.seq, target_system=255, target_component=190))
    assert ticket.done


# --- IN_PROGRESS -----------------------------------------------------------------------------------------------------


def test_in_progress_prolongs_the_wait(bench: Bench) -> None:
    ticket = bench.peer.reboot()
    bench.wait(0.005)
    bench.command_ack(Command.PREFLIGHT_REBOOT, CommandResult.IN_PROGRESS)
    bench.take(CommandLong)
    bench.wait(PROGRESS_WAIT - 0.1)
    assert not [m for m in bench.take(CommandLong) if m.command == Command.PREFLIGHT_REBOOT]
    bench.command_ack(Command.PREFLIGHT_REBOOT)
    assert ticket.value().result == CommandResult.ACCEPTED


def test_in_progress_prolongs_the_wait_but_not_for_ever(bench: Bench) -> None:
    ticket = bench.peer.reboot()
    began = bench.clock.now()
    while not ticket.done and bench.clock.now() < began + 2 * LONGEST_PROGRESS:
        bench.wait(0.5)
        bench.heartbeat()
        bench.command_ack(Command.PREFLIGHT_REBOOT, CommandResult.IN_PROGRESS)
    assert "did not answer restarting" in failed(ticket)
    assert LONGEST_PROGRESS < bench.clock.now() - began < LONGEST_PROGRESS + 6


def test_a_request_may_be_in_progress_too(bench: Bench) -> None:
    ticket = bench.peer.request(Timesync)
    bench.wait(0.005)
    bench.command_ack(Command.REQUEST_MESSAGE, CommandResult.IN_PROGRESS)
    assert not bool(ticket.done)
    bench.wait(0.005)
    bench.command_ack(Command.REQUEST_MESSAGE)
    bench.heard(Timesync(1, 2, 255, 190))
    assert ticket.done


# --- By state --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("which", ["arm", "disarm", "emergency_stop"])
def test_what_is_accepted_is_done_when_the_robot_says_that_it_is_so(bench: Bench, which: str) -> None:
    ticket, command, so = asked(bench, which)
    wrong: dict[str, Any] = {"armed": which != "arm", "state": State.DRIVING}
    bench.wait(0.005)
    assert [m.command for m in bench.take(CommandLong)] == [command, Command.REQUEST_MESSAGE], "asked for in one breath"
    bench.heartbeat(**so)
    assert not ticket.done, "what it said before it has accepted does not count"
    bench.command_ack(command)
    bench.command_ack(Command.REQUEST_MESSAGE)
    assert not bool(ticket.done)
    bench.heartbeat(**wrong)
    assert not bool(ticket.done)
    bench.heartbeat(**so)
    assert ticket.value().result == CommandResult.ACCEPTED


@pytest.mark.parametrize("stop", ["disarm", "emergency_stop"])
def test_a_stop_that_is_accepted_by_another_s_order_and_lost_is_not_done(bench: Bench, stop: str) -> None:
    """The robot accepts what system 254 asked, and our frame is lost: it stays armed."""
    bench.heartbeat(armed=True)
    ticket, command, _ = asked(bench, stop)
    for _ in range(5):
        bench.wait(0.1)
        bench.heard(CommandAck(command, 0, target_system=254, target_component=1))
        bench.heartbeat(armed=True)
        assert not bool(ticket.done)
    assert bench.peer.armed is True
    assert len([m for m in bench.take(CommandLong) if m.command == command]) >= 3


@pytest.mark.parametrize("stop", ["disarm", "emergency_stop"])
def test_a_stop_that_the_robot_does_not_come_to_is_an_error_after_two_seconds(bench: Bench, stop: str) -> None:
    ticket, command, _ = asked(bench, stop)
    began = bench.clock.now()
    while not ticket.done and bench.clock.now() < began + 10:
        bench.wait(0.05)
        bench.command_ack(command)
        bench.heartbeat(armed=True, state=State.DRIVING)
    assert STATE_WAIT <= bench.clock.now() - began <= STATE_WAIT + 0.11
    assert "it says that it is driving" in failed(ticket)
    assert isinstance(ticket.error, PeerError)
    assert not isinstance(ticket.error, RefusedError)


@pytest.mark.parametrize("stop", ["disarm", "emergency_stop"])
def test_a_stop_without_an_answer_is_an_error_after_two_seconds_too(bench: Bench, stop: str) -> None:
    ticket, _, _ = asked(bench, stop)
    bench.wait(STATE_WAIT - 0.1)
    assert not bool(ticket.done)
    bench.wait(0.2)
    assert "did not answer" in failed(ticket)


def test_arming_says_whose_session_it_is(bench: Bench) -> None:
    bench.peer.arm()
    bench.wait(0.005)
    (order,) = [m for m in bench.take(CommandLong) if m.command == Command.ARM_DISARM]
    assert (order.param1, order.param3) == (1.0, HOST_NUMBER)


def test_who_only_watches_arms_as_a_ground_station_does() -> None:
    watcher = Bench(open_session=False)
    watcher.heartbeat()
    watcher.version()
    watcher.peer.arm()
    watcher.wait(0.005)
    (order,) = [m for m in watcher.take(CommandLong) if m.command == Command.ARM_DISARM]
    assert (order.param1, order.param3) == (1.0, 0.0)


def test_a_robot_of_ours_is_not_armed_before_its_session_is_open() -> None:
    bench = Bench()
    bench.heartbeat()
    assert "has not answered the handshake yet" in failed(bench.peer.arm())
    assert not [m for m in bench.take(CommandLong) if m.command == Command.ARM_DISARM]
