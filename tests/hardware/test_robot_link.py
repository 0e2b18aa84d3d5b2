"""What every link to a robot must do, with the robot at hand: `pytest tests/hardware --hil-link serial:///dev/ttyACM0:115200`.

No wheel turns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import pytest

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.links.opening import open_link
from firmware_protocol.messages import JuniorSensors, RobotStatus
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from hil.bridge.bridge import Bridge
from hil.bridge.clock import MonotonicClock

if TYPE_CHECKING:
    from collections.abc import Iterator

    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.peer.peer import Peer

pytestmark = pytest.mark.hardware
T = TypeVar("T")


@pytest.fixture
def bridge(hil_link: str) -> Iterator[Bridge]:
    clock = MonotonicClock()
    with Bridge(open_link(hil_link), clock) as bridge:
        while clock.now() < 5 and not any(peer.ready for peer in bridge.peers.values()):
            bridge.step(0.1)
        yield bridge


@pytest.fixture
def peer(bridge: Bridge) -> Peer:
    ready = [peer for peer in bridge.peers.values() if peer.ready]
    assert ready, "no robot has answered within 5 s"
    return ready[0]


def ask(bridge: Bridge, ticket: Ticket[T]) -> T:
    while not ticket.done:
        bridge.step(0.1)
    return ticket.value()


def test_a_robot_is_heard_and_the_link_can_be_closed(hil_link: str) -> None:
    clock = MonotonicClock()
    link = open_link(hil_link)
    came = b""
    while not came and clock.now() < 3:
        came = link.read(0.5)
    assert came
    link.close()
    with pytest.raises(LinkClosedError):
        link.read(0)


def test_parameters_are_those_of_this_version(bridge: Bridge, peer: Peer) -> None:
    listed = ask(bridge, peer.list_parameters())
    assert list(listed) == [parameter.name for parameter in JUNIOR_PARAMETERS]


def test_it_answers_quickly_and_its_clock_runs(bridge: Bridge, peer: Peer) -> None:
    first = ask(bridge, peer.request(JuniorSensors)).time
    for _ in range(50):
        ask(bridge, peer.ping())
    assert ask(bridge, peer.request(JuniorSensors)).time > first
    assert peer.counters.latency_mean < 0.05
    assert peer.counters.loss < 0.05


def test_it_is_disarmed_and_has_our_session(bridge: Bridge, peer: Peer) -> None:
    status = ask(bridge, peer.request(RobotStatus))
    assert status.session == peer.session
    assert not peer.armed
