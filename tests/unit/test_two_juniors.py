"""Two Juniors in one ring, each with a network and a host of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import hil
from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError
from firmware_protocol.links.memory import SharedTime
from firmware_protocol.messages import OpponentCode
from hil.connecting.junior_address import junior_settings
from hil.connecting.network_address import network_of, networks_of
from hil.sumo.connecting import connect_all
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from hil.sumo.junior import Junior
    from hil.sumo.robots import Robots

ADDRESS = "sim://junior?networks=2&seed=4"


@pytest.fixture
def ring() -> Iterator[Robots]:
    with connect_all(ADDRESS) as robots:
        yield robots


def both(robots: Robots) -> tuple[Junior, Junior]:
    first, second = robots
    return first, second


def test_each_is_a_robot_of_its_own_and_one_has_the_referee(ring: Robots) -> None:
    first, second = both(ring)
    assert [first.peer.system, second.peer.system] == [1, 2]
    assert first.uid != second.uid
    assert first.referee is not None
    assert second.referee is None


def test_each_does_what_its_own_host_says_and_no_other(ring: Robots) -> None:
    first, second = both(ring)
    ring.arm()
    assert first.referee is not None
    before = first.referee.reset(7)
    second.perform("F F")
    after = first.referee.state()
    assert after.junior == before.junior
    assert abs(after.opponent[0] - before.opponent[0]) + abs(after.opponent[1] - before.opponent[1]) > 0.05


def test_each_senses_the_other(ring: Robots) -> None:
    first, second = both(ring)
    ring.arm()
    assert first.referee is not None
    seen = set()
    for seed in range(20):
        first.referee.reset(seed)
        ring.wait(0.1)
        seen |= {(bool(first.sense() & 3), bool(second.sense() & 3))}
    assert {(True, True)} < seen


def test_one_that_is_taken_off_the_table_is_silent_and_comes_back(ring: Robots) -> None:
    first, second = both(ring)
    assert first.referee is not None
    first.referee.reset(1, OpponentCode.FLAT_LIGHT)
    ring.wait(6.0)
    assert second.armed is None
    first.referee.reset(1, OpponentCode.JUNIOR)
    ring.wait(3.0)
    assert second.armed is False


def test_the_address_names_a_network_for_each() -> None:
    networks = networks_of(parse_address(ADDRESS))
    assert [network.url for network in networks] == [f"{ADDRESS}&network=1", f"{ADDRESS}&network=2"]
    assert [network_of(network) for network in networks] == [1, 2]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ("networks=3", "networks is 1 or 2, not 3"),
        ("networks=2&count=2", "several rings have one network"),
        ("networks=2&opponent=flat-light", "the opponent is flat-light"),
        ("networks=2&network=5", "network is 1 to 2, not 5"),
        ("networks=2&opponent=juniper", "the opponent is juniper"),
        ("networks=2&seed=many", "seed is a whole number, 0 to"),
    ],
)
def test_what_can_not_be_is_said_to_be(options: str, told: str) -> None:
    with pytest.raises(AddressError, match=told) as raised:
        connect_all(f"sim://junior?{options}")
    assert str(raised.value).count("sim://junior") == 1


def test_what_else_has_several_networks_is_no_ring() -> None:
    with pytest.raises(AddressError, match=r"no emulated 'junor'.*Did you mean sim://junior"):
        connect_all("sim://junor?networks=2")


def test_one_connection_for_two_robots_is_refused() -> None:
    with pytest.raises(AddressError, match="each on a network of its own"):
        hil.connect(ADDRESS)


def test_an_opponent_that_is_no_robot_has_no_host() -> None:
    with pytest.raises(ValueError, match="the opponent is point-light"):
        WorldSettings(opponent="point-light", hosted=True)


def test_what_is_not_given_has_its_default() -> None:
    assert junior_settings(parse_address("sim://junior")) == WorldSettings(seed=0)
    assert junior_settings(parse_address("sim://junior?networks=2")) == WorldSettings("junior", seed=0, hosted=True)


class Caller:
    """Has two networks, and says something on the second at certain times."""

    period = 0.005
    networks = 2

    def __init__(self, *calls: int) -> None:
        self._calls = calls
        self._ticks = 0
        self.came: list[tuple[int, bytes]] = []

    def now(self) -> float:
        return self._ticks * self.period

    def run_networks(self, inbound: Sequence[bytes], periods: int) -> list[bytes]:
        if inbound[1]:
            self.came.append((self._ticks, inbound[1]))
        for _ in range(periods):
            self._ticks += 1
            if self._ticks in self._calls:
                return [b"", b"call"]
        return [b"", b""]


@pytest.mark.parametrize(("prompt", "answered"), [(True, 4), (False, 10)])
def test_a_prompt_time_waits_for_the_answer_of_who_has_been_called(*, prompt: bool, answered: int) -> None:
    caller = Caller(4)
    time = SharedTime(caller, prompt=prompt)
    time.read(0, 0.05)
    assert time.clocks[0].ticks == answered
    assert time.read(1, 0.05) == b"call"
    time.send(1, b"answer")
    time.read(0, 0.05)
    assert caller.came == [(answered, b"answer")]


def test_a_prompt_time_passes_for_who_is_read_alone() -> None:
    time = SharedTime(Caller(2, 4), prompt=True)
    for _ in range(20):
        time.read(0, 0.02)
    assert time.clocks[0].ticks > 20


def test_who_is_behind_a_prompt_time_comes_up_to_it_before_it_passes_again() -> None:
    time = SharedTime(Caller(4), prompt=True)
    assert time.read(1, 0.05) == b"call"
    time.read(0, 0.05)
    assert [clock.ticks for clock in time.clocks] == [4, 4]
