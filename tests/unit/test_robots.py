"""Several robots in one hand: who is there, who joins and leaves, and calls for all at once."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

import pytest
from scripted_crowd import ScriptedCrowd
from scripted_robot import ScriptedRobot

import hil
from firmware_protocol.errors import LinkClosedError, LinkOpenError, NoRobotError, PeerError, RefusedError, VersionError
from firmware_protocol.events import PeerBack, PeerFound, PeerLost
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import Command, CommandLong, JuniorManeuver, Reason, RobotSession
from firmware_protocol.roles.junior import write_memory
from hil.bridge.bridge import Bridge
from hil.bridge.networks import Networks, RobotAddress
from hil.sumo.robots import Robots
from simdevice.sumo.crowd import Crowd
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Mapping

ALL = range(1, 6)


def group(*crowds: ScriptedCrowd, watch: bool = False, only: set[int] | None = None) -> Robots:
    """The robots on lines called `a`, `b`, ..."""
    networks = Networks()
    for name, crowd in zip("abc", crowds, strict=False):
        bridge = Bridge(
            MemoryLink(crowd), crowd, robots=only, open_sessions=not watch, session=lambda: 77, arrived=networks.wake
        )
        networks.add(name, bridge)
    return Robots(networks)


def ids(robots: Robots) -> list[int]:
    return [junior.peer.system for junior in robots]


class Late(ScriptedCrowd):
    """A line on which robots are switched on one after the other."""

    plan: Mapping[float, int] = MappingProxyType({})

    def step(self, inbound: bytes) -> bytes:
        for time, system in self.plan.items():
            if time <= self.now() and system not in self.robots:
                self.robots[system] = ScriptedRobot(system=system)
        return super().step(inbound)


def late(plan: dict[float, int]) -> Late:
    crowd = Late()
    crowd.plan = plan
    return crowd


# --- who is there ----------------------------------------------------------------------------------------------------


def test_finding_ends_when_nobody_new_was_heard_for_a_while() -> None:
    with group(late({0.5: 1, 1.2: 2, 2.0: 3, 4.5: 4})) as robots:
        robots.find(settle=1.5, timeout=10.0)
        assert ids(robots) == [1, 2, 3]
        assert robots.now() == pytest.approx(2.0 + 1.5, abs=0.1)
        robots.wait(1.5)
        assert ids(robots) == [1, 2, 3, 4]


def test_finding_ends_as_soon_as_all_that_are_expected_are_there() -> None:
    for expect in (3, [3, 1, 2], {RobotAddress("a", 1), RobotAddress("a", 2), RobotAddress("a", 3)}):
        with group(late({0.5: 1, 1.2: 2, 3.8: 3})) as robots:
            robots.find(settle=0.5, expect=expect, timeout=10.0)
            assert ids(robots) == [1, 2, 3]
            assert robots.now() < 3.8 + 0.6


def test_who_is_expected_and_does_not_come_is_missing_and_holds_nobody_up_for_ever() -> None:
    with group(ScriptedCrowd.of([1, 3])) as robots:
        robots.find(expect=[1, 2, 3], timeout=2.0)
        assert robots.now() == pytest.approx(2.0, abs=0.1)
        assert ids(robots) == [1, 3]
        assert robots.missing == [RobotAddress("a", 2)]
        assert 3 in robots
        assert 2 not in robots
        with pytest.raises(KeyError, match="robot 2 on a was never heard; robots heard: 1, 3"):
            robots[2]


def test_nobody_there() -> None:
    with group(ScriptedCrowd(), ScriptedCrowd()) as robots, pytest.raises(NoRobotError) as told:
        robots.find(timeout=1.0)
    assert [f"{name}: no robot answered within 1 s: nothing came" in str(told.value) for name in "ab"] == [True, True]


def test_robots_that_cannot_be_spoken_with_are_named_and_do_not_spoil_it() -> None:
    foreign = ScriptedRobot(system=2, version=(9, 0))
    with group(ScriptedCrowd({1: ScriptedRobot(system=1), 2: foreign})) as robots:
        robots.find()
        assert ids(robots) == [1]
        assert isinstance(robots.refused[RobotAddress("a", 2)], VersionError)
    with group(ScriptedCrowd({2: ScriptedRobot(system=2, version=(9, 0))})) as robots, pytest.raises(VersionError):
        robots.find(timeout=2.0)


def test_only_those_asked_for_get_a_session() -> None:
    crowd = ScriptedCrowd.of(ALL)
    with group(crowd, only={2, 4}) as robots:
        robots.find(expect=[2, 4])
        robots.wait(2.0)
    asked = {system for system, robot in crowd.robots.items() if any(isinstance(m, RobotSession) for m in robot.heard)}
    assert asked == {2, 4}


def test_one_that_falls_silent_leaves_and_comes_back_as_the_same() -> None:
    crowd = ScriptedCrowd.of(ALL)
    told: list[tuple[str, object]] = []
    with group(crowd) as robots:
        robots.listen(lambda network, event: told.append((network, event)))
        robots.find(expect=5)
        handle = robots[3]
        crowd.robots[3].silent = True
        robots.wait(4.0)
        assert ids(robots) == [1, 2, 4, 5]
        assert robots.missing == [RobotAddress("a", 3)]
        crowd.robots[3].silent = False
        robots.wait(2.0)
        assert ids(robots) == [1, 2, 3, 4, 5]
        assert robots[3] is handle
    events = [event for _, event in told if isinstance(event, PeerLost | PeerBack) and event.system == 3]
    assert [type(event) for event in events] == [PeerLost, PeerBack]
    assert {event.system for _, event in told if isinstance(event, PeerFound)} == set(ALL)
    assert {network for network, _ in told} == {"a"}


# --- calls for many --------------------------------------------------------------------------------------------------


def test_all_perform_at_the_same_time() -> None:
    crowd = ScriptedCrowd.of(ALL)
    with group(crowd) as robots:
        robots.find(expect=5)
        assert not robots.arm().errors
        began = robots.now()
        answers = robots.perform("FF S", period=0.25)
        assert robots.now() - began < 0.7
    assert sorted(address.system for address in answers.values) == list(ALL)
    assert not answers.errors
    assert all(len(robot.performed) == 1 for robot in crowd.robots.values())


def test_each_may_perform_something_else() -> None:
    crowd = ScriptedCrowd.of([1, 2, 3])
    with group(crowd) as robots:
        robots.find(expect=3)
        robots.arm()
        answers = robots.perform({RobotAddress("a", 1): "FF", RobotAddress("a", 3): ["B", "B", "S"]})
        assert {address.system for address in answers.values} == {1, 3}
        with pytest.raises(KeyError):
            robots.perform({RobotAddress("a", 9): "FF"})
        with pytest.raises(ValueError, match="no action is called 'X'"):
            robots.perform("X")
    counts = {
        system: [message.count for message in robot.heard if isinstance(message, JuniorManeuver)]
        for system, robot in crowd.robots.items()
    }
    assert counts == {1: [1], 2: [], 3: [3]}


def test_a_lost_robot_holds_up_nobody_and_its_error_says_so() -> None:
    crowd = ScriptedCrowd.of(ALL)
    with group(crowd) as robots:
        robots.find(expect=5)
        robots.arm()
        crowd.robots[4].silent = True
        began = robots.now()
        times = {}
        for junior, ticket in robots.as_answered(lambda junior: junior.start("FF", period=0.2)):
            times[junior.peer.system] = robots.now() - began
            assert (ticket.error is None) == (junior.peer.system != 4)
        assert list(times)[-1] == 4
        assert all(time < 0.4 for system, time in times.items() if system != 4)
        assert 2.0 < times[4] < 3.5


def test_a_slow_robot_can_be_given_up() -> None:
    crowd = ScriptedCrowd.of([1, 2])
    with group(crowd) as robots:
        robots.find(expect=2)
        robots.arm()
        robots.step()
        answers = robots.ask(
            lambda junior: junior.start(["F"] * (8 if junior.peer.system == 2 else 1), period=0.25), timeout=0.6
        )
        assert [address.system for address in answers.values] == [1]
        (error,) = answers.errors.values()
        assert isinstance(error, PeerError)
        assert "robot 2 on a has not answered" in str(error)
        assert robots.now() < 2.0


def test_one_that_refuses_does_not_stop_the_others() -> None:
    crowd = ScriptedCrowd.of([1, 2, 3])
    crowd.robots[2].refuse[JuniorManeuver] = Reason.BAD_VALUE
    with group(crowd) as robots:
        robots.find(expect=3)
        answers = robots.ask(lambda junior: write_memory(junior.peer, 255, 0, hil.Maneuver((hil.Action.F,), period=0.1)))
        assert len(answers.values) == 3
        reports = robots.perform("F")
        assert sorted(address.system for address in reports.values) == [1, 3]
        assert isinstance(reports.errors[RobotAddress("a", 2)], RefusedError)


def test_waiting_for_one_serves_all() -> None:
    crowd = ScriptedCrowd.of([1, 2])
    with group(crowd) as robots:
        robots.find(expect=2)
        robots.arm()
        ticket = robots[2].start("F", period=0.1)
        robots[1].perform("F F F", period=0.2)
        assert ticket.done
        seen: list[object] = []
        robots[2].listen(seen.append)
        robots[1].wait(1.0)
        assert seen
        assert {getattr(event, "system", 2) for event in seen} == {2}


# --- stopping --------------------------------------------------------------------------------------------------------


def test_leaving_disarms_all_even_those_that_are_lost() -> None:
    crowd = ScriptedCrowd.of(ALL)
    with group(crowd) as robots:
        robots.find(expect=5)
        robots.arm()
        crowd.robots[2].silent = True
        robots.wait(4.0)
        began = robots.now()
    assert not any(robot.armed for robot in crowd.robots.values())
    assert crowd.now() - began < 0.2
    robots.close()


def test_an_emergency_stop_is_said_to_all_at_once_and_survives_the_program() -> None:
    crowd = ScriptedCrowd.of(ALL)
    with group(crowd, only={1, 2}) as robots:
        robots.find(expect=[1, 2])
        robots.arm()
        assert len(robots.emergency_stop().values) == 2
    for system, robot in crowd.robots.items():
        orders = [message for message in robot.heard if isinstance(message, CommandLong)]
        stops = [order for order in orders if order.command == Command.FLIGHT_TERMINATION]
        assert [order.target_system for order in stops] == ([0, system] if system in {1, 2} else [0])
        assert not any(order.command == Command.ARM_DISARM and order.param1 == 0 for order in orders)


def test_disarming_all_ends_the_emergency_stop() -> None:
    crowd = ScriptedCrowd.of([1, 2])
    with group(crowd) as robots:
        robots.find(expect=2)
        robots.emergency_stop()
        assert len(robots.disarm().values) == 2
        assert len(robots.stop().values) == 2
    disarmed = [m for m in crowd.robots[1].heard if isinstance(m, CommandLong) and m.command == Command.ARM_DISARM]
    assert len(disarmed) == 2


def test_robots_armed_after_an_emergency_stop_that_one_did_not_hear_are_disarmed_at_the_end() -> None:
    crowd = ScriptedCrowd.of([1, 2])
    with group(crowd) as robots:
        robots.find(expect=2)
        crowd.robots[2].deaf = lambda message: isinstance(message, CommandLong)
        assert set(robots.emergency_stop().errors) == {RobotAddress("a", 2)}
        crowd.robots[2].deaf = lambda _: False
        assert len(robots.arm().values) == 2
    assert not any(robot.armed for robot in crowd.robots.values())


def test_watching_neither_stops_nor_disarms_until_one_is_taken() -> None:
    crowd = ScriptedCrowd.of([1, 2])
    for robot in crowd.robots.values():
        robot.armed = True
    with group(crowd, watch=True) as robots:
        robots.find(expect=2)
        robots.wait(1.0)
        assert [junior.armed for junior in robots] == [True, True]
        with pytest.raises(PeerError, match="only being watched"):
            robots[1].drive(0.1, 0.1)
        robots[1].take()
        assert not crowd.robots[1].armed
        robots[1].arm()
        robots[1].drive(0.1, 0.1)
    assert not crowd.robots[1].armed
    assert crowd.robots[2].armed
    crowd.robots[2].refuse[RobotSession] = Reason.BAD_VALUE
    with group(crowd, watch=True) as robots:
        robots.find(expect=2)
        with pytest.raises(RefusedError):
            robots[2].take()


# --- several networks ------------------------------------------------------------------------------------------------


def test_the_same_id_on_two_networks_is_two_robots() -> None:
    one, other = ScriptedCrowd.of([1, 2]), ScriptedCrowd.of([1])
    with group(one, other) as robots:
        robots.find(expect=3)
        assert robots.addresses == [RobotAddress("a", 1), RobotAddress("a", 2), RobotAddress("b", 1)]
        robots.arm()
        robots.perform({RobotAddress("b", 1): "F"})
        assert not one.robots[1].performed
        assert len(other.robots[1].performed) == 1
        with pytest.raises(KeyError, match="several networks"):
            robots[1]
        robots.wait(1.0)
        assert one.now() == pytest.approx(other.now(), abs=0.06)
        assert str(robots.addresses[2]) == "robot 1 on b"


class Cut(ScriptedCrowd):
    """A line that can be cut."""

    cut = False

    def step(self, inbound: bytes) -> bytes:
        if self.cut:
            raise LinkClosedError("b", "it is cut")
        return super().step(inbound)


def test_a_network_that_is_gone_takes_its_robots_with_it_and_no_others() -> None:
    one, other = ScriptedCrowd.of([1, 2]), Cut.of([1])
    assert isinstance(other, Cut)
    with group(one, other) as robots:
        robots.find(expect=3)
        robots.arm()
        other.cut = True
        answers = robots.perform("F")
        assert sorted(address.network for address in answers.values) == ["a", "a"]
        assert isinstance(answers.errors[RobotAddress("b", 1)], LinkClosedError)
        assert robots.missing == [RobotAddress("b", 1)]
        robots.wait(0.5)
        assert isinstance(robots.networks.failures["b"], LinkClosedError)
        assert sorted(address.network for address in robots.emergency_stop().errors) == ["b"]


def test_when_the_last_network_is_gone_waiting_ends_with_its_error() -> None:
    crowd = Cut.of([1, 2])
    assert isinstance(crowd, Cut)
    with group(crowd) as robots:
        robots.find(expect=2)
        crowd.cut = True
        answers = robots.ask(lambda junior: junior.peer.ping())
        assert all(isinstance(error, LinkClosedError) for error in answers.errors.values())
        assert len(answers.errors) == 2
        with pytest.raises(LinkClosedError, match="it is cut"):
            robots.wait(1.0)


def test_a_name_twice_is_refused() -> None:
    networks, crowd = Networks(), ScriptedCrowd()
    networks.add("a", Bridge(MemoryLink(crowd), crowd))
    with pytest.raises(ValueError, match="a is given twice"):
        networks.add("a", Bridge(MemoryLink(crowd), crowd))


# --- connect_all -----------------------------------------------------------------------------------------------------


def test_emulated_robots_are_counted_by_themselves() -> None:
    with hil.connect_all("sim://junior?count=4&seed=3") as robots:
        assert ids(robots) == [1, 2, 3, 4]
        assert all(junior.referee is not None for junior in robots)
        assert not robots.arm().errors
        assert len(robots.perform("L R", period=0.05).values) == 4
    with hil.connect_all("sim://junior?count=3&seed=3&system=2&wire=can", "sim://junior") as robots:
        assert [address.system for address in robots.addresses] == [1, 2]


@pytest.mark.slow
@pytest.mark.parametrize("loss", ["unplug", "switch_off"])
@pytest.mark.parametrize("wire", ["mavlink", "can"])
def test_nine_of_ten_do_not_notice_that_the_tenth_is_gone(loss: str, wire: str) -> None:
    crowd = Crowd(10, WorldSettings(seed=3, wire=wire))
    networks = Networks()
    networks.add("line", Bridge(MemoryLink(crowd, wire=wire), crowd, session=lambda: 77))
    with Robots(networks) as robots:
        robots.find(expect=10)
        robots.arm()
        nine = [junior for junior in robots if junior.peer.system != 4]

        def round_trips(seconds: float) -> list[float]:
            trips, end = [], robots.now() + seconds
            while robots.now() < end:
                for junior in nine:
                    began = robots.now()
                    junior.status()
                    trips.append(robots.now() - began)
            return trips

        before = round_trips(1.0)
        getattr(crowd, loss)(4)
        during = round_trips(4.0)
        assert robots.missing == [robots.address(4)]
        (crowd.plug if loss == "unplug" else crowd.switch_on)(4)
        after = round_trips(1.5)
        assert len(robots) == 10
        assert max(before) == pytest.approx(0.005)
        assert max(during) == max(after) == pytest.approx(max(before))
        assert all(junior.armed for junior in nine)
        assert sum(junior.peer.counters.retries for junior in nine) == 0


@pytest.mark.slow
def test_a_bus_can_be_full() -> None:
    with hil.connect_all("sim://junior?count=127&referee=0&wire=can", timeout=10.0) as robots:
        assert len(robots) == 127
        assert len(robots.arm().values) == 127
        began = robots.now()
        assert len(robots.perform("L R", period=0.05).values) == 127
        assert robots.now() - began < 0.3


def test_the_same_seed_gives_the_same_run() -> None:
    def run() -> list[tuple[int, float, object]]:
        with hil.connect_all("sim://junior?count=3&seed=5&faults=drop:0.05,jitter:0.01") as robots:
            robots.arm()
            reports = robots.perform("F L B", period=0.05).values
            return [(address.system, robots.now(), report) for address, report in sorted(reports.items())]

    assert run() == run()


def test_what_makes_no_sense_is_refused() -> None:
    with pytest.raises(ValueError, match="needs the address"):
        hil.connect_all()
    with pytest.raises(LinkOpenError, match="nothing listens"):
        hil.connect_all("tcp://127.0.0.1:1")
    with pytest.raises(ValueError, match="given twice"):
        hil.connect_all("sim://junior", "sim://junior")
    with pytest.raises(ValueError, match="in lock-step or all in real time"):
        hil.connect_all("sim://junior", "udpin://127.0.0.1:0")
    with pytest.raises(ValueError, match="1 to 127 robots can share this line, not 128"):
        hil.connect("sim://junior?count=128&wire=can")
