"""A step reads the clock once, and nobody above the bridge reads it at all: between two steps time stands still."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from quiet_tap import QuietTap
from scripted_pump import Nowhere, ScriptedPump, Taken
from scripted_robot import PERIOD, ScriptedRobot

from firmware_protocol.clock import ManualClock
from firmware_protocol.errors import LinkClosedError, LinkTimeoutError
from firmware_protocol.events import Received
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import Command, CommandLong, Heartbeat, JuniorSensors
from firmware_protocol.vocabulary import Action, Maneuver
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.signing import SigningKey
from hil.bridge.bridge import Bridge
from hil.bridge.clock import LastReading, MonotonicClock
from hil.bridge.networks import Networks
from hil.bridge.operator import INTERRUPT, Operator, OperatorInput
from hil.bridge.pump import InlinePump
from hil.bridge.taps import Circumstances, Opening
from hil.conformance.probe import Probe
from hil.signing.key_file import open_signing
from hil.sumo.junior import Junior
from hil.sumo.ring import OpenRing
from hil.sumo.robots import Robots

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.errors import LinkError

LATE = 0.004
"""So much later than a chunk has come, the bridge reads its clock, in s."""


class Counting:
    """A clock that goes on with every reading."""

    def __init__(self) -> None:
        self.readings = 0

    def now(self) -> float:
        self.readings += 1
        return self.readings * 0.001


class RealTime(MemoryLink):
    """A link to a robot whose time passes whether anybody steps or not."""

    lockstep = False


class Later:
    """A robot's clock, a little later."""

    def __init__(self, robot: ScriptedRobot) -> None:
        self._robot = robot

    def now(self) -> float:
        return self._robot.now() + LATE


class Stamps(QuietTap):
    """A tap that notes the times of steps and of chunks."""

    def __init__(self) -> None:
        self.steps: list[float] = []
        self.stamps: list[float] = []
        self.met: list[Circumstances] = []
        self.openings: list[Opening] = []
        self.drawn: list[int] = []
        self.refused: list[tuple[float, bytes]] = []

    def opened(self, opening: Opening) -> None:
        self.openings.append(opening)

    def session_drawn(self, number: int) -> None:
        self.drawn.append(number)

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> None:
        self.steps.append(time)
        self.stamps += [stamp for stamp, _ in chunks]
        self.met.append(met)

    def unsent(self, time: float, data: bytes, error: LinkError) -> None:
        del error
        self.refused.append((time, data))


def real(robot: ScriptedRobot, tap: Stamps | None = None) -> Junior:
    """A handle in real time, which this thread lets pass."""
    link = RealTime(robot)
    bridge = Bridge(link, Later(robot), taps=[tap] if tap else [], session=lambda: 77, pump=InlinePump(link, robot))
    junior = Junior(bridge)
    junior.find()
    return junior


def sleep(robot: ScriptedRobot, duration: float) -> None:
    """Let the robot live on while nobody steps; what it says is lost."""
    for _ in range(round(duration / PERIOD)):
        robot.step(b"")


def asked(robot: ScriptedRobot) -> int:
    """Times it was asked for a reading of its sensors."""
    return sum(
        isinstance(message, CommandLong) and message.command == Command.REQUEST_MESSAGE and message.param1 == JuniorSensors.ID
        for message in robot.heard
    )


# --- the reading -----------------------------------------------------------------------------------------------------


def test_the_last_reading_stands_still_until_the_clock_is_read_again() -> None:
    clock = ManualClock(3.0)
    reading = LastReading(clock)
    clock.advance(1.0)
    assert reading.now() == 3.0
    assert reading.read() == 4.0
    clock.advance(1.0)
    assert (reading.now(), reading.now()) == (4.0, 4.0)


def test_the_machine_s_clock_never_goes_back() -> None:
    clock = MonotonicClock()
    readings = [clock.now() for _ in range(100)]
    assert readings == sorted(readings)
    assert readings[0] >= 0.0


def test_a_step_reads_the_clock_once_whatever_it_does() -> None:
    clock, tap = Counting(), Stamps()
    beat = MavlinkCodec(system=3, component=1).encode(Heartbeat(10, 0, 0, 0, 4))
    pump = ScriptedPump(*[Taken(((0.0, beat), (0.0, beat)))] * 5)
    with Bridge(Nowhere(), clock, taps=[tap], pump=pump) as bridge:
        assert clock.readings == 1
        assert tap.openings[0].clock == bridge.now == 0.001
        for number in range(1, 11):
            bridge.step(0.1)
            assert clock.readings == number + 1
            assert bridge.now == tap.steps[-1]
    assert clock.readings == 11


def test_in_lock_step_one_of_no_length_with_nothing_to_do_is_none() -> None:
    robot, tap = ScriptedRobot(), Stamps()
    with Bridge(MemoryLink(robot), robot, taps=[tap], session=lambda: 77) as bridge:
        while not (bridge.peers and bridge.peers[1].ready):
            bridge.step(0.1)
        while bridge.next_due() <= bridge.now:
            bridge.step(PERIOD)
        steps = len(tap.steps)
        assert bridge.step(0.0) == []
        assert len(tap.steps) == steps
        bridge.peers[1].ping()
        bridge.step(0.0)
        assert len(tap.steps) == steps + 1
        bridge.operator.ask("key w")
        assert bridge.step(0.0) == []
        assert len(tap.steps) == steps + 1
        bridge.step(PERIOD)
        assert len(tap.steps) == steps + 2
        bridge.begin_anew("asleep")
        bridge.step(0.0)
        assert len(tap.steps) == steps + 3


def test_in_real_time_one_of_no_length_sees_what_time_it_is() -> None:
    robot, tap = ScriptedRobot(), Stamps()
    bridge = real(robot, tap).bridge
    before = len(tap.steps)
    sleep(robot, 0.5)
    bridge.step(0.0)
    assert len(tap.steps) == before + 1
    assert bridge.now == robot.now() + LATE


# --- who is above it -------------------------------------------------------------------------------------------------


def test_a_handle_s_time_is_that_of_the_last_step() -> None:
    robot = ScriptedRobot()
    junior = real(robot)
    before = junior.now()
    assert before == junior.bridge.now
    sleep(robot, 2.0)
    assert junior.now() == before
    junior.step(0.0)
    assert junior.now() == robot.now() + LATE


def test_a_deadline_counts_from_a_step_made_for_it() -> None:
    robot = ScriptedRobot()
    junior = real(robot)
    sleep(robot, 2.0)
    assert junior.deadline(0.5) == robot.now() + LATE + 0.5


def test_waiting_counts_from_its_first_step() -> None:
    robot = ScriptedRobot()
    junior = real(robot)
    sleep(robot, 2.0)
    begun = robot.now()
    junior.wait(0.5)
    assert robot.now() - begun == pytest.approx(0.5, abs=2 * PERIOD)


def test_after_a_sleep_a_reading_is_known_to_be_old_and_a_fresh_one_is_asked_for() -> None:
    robot = ScriptedRobot()
    junior = real(robot)
    junior.wait(1.0)
    before = asked(robot)
    assert junior.sensors.time == pytest.approx(robot.now(), abs=0.021)
    assert asked(robot) == before
    robot.stream = False
    sleep(robot, 1.0)
    assert not bool(junior.stale)  # as of the last step
    assert junior.sensors.time == pytest.approx(robot.now(), abs=2 * PERIOD)
    assert asked(robot) == before + 1
    assert not bool(junior.stale)


def test_signatures_begin_with_the_calendar_and_go_on_by_the_readings() -> None:
    clock, key = ManualClock(3.0), SigningKey(bytes(range(1, 33)))
    reading = LastReading(clock)
    signing = open_signing(key, Nowhere(), reading, lambda: 1_000_000)
    assert signing is not None
    assert signing.clock() == 1_000_000
    clock.advance(2.0)
    assert signing.clock() == 1_000_000
    reading.read()
    assert signing.clock() == 1_200_000  # in 10 us


def test_the_time_of_several_networks() -> None:
    robots = [ScriptedRobot(), ScriptedRobot()]
    lockstep, live = Networks(), Networks()
    for name, robot in zip("ab", robots, strict=True):
        lockstep.add(name, Bridge(MemoryLink(robot), robot))
    lockstep.bridges["a"].step(0.1)
    assert lockstep.now() == Robots(lockstep).now() == lockstep.bridges["b"].now == 0.0  # the one furthest behind
    clocks = [ManualClock(1.0), ManualClock(2.0)]
    for name, clock in zip("ab", clocks, strict=True):
        live.add(name, Bridge(Nowhere(name), clock, pump=ScriptedPump()))
        clock.advance(5.0)
    assert live.now() == Robots(live).now() == 2.0  # neither has stepped
    live.step(0.0)
    assert live.now() == 7.0
    live.failures["b"] = LinkClosedError("b", "over")
    assert live.now() == 6.0


# --- how long something took -----------------------------------------------------------------------------------------


def test_a_question_lasts_from_the_step_that_sent_it_to_the_stamp_of_its_answer() -> None:
    robot, tap = ScriptedRobot(), Stamps()
    junior = real(robot, tap)
    ticket = junior.peer.ping()
    assert (ticket.asked_at, ticket.answered_at) == (None, None)
    junior.step(0.0)
    sent = tap.steps[-1]
    assert not ticket.done
    junior.finish(ticket)
    assert ticket.asked_at == sent
    assert ticket.answered_at == tap.stamps[-1]
    assert ticket.answered_at == pytest.approx(tap.steps[-1] - LATE)


def test_one_that_was_asked_again_lasts_from_the_first_time() -> None:
    robot, tap = ScriptedRobot(), Stamps()
    junior = real(robot, tap)
    robot.deaf = lambda message: type(message).__name__ == "Ping"
    ticket = junior.peer.ping()
    junior.step(0.0)
    first = tap.steps[-1]
    junior.wait(0.3)
    assert not bool(ticket.done)
    robot.deaf = lambda _: False
    junior.finish(ticket)
    assert ticket.asked_at == first


def test_one_without_an_answer_has_none() -> None:
    robot = ScriptedRobot()
    junior = real(robot)
    robot.silent = True
    ticket = junior.peer.ping()
    while not ticket.done:
        junior.step(0.1)
    assert ticket.error is not None
    assert ticket.asked_at is not None
    assert ticket.answered_at is None


def test_a_maneuver_lasts_until_the_stamp_of_its_result_and_no_longer() -> None:
    robot, tap = ScriptedRobot(), Stamps()
    junior = real(robot, tap)
    junior.arm()
    results: list[float] = []
    junior.listen(
        lambda event: (
            results.append(event.time)
            if isinstance(event, Received) and type(event.message).__name__ == "JuniorManeuverResult"
            else None
        )
    )
    sent = len(tap.steps)
    done = OpenRing(junior).engage(Maneuver((Action.F,) * 4, period=0.1, floor_reflex=False))
    assert done.duration == round(results[0] - tap.steps[sent], 6)
    assert done.duration == pytest.approx(0.4 - LATE, abs=2 * PERIOD)


# --- the probe of the conformance checks -----------------------------------------------------------------------------


def test_a_probe_reads_the_clock_once_a_step_too() -> None:
    clock, tap = Counting(), Stamps()
    beat = MavlinkCodec(system=3, component=1).encode(Heartbeat(10, 0, 0, 0, 4))
    pump = ScriptedPump(*[Taken(((0.0, beat), (0.0, beat)))] * 5)
    probe = Probe(Nowhere(), clock, host=77, taps=[tap], pump=pump, network="net")
    assert clock.readings == 1
    assert tap.openings == [Opening("net", "nowhere:", "mavlink", lockstep=False, clock=0.001)]
    assert tap.drawn == [77]
    for number in range(1, 11):
        probe.step(0.1)
        assert clock.readings == number + 1
        assert probe.now() == tap.steps[-1]
    probe.close()
    assert clock.readings == 11


def test_a_probe_takes_in_what_the_operator_asks_for() -> None:
    operator, tap, pump = Operator(), Stamps(), ScriptedPump()
    probe = Probe(Nowhere(), ManualClock(), host=77, taps=[tap], pump=pump, operator=operator)
    operator.ask(INTERRUPT)
    assert pump.woken == 1
    with pytest.raises(KeyboardInterrupt):
        probe.step(0.1)
    assert pump.waits == [0.0]
    assert tap.met == [Circumstances((OperatorInput(INTERRUPT),))]
    probe.close()
    assert not operator.serving


def test_a_probe_tells_of_the_end_of_its_link_and_of_what_was_not_sent() -> None:
    gone = LinkClosedError("nowhere:", "pulled")
    tap, pump, link = Stamps(), ScriptedPump(Taken(dropped=7), Taken(error=gone)), Nowhere()
    probe = Probe(link, ManualClock(2.0), host=77, taps=[tap], pump=pump)
    probe.step(0.1)
    with pytest.raises(LinkClosedError, match="pulled"):
        probe.step(0.1)
    assert tap.met == [Circumstances(dropped=7), Circumstances(ended=gone)]
    link.failure = LinkTimeoutError("nowhere:", "busy")
    with pytest.raises(LinkTimeoutError):
        probe.raw(b"abc")
    assert tap.refused == [(2.0, b"abc")]
