"""A flood of input: what is due goes out before it is decoded, and nobody is lost or made much of because of it."""

from __future__ import annotations

import queue
import random
from typing import TYPE_CHECKING

import pytest
from quiet_tap import QuietTap
from scripted_robot import ScriptedRobot

import hil.bridge.pump as pump_module
from firmware_protocol.clock import ManualClock
from firmware_protocol.events import LinkNews, PeerLost, Received
from firmware_protocol.link import Link
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import Command, CommandAck, CommandLong, CommandResult, Heartbeat, JuniorSensors, RobotStatus
from firmware_protocol.peer.exchanges.commands import CommandExchange, RequestExchange
from firmware_protocol.peer.exchanges.exchange import Exchanges, Retry
from firmware_protocol.peer.quality import Counters
from firmware_protocol.roles.junior import drive
from firmware_protocol.wire.mavlink import MavlinkCodec
from hil.bridge.bridge import Bridge
from hil.bridge.networks import Networks
from hil.bridge.operator import Operator
from hil.bridge.pump import SLICE

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.events import Event
    from firmware_protocol.peer.peer import Peer
    from firmware_protocol.wire.fields import Message
    from hil.bridge.taps import Circumstances

NOISE = random.Random(1).randbytes(5 * SLICE + 1000).replace(b"\xfd", b"\xfc")
BEAT = Heartbeat(10, 0, 0, 0, 4)


def is_stop(message: Message) -> bool:
    return isinstance(message, CommandLong) and message.command == Command.FLIGHT_TERMINATION


class Order(QuietTap):
    """A tap that notes what came before what."""

    def __init__(self) -> None:
        self.did: list[str] = []
        self.chunks: list[tuple[float, bytes]] = []
        self.rx: list[tuple[float, bytes]] = []
        self.said: list[Message] = []
        self.news: list[LinkNews] = []

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> None:
        del time, met
        self.did.append("step")
        self.chunks += chunks

    def wire_rx(self, time: float, data: bytes) -> None:
        self.did.append("rx")
        self.rx.append((time, data))

    def wire_tx(self, time: float, data: bytes) -> None:
        del time, data
        self.did.append("tx")

    def sent(self, time: float, message: Message) -> None:
        del time
        self.said.append(message)

    def event(self, event: Event) -> None:
        if isinstance(event, LinkNews):
            self.news.append(event)


class Flooded:
    """Robots on one line in lock-step, and whatever else a test puts on it; the host's clock is moved by the test alone."""

    def __init__(self, *systems: int) -> None:
        self.robots = [ScriptedRobot(system=system) for system in systems or (1,)]
        self.flood = b""
        self.clock = ManualClock()
        self.order = Order()
        self.bridge = Bridge(MemoryLink(self), self.clock, taps=[self.order], session=lambda: 77)
        self.events: list[Event] = []
        while not all(peer.ready for peer in self.bridge.peers.values()) or len(self.bridge.peers) < len(self.robots):
            self.clock.advance(0.005)
            self.bridge.step(0.005)
        self.forget()

    def now(self) -> float:
        return self.robots[0].now()

    def step(self, inbound: bytes) -> bytes:
        flood, self.flood = self.flood, b""
        return b"".join(robot.step(inbound) for robot in self.robots) + flood

    def begin(self, flood: bytes) -> None:
        """Have the flood come; one slice of it is taken in, by a step that has nothing to send at once."""
        self.flood = flood
        while not self.bridge.pending:
            self.events += self.bridge.step(0.005)
        self.forget()

    def forget(self) -> None:
        """Look only at what is done from now on."""
        for noted in (self.order.did, self.order.said, self.order.chunks, self.order.rx):
            noted.clear()

    def serve(self, done: Callable[[], bool] = lambda: False) -> None:
        """Step until all is taken in, or something is so."""
        while self.bridge.pending and not done():
            self.events += self.bridge.step(0.005)

    @property
    def peer(self) -> Peer:
        return self.bridge.peers[self.robots[0].system]


def test_an_emergency_stop_is_sent_before_a_backlog_is_decoded() -> None:
    rig = Flooded()
    rig.begin(NOISE)
    ticket = rig.peer.emergency_stop()
    rig.bridge.step(0.05)
    assert rig.order.did[:3] == ["step", "tx", "rx"]
    assert is_stop(rig.order.said[0])
    assert rig.bridge.pending
    rig.serve()
    while not ticket.done:
        rig.bridge.step(0.005)
    assert ticket.value().command == Command.FLIGHT_TERMINATION


def test_where_nothing_waits_what_came_is_decoded_first() -> None:
    rig = Flooded()
    rig.bridge.step(0.005)
    rig.forget()
    rig.clock.advance(2.0)  # a heartbeat is due at the end of the wait
    rig.robots[0].armed = False
    rig.flood = NOISE[:1000]
    rig.bridge.next_due = lambda: 1.0 if rig.order.did else 9.0  # type: ignore[method-assign]
    rig.bridge.step(0.005)
    assert rig.order.did == ["step", "rx", "tx"]


def test_a_step_takes_in_a_slice_and_the_taps_see_what_was_consumed() -> None:
    rig = Flooded()
    rig.begin(NOISE)
    rig.serve()
    assert [len(data) for _, data in rig.order.rx[:4]] == [SLICE] * 4
    assert rig.order.did.count("step") == rig.order.did.count("rx") == 5
    assert rig.order.chunks == rig.order.rx
    assert b"".join(data for _, data in rig.order.rx) == NOISE[-sum(len(data) for _, data in rig.order.rx) :]
    assert {stamp for stamp, _ in rig.order.rx} == {rig.clock.now()}


def test_the_urgent_goes_first() -> None:
    rig = Flooded(1, 9)
    first, second = rig.bridge.peers[1], rig.bridge.peers[9]
    first.request(JuniorSensors)
    second.request(RobotStatus)
    second.emergency_stop()
    rig.bridge.step(0.0)
    targets = [(is_stop(message), message.target_system) for message in rig.order.said if isinstance(message, CommandLong)]
    assert targets == [(True, 9), (False, 9), (False, 9), (False, 1)], "the stop, its state, and then the rest"
    assert not rig.bridge.urgent


@pytest.mark.parametrize(
    ("ask", "urgent"),
    [
        (lambda peer: peer.disarm(), True),
        (lambda peer: peer.emergency_stop(), True),
        (lambda peer: drive(peer, 0.0, 0.0, 0.0), True),
        (lambda peer: drive(peer, 0.1, 0.0, 0.2), False),
        (lambda peer: peer.arm(), False),
        (lambda peer: peer.request(RobotStatus), False),
    ],
)
def test_what_is_urgent(ask: Callable[[Peer], object], urgent: bool) -> None:  # noqa: FBT001
    rig = Flooded()
    ask(rig.peer)
    assert rig.bridge.urgent is urgent
    rig.bridge.step(0.0)
    assert not rig.bridge.urgent


def test_an_urgent_question_that_failed_unsent_is_urgent_no_more() -> None:
    rig = Flooded()
    drive(rig.peer, 0.0, 0.0, 0.0)
    drive(rig.peer, 0.1, 0.1, 0.1)
    assert not rig.bridge.urgent


def test_a_disarming_that_had_to_wait_for_its_turn_goes_before_the_rest_of_that_moment() -> None:
    exchanges = Exchanges("robot 1", Counters(), Retry())
    arming, disarming = (CommandLong(1, 1, Command.ARM_DISARM, 0, armed) for armed in (1.0, 0.0))
    ticket = exchanges.add(CommandExchange("arming", arming))
    exchanges.due(0.0)
    exchanges.add(CommandExchange("disarming", disarming))
    exchanges.add(RequestExchange(RobotStatus, 1, 1))
    ack = CommandAck(Command.ARM_DISARM, CommandResult.ACCEPTED, target_system=255, target_component=190)
    exchanges.answer(Received(ack, 1, 1, 0, 0.01, b""))
    assert ticket.done
    first, second = exchanges.due(0.01)
    assert first == disarming
    assert isinstance(second, CommandLong)
    assert second.command == Command.REQUEST_MESSAGE


def test_a_robot_is_not_lost_by_a_backlog_that_has_waited_for_long() -> None:
    rig = Flooded()
    rig.begin(NOISE)
    rig.clock.advance(10.0)  # of the user's own code
    ticket = rig.peer.emergency_stop()
    rig.serve(lambda: len(rig.order.did) > 5)
    assert rig.bridge.pending
    assert not any(isinstance(event, PeerLost) for event in rig.events)
    assert ticket.error is None


def test_a_robot_is_not_lost_by_what_was_dropped() -> None:
    rig = Flooded()
    rig.clock.advance(10.0)  # of the user's own code; what came meanwhile was dropped, all but the last
    rig.bridge._pump._rest = (10.0, NOISE)  # type: ignore[attr-defined]
    ticket = rig.peer.emergency_stop()
    rig.serve()
    while not ticket.done:
        rig.events += rig.bridge.step(0.005)
    assert ticket.error is None
    assert not any(isinstance(event, PeerLost) for event in rig.events)


def test_a_robot_that_is_silent_is_lost_for_all_the_flood() -> None:
    rig = Flooded()
    rig.robots[0].silent = True
    for _ in range(400):
        rig.clock.advance(0.01)
        if not rig.bridge.pending:
            rig.flood = NOISE
        rig.events += rig.bridge.step(0.005)
    (lost,) = [event for event in rig.events if isinstance(event, PeerLost)]
    assert 3.0 <= lost.time <= 3.2


def test_what_was_dropped_is_counted_and_told_once_a_second() -> None:
    rig = Flooded()
    told = rig.order.news
    for overrun in (1000, 2500, 4000):
        rig.bridge._pump.overrun = overrun
        rig.events += rig.bridge.step(0.005)
        rig.clock.advance(0.4)
    assert [news.text.split(" ")[0] for news in told] == ["1,000"]
    rig.events += rig.bridge.step(0.005)
    assert [news.text.split(" ")[0] for news in told] == ["1,000", "3,000"]
    assert rig.bridge.overrun == 4000
    assert "more than 1,024 KiB were waiting" in told[0].text
    assert [event for event in rig.events if isinstance(event, LinkNews)] == told
    rig.clock.advance(5.0)
    rig.bridge.step(0.005)
    assert len(told) == 2


class Bounded(Link):
    """A link in real time that brings so much, and then nothing."""

    url = "bounded:"

    def __init__(self, *chunks: bytes) -> None:
        self._chunks = list(chunks)

    def write(self, data: bytes) -> None:
        del data

    def read(self, timeout: float) -> bytes:
        del timeout
        if not self._chunks:
            raise KeyError("the thread is to end without a word")
        return self._chunks.pop(0)

    def close(self) -> None:
        pass


def test_the_newest_is_heard_after_a_flood_that_nobody_took(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pump_module, "LIMIT", 3 * SLICE)
    clock, order = ManualClock(), Order()
    beat = MavlinkCodec(system=3, component=1).encode(BEAT)
    bridge = Bridge(Bounded(*[NOISE[:SLICE]] * 20, beat), clock, taps=[order])
    bridge._pump._thread.join(10.0)  # type: ignore[attr-defined]
    while bridge.pending:
        bridge.step(0.0)
    assert list(bridge.peers) == [3]
    assert bridge.overrun == 18 * SLICE  # the heartbeat takes the place of a third chunk
    assert len(order.news) == 1
    bridge.close()


def test_strangers_are_known_by_their_number_and_cost_nothing_else() -> None:
    rig = Flooded()
    rig.bridge.keep([1])
    frames = [MavlinkCodec(system=system, component=1).encode(BEAT) for system in range(2, 256)]
    rig.begin(b"".join(frames) * 10)
    rig.serve()
    assert set(rig.bridge.peers) == {1}
    assert len(rig.bridge.strangers) == 253  # 255 are we
    assert {type(message) for message in rig.order.said} <= {Heartbeat, CommandLong}


# --- Several networks ------------------------------------------------------------------------------------------------


class Waited(queue.SimpleQueue[None]):
    """In place of the bell that says that something has come; it never rings."""

    def __init__(self) -> None:
        self.waits: list[float] = []

    def get(self, block: bool = True, timeout: float | None = None) -> None:  # noqa: FBT001, FBT002 - as of the queue
        del block
        assert timeout is not None
        self.waits.append(timeout)
        raise queue.Empty


class Network:
    """A bridge as far as `Networks` looks at it."""

    def __init__(self, name: str, served: list[str], operator: Operator) -> None:
        self.link = Bounded()
        self.now = 0.0
        self.operator = operator
        self.pending = False
        self.urgent = False
        self._name = name
        self._served = served

    def next_due(self) -> float:
        return 5.0

    def step(self, wait: float) -> list[Event]:
        assert wait == 0.0
        self._served.append(self._name)
        return []


def networks() -> tuple[Networks, list[Network], Waited, list[str]]:
    both, served, waited, operator = Networks(), list[str](), Waited(), Operator()
    each = [Network(name, served, operator) for name in ("a", "b")]
    for name, network in zip("ab", each, strict=True):
        both.add(name, network)  # type: ignore[arg-type]
    both._bell = waited
    return both, each, waited, served


def test_networks_do_not_wait_while_more_has_come_than_was_taken_in() -> None:
    both, each, waited, _ = networks()
    both.step(2.0)
    assert waited.waits == [2.0]
    each[1].pending = True
    both.step(2.0)
    assert waited.waits == [2.0]


def test_networks_do_not_wait_while_something_is_asked_for() -> None:
    both, each, waited, _ = networks()
    each[0].operator.ask("key w")
    both.step(2.0)
    assert waited.waits == []


def test_the_network_with_something_urgent_is_served_first() -> None:
    both, each, _, served = networks()
    both.step(0.0)
    each[1].urgent = True
    both.step(0.0)
    assert served == ["a", "b", "b", "a"]
