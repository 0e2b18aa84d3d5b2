"""Numbered messages: a session, a sequence, an answer; a repetition never acts twice."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from firmware_bench import HOST, HOST_NUMBER, SESSION, FirmwareBench, forge

from firmware_protocol.messages import (
    PROTOCOL_MAJOR,
    PROTOCOL_MINOR,
    Command,
    ContestCommand,
    JuniorManeuverResult,
    JuniorMemoryEntry,
    JuniorWheels,
    ManeuverOption,
    Reason,
    RobotAck,
    RobotSession,
    RobotStatus,
    State,
    SwarmMove,
)
from firmware_protocol.vocabulary import Action, Outcome

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message


def session_message(session: int, major: int = 2, minor: int = 0) -> RobotSession:
    return RobotSession(session, 0, HOST_NUMBER, target_system=1, target_component=1, major=major, minor=minor)


def maneuvers(bench: FirmwareBench) -> int:
    bench.command(Command.REQUEST_MESSAGE, RobotStatus.ID)
    return bench.latest(RobotStatus).maneuvers


def test_without_a_session_nothing_numbered_is_taken() -> None:
    bench = FirmwareBench()
    bench.arm()
    assert bench.ask(bench.maneuver_message((Action.FF,))) is Reason.WRONG_SESSION
    assert bench.ask(bench.maneuver_message((Action.FF,), session=0)) is Reason.WRONG_SESSION
    assert bench.wheels == (0, 0)


@pytest.mark.parametrize("minor", [0, PROTOCOL_MINOR, 255])
def test_a_host_of_any_minor_version_drives_it(minor: int) -> None:
    bench = FirmwareBench()
    assert bench.ask(session_message(SESSION, PROTOCOL_MAJOR, minor)) is Reason.NONE
    bench.opened = True
    bench.arm()
    assert bench.ask(bench.wheels_message(0.5, 0.5, 0.2)) is Reason.NONE
    assert bench.wheels != (0, 0)


def test_what_is_for_another_role_is_unknown_to_a_junior() -> None:
    bench = FirmwareBench().armed()
    bench.command(Command.REQUEST_MESSAGE, RobotStatus.ID)
    before = bench.latest(RobotStatus).unknown
    move = SwarmMove(SESSION, 1, 0.0, 0.1, None, 0.0, 1, 1, 0, 0, 0, 0)
    assert bench.ask(move) is None
    assert bench.wheels == (0, 0)
    bench.command(Command.REQUEST_MESSAGE, RobotStatus.ID)
    assert bench.latest(RobotStatus).unknown > before


def test_a_new_session_stops_and_disarms_the_same_one_does_nothing() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.FF,), 5.0)
    assert bench.ask(session_message(SESSION)) is Reason.NONE
    assert bench.state() is State.PERFORMING
    assert bench.ask(session_message(99)) is Reason.NONE
    assert bench.state() is State.DISARMED
    assert bench.wheels == (0, 0)
    bench.run(1000)
    assert not bench.got(JuniorManeuverResult), "the new host knows nothing of it"
    assert bench.latest(RobotStatus).session == 99
    bench.arm()
    assert bench.ask(bench.maneuver_message((Action.FF,))) is Reason.WRONG_SESSION
    assert bench.state() is State.READY


def test_a_new_host_is_not_told_what_the_one_before_asked_for() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.FF,), 0.05)
    bench.run(100)
    old = bench.sequence
    bench.open(99)
    bench.session = 99
    bench.clear()
    message = bench.maneuver_message((Action.FF,), sequence=old)
    assert bench.ask(message) is Reason.DISARMED
    assert bench.ask(message) is Reason.DISARMED
    bench.run(300)
    assert not bench.got(JuniorManeuverResult)


@pytest.mark.parametrize("others", [1, 2, 4])
def test_late_copies_of_an_earlier_session_perform_nothing_again(others: int) -> None:
    bench = FirmwareBench().armed()
    message = bench.maneuver_message((Action.FF,), 0.05)
    assert bench.ask(message) is Reason.NONE
    bench.run(100)
    for other in range(others):
        bench.open(100 + other)
        bench.arm()
        assert bench.ask(bench.maneuver_message((Action.S,), 0.05, sequence=1, session=100 + other)) is Reason.NONE
        bench.run(100)
    for other in range(others):
        bench.open(SESSION)
        bench.arm()
        assert bench.ask(message) is Reason.OLD_SEQUENCE
        bench.open(100 + other)
        bench.arm()
        repeated = bench.maneuver_message((Action.S,), 0.05, sequence=1, session=100 + other)
        assert bench.ask(repeated) is Reason.OLD_SEQUENCE
    assert bench.wheels == (0, 0)
    assert maneuvers(bench) == 1 + others
    bench.open(SESSION)
    bench.arm()
    assert bench.ask(bench.maneuver_message((Action.FF,), 0.05)) is Reason.NONE, "the host itself goes on"


def test_a_reboot_ends_the_session() -> None:
    bench = FirmwareBench().armed()
    bench.power_on()
    bench.arm()
    assert bench.ask(bench.maneuver_message((Action.FF,))) is Reason.WRONG_SESSION


@pytest.mark.parametrize(
    ("major", "minor", "reason"),
    [(1, 0, Reason.BAD_VALUE), (3, 0, Reason.BAD_VALUE), (0, 9, Reason.BAD_VALUE), (2, 200, Reason.NONE)],
)
def test_versions(major: int, minor: int, reason: Reason) -> None:
    bench = FirmwareBench()
    assert bench.ask(session_message(5, major, minor)) is reason
    bench.run(1000)
    assert bench.latest(RobotStatus).session == (5 if reason is Reason.NONE else 0)


def test_a_repeated_maneuver_is_answered_and_not_performed() -> None:
    bench = FirmwareBench().armed()
    message = bench.maneuver_message((Action.FF,), 0.1)
    assert bench.ask(message) is Reason.NONE
    for _ in range(5):
        assert bench.ask(message) is Reason.NONE
    bench.run(200)
    assert bench.result().samples[0] == 20
    before = len(bench.got(JuniorManeuverResult))
    assert bench.ask(message) is Reason.NONE
    assert bench.wheels == (0, 0)
    assert bench.state() is State.READY
    assert len(bench.got(JuniorManeuverResult)) == before + 1, "and the result is told again"
    assert maneuvers(bench) == 1


def test_repeated_wheels_do_not_drive_longer() -> None:
    bench = FirmwareBench().armed()
    message = bench.wheels_message(0.5, 0.5, 0.1)
    for _ in range(20):
        assert bench.ask(message) is Reason.NONE
        assert bench.wheels == (500, 500)
    assert bench.ask(message) is Reason.NONE
    assert bench.wheels == (0, 0)


def test_a_refused_message_stays_refused_when_it_is_repeated() -> None:
    bench = FirmwareBench()
    bench.open()
    message = bench.maneuver_message((Action.FF,))
    assert bench.ask(message) is Reason.DISARMED
    bench.arm()
    assert bench.ask(message) is Reason.DISARMED, (
        "a delayed copy of what was refused must not move a robot that was armed since"
    )
    assert bench.wheels == (0, 0)


def test_the_last_eight_are_answered_again_older_ones_refused() -> None:
    bench = FirmwareBench().armed()
    messages = [bench.wheels_message(0.1, 0.1, 0.01) for _ in range(12)]
    for message in messages:
        assert bench.ask(message) is Reason.NONE
    bench.run(50)
    answers = [bench.ask(message) for message in messages]
    assert answers == [Reason.OLD_SEQUENCE] * 4 + [Reason.NONE] * 8
    assert bench.wheels == (0, 0)


def test_another_message_with_a_number_that_is_taken_is_refused() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.S,), 5.0)
    assert bench.ask(bench.wheels_message(1.0, 1.0, 1.0, sequence=bench.sequence)) is Reason.OLD_SEQUENCE
    assert bench.wheels == (0, 0)


def test_numbers_may_wrap_and_may_have_gaps() -> None:
    bench = FirmwareBench().armed()
    for sequence in (0x4000, 0x7FFF, 0xFFF0, 0xFFFF, 3, 4):
        assert bench.ask(bench.wheels_message(0.1, 0.1, 0.01, sequence=sequence)) is Reason.NONE
    for old in (2, 0xFFFE, 0x8005):
        assert bench.ask(bench.wheels_message(0.1, 0.1, 0.01, sequence=old)) is Reason.OLD_SEQUENCE


def test_the_same_number_in_a_new_session_is_new() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.S,), 0.05)
    bench.run(100)
    bench.open(5)
    bench.arm()
    assert bench.ask(bench.maneuver_message((Action.S,), 0.05, sequence=1, session=5)) is Reason.NONE
    bench.run(100)
    assert maneuvers(bench) == 2


@pytest.mark.parametrize(
    "changes",
    [{"speed": (1.001, 0.0)}, {"speed": (0.0, -1.001)}, {"speed": (-32.768, 32.767)}, {"duration": 5.001}],
    ids=str,
)
def test_wheels_out_of_range_are_refused(changes: dict[str, object]) -> None:
    bench = FirmwareBench().armed()
    bench.tick(raw=forge(bench.wheels_message(0.1, 0.1, 1.0), **changes))
    assert bench.latest(RobotAck).reason == Reason.BAD_VALUE
    assert bench.wheels == (0, 0)


@pytest.mark.parametrize("changes", [{"command": 2}, {"countdown": 60.001}], ids=str)
def test_contests_that_cannot_be_are_refused(changes: dict[str, object]) -> None:
    bench = FirmwareBench().armed()
    bench.ask(bench.write_message((Action.FF,), 0))
    bench.tick(raw=forge(bench.contest_message(ContestCommand.START), **changes))
    assert bench.latest(RobotAck).reason == Reason.BAD_VALUE
    assert bench.state() is State.READY


def test_a_memory_entry_is_read_again_when_the_answer_was_lost() -> None:
    bench = FirmwareBench().armed()
    bench.ask(bench.write_message((Action.FF,), 2))
    message = bench.read_message(0)
    first = bench.tick(message)
    assert isinstance(first[0], JuniorMemoryEntry)
    assert bench.tick(message) == first


def to_everybody(message: Message) -> bytes:
    return forge(message, target_system=0)


def test_to_all_robots_only_stop_is_honoured() -> None:
    bench = FirmwareBench().armed()
    bench.ask(bench.write_message((Action.FF,), 0))
    for message in (bench.maneuver_message((Action.FF,)), bench.contest_message(ContestCommand.START), session_message(3)):
        assert bench.tick(raw=to_everybody(message)) == []
    assert bench.state() is State.READY
    assert bench.ask(bench.contest_message(ContestCommand.START)) is Reason.NONE
    bench.tick(raw=to_everybody(bench.contest_message(ContestCommand.STOP)))
    assert bench.state() is State.READY


def test_messages_for_others_are_not_answered() -> None:
    bench = FirmwareBench().armed()
    for changes in ({"target_system": 2}, {"target_component": 25}):
        assert bench.tick(raw=forge(bench.wheels_message(1.0, 1.0, 1.0), **changes)) == []
    assert bench.tick(raw=forge(bench.wheels_message(1.0, 1.0, 1.0), target_component=0)) != []
    assert bench.wheels == (1000, 1000)


def test_nothing_is_performed_twice_whatever_is_lost_and_repeated() -> None:
    bench = FirmwareBench().armed()
    messages = [bench.maneuver_message((Action.FF,), 0.05, ManeuverOption.EYES) for _ in range(60)]
    late: list[Message] = []
    for i, message in enumerate(messages):
        bench.tick(message, *([message] if i % 3 == 0 else []))
        late.append(message)
        for _ in range(12):
            bench.tick(HOST, late[max(0, i - 5)], late[i // 2])
    assert maneuvers(bench) == 60
    assert all(result.outcome == Outcome.COMPLETED for result in bench.got(JuniorManeuverResult))


def test_status_tells_the_last_number() -> None:
    bench = FirmwareBench().armed()
    bench.ask(JuniorWheels(SESSION, 700, speed=(0.0, 0.0), duration=0.0, target_system=1, target_component=1))
    bench.run(1000)
    assert (bench.latest(RobotStatus).session, bench.latest(RobotStatus).sequence) == (SESSION, 700)
