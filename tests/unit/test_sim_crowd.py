"""Several emulated robots on one line: who they are, what they hear, and what happens without power or cable."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    Command,
    CommandLong,
    Heartbeat,
    JuniorWheels,
    RefereeState,
    RobotAlive,
    RobotSession,
    RobotStatus,
)
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN, MAVLINK
from simdevice.sumo.crowd import Crowd
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

ALIVE = RobotAlive(7)


class Line:
    """The host's end of a crowd's line."""

    def __init__(self, crowd: Crowd) -> None:
        self.crowd = crowd
        self._codec = open_codec(crowd.wire, system=HOST_SYSTEM, component=HOST_COMPONENT)

    def run(self, seconds: float, *messages: Message, alive: bool = True) -> list[Received]:
        data = b"".join(map(self._codec.encode, messages))
        heard = []
        for period in range(round(seconds / 0.005)):
            if alive and period % 8 == 0:
                data += self._codec.encode(ALIVE)
            for event in self._codec.receive(self.crowd.step(data), self.crowd.now()):
                assert isinstance(event, Received), event
                heard.append(event)
            data = b""
        return heard

    def drive(self, *systems: int) -> None:
        for system in systems:
            self.run(0.02, RobotSession(50 + system, 0, 7, system, 1, 2, 0))
            self.run(0.02, CommandLong(system, 1, Command.ARM_DISARM, param1=1.0, param3=7.0))
            self.run(0.02, JuniorWheels(50 + system, 1, (0.2, 0.2), 5.0, system, 1))

    def driving(self) -> set[int]:
        return {system for system, member in self.crowd.members.items() if member.world.device.wheels != (0.0, 0.0)}


def systems(heard: list[Received], component: int = 1) -> set[int]:
    return {event.system for event in heard if event.component == component}


def place(crowd: Crowd, system: int) -> tuple[float, float]:
    body = crowd.members[system].world.match.robot.body
    return body.x, body.y


def boots(heard: list[Received], system: int) -> list[int]:
    return [event.message.boot_count for event in heard if isinstance(event.message, RobotStatus) and event.system == system]


@pytest.mark.parametrize("wire", [MAVLINK, CAN])
def test_all_say_who_they_are_within_a_second_and_not_all_at_once(wire: str) -> None:
    line = Line(Crowd(10, WorldSettings(seed=4, wire=wire)))
    heard = line.run(1.0)
    assert systems(heard) == systems(heard, 25) == set(range(1, 11))
    beats = [event.time for event in heard if isinstance(event.message, Heartbeat)]
    assert len(set(beats)) == len(beats) == 10


def test_the_first_lives_as_it_would_alone_and_the_others_differ() -> None:
    crowd, alone = Crowd(3, WorldSettings(seed=4)), junior_world(WorldSettings(seed=4))
    codec = open_codec(MAVLINK, system=HOST_SYSTEM, component=HOST_COMPONENT)
    raw: dict[int, list[bytes]] = {1: [], 2: [], 3: []}
    expected = b""
    for _ in range(300):
        expected += alone.step(b"")
        for event in codec.receive(crowd.step(b""), crowd.now()):
            raw[event.system].append(event.raw)  # type: ignore[index]
    assert b"".join(raw[1]) == expected
    poses = {place(crowd, system) for system in crowd.members}
    assert len(poses) == 3


def test_the_same_seed_gives_the_same_bytes() -> None:
    crowds = [Crowd(3, WorldSettings(seed=9)), Crowd(3, WorldSettings(seed=9))]
    question = open_codec(MAVLINK, system=255, component=190).encode(CommandLong(2, 1, Command.REQUEST_MESSAGE, 0, 148.0))
    first, second = ([crowd.step(question if tick == 99 else b"") for tick in range(400)] for crowd in crowds)
    assert first == second


def test_a_command_moves_the_robot_it_is_for_and_no_other() -> None:
    line = Line(Crowd(3))
    line.run(1.0)
    line.drive(2)
    assert line.driving() == {2}
    line.drive(1)
    assert line.driving() == {1, 2}


def test_an_unplugged_robot_lives_on_unheard_and_stops_by_its_watchdog() -> None:
    line = Line(Crowd(3))
    line.run(1.0)
    line.drive(1, 2, 3)
    line.crowd.unplug(2)
    assert systems(line.run(0.2)) == {1, 3}
    assert line.driving() == {1, 2, 3}
    assert systems(line.run(0.2), 25) == {1, 3}
    assert line.driving() == {1, 3}
    line.crowd.plug(2)
    heard = line.run(1.2)
    assert systems(heard) == {1, 2, 3}
    assert [event.message.boot_count for event in heard if isinstance(event.message, RobotStatus) and event.system == 2][
        -1
    ] == 2


def test_a_robot_without_power_stops_at_once_says_nothing_and_boots_again() -> None:
    line = Line(Crowd(3))
    line.run(1.0)
    line.drive(1, 2, 3)
    line.crowd.switch_off(2)
    heard = line.run(0.5)
    assert line.driving() == {1, 3}
    assert systems(heard) == systems(heard, 25) == {1, 3}
    before = place(line.crowd, 2)
    line.run(0.1)
    assert place(line.crowd, 2) == pytest.approx(before, abs=1e-6)
    line.crowd.switch_on(2)
    line.crowd.switch_on(2)  # it is on already: no second start
    heard = line.run(1.2)
    assert [event.message.boot_count for event in heard if isinstance(event.message, RobotStatus) and event.system == 2] == [
        3,
        3,
    ]
    assert not {2} & line.driving()


def test_one_that_is_switched_off_from_the_start_joins_when_it_is_switched_on() -> None:
    line = Line(Crowd(2))
    line.crowd.switch_off(2)
    assert systems(line.run(1.5)) == {1}
    line.crowd.switch_on(2)
    assert systems(line.run(0.1)) == {1, 2}


def test_their_eeproms_go_into_one_image_and_back() -> None:
    crowd = Crowd(3)
    assert len(crowd.nvm) == 3 * 1024
    again = Crowd(3, WorldSettings(nvm=crowd.nvm))
    assert systems(Line(again).run(1.0)) == {1, 2, 3}
    with pytest.raises(ValueError, match="4096 bytes, the image 3072"):
        Crowd(4, WorldSettings(nvm=crowd.nvm))


def test_rings_without_a_referee() -> None:
    heard = Line(Crowd(2, WorldSettings(referee=False))).run(1.0)
    assert not any(isinstance(event.message, RefereeState) for event in heard)


@pytest.mark.parametrize(("count", "wire", "most"), [(0, MAVLINK, 254), (255, MAVLINK, 254), (128, CAN, 127)])
def test_more_than_there_are_ids_is_refused(count: int, wire: str, most: int) -> None:
    with pytest.raises(ValueError, match=f"1 to {most} robots can share this line, not {count}"):
        Crowd(count, WorldSettings(wire=wire))


@pytest.mark.slow
@pytest.mark.parametrize(("count", "wire"), [(254, MAVLINK), (127, CAN)])
def test_every_id_can_be_used(count: int, wire: str) -> None:
    heard = Line(Crowd(count, WorldSettings(wire=wire, referee=False))).run(1.0, alive=False)
    assert systems(heard) == set(range(1, count + 1))
