"""Questions and answers: retries, order, refusals, and that nothing is performed or delivered twice."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from peer_bench import HOST_NUMBER, QUICK, Bench, failed
from scripted_robot import sensors

from firmware_protocol.errors import EncodeError, PeerError, RefusedError
from firmware_protocol.events import Received
from firmware_protocol.messages import (
    Command,
    CommandLong,
    CommandResult,
    ContestCommand,
    JuniorContest,
    JuniorMemoryEntry,
    JuniorMemoryRead,
    JuniorMemoryWrite,
    JuniorSensors,
    JuniorWheels,
    OpponentCode,
    ParamRequestList,
    ParamRequestRead,
    ParamSet,
    ParamValue,
    Ping,
    Reason,
    RefereeReset,
    RobotStatus,
    State,
)
from firmware_protocol.peer.peer import Peer
from firmware_protocol.peer.quality import ClockComparison, Counters
from firmware_protocol.roles.junior import contest, drive, erase_memory, perform, read_memory, write_memory
from firmware_protocol.roles.referee import reset_bout
from firmware_protocol.vocabulary import ANY_STIMULUS

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.messages import CommandAck
    from firmware_protocol.peer.exchanges.exchange import Ticket


@pytest.fixture
def bench() -> Bench:
    return Bench.connected()


# --- Standard commands -----------------------------------------------------------------------------------------------


def test_a_command_is_repeated_with_its_confirmation_counted_up(bench: Bench) -> None:
    ticket = bench.peer.reboot()
    bench.wait(0.5)
    sent = [m for m in bench.take(CommandLong) if m.command == Command.PREFLIGHT_REBOOT]
    assert [message.confirmation for message in sent] == [0, 1, 2, 3]
    assert {message.param1 for message in sent} == {1.0}
    bench.command_ack(Command.PREFLIGHT_REBOOT)
    assert ticket.value().result == CommandResult.ACCEPTED
    bench.wait(1.0)
    assert not [m for m in bench.take(CommandLong) if m.command == Command.PREFLIGHT_REBOOT]


def test_a_command_without_an_answer_is_given_up_by_name(bench: Bench) -> None:
    ticket = bench.peer.reboot()
    for _ in range(8):
        bench.wait(0.5)
        bench.heartbeat()
    assert "robot 1 did not answer restarting (10 tries, 3.1 s)" in failed(ticket)
    assert isinstance(ticket.error, PeerError)


@pytest.mark.parametrize("result_code", [1, 2, 3, 4, 99])
def test_a_refused_command_says_why(bench: Bench, result_code: int) -> None:
    ticket = bench.peer.message_interval(JuniorSensors, 0.02)
    bench.wait(0.005)
    assert bench.last(CommandLong).param2 == 20000.0
    bench.command_ack(Command.SET_MESSAGE_INTERVAL, result_code)
    with pytest.raises(RefusedError, match="streaming JUNIOR_SENSORS"):
        ticket.value()


def test_commands_of_a_kind_go_one_after_the_other(bench: Bench) -> None:
    first, second = bench.peer.message_interval(JuniorSensors, 0.02), bench.peer.message_interval(RobotStatus, 1.0)
    bench.wait(0.01)
    assert [message.param1 for message in bench.take(CommandLong)] == [JuniorSensors.ID]
    bench.command_ack(Command.SET_MESSAGE_INTERVAL)
    assert (first.done, second.done) == (True, False)
    bench.wait(0.01)
    assert [message.param1 for message in bench.take(CommandLong)] == [RobotStatus.ID]
    bench.command_ack(Command.SET_MESSAGE_INTERVAL)
    assert second.done


ASKED_OF: dict[str, tuple[Callable[[Peer], Ticket[CommandAck]], Command, dict[str, Any]]] = {
    "arming": (Peer.arm, Command.ARM_DISARM, {"armed": True}),
    "disarming": (Peer.disarm, Command.ARM_DISARM, {"armed": False, "state": State.DISARMED}),
    "the emergency stop": (Peer.emergency_stop, Command.FLIGHT_TERMINATION, {"state": State.STOPPED}),
}


@pytest.mark.parametrize("name", ASKED_OF)
def test_a_state_that_is_reached_is_asked_for_once(bench: Bench, name: str) -> None:
    ask, command, said = ASKED_OF[name]
    ticket = ask(bench.peer)
    bench.wait(0.01)
    assert [m.command for m in bench.take(CommandLong)] == [command, Command.REQUEST_MESSAGE]
    bench.command_ack(command)
    assert not ticket.done
    bench.heartbeat(**said)
    assert ticket.value().command == command
    assert ticket.answered_at == bench.clock.now()
    bench.wait(1.0)
    assert not [m for m in bench.take(CommandLong) if m.command == command]
    assert bench.peer.counters.retries == 0


def test_arming_is_repeated_later_where_others_are_armed_on_the_same_line(bench: Bench) -> None:
    def armed() -> list[CommandLong]:
        return [m for m in bench.take(CommandLong) if m.command == Command.ARM_DISARM]

    bench.peer.arm(beside=0.25)
    bench.wait(0.3)
    assert len(armed()) == 1
    bench.wait(0.05)
    assert [message.confirmation for message in armed()] == [1]


def test_a_state_that_is_reached_makes_way_for_the_next_of_its_kind(bench: Bench) -> None:
    bench.peer.disarm()
    bench.peer.arm()
    bench.wait(0.01)
    bench.take(CommandLong)
    bench.command_ack(Command.ARM_DISARM)
    bench.heartbeat(state=State.DISARMED)
    assert [m.param1 for m in bench.take(CommandLong) if m.command == Command.ARM_DISARM] == [1.0]


def test_disarming_does_not_wait_for_arming(bench: Bench) -> None:
    arming = bench.peer.arm()
    bench.wait(0.01)
    assert [m.param1 for m in bench.take(CommandLong) if m.command == Command.ARM_DISARM] == [1.0]
    bench.peer.disarm()
    bench.wait(0.005)
    assert [m.param1 for m in bench.take(CommandLong) if m.command == Command.ARM_DISARM] == [0.0]
    assert "disarming has replaced arming" in failed(arming)


def test_arming_that_is_denied_to_the_host_of_a_session_says_that_another_has_the_robot(bench: Bench) -> None:
    arming = bench.peer.arm()
    bench.wait(0.005)
    assert bench.take(CommandLong)[0].param3 == HOST_NUMBER
    bench.command_ack(Command.ARM_DISARM, CommandResult.DENIED)
    assert failed(arming) == "the robot refused arming: another host has taken it over, or it has restarted"
    assert arming.reason is Reason.WRONG_SESSION


def test_arming_that_is_denied_without_a_session_is_not_allowed() -> None:
    watcher = Bench(open_session=False)
    arming = watcher.peer.arm()
    watcher.wait(0.005)
    watcher.command_ack(Command.ARM_DISARM, CommandResult.DENIED)
    assert failed(arming) == "the robot refused arming: it is not allowed or a value is out of range"
    assert arming.reason is Reason.NONE


def test_a_late_answer_to_a_repeated_command_is_not_taken_for_that_to_the_next(bench: Bench) -> None:
    bench.peer.message_interval(JuniorSensors, 0.02)
    bench.wait(0.1)  # asked twice
    bench.command_ack(Command.SET_MESSAGE_INTERVAL)
    second = bench.peer.message_interval(RobotStatus, 1.0)
    bench.wait(0.01)
    bench.command_ack(Command.SET_MESSAGE_INTERVAL)  # the second answer to the first
    assert not second.done
    bench.wait(0.2)
    assert bench.last(CommandLong).param1 == RobotStatus.ID
    bench.command_ack(Command.SET_MESSAGE_INTERVAL)
    assert second.done


def test_the_emergency_stop_waits_for_nothing(bench: Bench) -> None:
    perform(bench.peer, QUICK)
    bench.peer.arm()
    bench.wait(0.3)
    bench.sent.clear()
    bench.peer.emergency_stop()
    assert bench.peer.next_due() <= bench.clock.now()
    assert [m.command for m in bench.take(CommandLong)] == [Command.FLIGHT_TERMINATION, Command.REQUEST_MESSAGE]


# --- Requests --------------------------------------------------------------------------------------------------------


def test_a_requested_message_is_the_one_after_the_acknowledgement(bench: Bench) -> None:
    ticket = bench.peer.request(JuniorSensors)
    bench.wait(0.005)
    bench.heard(sensors(20.0))  # of the stream, older than the question
    assert not ticket.done
    bench.wait(0.005)
    bench.command_ack(Command.REQUEST_MESSAGE)
    assert not ticket.done
    bench.heard(sensors(20.01))
    assert ticket.value().time == 20.01


def test_a_requested_message_may_come_with_the_acknowledgement(bench: Bench) -> None:
    ticket = bench.peer.request(JuniorSensors)
    bench.wait(0.005)
    bench.heard(sensors(20.0))
    bench.command_ack(Command.REQUEST_MESSAGE)
    assert ticket.value().time == 20.0


def test_a_refused_request_says_so(bench: Bench) -> None:
    ticket = bench.peer.request(JuniorContest)
    bench.wait(0.005)
    bench.command_ack(Command.REQUEST_MESSAGE, CommandResult.DENIED)
    assert "the request for JUNIOR_CONTEST" in failed(ticket)


def test_disarming_takes_no_acknowledgement_from_a_request(bench: Bench) -> None:
    bench.peer.disarm()
    ticket = bench.peer.request(JuniorSensors)
    bench.wait(0.005)
    bench.command_ack(Command.REQUEST_MESSAGE)  # that of the state was lost
    bench.heard(sensors(20.0))
    assert ticket.value().time == 20.0


def test_a_ping_is_answered_by_its_own_number(bench: Bench) -> None:
    ticket = bench.peer.ping()
    bench.wait(0.005)
    number = bench.last(Ping).seq
    bench.heard(Ping(1, number + 1, 255, 190))
    bench.heard(Ping(1, number, 254, 190))
    assert not ticket.done
    bench.heard(Ping(1, number, 255, 190))
    assert ticket.done


# --- Numbered messages -----------------------------------------------------------------------------------------------


def test_a_numbered_message_is_the_same_at_every_try(bench: Bench) -> None:
    ticket = contest(bench.peer, ContestCommand.START, 2.0)
    bench.wait(0.6)
    sent = bench.take(JuniorContest)
    assert len(sent) == 4
    assert set(sent) == {JuniorContest(701, 1, 2.0, 1, 1, ContestCommand.START)}
    bench.ack(JuniorContest, 1)
    assert ticket.done


def test_numbered_messages_go_one_after_the_other_in_order(bench: Bench) -> None:
    writing = [write_memory(bench.peer, ANY_STIMULUS, k, QUICK) for k in range(3)]
    for k in range(3):
        bench.wait(0.1)
        assert {message.sequence for message in bench.take(JuniorMemoryWrite)} == {k + 1}
        bench.ack(JuniorMemoryWrite, k + 1)
        assert [ticket.done for ticket in writing] == [True] * (k + 1) + [False] * (2 - k)


def test_nothing_jumps_the_queue(bench: Bench) -> None:
    write_memory(bench.peer, ANY_STIMULUS, 0, QUICK)
    write_memory(bench.peer, ANY_STIMULUS, 1, QUICK)
    bench.wait(0.005)
    frame = Received(bench.answer_to(JuniorMemoryWrite, 1), 1, 1, 200, bench.clock.now(), b"")
    bench.peer.handle(frame)  # answered, and before the second could be sent
    write_memory(bench.peer, ANY_STIMULUS, 2, QUICK)
    bench.take(JuniorMemoryWrite)
    bench.wait(0.1)
    assert bench.take(JuniorMemoryWrite)[0].current == 1


def test_an_acknowledgement_of_something_else_is_not_taken(bench: Bench) -> None:
    ticket = erase_memory(bench.peer)
    bench.wait(0.005)
    bench.ack(JuniorMemoryWrite, 2)
    bench.ack(JuniorContest, 1)
    assert not ticket.done
    bench.ack(JuniorMemoryWrite, 1)
    assert ticket.value().sequence == 1
    assert bench.last(JuniorMemoryWrite).count == 0


@pytest.mark.parametrize("reason", [*Reason, 77])
def test_a_refusal_is_told_in_words(bench: Bench, reason: int) -> None:
    ticket = drive(bench.peer, 1.0, 1.0, 0.1)
    bench.wait(0.005)
    bench.ack(JuniorWheels, 1, 1, reason)
    if reason == Reason.WRONG_SESSION:  # it may have restarted: that is looked at first
        assert not ticket.done
        assert bench.requests() == [RobotStatus.ID]
        bench.status()
        bench.command_ack(Command.REQUEST_MESSAGE)
        bench.wait(0.1)
        assert len(bench.take(JuniorWheels)) == 1
        bench.ack(JuniorWheels, 1, 1, reason)
    assert isinstance(ticket.error, RefusedError)
    assert "the robot refused driving" in failed(ticket)
    assert ticket.reason == (reason if reason in set(Reason) else Reason.NONE)


def test_a_newer_drive_command_replaces_an_unanswered_one(bench: Bench) -> None:
    first = drive(bench.peer, 1.0, 1.0, 0.1)
    bench.wait(0.005)
    second = drive(bench.peer, 0.0, 0.0, 0.1)
    bench.wait(0.005)
    assert "newer" in failed(first)
    assert [message.sequence for message in bench.take(JuniorWheels)] == [1, 2]
    bench.ack(JuniorWheels, 2)
    assert second.done


def test_the_referee_is_asked_by_its_own_component(bench: Bench) -> None:
    robot, referee = erase_memory(bench.peer), reset_bout(bench.peer, 77, OpponentCode.FLAT_HEAVY)
    bench.wait(0.005)
    assert bench.last(RefereeReset) == RefereeReset(77, 701, 2, 1, 25, OpponentCode.FLAT_HEAVY)
    bench.ack(RefereeReset, 2)  # from the robot: it is not the one asked
    assert not referee.done
    bench.ack(RefereeReset, 2, component=25)
    assert referee.value().message == RefereeReset.ID
    assert not robot.done


def test_the_memory_is_read_by_an_entry_or_a_refusal(bench: Bench) -> None:
    read = read_memory(bench.peer, 0)
    bench.wait(0.005)
    bench.ack(JuniorMemoryRead, 1)
    assert not read.done
    entry = JuniorMemoryEntry(701, 1, 0xBEEF, 0.25, 5, 255, 190, 1, 0, 255, 0, 1, (1,) + (0,) * 7)
    bench.heard(entry)
    assert read.value() == entry
    missing = read_memory(bench.peer, previous=1, current=2)
    bench.wait(0.005)
    bench.ack(JuniorMemoryRead, 2, 1, Reason.NOT_FOUND)
    assert missing.reason is Reason.NOT_FOUND


def test_what_the_wire_cannot_carry_is_refused_where_it_is_asked(bench: Bench) -> None:
    with pytest.raises(EncodeError):
        drive(bench.peer, 2.0, 0.0, 0.1)
    with pytest.raises(EncodeError):
        bench.peer.set_parameter("A_NAME_MUCH_TOO_LONG", 1.0)
    bench.wait(0.1)
    assert bench.take(JuniorWheels) == []


def test_sequences_wrap_around(bench: Bench) -> None:
    bench.peer.numbering.sequence = 65535
    erase_memory(bench.peer)
    bench.wait(0.005)
    assert bench.last(JuniorMemoryWrite).sequence == 0


# --- Parameters ------------------------------------------------------------------------------------------------------


def value(name: str, number: float, index: int = 0, count: int = 24) -> ParamValue:
    return ParamValue(name, number, 9, count, index)


def test_a_parameter_is_read_by_name(bench: Bench) -> None:
    ticket = bench.peer.read_parameter("SPD_SLOW")
    bench.wait(0.1)
    assert len(bench.take(ParamRequestRead)) == 2
    bench.heard(value("SPD_FAST", 1.0))
    assert not ticket.done
    bench.heard(value("SPD_SLOW", 0.0))
    assert ticket.value() == 0.0


def test_an_unknown_parameter_is_told(bench: Bench) -> None:
    tickets = [bench.peer.read_parameter("NO_SUCH"), bench.peer.set_parameter("NO_SUCH", 1)]
    for ticket in tickets:
        bench.wait(0.005)
        bench.heard(value("NO_SUCH", 0.0, 0xFFFF))
        assert ticket.reason is Reason.NOT_FOUND


def test_a_parameter_is_set_when_the_robot_says_so(bench: Bench) -> None:
    ticket = bench.peer.set_parameter("SPD_SLOW", 0.3)
    bench.wait(0.005)
    assert bench.last(ParamSet).param_value == 0.3
    bench.heard(value("SPD_SLOW", 0.30000001192092896))
    assert ticket.value() == pytest.approx(0.3)


def test_a_robot_that_does_not_answer_the_setting_of_a_parameter_is_asked_whether_it_has_it(bench: Bench) -> None:
    ticket = bench.peer.set_parameter("NO_SUCH", 7.0)
    bench.wait(0.37)
    assert bench.take(ParamRequestRead) == []
    bench.wait(0.02)
    assert bench.take(ParamRequestRead) == [ParamRequestRead(1, 1, "NO_SUCH")]
    bench.heard(value("NO_SUCH", 0.0, 0xFFFF))
    assert "there is no such entry" in failed(ticket)


def test_other_values_may_answer_others_and_are_a_refusal_only_try_after_try(bench: Bench) -> None:
    ticket = bench.peer.set_parameter("SPD_SLOW", 7.0)
    bench.wait(0.005)
    for _ in range(5):  # another client reads it
        bench.heard(value("SPD_SLOW", 0.4))
    assert not ticket.done
    bench.wait(0.1)
    bench.heard(value("SPD_SLOW", 0.4))
    assert not ticket.done
    bench.wait(0.15)
    assert len(bench.take(ParamSet)) == 3
    bench.heard(value("SPD_SLOW", 0.4))
    assert "setting parameter SPD_SLOW to 7: it keeps 0.4" in failed(ticket)


def test_missing_parameters_are_asked_for_one_by_one(bench: Bench) -> None:
    ticket = bench.peer.list_parameters()
    bench.wait(0.1)
    assert len(bench.take(ParamRequestList)) == 2
    for index in (0, 1, 4):
        bench.heard(value(f"P{index}", index, index, 5))
        bench.wait(0.005)
    bench.wait(0.25)
    assert [m.param_index for m in bench.take(ParamRequestRead)][:2] == [2, 3]
    bench.heard(value("P2", 2, 2, 5))
    bench.heard(value("P2", 2, 2, 5))
    bench.heard(value("P3", 3, 3, 5))
    assert list(ticket.value().items()) == [(f"P{k}", float(k)) for k in range(5)]


# --- Latency and clocks ----------------------------------------------------------------------------------------------


def test_latency_is_measured_on_questions_asked_once(bench: Bench) -> None:
    counters = bench.peer.counters
    before = counters.answers
    bench.peer.ping()
    bench.peer.due(bench.clock.now())
    bench.clock.advance(0.03)
    bench.heard(Ping(0, 1 << 24 | 1, 255, 190))
    assert counters.answers == before + 1
    assert counters.latency == pytest.approx(0.03)
    bench.peer.ping()
    bench.wait(0.1)
    bench.heard(Ping(0, 1 << 24 | 2, 255, 190))
    assert counters.answers == before + 1
    assert counters.latency_min <= counters.latency_mean


def test_counters_start_empty() -> None:
    counters = Counters()
    assert counters.loss == 0.0
    assert counters.latency_mean != counters.latency_mean  # NaN


def test_the_clock_offset_is_the_median_of_the_quicker_half() -> None:
    clock = ClockComparison()
    assert clock.offset is None
    for k in range(40):
        question = clock.question(float(k), 1, 1)
        slow = 0.2 if k % 3 == 0 else 0.0  # one answer in three is late on its way back
        robot = question.ts1 + 3_000_000_000 + 5_000_000
        clock.answer(type(question)(robot, question.ts1), k + 0.01 + slow)
    assert clock.offset == pytest.approx(-3.0, abs=1e-6)
    clock.answer(type(question)(robot + 10**12, question.ts1), 50.0)  # twice: ignored
    assert clock.offset == pytest.approx(-3.0, abs=1e-6)
    clock.reset()
    assert clock.offset is None


def test_a_ticket_shows_what_it_is(bench: Bench) -> None:
    ticket = bench.peer.ping()
    assert "open" in repr(ticket)
    with pytest.raises(PeerError, match="no answer to a ping yet"):
        ticket.value()
    bench.wait(0.005)
    bench.heard(Ping(0, 1 << 24 | 1, 255, 190))
    assert "answered" in repr(ticket)
    refused = erase_memory(bench.peer)
    bench.wait(0.005)
    bench.ack(JuniorMemoryWrite, 1, 1, Reason.BUSY)
    assert "failed" in repr(refused)
