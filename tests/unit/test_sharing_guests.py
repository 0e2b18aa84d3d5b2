"""Guests of a shared link over loopback: all see the same, the slow are cut off, rubbish does no harm, nobody is waited for."""

from __future__ import annotations

import socket
import threading
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import numpy as np
import pytest
from guest import PATIENCE, ROVER, STOP, Guest

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    ROBOT_COMPONENT,
    SHARE_COMPONENT,
    AutopilotVersion,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    JuniorSensors,
    ParamRequestRead,
    RobotAck,
    RobotAlive,
    RobotSession,
    Statustext,
)
from firmware_protocol.wire.batch import Arrivals
from firmware_protocol.wire.rows import ROWS
from hil.sharing.guests import MOST_GUESTS, MOST_HEARD, MOST_WAITING
from hil.sharing.sharing import Sharing

if TYPE_CHECKING:
    from collections.abc import Iterator

    from firmware_protocol.wire.fields import Message

LONG = "a line of a length that a robot may well say, at most"[:50]
QUESTION = CommandLong(1, 1, Command.REQUEST_MESSAGE, 0, 148.0)


class Shared:
    """A link that is shared, and what its guests have asked for."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, str]] = []
        self._asking = threading.Condition()
        self.sharing = Sharing("127.0.0.1", 0, "coach", self._ask)
        self.port = self.sharing.port
        self.says(ROVER)
        self.says(AutopilotVersion(7, 1, 2, uid=99))

    def _ask(self, what: str, robot: str) -> None:
        with self._asking:
            self.asked.append((what, robot))
            self._asking.notify_all()

    def wait_for_asked(self, count: int) -> None:
        """Wait until so much was asked for."""
        with self._asking:
            assert self._asking.wait_for(lambda: len(self.asked) >= count, PATIENCE)

    def says(self, message: Message, system: int = 1, component: int = ROBOT_COMPONENT) -> None:
        """Somebody on the link says this."""
        self.sharing.received(Received(message, system, component, 0, 0.0, b""))


@contextmanager
def link() -> Iterator[Shared]:
    made = Shared()
    try:
        yield made
    finally:
        made.sharing.finish()


@pytest.fixture
def shared() -> Iterator[Shared]:
    with link() as made:
        yield made


def test_a_comer_is_told_who_drives_and_who_is_there(shared: Shared) -> None:
    with Guest(shared.port) as guest:
        guest.wait_for(Heartbeat, lambda one: one.type == 10)
        first, second, third = guest.heard[:3]
    assert (first.system, first.component, type(first.message)) == (HOST_SYSTEM, SHARE_COMPONENT, Heartbeat)
    assert second.message == guest.welcome == Statustext(6, "watching, coach drives")
    assert (third.system, third.component, third.message) == (1, ROBOT_COMPONENT, ROVER)


def test_both_directions_are_copied_to_all_in_order(shared: Shared) -> None:
    with Guest(shared.port) as one, Guest(shared.port, 250, 7) as other:
        for number in range(300):
            shared.says(Statustext(6, f"{number}"))
            shared.sharing.sent(0.0, RobotAlive(number + 1))
        for guest in (one, other):
            guest.wait_for(RobotAlive, lambda alive: alive.host == 300)
            told = [event for event in guest.heard if isinstance(event.message, Statustext | RobotAlive)][1:]
            assert [event.message.text for event in told[::2] if isinstance(event.message, Statustext)] == [
                str(number) for number in range(300)
            ]
            assert {(event.system, event.component) for event in told[1::2]} == {(HOST_SYSTEM, HOST_COMPONENT)}
            of_robot = [event.sequence for event in guest.heard if event.system == 1]
            assert of_robot == [number & 0xFF for number in range(len(of_robot))], "no frame is missing"


def test_what_comes_as_arrays_is_copied_too(shared: Shared) -> None:
    rows = np.zeros(3, ROWS[RobotAlive])
    rows["host"] = (5, 6, 7)
    heard = [Received(Statustext(6, "heard"), 1, ROBOT_COMPONENT, 0, 0.0, b"")]
    with Guest(shared.port) as guest:
        shared.sharing.sent_rows(0.0, RobotAlive, rows)
        shared.sharing.arrived(Arrivals({}, heard, [0]))
        guest.wait_for(Statustext, lambda one: one.text == "heard")
        assert [one.host for one in guest.of_kind(RobotAlive)] == [5, 6, 7]


def test_answers_to_the_host_are_not_taken_for_a_guest_s_own(shared: Shared) -> None:
    to_host = RobotAck(RobotSession.ID, 1, 0, HOST_SYSTEM, HOST_COMPONENT, 0, 0)
    with Guest(shared.port) as alike, Guest(shared.port, 255, 230) as other:
        for guest in (alike, other):
            guest.say(QUESTION)
            guest.wait_for(AutopilotVersion)
        shared.says(to_host)
        shared.says(CommandAck(400, CommandResult.ACCEPTED, target_system=HOST_SYSTEM, target_component=HOST_COMPONENT))
        shared.says(Statustext(6, "after"))
        for guest, acks in ((alike, 0), (other, 1)):
            guest.wait_for(Statustext, lambda one: one.text == "after")
            assert guest.of_kind(RobotAck).count(to_host) == acks
            assert [ack.command for ack in guest.of_kind(CommandAck)] == [Command.REQUEST_MESSAGE]


def test_a_guest_s_stop_is_asked_for_and_answered_to_it_alone(shared: Shared) -> None:
    with Guest(shared.port, 250, 7) as one, Guest(shared.port, 251, 7) as other:
        one.say(STOP)
        shared.wait_for_asked(1)
        assert shared.asked == [("guest stop", "")]
        shared.says(CommandAck(185, 0, target_system=HOST_SYSTEM, target_component=HOST_COMPONENT))
        assert one.wait_for(CommandAck, lambda ack: ack.target_system == 250).result == CommandResult.ACCEPTED
        shared.says(Statustext(6, "after"))
        other.wait_for(Statustext, lambda told: told.text == "after")
        assert other.of_kind(CommandAck) == []


def test_a_stop_that_the_robot_does_not_confirm_has_failed(shared: Shared) -> None:
    with Guest(shared.port, 250, 7) as guest:
        guest.say(STOP)
        assert guest.wait_for(CommandAck).result == CommandResult.FAILED


def test_a_slow_guest_is_cut_off_and_nobody_waits_for_it(shared: Shared) -> None:
    with Guest(shared.port, holds=4096) as slow, Guest(shared.port, 250, 7) as quick:
        rounds = 4 * MOST_WAITING // (1000 * len(LONG))
        for number in range(rounds):
            for _ in range(1000):
                shared.says(Statustext(6, LONG))
            shared.says(Statustext(6, f"{number}"))
            quick.wait_for(Statustext, lambda one, last=f"{number}": one.text == last)  # type: ignore[misc]
        assert len(quick.of_kind(Statustext)) == rounds * 1001 + 1
        slow.to_the_end()
        assert len(slow.of_kind(Statustext)) < rounds * 1001
    with Guest(shared.port) as again:
        assert again.welcome.severity == 6


def test_rubbish_is_passed_over_and_listened_to_slowly(shared: Shared) -> None:
    rubbish = bytes(np.random.default_rng(5).integers(0, 256, MOST_HEARD // 2, np.uint8))
    with Guest(shared.port) as bad, Guest(shared.port, 250, 7) as good:
        for beginning in (rubbish, b"\xfd" * 300, b"\xfe" * 40, b"GET / HTTP/1.1\r\n\r\n"):
            bad.socket.sendall(beginning)
            for _ in range(280):  # bytes of a frame that the rubbish may seem to have begun
                bad.say(RobotAlive(1))
            bad.say(QUESTION)
            bad.wait_for(AutopilotVersion)
        bad.socket.settimeout(0.0)
        sent = 0
        with suppress(BlockingIOError):
            while sent < 1 << 28:
                sent += bad.socket.send(rubbish * 8)
        assert sent < 1 << 26, "it is not listened to as fast as it speaks"
        good.say(QUESTION)
        good.wait_for(AutopilotVersion)
    assert shared.asked == []


@pytest.mark.parametrize("method", ["POST", "GET", "OPTIONS"])
def test_a_page_in_a_browser_stops_nothing(shared: Shared, method: str) -> None:
    with Guest(shared.port) as page, Guest(shared.port, 250, 7) as good:
        page.socket.sendall(f"{method} / HTTP/1.1\r\nContent-Length: 45\r\n\r\n".encode())
        with suppress(OSError):
            page.say(STOP)
        good.say(QUESTION)
        good.wait_for(AutopilotVersion)
    assert shared.asked == []


def test_who_asks_without_listening_is_cut_off(shared: Shared) -> None:
    with Guest(shared.port, holds=4096) as deaf, Guest(shared.port, 250, 7) as good:
        deaf.socket.settimeout(0.0)
        with suppress(BlockingIOError):
            for _ in range(100_000):
                deaf.say(ParamRequestRead(1, 1, "P9"))
        good.say(QUESTION)
        good.wait_for(AutopilotVersion)


def test_one_too_many_is_told_so(shared: Shared) -> None:
    guests = [Guest(shared.port) for _ in range(MOST_GUESTS)]
    with Guest(shared.port) as late:
        assert late.welcome == Statustext(3, "4 programs look on already")
        late.to_the_end()
    guests.pop().socket.close()
    shared.says(Statustext(6, LONG))
    for _ in range(100):  # until it is noticed that there is room
        with Guest(shared.port) as late:
            if late.welcome.severity == 6:
                break
    else:
        pytest.fail("there is no room where one has left")
    for guest in guests:
        guest.socket.close()


@pytest.mark.parametrize(("died", "words"), [(False, "coach has ended"), (True, "coach has died, or was killed")])
def test_at_the_end_everybody_is_told(died: bool, words: str) -> None:  # noqa: FBT001 - a parameter
    with link() as shared, Guest(shared.port) as guest:
        shared.says(Statustext(6, "last"))
        shared.sharing.finish(died=died)
        guest.to_the_end()
        assert [one.text for one in guest.of_kind(Statustext)][1:] == ["last", f"{words}: nobody drives"]
        assert guest.of_kind(Statustext)[-1].severity == 3
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", shared.port), PATIENCE)


def test_what_is_said_when_nobody_looks_on_costs_nothing_and_is_not_kept(shared: Shared) -> None:
    sensors = JuniorSensors(time=1.0, battery=7.4, travel=(0.0, 0.0), eye=(1, 2), floor=(3, 4), flags=0)
    shared.says(sensors)
    with Guest(shared.port) as guest:
        guest.say(CommandLong(1, 1, Command.REQUEST_MESSAGE, 0, float(JuniorSensors.ID)))
        assert guest.wait_for(CommandAck).result == CommandResult.DENIED
        shared.says(sensors)
        guest.wait_for(JuniorSensors)
        guest.say(CommandLong(1, 1, Command.REQUEST_MESSAGE, 0, float(JuniorSensors.ID)))
        assert guest.wait_for(CommandAck).result == CommandResult.ACCEPTED


def test_a_port_that_is_taken_is_refused() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(OSError, match="in use"):
        Sharing("127.0.0.1", taken.getsockname()[1], "coach", lambda *_: None)
