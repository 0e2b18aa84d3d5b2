"""Who keeps an armed robot moving: the keeper, and nobody else; on MAVLink and on CAN."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from can_bench import CanBench
from firmware_bench import HEARTBEAT, HOST, HOST_NUMBER, SESSION, TICK, FirmwareBench, forge

from firmware_protocol.messages import (
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    ContestCommand,
    JuniorManeuverResult,
    JuniorMemoryEntry,
    ManualControl,
    ParamSet,
    Ping,
    Reason,
    RobotAck,
    RobotAlive,
    RobotSession,
    State,
    Statustext,
)
from firmware_protocol.vocabulary import Action
from firmware_protocol.wire.mavlink import MavlinkCodec

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

WATCHDOG = 250
"""ms of silence that stop a robot."""
OFTEN = 8
"""Ticks from one message to the next: 40 ms."""
BENCHES = {"mavlink": FirmwareBench, "can": CanBench}
OTHER = 4321
"""Number of another host's program."""


@pytest.fixture(params=list(BENCHES))
def bench(request: pytest.FixtureRequest) -> FirmwareBench:
    """A robot that has been on for a while."""
    bench = BENCHES[request.param]()
    bench.run(500)
    return bench


@pytest.fixture
def line() -> FirmwareBench:
    """A robot on a byte link."""
    bench = FirmwareBench()
    bench.run(500)
    return bench


def session(number: int, host: int) -> RobotSession:
    """Opens a session."""
    return RobotSession(session=number, sequence=0, host=host, target_system=1, target_component=1, major=2, minor=0)


def open_by(bench: FirmwareBench, host: int, number: int = SESSION) -> None:
    """Open a session as this program."""
    assert bench.ask(session(number, host)) is Reason.NONE
    bench.session = number


def arm(bench: FirmwareBench, number: float = 0.0) -> CommandResult | None:
    """Arm; `number` is what the third parameter says."""
    return bench.command(Command.ARM_DISARM, 1.0, param3=number)


def moves_for(bench: FirmwareBench, *messages: Message, raw: bytes = b"", every: int = OFTEN, ms: int = 1000) -> int:
    """How long the wheels go on turning while this comes again and again, in ms; at most `ms`."""
    for i in range(ms // TICK):
        bench.tick(*(messages if i % every == 0 else ()), raw=raw if i % every == 0 else b"")
        if bench.wheels == (0, 0):
            return (i + 1) * TICK
    return ms


def driven_by_stick(bench: FirmwareBench, codec: MavlinkCodec) -> None:
    """A ground station's stick, held: forward."""
    bench.tick(raw=codec.encode(ManualControl(target=1, x=500, r=0)))


# --- a host that holds the session ----------------------------------------------------------------------------------


@pytest.mark.parametrize("alive", [RobotAlive(HOST_NUMBER), RobotAlive(HOST_NUMBER, 1, 1)])
def test_the_host_that_armed_keeps_it_by_robot_alive(bench: FirmwareBench, alive: RobotAlive) -> None:
    bench.armed().perform((Action.FF,), 5.0)
    assert moves_for(bench, alive, ms=3000) == 3000
    assert moves_for(bench) == WATCHDOG - OFTEN * TICK + TICK
    assert bench.state() is State.READY


def test_robot_alive_just_in_time_keeps_it(bench: FirmwareBench) -> None:
    bench.armed().perform((Action.FF,), 5.0)
    assert moves_for(bench, HOST, every=WATCHDOG // TICK, ms=3000) == 3000
    bench.perform((Action.FF,), 5.0)
    bench.run(WATCHDOG - TICK, alive=False)
    assert bench.wheels == (1000, 1000)
    bench.tick()
    assert bench.wheels == (0, 0)


def test_numbered_messages_of_the_session_keep_it(bench: FirmwareBench) -> None:
    bench.armed().perform((Action.FF,), 5.0)
    for _ in range(10):
        bench.ask(bench.read_message(0))
        bench.run(200, alive=False)
        assert bench.state() is State.PERFORMING
    again = bench.read_message(0)
    for _ in range(5):
        bench.ask(again)
        bench.run(200, alive=False)
        assert bench.state() is State.PERFORMING, "a repetition is the host's word, too"


@pytest.mark.parametrize(
    "message",
    [
        HEARTBEAT,
        Ping(time_usec=1, seq=1),
        RobotAlive(OTHER),
        RobotAlive(OTHER, 1, 1),
        RobotAlive(HOST_NUMBER, 2, 1),
        CommandLong(1, 1, command=int(Command.REQUEST_MESSAGE), param1=1.0),
    ],
    ids=["heartbeat", "ping", "another host", "another host to this robot", "for another robot", "command"],
)
def test_nothing_else_keeps_it(bench: FirmwareBench, message: Message) -> None:
    bench.armed().perform((Action.FF,), 5.0)
    assert moves_for(bench, message, ms=3000) == WATCHDOG
    bench.run(300, alive=False)
    assert "host" in bench.latest(Statustext).text


def test_numbered_messages_of_another_session_do_not_keep_it(bench: FirmwareBench) -> None:
    bench.armed().perform((Action.FF,), 5.0)
    bench.session = SESSION + 1
    for _ in range(10):
        bench.ask(bench.maneuver_message((Action.FF,)))
        bench.run(45, alive=False)
    assert bench.state() is State.READY
    assert bench.wheels == (0, 0)


def test_robot_alive_counts_whoever_sends_it_since_the_number_says_whose_it_is(line: FirmwareBench) -> None:
    line.armed().perform((Action.FF,), 5.0)
    assert moves_for(line, raw=MavlinkCodec(system=250, component=1).encode(HOST)) == 1000


def test_a_damaged_robot_alive_does_not_count(line: FirmwareBench) -> None:
    line.armed().perform((Action.FF,), 5.0)
    damaged = bytes([*line.host.encode(HOST)[:-1], 0])
    assert moves_for(line, raw=damaged) == WATCHDOG


def test_robot_alive_keeps_nothing_that_was_not_armed(bench: FirmwareBench) -> None:
    bench.open()
    bench.run(1000)
    assert bench.state() is State.DISARMED
    assert bench.wheels == (0, 0)


def test_no_stick_drives_what_a_host_has_armed_though_it_comes_from_the_host_s_address(bench: FirmwareBench) -> None:
    bench.armed()
    for _ in range(10):
        bench.tick(HOST, ManualControl(target=1, x=500, r=0))
        assert bench.wheels == (0, 0)
    assert bench.state() is State.READY
    assert bench.ask(bench.wheels_message(0.25, 0.25, 1.0)) is Reason.NONE
    bench.tick(ManualControl(target=1, x=500, r=0))
    assert bench.wheels == (250, 250), "its host still drives"
    assert arm(bench) is CommandResult.ACCEPTED
    bench.tick(ManualControl(target=1, x=500, r=0))
    assert bench.wheels == (500, 500), "who armed without a number does"


def test_a_robot_that_somebody_else_keeps_is_not_kept_by_robot_alive(line: FirmwareBench) -> None:
    line.open()
    ground = MavlinkCodec(system=9, component=190)
    line.tick(raw=ground.encode(CommandLong(1, 1, command=int(Command.ARM_DISARM), param1=1.0)))
    driven_by_stick(line, ground)
    assert line.wheels == (500, 500)
    for _ in range(60):
        line.tick(HOST)
    assert line.wheels == (0, 0)


# --- the number that arms -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [OTHER, HOST_NUMBER - 1, HOST_NUMBER + 1, HOST_NUMBER + 0.5, 1, 0.5, 1e-9, 65535, 1e9])
def test_a_number_that_is_not_the_session_s_is_denied(bench: FirmwareBench, number: float) -> None:
    bench.open()
    assert arm(bench, number) is CommandResult.DENIED
    assert bench.state() is State.DISARMED
    assert bench.ask(bench.read_message(0)) is Reason.NOT_FOUND, "the session is still open"


def test_a_number_is_denied_while_no_session_is_open(bench: FirmwareBench) -> None:
    assert arm(bench, HOST_NUMBER) is CommandResult.DENIED
    assert arm(bench, 0.5) is CommandResult.DENIED
    assert bench.state() is State.DISARMED
    bench.open()
    assert arm(bench) is CommandResult.ACCEPTED
    assert arm(bench, HOST_NUMBER) is CommandResult.DENIED, "arming without it has closed the session"
    assert bench.state() is State.READY


def test_the_greatest_number_is_one_like_any_other(bench: FirmwareBench) -> None:
    open_by(bench, 65535)
    assert arm(bench, 65536) is CommandResult.DENIED
    assert arm(bench, 65535) is CommandResult.ACCEPTED
    bench.perform((Action.FF,), 5.0)
    assert moves_for(bench, RobotAlive(65535)) == 1000


def test_a_host_without_a_number_opens_no_session(line: FirmwareBench) -> None:
    line.tick(raw=forge(session(SESSION, HOST_NUMBER), host=0))
    assert line.latest(RobotAck).reason == Reason.BAD_VALUE
    assert arm(line, HOST_NUMBER) is CommandResult.DENIED


def test_it_takes_no_number_to_disarm(bench: FirmwareBench) -> None:
    bench.armed()
    assert bench.command(Command.ARM_DISARM, 0.0, param3=OTHER) is CommandResult.ACCEPTED
    assert bench.state() is State.DISARMED


# --- a ground station -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [0.0, math.nan, -1.0], ids=["zero", "NaN", "negative"])
def test_arming_without_a_number_closes_the_session(bench: FirmwareBench, number: float) -> None:
    bench.open()
    assert arm(bench, number) is CommandResult.ACCEPTED
    assert bench.ask(bench.maneuver_message((Action.FF,))) is Reason.WRONG_SESSION
    assert bench.ask(bench.read_message(0)) is Reason.WRONG_SESSION
    bench.open()
    assert bench.state() is State.DISARMED
    bench.arm()
    bench.perform((Action.FF,), 1.0)


def test_a_session_that_was_closed_goes_on_where_it_was(bench: FirmwareBench) -> None:
    bench.armed()
    old = bench.maneuver_message((Action.FF,), 5.0)
    assert bench.ask(old) is Reason.NONE
    assert arm(bench) is CommandResult.ACCEPTED
    bench.open()
    bench.arm()
    assert bench.ask(old) is Reason.OLD_SEQUENCE
    assert bench.wheels == (0, 0)


@pytest.mark.parametrize("message", [HEARTBEAT, Ping(time_usec=1, seq=1), RobotAlive(OTHER)])
def test_who_armed_without_a_session_keeps_it_by_any_frame(bench: FirmwareBench, message: Message) -> None:
    assert arm(bench) is CommandResult.ACCEPTED
    stick = ManualControl(target=1, x=500, r=0)
    bench.tick(stick)
    assert bench.wheels == (500, 500)
    bench.tick(message)
    bench.run(200, alive=False)
    assert bench.wheels == (500, 500)
    bench.run(50, alive=False)
    assert bench.wheels == (0, 0), "the stick was let go"


@pytest.mark.parametrize(("system", "component"), [(255, 191), (254, 190), (1, 190), (7, 7)])
def test_only_that_system_and_component_keep_it(line: FirmwareBench, system: int, component: int) -> None:
    ground = MavlinkCodec(system=7, component=190)
    line.tick(raw=ground.encode(CommandLong(1, 1, command=int(Command.ARM_DISARM), param1=1.0)))
    watchdog = 50
    line.tick(raw=ground.encode(ParamSet(1, 1, "WATCHDOG", float(watchdog))))
    driven_by_stick(line, ground)
    assert moves_for(line, raw=ground.encode(HEARTBEAT), every=4, ms=200) == 200
    driven_by_stick(line, ground)
    other = MavlinkCodec(system=system, component=component)
    assert moves_for(line, raw=other.encode(HEARTBEAT), every=1, ms=200) == watchdog
    assert moves_for(line, raw=other.encode(ManualControl(target=1, x=500, r=0)), ms=100) == TICK, "nor drives it"


# --- another keeper -------------------------------------------------------------------------------------------------


def test_what_was_performed_stops_when_a_ground_station_arms(bench: FirmwareBench) -> None:
    bench.armed().perform((Action.FF,), 5.0)
    bench.clear()
    assert arm(bench) is CommandResult.ACCEPTED
    assert bench.wheels == (0, 0)
    assert bench.state() is State.READY
    bench.run(500, alive=False)
    assert not bench.got(JuniorManeuverResult), "there is nobody to tell"


def test_what_a_ground_station_drove_stops_when_another_arms(line: FirmwareBench) -> None:
    first, second = MavlinkCodec(system=7, component=190), MavlinkCodec(system=8, component=190)
    order = CommandLong(1, 1, command=int(Command.ARM_DISARM), param1=1.0)
    line.tick(raw=first.encode(order))
    driven_by_stick(line, first)
    line.tick(raw=first.encode(order))
    assert line.wheels == (500, 500), "the same one again changes nothing"
    line.tick(raw=second.encode(order))
    assert line.wheels == (0, 0)
    assert line.state() is State.READY
    driven_by_stick(line, first)
    assert line.wheels == (0, 0)
    driven_by_stick(line, second)
    assert line.wheels == (500, 500)


def test_what_was_performed_goes_on_when_its_host_arms_again(bench: FirmwareBench) -> None:
    bench.armed().perform((Action.FF,), 5.0)
    bench.arm()
    assert bench.wheels == (1000, 1000)
    assert bench.state() is State.PERFORMING


def test_a_host_that_speaks_from_another_address_is_another_keeper(line: FirmwareBench) -> None:
    line.armed().perform((Action.FF,), 5.0)
    order = CommandLong(1, 1, command=int(Command.ARM_DISARM), param1=1.0, param3=HOST_NUMBER)
    line.tick(raw=MavlinkCodec(system=255, component=191).encode(order))
    assert line.wheels == (0, 0)
    assert line.ask(line.read_message(0)) is Reason.NOT_FOUND, "its session is still open"


def test_a_host_that_takes_over_from_a_ground_station_stops_it_first(bench: FirmwareBench) -> None:
    assert arm(bench) is CommandResult.ACCEPTED
    bench.tick(ManualControl(target=1, x=500, r=0))
    assert bench.wheels == (500, 500)
    bench.open()
    assert bench.state() is State.DISARMED
    assert bench.wheels == (0, 0)
    bench.tick(ManualControl(target=1, x=500, r=0))
    assert bench.wheels == (0, 0)


def test_a_new_session_leaves_no_keeper(bench: FirmwareBench) -> None:
    bench.armed()
    open_by(bench, OTHER, SESSION + 1)
    assert bench.state() is State.DISARMED
    assert arm(bench, HOST_NUMBER) is CommandResult.DENIED
    assert arm(bench, OTHER) is CommandResult.ACCEPTED
    bench.perform((Action.FF,), 5.0)
    assert moves_for(bench, HOST) == WATCHDOG
    bench.perform((Action.FF,), 5.0)
    assert moves_for(bench, RobotAlive(OTHER)) == 1000


def test_a_new_session_in_a_contest_leaves_no_keeper(bench: FirmwareBench) -> None:
    bench.armed()
    assert bench.ask(bench.write_message((Action.FF,), current=0)) is Reason.NONE
    assert bench.ask(bench.contest_message(ContestCommand.START, 0.0)) is Reason.NONE
    bench.run(100)
    assert bench.state() is State.CONTEST
    open_by(bench, OTHER, SESSION + 1)
    assert bench.state() is State.CONTEST, "a contest goes on"
    assert bench.ask(bench.contest_message(ContestCommand.STOP)) is Reason.NONE
    assert bench.state() is State.READY
    bench.run(500)
    bench.tick(ManualControl(target=1, x=500, r=0))
    assert bench.wheels == (0, 0), "who armed it is its keeper no more"
    for alive in (RobotAlive(OTHER), HOST, HEARTBEAT):
        assert bench.ask(bench.wheels_message(0.5, 0.5, 1.0)) is Reason.NONE
        assert bench.wheels == (0, 0), "nobody keeps it: it must not move"
        bench.tick(alive)
        assert bench.wheels == (0, 0)
    assert arm(bench, OTHER) is CommandResult.ACCEPTED
    assert bench.ask(bench.wheels_message(0.5, 0.5, 1.0)) is Reason.NONE
    assert moves_for(bench, RobotAlive(OTHER), ms=900) == 900


# --- anybody --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("order", "state"), [((Command.FLIGHT_TERMINATION, 1.0), State.STOPPED), ((Command.ARM_DISARM, 0.0), State.DISARMED)]
)
@pytest.mark.parametrize("target", [0, 1])
def test_anybody_stops_and_disarms_it(line: FirmwareBench, order: tuple[Command, float], state: State, target: int) -> None:
    line.armed().perform((Action.FF,), 5.0)
    command, value = order
    stranger = MavlinkCodec(system=33, component=44)
    line.tick(raw=stranger.encode(CommandLong(target, target, command=int(command), param1=value)))
    assert line.state() is state
    assert line.wheels == (0, 0)
    ack = line.latest(CommandAck)
    assert (ack.command, ack.result, ack.target_system, ack.target_component) == (int(command), 0, 33, 44)


def test_results_and_entries_go_to_who_spoke_last_in_the_session(line: FirmwareBench) -> None:
    line.armed()
    moved = MavlinkCodec(system=255, component=77)
    line.tick(raw=moved.encode(line.write_message((Action.FF,), current=1)))
    line.tick(raw=moved.encode(line.read_message(0)))
    entry = line.latest(JuniorMemoryEntry)
    assert (entry.target_system, entry.target_component) == (255, 77)
    line.tick(raw=moved.encode(line.maneuver_message((Action.FF,), 0.05)))
    line.run(100)
    result = line.latest(JuniorManeuverResult)
    assert (result.target_system, result.target_component) == (255, 77)
