"""The life of a connection: every transition of the table, by messages and by the clock."""

from __future__ import annotations

import itertools

import pytest
from peer_bench import HOST_NUMBER, Bench, failed

from firmware_protocol.errors import LinkClosedError, PeerError, PeerLostError, RefusedError, VersionError
from firmware_protocol.events import PeerBack, PeerFound, PeerLost
from firmware_protocol.messages import (
    PROTOCOL_MAJOR,
    PROTOCOL_MINOR,
    AutopilotVersion,
    Command,
    CommandLong,
    CommandResult,
    Heartbeat,
    JuniorSensors,
    JuniorWheels,
    Ping,
    Reason,
    RefereeState,
    RobotSession,
    RobotStatus,
    Timesync,
)
from firmware_protocol.peer.connection import TRANSITIONS, USABLE, Input, PeerState
from firmware_protocol.peer.exchanges.exchange import HOLD
from firmware_protocol.peer.timing import SILENCE
from firmware_protocol.roles.junior import drive, perform, read_memory
from firmware_protocol.vocabulary import Action, Maneuver

GIVE_UP = 3.4
"""Longer than ten tries take, in s."""


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def ready(bench: Bench) -> Bench:
    bench.connect()
    bench.events.clear()
    return bench


def keep_beating(bench: Bench, time: float) -> None:
    """The robot's heart beats, and it answers nothing."""
    for _ in range(int(time)):
        bench.wait(1.0)
        bench.heartbeat()


def test_heartbeat_version_session_ready(bench: Bench) -> None:
    assert bench.state() is PeerState.SILENT
    bench.heartbeat()
    assert bench.state() is PeerState.IDENTIFYING
    assert bench.requests() == [AutopilotVersion.ID]
    bench.version()
    assert bench.state() is PeerState.OPENING
    assert bench.take(RobotSession) == [RobotSession(701, 0, HOST_NUMBER, 1, 1, major=2, minor=0)]
    bench.peer.due(bench.clock.now())
    bench.sent.append(RobotSession(701, 0, HOST_NUMBER, 1, 1, major=2, minor=0))
    bench.ack()
    assert bench.peer.ready
    assert bench.peer.session == 701
    assert bench.events == [PeerFound(1, 10.0)]


def test_the_count_of_starts_is_asked_for_at_once(bench: Bench) -> None:
    bench.heartbeat()
    bench.version()
    bench.ack()
    assert RobotStatus.ID in bench.requests()


@pytest.mark.parametrize(("theirs", "spoken"), [(0, 0), (PROTOCOL_MINOR, PROTOCOL_MINOR), (PROTOCOL_MINOR + 6, PROTOCOL_MINOR)])
def test_a_session_names_the_newest_minor_version_that_both_know(bench: Bench, theirs: int, spoken: int) -> None:
    bench.heartbeat()
    bench.version(PROTOCOL_MAJOR, theirs)
    assert bench.state() is PeerState.OPENING
    assert [(one.major, one.minor) for one in bench.take(RobotSession)] == [(PROTOCOL_MAJOR, spoken)]


@pytest.mark.parametrize("minor", [0, PROTOCOL_MINOR, PROTOCOL_MINOR + 1, 255])
def test_an_older_minor_version_is_as_good_as_ours_and_a_newer_one_likewise(bench: Bench, minor: int) -> None:
    bench.heartbeat()
    bench.version(PROTOCOL_MAJOR, minor)
    bench.ack()
    assert bench.state() is PeerState.READY
    ticket = drive(bench.peer, 0.1, 0.1, 0.1)
    bench.peer.due(bench.clock.now())
    bench.ack(JuniorWheels, 1)
    assert ticket.value().result == 0


@pytest.mark.parametrize(
    ("major", "said"),
    [(3, "update this software"), (1, "flash it again"), (0, "names no version"), (200, "speaks protocol 200.3")],
)
def test_another_version_is_refused_with_a_clear_message(bench: Bench, major: int, said: str) -> None:
    bench.heartbeat()
    bench.version(major, 3 if major else 0)
    assert bench.state() is PeerState.REFUSED
    assert isinstance(bench.peer.failure, VersionError)
    assert said in str(bench.peer.failure)
    assert bench.take(RobotSession) == []
    bench.heartbeat()
    assert bench.state() is PeerState.REFUSED
    assert said in failed(drive(bench.peer, 0, 0, 0.1))


def test_a_vehicle_that_knows_no_such_request_is_refused(bench: Bench) -> None:
    bench.heartbeat()
    bench.command_ack(Command.REQUEST_MESSAGE, CommandResult.UNSUPPORTED)
    assert bench.state() is PeerState.REFUSED
    assert isinstance(bench.peer.failure, RefusedError)


def test_a_refused_session_ends_the_handshake(bench: Bench) -> None:
    bench.heartbeat()
    bench.version()
    bench.ack(result=1, reason=Reason.BAD_VALUE)
    assert bench.state() is PeerState.REFUSED
    assert "opening a session: a value is out of range" in str(bench.peer.failure)


def test_a_busy_robot_is_asked_again_at_its_next_heartbeat(bench: Bench) -> None:
    bench.heartbeat()
    bench.version()
    bench.ack(result=1, reason=Reason.BUSY)
    assert bench.state() is PeerState.SILENT
    bench.heartbeat()
    assert bench.state() is PeerState.IDENTIFYING


def test_questions_are_repeated_with_growing_pauses_and_then_given_up(bench: Bench) -> None:
    bench.heartbeat()
    times = []
    while bench.state() is PeerState.IDENTIFYING:
        if bench.requests():
            times.append(bench.clock.now())
        bench.wait(0.005)
        if len(times) == 8:
            bench.heartbeat()
    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert len(times) == 10
    assert gaps == pytest.approx([0.08, 0.12, 0.18, 0.27, 0.4, 0.4, 0.4, 0.4, 0.4], abs=0.0051)
    assert bench.state() is PeerState.SILENT
    bench.heartbeat()
    assert bench.state() is PeerState.IDENTIFYING


def test_a_session_that_is_never_acknowledged_is_given_up(bench: Bench) -> None:
    bench.heartbeat()
    bench.version()
    keep_beating(bench, 4)
    assert bench.state() is not PeerState.OPENING
    assert bench.peer.counters.retries >= 9


@pytest.mark.parametrize("stage", [PeerState.IDENTIFYING, PeerState.OPENING, PeerState.REFUSED])
def test_silence_during_the_handshake_begins_anew(bench: Bench, stage: PeerState) -> None:
    bench.heartbeat()
    if stage is PeerState.OPENING:
        bench.version()
    if stage is PeerState.REFUSED:
        bench.version(9)
    assert bench.state() is stage
    bench.wait(SILENCE + 0.01)
    assert bench.state() is PeerState.SILENT
    assert bench.events == []


def test_watching_opens_no_session() -> None:
    bench = Bench(open_session=False)
    bench.heartbeat()
    bench.version()
    assert bench.peer.ready
    assert bench.events == [PeerFound(1, 10.0)]
    assert bench.take(RobotSession) == []
    assert "only being watched" in failed(perform(bench.peer, Maneuver((Action.F,))))
    assert not bench.peer.read_parameter("SPD_FAST").done


def test_silence_loses_a_robot_and_all_that_was_asked(ready: Bench) -> None:
    ticket = perform(ready.peer, Maneuver((Action.F,)))
    ready.wait(SILENCE - 0.02)
    assert ready.peer.ready
    ready.wait(0.03)
    assert ready.state() is PeerState.LOST
    assert [type(event) for event in ready.events] == [PeerLost]
    assert "fell silent" in failed(ticket)
    assert isinstance(ticket.error, PeerLostError)
    assert "fell silent" in failed(drive(ready.peer, 0, 0, 0.1))


def test_a_robot_is_back_if_it_has_not_restarted(ready: Bench) -> None:
    ready.wait(SILENCE + 0.01)
    ready.sent.clear()
    ready.heartbeat()
    assert ready.state() is PeerState.CHECKING
    assert ready.requests() == [RobotStatus.ID]
    ready.status()
    assert ready.peer.ready
    assert ready.peer.session == 701
    assert ready.events[1:] == [PeerBack(1, ready.clock.now(), rebooted=False)]


def test_a_robot_that_is_back_and_has_restarted_gets_a_new_session(ready: Bench) -> None:
    ready.wait(SILENCE + 0.01)
    ready.heartbeat()
    ready.status(boots=2, time=0.5)
    assert ready.state() is PeerState.IDENTIFYING
    ready.version()
    ready.ack()
    assert ready.peer.session == 702
    assert ready.events[1:] == [PeerBack(1, ready.clock.now(), rebooted=True)]


@pytest.mark.parametrize("sign", ["boots", "status time", "sensor time"])
def test_a_restart_without_silence_is_noticed(ready: Bench, sign: str) -> None:
    ticket = perform(ready.peer, Maneuver((Action.F,)))
    if sign == "boots":
        ready.status(boots=2)
    elif sign == "status time":
        ready.status(time=0.2)
    else:
        ready.heard(JuniorSensors(0.02, (0.0, 0.0), (0, 0), (0, 0), 7.0, 0))
    assert ready.state() is PeerState.IDENTIFYING
    assert ready.events == [PeerLost(1, ready.clock.now(), "it has restarted")]
    assert "has restarted" in failed(ticket)
    ready.version()
    ready.ack()
    assert ready.events[1:] == [PeerBack(1, ready.clock.now(), rebooted=True)]


def test_frames_that_overtake_each_other_are_no_restart(ready: Bench) -> None:
    ready.heard(JuniorSensors(20.0, (0.0, 0.0), (0, 0), (0, 0), 7.0, 0))
    ready.heard(JuniorSensors(19.98, (0.0, 0.0), (0, 0), (0, 0), 7.0, 0))
    assert ready.peer.ready


@pytest.mark.parametrize("stage", [PeerState.IDENTIFYING, PeerState.OPENING, PeerState.REFUSED, PeerState.LOST])
def test_a_restart_at_any_other_time_begins_the_handshake_anew(ready: Bench, stage: PeerState) -> None:
    ready.status(boots=2)
    if stage is not PeerState.LOST:
        ready.version() if stage is PeerState.OPENING else None
        ready.version(9) if stage is PeerState.REFUSED else None
        assert ready.state() is stage
    else:
        ready.version()
        ready.ack()
        ready.wait(SILENCE + 0.01)
    ready.requests()
    ready.status(boots=3)
    assert ready.state() is PeerState.IDENTIFYING
    assert AutopilotVersion.ID in ready.requests()


def test_a_robot_that_is_heard_again_but_does_not_answer_stays_lost(ready: Bench) -> None:
    ready.wait(SILENCE + 0.01)
    ready.events.clear()
    ready.heartbeat()
    assert ready.state() is PeerState.CHECKING
    keep_beating(ready, 3)
    ready.wait(0.5)
    assert ready.state() in {PeerState.LOST, PeerState.CHECKING}
    ready.wait(SILENCE + 0.01)
    assert ready.state() is PeerState.LOST
    assert ready.events == []


def test_the_link_closing_loses_the_robot_with_that_cause(ready: Bench) -> None:
    ticket = ready.peer.arm()
    error = LinkClosedError("serial:///dev/ttyACM0", "the port is gone")
    events = ready.peer.closed(error, 11.0)
    assert events == [PeerLost(1, 11.0, "serial:///dev/ttyACM0: the port is gone")]
    assert ticket.error is error
    assert perform(ready.peer, Maneuver((Action.F,))).error is error
    assert ready.peer.closed(error, 12.0) == []


def test_the_link_closing_before_the_handshake_is_no_loss(bench: Bench) -> None:
    assert bench.peer.closed(LinkClosedError("tcp:", "gone"), 11.0) == []


def test_numbered_messages_need_the_handshake_and_say_so(bench: Bench) -> None:
    for ticket in (drive(bench.peer, 0, 0, 0.1), perform(bench.peer, Maneuver((Action.F,))), read_memory(bench.peer, 0)):
        assert isinstance(ticket.error, PeerError)
        assert "handshake" in failed(ticket)
        with pytest.raises(PeerError, match="handshake"):
            ticket.value()


def test_one_heartbeat_a_second_while_disarmed(ready: Bench) -> None:
    ready.wait(1.0)
    ready.sent.clear()
    ready.wait(2.5)
    assert 2 <= len(ready.take(Heartbeat)) <= 3


def test_a_robot_of_ours_is_kept_from_when_it_says_that_it_is_armed_until_it_says_that_it_is_not(ready: Bench) -> None:
    assert not bool(ready.peer.kept)
    ticket = ready.peer.arm()
    ready.wait(0.005)
    ready.command_ack(Command.ARM_DISARM)
    assert not bool(ticket.done)
    ready.heartbeat(armed=True)
    assert bool(ticket.done)
    assert bool(ready.peer.kept)
    disarming = ready.peer.disarm()
    ready.wait(0.005)
    ready.command_ack(Command.ARM_DISARM)
    assert not bool(disarming.done)
    assert bool(ready.peer.kept)
    ready.heartbeat(armed=False)
    assert bool(disarming.done)
    assert not bool(ready.peer.kept)


def test_a_robot_that_is_only_watched_is_not_kept() -> None:
    watcher = Bench(open_session=False)
    watcher.heartbeat(armed=True)
    watcher.version()
    watcher.heartbeat(armed=True)
    assert watcher.peer.ready
    assert watcher.peer.armed
    assert not bool(watcher.peer.kept)


def test_whether_a_lost_robot_is_armed_nobody_knows(ready: Bench) -> None:
    ready.heartbeat(armed=True)
    assert bool(ready.peer.armed)
    ready.wait(3.5)
    assert ready.peer.armed is None
    assert not bool(ready.peer.kept)


def test_a_heartbeat_that_arming_has_overtaken_does_not_end_the_keep_alive(ready: Bench) -> None:
    ready.peer.arm()
    ready.wait(0.005)
    ready.command_ack(Command.ARM_DISARM)
    ready.heartbeat(armed=True)
    ready.heartbeat(armed=False)
    assert ready.peer.armed
    ready.wait(HOLD)
    ready.heartbeat(armed=False)
    assert not ready.peer.armed


def test_a_refused_arming_does_not_count(ready: Bench) -> None:
    ticket = ready.peer.arm()
    ready.wait(0.005)
    ready.command_ack(Command.ARM_DISARM, CommandResult.TEMPORARILY_REJECTED)
    assert not ready.peer.armed
    assert "arming: not in its present state" in failed(ticket)


def test_frames_are_counted(ready: Bench) -> None:
    counters = ready.peer.counters
    good = counters.good
    ping = Ping(1, 1, 255, 190)
    ready.heard(ping)
    ready.heard(ping, step=4)
    assert (counters.good - good, counters.lost) == (2, 3)
    ready.heard(ping, step=-1)
    assert (counters.late, counters.lost) == (1, 2)
    ready.heard(ping, step=2, raw=b"same")
    before = len(ready.shown)
    ready.heard(ping, step=0, raw=b"same")
    assert (counters.duplicates, len(ready.shown)) == (1, before)
    ready.heard(ping)
    ready.heard(ping, step=-1, raw=b"same")  # and later still
    assert (counters.duplicates, len(ready.shown)) == (2, before + 1)
    ready.peer.reject()
    assert counters.rejected == 1
    assert 0 < counters.loss < 0.5


def test_the_referees_frames_have_their_own_sequence(ready: Bench) -> None:
    pose = (0.0, 0.0)
    state = RefereeState(1.0, 1, 0.0, pose, 0.0, pose, 0.0, 0.7, 1, 0, 1)
    for _ in range(5):
        ready.heard(state, component=25)
    assert ready.peer.counters.lost == 0
    assert ready.peer.components == {1, 25}
    assert ready.shown.count(state) == 5


def test_a_referee_does_not_keep_a_silent_robot_alive(ready: Bench) -> None:
    pose = (0.0, 0.0)
    for _ in range(8):
        ready.wait(0.5)
        ready.heard(RefereeState(1.0, 1, 0.0, pose, 0.0, pose, 0.0, 0.7, 1, 0, 1), component=25)
    assert ready.state() is PeerState.LOST


def test_the_robots_own_questions_are_answered(ready: Bench) -> None:
    ready.heard(Timesync(0, 1234))
    ready.heard(Ping(55, 7))
    answers = list(ready.sent)
    assert Timesync(round(ready.clock.now() * 1e9), 1234, 1, 1) in answers
    assert Ping(55, 7, 1, 1) in answers


def test_clocks_are_compared_once_a_second(ready: Bench) -> None:
    for k in range(2000):
        ready.wait(0.005)
        if k % 200 == 0:
            ready.heartbeat()
        for question in ready.take(Timesync):
            ready.clock.advance(0.01)
            ready.heard(Timesync(question.ts1 + 5_000_000 + 7_000_000_000, question.ts1))
    assert ready.peer.clock.offset == pytest.approx(-7.0)


def test_a_watched_robot_that_is_taken_while_it_is_looked_at_again_is_first_looked_at() -> None:
    bench = Bench(open_session=False)
    bench.heartbeat()
    bench.version()
    assert bench.state() is PeerState.WATCHING
    bench.status()
    bench.wait(SILENCE + 0.1)
    bench.heartbeat()
    bench.peer.take(bench.clock.now())
    assert bench.state() is PeerState.CHECKING
    bench.status()
    assert bench.state() is PeerState.OPENING
    bench.ack()
    assert bench.state() is PeerState.READY


def test_what_is_known_of_a_robot_counts_from_its_link_back_until_it_is_ready_or_has_restarted() -> None:
    known = {PeerState.AWAITED, PeerState.RECOGNISING, PeerState.COMPARING, PeerState.REOPENING, PeerState.UNUSABLE}
    for (before, happened), after in TRANSITIONS.items():
        if after in known:
            assert before in known or happened is Input.LINK_BACK
        if before in known:
            assert after in known or after in USABLE or happened in {Input.RESTARTED, Input.LINK_GONE}


def test_every_transition_leads_somewhere_and_none_leaves_the_robot_stuck() -> None:
    assert {state for state, _ in TRANSITIONS} == set(PeerState)
    assert {happened for _, happened in TRANSITIONS} == set(Input)
    reached = {PeerState.SILENT}
    for _ in PeerState:
        reached |= {after for (before, _), after in TRANSITIONS.items() if before in reached}
    assert reached == set(PeerState)
    back = {PeerState.READY}
    for _ in PeerState:
        back |= {before for (before, _), after in TRANSITIONS.items() if after in back}
    assert back == set(PeerState)


def test_the_first_message_to_a_robot_is_not_a_command_that_moves_it(bench: Bench) -> None:
    bench.heartbeat()
    kinds = {type(message) for message in bench.sent}
    assert kinds <= {Heartbeat, CommandLong}
