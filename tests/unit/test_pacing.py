"""What a robot is asked for on a slow line, and which line is too slow."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from firmware_bench import FirmwareBench
from quiet_tap import QuietTap

import hil
from firmware_protocol.address import parse_address
from firmware_protocol.errors import LinkOpenError
from firmware_protocol.events import LinkNews, PeerBack, PeerFound, Received
from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.messages import (
    AutopilotVersion,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    JuniorSensors,
    RefereeState,
    RobotAlive,
    RobotStatus,
    State,
    Timesync,
)
from firmware_protocol.peer.exchanges.commands import CommandExchange
from firmware_protocol.peer.exchanges.exchange import Exchanges
from firmware_protocol.peer.pacing import (
    baud_of,
    by_itself,
    bytes_per_second,
    frame_length,
    full_capacity,
    least_capacity,
    pace_for,
    spared,
)
from firmware_protocol.peer.quality import Counters
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.wire.mavlink import MavlinkCodec
from hil.connecting.lines import capacity_of, need_full_rate, pace_of
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from firmware_protocol.events import Event
    from firmware_protocol.wire.fields import Message


class Overheard(QuietTap):
    """A tap that counts bytes.

    Attributes:
        came: Stamp and number of bytes of what came, in order.
        events: What was told.
        said: What we have said.
    """

    def __init__(self) -> None:
        self.came: list[tuple[float, int]] = []
        self.events: list[Event] = []
        self.said: list[Message] = []

    def wire_rx(self, time: float, data: bytes) -> None:
        """Count."""
        self.came.append((time, len(data)))

    def sent(self, time: float, message: Message) -> None:  # noqa: ARG002 - a tap's
        """Keep what we say."""
        self.said.append(message)

    def event(self, event: Event) -> None:
        """Keep what is told."""
        self.events.append(event)


def test_the_robots_own_rates_are_those_that_are_reckoned_with() -> None:
    bench = FirmwareBench()
    bench.run(10_000)
    heard = {kind: len(bench.got(kind)) / 10 for kind in by_itself(JUNIOR)}
    assert heard == pytest.approx({kind: 1 / interval for kind, interval in by_itself(JUNIOR).items()}, abs=0.11)
    assert not bench.got(AutopilotVersion)


@pytest.mark.parametrize(
    ("message", "length"), [(RobotAlive(65535), 14), (JuniorSensors(1.0, (1.0, 1.0), (9, 9), (9, 9), 7.4, 0x8001), 40)]
)
def test_the_length_of_a_frame_is_what_a_codec_makes_of_it(message: Message, length: int) -> None:
    made = len(MavlinkCodec(system=255, component=190).encode(message))
    assert made == length
    assert made <= frame_length(type(message), signed=False) == frame_length(type(message), signed=True) - 13


@pytest.mark.parametrize(("signed", "least", "full"), [(False, 9_100, 42_600), (True, 16_100, 56_400)])
def test_which_rates_are_too_slow_and_which_slow(signed: bool, least: int, full: int) -> None:  # noqa: FBT001
    assert baud_of(least_capacity(JUNIOR, signed=signed)) == least
    assert baud_of(full_capacity(JUNIOR, signed=signed)) == full
    assert pace_for(JUNIOR, full_capacity(JUNIOR, signed=signed), signed=signed) is None
    assert pace_for(JUNIOR, full_capacity(JUNIOR, signed=signed) - 1, signed=signed) is not None


@pytest.mark.parametrize(
    ("baud", "signed"),
    [
        *[(baud, False) for baud in (9600, 14400, 19200, 28800, 38400, 42000)],
        *[(baud, True) for baud in (19200, 28800, 38400, 56000)],
    ],
)
def test_half_of_a_slow_line_stays_free(baud: int, signed: bool) -> None:  # noqa: FBT001
    capacity = baud / 10
    pace = pace_for(JUNIOR, capacity, signed=signed)
    assert pace is not None
    asked = {**spared(JUNIOR), **pace.streams}
    assert bytes_per_second(asked, signed=signed) <= capacity / 2
    assert JUNIOR.streams[JuniorSensors] <= pace.streams[JuniorSensors] <= JUNIOR.slowest
    faster = {**asked, JuniorSensors: pace.streams[JuniorSensors] - 0.005}
    assert bytes_per_second(faster, signed=signed) > capacity / 2, "no slower than it must be"
    assert pace.retry.first > 240 / capacity


def test_what_a_line_carries() -> None:
    assert capacity_of(parse_address("serial:///dev/ttyS0:19200")) == 1920
    assert capacity_of(parse_address("tcp://127.0.0.1:1")) is None
    spec = FaultSpec(rate=500.0)
    assert capacity_of(parse_address("tcp://127.0.0.1:1"), spec) == 500
    assert capacity_of(parse_address("serial:///dev/ttyS0:19200"), spec) == 500
    assert capacity_of(parse_address("serial:///dev/ttyS0:19200"), replace(spec, rate=5000.0)) == 1920


@pytest.mark.parametrize(
    ("url", "signed", "words"),
    [
        ("serial:///dev/ttyS0:300", False, "a line of 300 baud is too slow: driving a robot takes 9,100 baud. Set both ends"),
        ("serial:///dev/ttyS0:4800", False, "a line of 4,800 baud is too slow: driving a robot takes 9,100 baud"),
        ("serial:///dev/ttyS0:9600", True, "a line of 9,600 baud is too slow: driving a robot takes 16,100 baud"),
    ],
)
def test_a_line_that_is_too_slow_is_refused_with_the_figure(url: str, signed: bool, words: str) -> None:  # noqa: FBT001
    with pytest.raises(LinkOpenError, match=words):
        pace_of(parse_address(url), signed=signed)


def test_a_check_needs_all_that_a_robot_says() -> None:
    need_full_rate(parse_address("serial:///dev/ttyS0:57600"), signed=False)
    with pytest.raises(LinkOpenError, match=r"38,400 baud is too slow: checking all that a robot says takes 42,600 baud"):
        need_full_rate(parse_address("serial:///dev/ttyS0:38400"), signed=False)


def test_no_port_is_opened_that_is_too_slow() -> None:
    with pytest.raises(LinkOpenError, match="1,200 baud"):
        hil.connect("serial:///dev/nowhere:1200")
    with pytest.raises(LinkOpenError, match="1,200 baud"):
        hil.connect_all("serial:///dev/nowhere:1200", watch=True)
    with pytest.raises(LinkOpenError, match=r"a line of 500 bytes a second is too slow: driving a robot takes 902"):
        hil.connect("sim://junior?faults=rate:500")


@pytest.mark.parametrize("rate", [960, 1920, 3840])
def test_on_a_slow_line_the_robot_is_asked_for_less_and_works(rate: int) -> None:
    tap = Overheard()
    with hil.connect(f"sim://junior?seed=1&faults=rate:{rate}", taps=[tap]) as junior:
        pace = junior.bridge.pace
        assert pace is not None
        told = [event for event in tap.events if isinstance(event, LinkNews)]
        assert [event.text for event in told] == [pace.text]
        assert told[0].time < next(event.time for event in tap.events if isinstance(event, PeerFound))
        assert junior.referee is not None
        junior.wait(3.0)  # what was under way before it was asked for less
        quiet, came = junior.now(), len(tap.came)
        assert not junior.stale
        junior.wait(10.0)
        assert sum(size for _, size in tap.came[came:]) / (junior.now() - quiet) <= rate / 2
        assert junior.parameter("EYE_L_ON") == 250
        junior.arm()
        assert junior.perform(["L", "R"]).done == 2
        junior.disarm()
        assert junior.state is State.DISARMED


def test_a_robot_that_restarts_is_asked_again() -> None:
    tap = Overheard()
    with hil.connect("sim://junior?seed=1&faults=rate:1920,brownout:4+0.5", taps=[tap], reconnect=30.0) as junior:
        junior.wait(4.2)
        junior.wait_until_back()
        junior.wait(4.0)  # what was under way before it was asked for less
        assert any(isinstance(event, PeerBack) and event.rebooted for event in tap.events)
        quiet, came = junior.now(), len(tap.came)
        junior.wait(5.0)
        assert sum(size for _, size in tap.came[came:]) / (junior.now() - quiet) <= 1920 / 2
        assert sum(isinstance(event, LinkNews) and "line carries" in event.text for event in tap.events) == 1
    asked = [int(said.param1) for said in tap.said if isinstance(said, CommandLong) and said.target_component == 25]
    assert asked.count(RefereeState.ID) >= 2, "a referee may have been restarted with it"


def test_the_usual_rate_of_a_stream_is_that_of_the_line() -> None:
    with hil.connect("sim://junior?seed=1&faults=rate:1920") as junior:
        junior.finish(junior.peer.message_interval(JuniorSensors, 0.0))
        before = junior.peer.counters.good
        junior.wait(5.0)
        assert junior.peer.counters.good - before < 250 / 2


def test_on_a_slow_line_a_late_answer_is_waited_for_longer_before_the_next_question_of_its_kind() -> None:
    pace = pace_for(JUNIOR, 960.0, signed=False)
    assert pace is not None
    exchanges = Exchanges("robot 1", Counters(), pace.retry)

    def answer(time: float) -> None:
        exchanges.answer(Received(CommandAck(Command.SET_MESSAGE_INTERVAL, CommandResult.ACCEPTED), 1, 1, 0, time, b""))

    first, second = (
        exchanges.add(CommandExchange(f"streaming {kind.NAME}", CommandLong(1, 1, Command.SET_MESSAGE_INTERVAL, 0, kind.ID)))
        for kind in (JuniorSensors, RobotStatus)
    )
    assert len(exchanges.due(0.0)) == 1
    assert exchanges.due(pace.retry.first - 0.01) == []
    assert len(exchanges.due(pace.retry.first)) == 1, "it is repeated"
    answer(pace.retry.first + 0.01)  # to the first try
    assert first.done
    late = 2 * pace.retry.first  # and to the second, after as long as that to the first took
    assert exchanges.due(late) == []
    answer(late)
    assert not second.done
    assert len(exchanges.due(pace.retry.first + pace.retry.hold + 0.01)) == 1


def test_a_fast_line_is_left_as_it_is() -> None:
    tap = Overheard()
    with hil.connect("sim://junior?seed=1&faults=rate:5760", taps=[tap]) as junior:
        assert junior.bridge.pace is None
    intervals = {
        int(message.param1): message.param2
        for message in tap.said
        if isinstance(message, CommandLong) and message.command == Command.SET_MESSAGE_INTERVAL
    }
    assert intervals == {JuniorSensors.ID: 20000.0, RobotStatus.ID: 1e6}
    assert not any(isinstance(event, LinkNews) for event in tap.events)


def test_a_vehicle_that_may_be_no_junior_is_asked_for_nothing_that_it_has() -> None:
    tap = Overheard()
    with hil.connect_all("sim://junior?seed=1&faults=rate:1920", watch=True, taps=[tap], expect=1):
        pass
    commands = [message for message in tap.said if isinstance(message, CommandLong)]
    changed = {int(message.param1) for message in commands if message.command == Command.SET_MESSAGE_INTERVAL}
    assert changed == {JuniorSensors.ID}


def test_an_emulated_referee_reports_as_often_as_it_is_asked_to() -> None:
    world = junior_world(WorldSettings(seed=1))
    host, ears = MavlinkCodec(system=255, component=190), MavlinkCodec(system=1, component=1)

    def reports(inbound: bytes = b"") -> tuple[int, list[int]]:
        """How many come in two seconds, and with what the order was answered."""
        out = world.step(inbound) + b"".join(world.step(b"") for _ in range(399))
        heard = [event.message for event in ears.receive(out, world.now()) if isinstance(event, Received)]
        acks = [message.result for message in heard if type(message).__name__ == "CommandAck"]  # type: ignore[attr-defined]
        return sum(isinstance(message, RefereeState) for message in heard), acks

    def order(interval: float, message: int = RefereeState.ID) -> bytes:
        return host.encode(CommandLong(1, 25, Command.SET_MESSAGE_INTERVAL, param1=float(message), param2=interval))

    assert reports() == (40, [])
    assert reports(order(400e3)) == (5, [CommandResult.ACCEPTED])
    assert reports(order(-1.0)) == (5, [CommandResult.DENIED]), "nobody would know how a bout ends"
    assert reports(order(400e3, JuniorSensors.ID)) == (5, [CommandResult.DENIED])
    assert reports(order(0.0)) == (40, [CommandResult.ACCEPTED])


def test_a_robot_on_a_paced_port_waits_for_room_instead_of_losing_what_it_says() -> None:
    world = junior_world(WorldSettings(seed=1))
    ears = MavlinkCodec(system=255, component=190)
    heard: dict[type[Message], int] = {}
    waiting = 0.0
    for _ in range(1000):  # 960 bytes a second for 5 s, and a buffer of 192
        waiting = max(0.0, waiting - 4.8)
        world.room = int(192 - waiting)
        out = world.step(b"")
        waiting += len(out)
        assert waiting <= 192
        for event in ears.receive(out, world.now()):
            assert isinstance(event, Received)
            heard[type(event.message)] = heard.get(type(event.message), 0) + 1
    assert heard[Heartbeat] == 5, "what comes first in its period is never lost"
    assert heard[JuniorSensors] > 80
    assert Timesync not in heard
