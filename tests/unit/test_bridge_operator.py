"""What the operator asks for comes in by a bridge's steps: one that waits returns, tells the taps, and ends what it began."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import pytest
from quiet_tap import QuietTap
from scripted_pump import Bell, Mute, Nowhere, ScriptedPump, Taken
from scripted_robot import ScriptedRobot

from firmware_protocol.clock import ManualClock
from firmware_protocol.errors import LinkClosedError
from firmware_protocol.events import Received
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import Heartbeat
from firmware_protocol.wire.mavlink import MavlinkCodec
from hil.bridge.bridge import Bridge
from hil.bridge.networks import Networks
from hil.bridge.operator import INTERRUPT, INTERRUPTED, Operator, OperatorInput
from hil.bridge.pump import ThreadedPump
from hil.sumo.junior import Junior

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.wire.fields import Message
    from hil.bridge.taps import Circumstances

BEAT = MavlinkCodec(system=3, component=1).encode(Heartbeat(10, 0, 0, 0, 4))


class Inputs(QuietTap):
    """A tap that notes what was taken in, and what was said, in order."""

    def __init__(self) -> None:
        self.did: list[tuple[OperatorInput, ...] | str] = []

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> None:
        del time, chunks
        self.did.append(met.inputs)

    def received(self, event: object) -> None:
        del event
        self.did.append("heard")

    def sent(self, time: float, message: Message) -> None:
        del time, message
        self.did.append("said")

    @property
    def inputs(self) -> list[OperatorInput]:
        return [one for step in self.did if not isinstance(step, str) for one in step]


AskWhen = Callable[[Bell], threading.Thread]


@pytest.fixture
def operator() -> Operator:
    return Operator()


@pytest.fixture(params=["from a thread", "by a signal"])
def ask_when(request: pytest.FixtureRequest, operator: Operator) -> Iterator[AskWhen]:
    """Has the operator ask for an interrupt as soon as somebody waits at a bell."""
    asked = threading.Event()

    def interrupt(*_: object) -> None:
        if not asked.is_set():
            asked.set()
            operator.ask(INTERRUPT)

    def signalled() -> None:
        while not asked.wait(0.01):  # one that comes just before the wait begins is heard when it ends
            signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGUSR1)

    def begin(bell: Bell) -> threading.Thread:
        def run() -> None:
            if bell.awaited.wait(10.0):
                how()

        thread = threading.Thread(target=run)
        thread.start()
        return thread

    how: Callable[[], None] = interrupt
    if request.param == "from a thread":
        yield begin
        return
    if not hasattr(signal, "pthread_kill"):
        pytest.skip("this system has no such signals")
    how = signalled
    before = signal.signal(signal.SIGUSR1, interrupt)
    try:
        yield begin
    finally:
        signal.signal(signal.SIGUSR1, before)


def waiting(pump: ThreadedPump) -> Bell:
    """The bell at which a step waits for this pump."""
    pump._bell = bell = Bell()
    return bell


def test_a_step_that_waits_is_woken_and_raises(operator: Operator, ask_when: AskWhen) -> None:
    link, clock, tap = Mute(), ManualClock(), Inputs()
    pump = ThreadedPump(link, clock)
    bell = waiting(pump)
    with Bridge(link, clock, taps=[tap], pump=pump, operator=operator) as bridge:
        bridge.step(0.5)  # the first heartbeat is due at once
        thread = ask_when(bell)
        with pytest.raises(KeyboardInterrupt):
            bridge.step(0.5)
        thread.join()
        assert bell.unheard == 0
        assert tap.did == [(), "said", (OperatorInput(INTERRUPT),)]
        bridge.step(0.0)
    assert tap.inputs == [OperatorInput(INTERRUPT)]


def test_of_several_networks_the_step_that_waits_is_woken_and_raises(operator: Operator, ask_when: AskWhen) -> None:
    clock, networks, tap = ManualClock(), Networks(), Inputs()
    for name in ("a", "b"):
        bridge = Bridge(Mute(name), clock, taps=[tap], operator=operator, arrived=networks.wake)
        networks.add(name, bridge)
    networks.step(0.0)
    networks._bell = bell = Bell()
    thread = ask_when(bell)
    with pytest.raises(KeyboardInterrupt):
        networks.step(0.5)
    thread.join()
    assert bell.unheard == 0
    assert tap.inputs == [OperatorInput(INTERRUPT)]
    networks.step(0.0)
    networks.close()
    assert not operator.serving


def test_what_was_asked_for_before_a_step_has_it_not_wait() -> None:
    operator, clock, tap = Operator(), ManualClock(), Inputs()
    pump = ScriptedPump()
    with Bridge(Nowhere(), clock, taps=[tap], pump=pump, operator=operator) as bridge:
        bridge.step(0.0)
        operator.ask("key w", "3")
        assert pump.woken == 1
        bridge.step(0.7)
        bridge.step(0.7)
    assert pump.waits == [0.0, 0.0, 0.7]
    assert tap.inputs == [OperatorInput("key w", "3")]
    assert operator.pressed() == [OperatorInput("key w", "3")]


def test_a_closed_bridge_is_not_woken() -> None:
    operator, pump = Operator(), ScriptedPump()
    bridge = Bridge(Nowhere(), ManualClock(), pump=pump, operator=operator)
    assert operator.serving
    bridge.close()
    operator.ask(INTERRUPT)
    assert (operator.serving, pump.woken) == (False, 0)


def test_an_interrupted_step_is_finished_and_what_has_happened_is_returned_by_the_next() -> None:
    operator, tap = Operator(), Inputs()
    pump = ScriptedPump(Taken(((0.0, BEAT),), happens=lambda: operator.ask(INTERRUPT)))
    with Bridge(Nowhere(), ManualClock(), taps=[tap], pump=pump, operator=operator) as bridge:
        with pytest.raises(KeyboardInterrupt):
            bridge.step(0.1)
        assert tap.did == [(OperatorInput(INTERRUPT),), "heard", "said", "said"]
        assert list(bridge.peers) == [3]
        (event,) = bridge.step(0.1)
        assert isinstance(event, Received)
        assert isinstance(event.message, Heartbeat)
        assert bridge.step(0.1) == []


class Interrupting(ScriptedRobot):
    """A robot at whose first words the operator has enough."""

    operator: Operator | None = None

    def step(self, inbound: bytes) -> bytes:
        out = super().step(inbound)
        if out and self.operator is not None:
            self.operator.ask(INTERRUPT)
            self.operator = None
        return out


def test_in_lock_step_a_step_of_no_length_returns_it() -> None:
    robot, operator = Interrupting(), Operator()
    robot.operator = operator
    with Bridge(MemoryLink(robot), robot, operator=operator) as bridge:
        bridge.step(0.1)
        with pytest.raises(KeyboardInterrupt):
            bridge.step(0.1)
        now = robot.now()
        assert any(isinstance(event, Received) for event in bridge.step(0.0))
        assert robot.now() == now


def test_of_several_networks_what_the_others_have_told_is_returned_by_the_next_step() -> None:
    operator, clock, networks = Operator(), ManualClock(), Networks()
    for name, system, happens in (("a", 1, None), ("b", 2, lambda: operator.ask(INTERRUPT))):
        beat = MavlinkCodec(system=system, component=1).encode(Heartbeat(10, 0, 0, 0, 4))
        pump = ScriptedPump(Taken(((0.0, beat),), happens=happens))
        networks.add(name, Bridge(Nowhere(name), clock, pump=pump, operator=operator))
    with pytest.raises(KeyboardInterrupt):
        networks.step(0.0)
    events = networks.step(0.0)
    assert [(name, event.system) for name, event in events if isinstance(event, Received)] == [("a", 1), ("b", 2)]
    assert networks.step(0.0) == []


def test_a_link_that_ends_in_the_interrupted_step_has_ended_for_the_next() -> None:
    operator = Operator()
    over = LinkClosedError("nowhere:", "over")
    pump = ScriptedPump(Taken(((0.0, BEAT),)), Taken(error=over, happens=lambda: operator.ask(INTERRUPT)))
    with Bridge(Nowhere(), ManualClock(), pump=pump, operator=operator) as bridge:
        bridge.step(0.1)
        with pytest.raises(KeyboardInterrupt):
            bridge.step(0.1)
        with pytest.raises(LinkClosedError, match="over"):
            bridge.step(0.1)


def test_a_handle_that_is_left_by_python_s_own_interrupt_says_so_with_its_last_steps() -> None:
    robot, tap = ScriptedRobot(), Inputs()
    junior = Junior(Bridge(MemoryLink(robot), robot, taps=[tap]))
    junior.find()
    junior.arm()
    with pytest.raises(KeyboardInterrupt), junior:
        raise KeyboardInterrupt
    assert tap.inputs == [OperatorInput(INTERRUPTED)]
    assert not robot.armed


def test_one_that_a_step_has_interrupted_has_said_so() -> None:
    robot, tap = ScriptedRobot(), Inputs()
    junior = Junior(Bridge(MemoryLink(robot), robot, taps=[tap]))
    junior.find()
    junior.arm()
    junior.bridge.operator.ask(INTERRUPT)
    with pytest.raises(KeyboardInterrupt), junior:
        junior.wait(1.0)
    assert tap.inputs == [OperatorInput(INTERRUPT)]
    assert not robot.armed
