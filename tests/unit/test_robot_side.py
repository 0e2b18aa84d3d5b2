"""The live page of emulated robots that are served: what is overheard, what may be asked for, and what it does to them."""

from __future__ import annotations

import http.client
import json
from contextlib import closing
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import pytest

from firmware_protocol.wire.fields import MAVLINK
from hil.cli.emulate_live import HandledCrowd, HandledJunior, HandledSwarm
from hil.look.live.robot_side import RobotSide
from simdevice.serving.endpoints import Endpoint
from simdevice.sumo.crowd import Crowd
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings
from simdevice.sumo.world import World
from simdevice.swarm.settings import SwarmSettings
from simdevice.swarm.world import SwarmWorld

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

SETTINGS = WorldSettings(referee=False)
ASKED = (("power-off", "no power."), ("lift", "held up"), ("power-on", "has power, and is"), ("put-down", "has power."))
"""What is asked for on the page, and what it is told then."""


class Ends(Endpoint):
    """An endpoint that somebody else reads and writes."""

    url = "memory:"

    def __init__(self) -> None:
        self.inbound, self.sent = b"from the host", list[bytes]()

    def files(self) -> list[int]:
        return [7]

    def poll(self, now: float) -> None:
        pass

    def receive(self, now: float) -> bytes:  # noqa: ARG002 - nothing is paced
        data, self.inbound = self.inbound, b""
        return data

    def room(self) -> int | None:
        return 11

    def send(self, data: bytes, now: float) -> None:  # noqa: ARG002 - likewise
        self.sent.append(data)

    def close(self) -> None:
        self.sent.append(b"closed")


class Hands:
    """Robots, and what was done to them."""

    count = 1
    liftable = True

    def __init__(self) -> None:
        self.done: list[tuple[str, bool]] = []

    def power(self, *, on: bool) -> None:
        self.done.append(("power", on))

    def hold_up(self, *, up: bool) -> None:
        self.done.append(("up", up))


@pytest.fixture
def hands() -> Hands:
    return Hands()


@pytest.fixture
def side(hands: Hands) -> Iterator[RobotSide]:
    made = RobotSide(hands, [("memory:", MAVLINK)], {}, public=False, failed=pytest.fail)
    with closing(made):
        yield made


def told(stream: http.client.HTTPResponse, words: str) -> dict[str, Any]:
    """The next question that has some words in it."""
    while line := stream.readline().decode():
        if line.startswith("event: asked") and words in (line := stream.readline().decode()):
            found: dict[str, Any] = json.loads(line.removeprefix("data: "))
            return found
    raise AssertionError(words)


def test_robots_are_handled_as_the_page_asks_and_the_page_is_told_how_they_are(side: RobotSide, hands: Hands) -> None:
    address = urlsplit(side.recorder.page)

    def ask(what: str) -> tuple[int, Any]:
        with closing(http.client.HTTPConnection(address.netloc, timeout=60)) as connection:
            connection.request("POST", address.path + what, headers={"Origin": f"http://{address.netloc}"})
            answer = connection.getresponse()
            return answer.status, json.loads(answer.read()) if answer.status == 200 else None

    with closing(http.client.HTTPConnection(address.netloc, timeout=60)) as listening:
        listening.request("GET", address.path + "told")
        stream = listening.getresponse()
        assert told(stream, "has power.")["choices"] == ["power-off", "lift"]
        for number, (what, words) in enumerate(ASKED, 1):
            assert ask(what) == (200, {"taken": True})
            while len(hands.done) < number:
                side.attend()
            assert told(stream, words)
        assert ask("stop")[0] == ask("won")[0] == 404
        stream.close()
    assert hands.done == [("power", False), ("up", True), ("power", True), ("up", False)]


def test_an_overheard_endpoint_is_the_endpoint(side: RobotSide) -> None:
    ends = Ends()
    overheard = side.overheard(ends)
    assert (overheard.url, overheard.wire, overheard.files(), overheard.room()) == ("memory:", MAVLINK, [7], 11)
    assert overheard.due() == ends.due()
    overheard.poll(0.0)
    assert overheard.receive(0.0) == b"from the host"
    overheard.send(b"from the robot", 0.1)
    overheard.send(b"", 0.2)
    overheard.close()
    assert ends.sent == [b"from the robot", b"", b"closed"]


@pytest.mark.parametrize("make", [junior_world, World])
def test_who_is_held_up_does_not_move_until_it_is_put_down(make: Callable[[WorldSettings], World]) -> None:
    world = make(SETTINGS)
    handled = HandledJunior(world)
    handled.hold_up(up=True)
    for _ in range(500):
        world.step(b"")
    assert world.match.lifted > 0
    handled.hold_up(up=False)
    for _ in range(20):
        world.step(b"")
    assert world.match.lifted == 0


def test_power_of_one_of_several_and_of_a_swarm() -> None:
    junior, crowd, swarm = junior_world(SETTINGS), Crowd(2, SETTINGS), SwarmWorld(SwarmSettings(2, 1))
    powered = []
    for on in (False, True):
        HandledJunior(junior).power(on=on)
        powered.append(junior.device.powered)
    assert powered == [False, True]
    several = HandledCrowd(crowd)
    several.power(on=False)
    several.hold_up(up=True)
    crowd.step(b"")
    assert [member.world.device.powered for member in crowd.members.values()] == [False, False]
    assert all(member.world.match.lifted for member in crowd.members.values())
    robots = HandledSwarm(swarm)
    for on in (False, True):
        robots.power(on=on)
        swarm.run_networks([b""], 1)
        assert [bool(each) for each in swarm.arrays.running[: robots.count]] == [on] * 3
