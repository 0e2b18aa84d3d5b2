"""What a step meets besides bytes, and what was not taken by the link: the taps are told of all of it, where it happens."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from quiet_tap import QuietTap
from scripted_pump import Nowhere, ScriptedPump, Taken
from scripted_robot import PERIOD, ScriptedRobot

import hil
from firmware_protocol.clock import ManualClock
from firmware_protocol.errors import LinkClosedError, LinkError, LinkTimeoutError
from firmware_protocol.events import LinkNews, Received, Rejected
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import Heartbeat, JuniorManeuverResult, Ping
from firmware_protocol.roles.junior import perform
from firmware_protocol.vocabulary import Action, Maneuver
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.signing import Signing, SigningKey, setup_signing
from hil.bridge.bridge import Bridge
from hil.bridge.pump import Back, Lost
from hil.bridge.reopening import Reopening
from hil.bridge.taps import NOTHING, Circumstances, Opening

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.events import Event
    from firmware_protocol.link import Link
    from firmware_protocol.wire.fields import Message

BEAT = MavlinkCodec(system=3, component=1).encode(Heartbeat(10, 0, 0, 0, 4))
GONE = LinkClosedError("nowhere:", "pulled")
KEY = SigningKey(bytes(range(1, 33)))


class Met(QuietTap):
    """A tap that notes what steps meet, and what else happens, in order."""

    def __init__(self) -> None:
        self.met: list[Circumstances] = []
        self.did: list[str] = []
        self.openings: list[Opening] = []
        self.drawn: list[int] = []
        self.heard: list[Message] = []
        self.refused: list[tuple[float, bytes, LinkError]] = []

    def opened(self, opening: Opening) -> None:
        self.openings.append(opening)
        self.did.append("opened")

    def session_drawn(self, number: int) -> None:
        self.drawn.append(number)
        self.did.append("drawn")

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> None:
        del time, chunks
        self.met.append(met)
        self.did.append("step")

    def unsent(self, time: float, data: bytes, error: LinkError) -> None:
        self.refused.append((time, data, error))
        self.did.append("unsent")

    def wire_tx(self, time: float, data: bytes) -> None:
        del time, data
        self.did.append("tx")

    def received(self, event: Received | Rejected) -> None:
        self.did.append("heard")
        if isinstance(event, Received):
            self.heard.append(event.message)

    def sent(self, time: float, message: Message) -> None:
        del time
        self.did.append(f"said {type(message).__name__}")

    def event(self, event: Event) -> None:
        self.did.append(type(event).__name__)


class Opener:
    """Opens nothing: the pump tells when the link is there again."""

    def open(self) -> Link:
        raise NotImplementedError

    def let_pass(self, duration: float) -> None:
        raise NotImplementedError(duration)


class Rig:
    """A bridge whose pump is a script."""

    def __init__(self, *script: Taken, patience: float = 0.0) -> None:
        self.tap, self.link, self.clock, self.pump = Met(), Nowhere(), ManualClock(1.5), ScriptedPump(*script)
        reopening = Reopening(Opener(), patience) if patience else None
        self.bridge = Bridge(
            self.link, self.clock, taps=[self.tap], session=lambda: 77, pump=self.pump, reopening=reopening, network="net"
        )

    def step(self) -> list[Event]:
        self.clock.advance(0.01)
        return self.bridge.step(0.1)


# --- how a bridge begins ---------------------------------------------------------------------------------------------


def test_taps_are_told_how_a_bridge_begins_before_anything_else() -> None:
    rig = Rig()
    assert rig.tap.openings == [Opening("net", "nowhere:", "mavlink", lockstep=False, clock=1.5)]
    assert rig.tap.drawn == [77]
    assert rig.tap.did == ["opened", "drawn"]
    assert rig.bridge.network == "net"


def test_a_network_is_called_after_its_link_unless_it_has_a_name() -> None:
    tap = Met()
    Bridge(Nowhere("nowhere:7"), ManualClock(), taps=[tap], pump=ScriptedPump()).close()
    assert tap.openings[0].network == "nowhere:7"


def test_the_calendar_of_a_signed_run_is_told() -> None:
    tap = Met()
    Bridge(Nowhere(), ManualClock(), taps=[tap], pump=ScriptedPump(), signing=Signing(KEY, lambda: 123_456)).close()
    assert tap.openings[0].signing_time == 123_456


def test_every_number_that_is_drawn_is_told() -> None:
    robot, tap, numbers = ScriptedRobot(), Met(), iter(range(100, 200))
    with Bridge(MemoryLink(robot), robot, taps=[tap], session=lambda: next(numbers)) as bridge:
        while not (bridge.peers and bridge.peers[1].ready):
            bridge.step(0.1)
        assert tap.drawn == [bridge.host, bridge.peers[1].session] == [100, 101]
        bridge.begin_anew("asleep")
        while bridge.peers[1].session != 102:
            bridge.step(0.1)
    assert tap.drawn == [100, 101, 102]


# --- what a step meets -----------------------------------------------------------------------------------------------


def test_most_steps_meet_nothing() -> None:
    rig = Rig(Taken(((1.51, BEAT),)))
    rig.step()
    rig.step()
    assert [met is NOTHING for met in rig.tap.met] == [True, True]


def test_a_link_that_is_lost_and_is_back() -> None:
    again = Nowhere("nowhere:2")
    rig = Rig(Taken(((1.51, BEAT),), Lost(GONE)), Taken(), Taken((), Back(again)), Taken(), patience=5.0)
    for _ in range(4):
        rig.step()
    assert rig.tap.met == [Circumstances(lost=GONE), NOTHING, Circumstances(back="nowhere:2"), NOTHING]
    assert rig.pump.let == 1
    assert rig.bridge.link is again


def test_a_link_that_has_ended() -> None:
    rig = Rig(Taken(((1.51, BEAT),)), Taken(error=GONE))
    rig.step()
    rig.step()
    assert rig.tap.met == [NOTHING, Circumstances(ended=GONE)]
    with pytest.raises(LinkClosedError, match="pulled"):
        rig.step()
    assert len(rig.tap.met) == 2


def test_news_of_the_link() -> None:
    rig = Rig()
    rig.step()
    rig.link.said = ["the bus is in trouble", "the bus is well"]
    events = rig.step()
    rig.step()
    assert rig.tap.met == [NOTHING, Circumstances(news=("the bus is in trouble", "the bus is well")), NOTHING]
    assert [event.text for event in events if isinstance(event, LinkNews)] == ["the bus is in trouble", "the bus is well"]


def test_bytes_that_were_dropped_by_each_step() -> None:
    rig = Rig(Taken(dropped=10), Taken(), Taken(dropped=7))
    for _ in range(3):
        rig.step()
    assert rig.tap.met == [Circumstances(dropped=10), NOTHING, Circumstances(dropped=7)]


def test_a_bridge_over_an_emulated_robot_whose_plug_is_pulled_tells_likewise() -> None:
    tap = Met()
    with hil.connect("sim://junior?faults=unplug:1+0.3", taps=[tap], reconnect=5) as junior:
        junior.wait(3.0)
        junior.wait_until_back()
    (lost,) = [met for met in tap.met if met.lost is not None]
    (back,) = [met for met in tap.met if met.back]
    assert isinstance(lost.lost, LinkClosedError)
    assert (lost.back, back.lost) == ("", None)
    assert back.back == junior.bridge.link.url
    assert tap.met.index(lost) < tap.met.index(back)
    assert tap.openings[0].network == "sim://junior?faults=unplug:1+0.3"


# --- what the link does not take -------------------------------------------------------------------------------------


def test_what_is_not_taken_in_time_is_told_and_not_as_sent() -> None:
    rig = Rig()
    rig.link.failure = LinkTimeoutError("nowhere:", "busy")
    rig.step()
    assert rig.tap.did == ["opened", "drawn", "step", "unsent"]
    ((time, data, error),) = rig.tap.refused
    assert time == pytest.approx(1.51)
    assert error is rig.link.failure
    assert len(data) == 21
    assert rig.bridge.unsent == 1
    rig.link.failure = None
    rig.bridge.send(Ping(7, 1))
    assert rig.tap.did[-2:] == ["tx", "said Ping"]


def test_what_finds_the_link_gone_is_told_and_ends_it() -> None:
    rig = Rig()
    rig.link.failure = GONE
    with pytest.raises(LinkClosedError, match="pulled"):
        rig.bridge.send(Ping(7, 1))
    ((time, data, error),) = rig.tap.refused
    assert (time, error) == (1.5, GONE)
    assert data == MavlinkCodec(system=255, component=190).encode(Ping(7, 1))
    rig.step()
    assert rig.tap.met == [NOTHING]  # it was the write that told so
    with pytest.raises(LinkClosedError, match="pulled"):
        rig.step()


def test_where_the_link_may_be_opened_again_the_pump_is_told_and_no_more_is_written() -> None:
    rig = Rig(patience=5.0)
    rig.link.failure = GONE
    rig.bridge.send(Ping(7, 1))
    assert rig.pump.dropped == [GONE]
    with pytest.raises(LinkClosedError, match="for the moment"):
        rig.bridge.send(Ping(7, 2))
    rig.step()
    assert len(rig.tap.refused) == 1
    assert rig.bridge.unsent == 0


def test_a_key_that_was_not_taken_is_not_told() -> None:
    rig = Rig()
    rig.link.failure = LinkTimeoutError("nowhere:", "busy")
    rig.bridge.send(setup_signing(1, KEY, 5))
    ((_, data, _),) = rig.tap.refused
    assert KEY.secret[:4] not in data
    assert data[10:] == bytes(len(data) - 10)


# --- beginning anew --------------------------------------------------------------------------------------------------


def test_beginning_anew_comes_before_anything_is_taken_in_or_sent() -> None:
    robot, tap = ScriptedRobot(), Met()
    with Bridge(MemoryLink(robot), robot, taps=[tap], session=iter(range(100, 200)).__next__) as bridge:
        while not (bridge.peers and bridge.peers[1].ready):
            bridge.step(0.1)
        ticket = perform(bridge.peers[1], Maneuver((Action.F,), period=0.05, floor_reflex=False))
        while robot._result is None or robot.now() < robot._result_due - 1.5 * PERIOD:
            bridge.step(PERIOD)
        assert not ticket.done  # its result comes with the next bytes
        bridge.begin_anew("asleep")
        tap.did.clear()
        bridge.step(PERIOD)
        assert tap.did[:3] == ["step", "PeerLost", "heard"]
        assert any(isinstance(event, JuniorManeuverResult) for event in tap.heard)
        assert ticket.error is not None
        assert ticket.answered_at is None
        assert "asleep" in str(ticket.error)
