"""Several robots on one link, over every kind of link, in real time: found, commanded together, and one of them lost."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Final

import pytest
from serving import Stepped, in_thread

import hil
from firmware_protocol.errors import PeerError, PeerLostError
from firmware_protocol.events import PeerBack, PeerLost
from simdevice.serving.opening import open_endpoint
from simdevice.sumo.crowd import Crowd
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

COUNT: Final = 5
LOST: Final = 2
SPEED: Final = 2
"""Seconds of emulation per second."""
PATIENCE: Final = 30.0
_PORT: Final = 20000 + os.getpid() % 20000
LINKS: Final = (
    "pty:921600",
    "tcp://127.0.0.1:0",
    "udp://127.0.0.1:0",
    "can://virtual/several",
    f"can://udp_multicast/239.74.163.2?port={_PORT}",
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs ptys"),
]


class Watched(Stepped):
    """A crowd that another thread serves, and the test can wait for."""

    def __init__(self, crowd: Crowd) -> None:
        super().__init__(crowd)
        self.crowd = crowd

    def wheels(self, system: int) -> tuple[float, float]:
        return self.crowd.members[system].world.device.wheels


@pytest.fixture
def served(request: pytest.FixtureRequest) -> Iterator[tuple[str, Watched]]:
    endpoint = open_endpoint(str(request.param))
    watched = Watched(Crowd(COUNT, WorldSettings(seed=3, wire=endpoint.wire)))
    with in_thread(watched, endpoint, speed=SPEED):
        yield endpoint.url, watched


@pytest.mark.parametrize("served", LINKS, indirect=True)
def test_one_of_several_is_lost_and_comes_back_and_the_others_go_on(served: tuple[str, Watched]) -> None:
    url, watched = served
    told: list[object] = []
    with hil.connect_all(url, expect=COUNT, timeout=PATIENCE) as robots:
        robots.listen(lambda _, event: told.append(event))
        assert [junior.peer.system for junior in robots] == list(range(1, COUNT + 1))
        assert not robots.arm().errors
        assert len(robots.perform("L R", period=0.05).values) == COUNT
        for junior in robots:
            junior.drive(0.2, -0.2, 0.5)
        watched.crowd.switch_off(LOST)
        watched.until(lambda: watched.wheels(LOST) == (0.0, 0.0))
        slow = url.startswith("tcp")  # the others do not wait until silence says that it is lost: it restarts before
        answers = robots.perform("L R", period=0.05, timeout=None if slow else 0.6)
        assert isinstance(answers.errors.pop(robots.address(LOST)), PeerLostError if slow else PeerError)
        assert not answers.errors
        assert len(answers.values) == COUNT - 1
        assert robots.missing == ([robots.address(LOST)] if slow else [])
        assert all(junior.armed for junior in robots if junior.peer.system != LOST)  # kept alive meanwhile
        watched.crowd.switch_on(LOST)
        end = robots.now() + PATIENCE
        while not any(isinstance(event, PeerBack) for event in told) and robots.now() < end:
            robots.step()
        robots[LOST].arm()
        assert robots[LOST].perform("L", period=0.05).done == 1
    assert [(type(event), event.system) for event in told if isinstance(event, PeerLost | PeerBack)] == [
        (PeerLost, LOST),
        (PeerBack, LOST),
    ]
    watched.until(lambda: all(watched.wheels(system) == (0.0, 0.0) for system in range(1, COUNT + 1)))


@pytest.mark.parametrize("served", [LINKS[0], LINKS[-1]], indirect=True)
def test_one_of_several_is_taken_and_the_others_are_left_alone(served: tuple[str, Watched]) -> None:
    url, _ = served
    mark = "&" if "?" in url else "?"
    with hil.connect_all(url, expect=COUNT, timeout=PATIENCE) as robots:
        robots.arm()
        sessions = {junior.peer.system: junior.status().session for junior in robots}
        robots.emergency_stop()  # survives the end of the program, as a session does
    with hil.connect(f"{url}{mark}system=3", timeout=PATIENCE) as junior:
        assert junior.peer.system == 3
        assert junior.status().session == junior.peer.session != sessions[3]
        junior.wait(0.3)
        assert junior.bridge.strangers == {1, 2, 4, 5}
    with hil.connect_all(url, expect=COUNT, timeout=PATIENCE, watch=True) as robots:
        found = {junior.peer.system: junior.status().session for junior in robots}
        assert {system for system in found if found[system] != sessions[system]} == {3}
