"""What faults do to an emulated robot's hardware, as its firmware reads and drives it."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import pytest

from firmware_protocol.events import Received
from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.messages import (
    Command,
    CommandLong,
    JuniorSensors,
    JuniorWheels,
    RobotSession,
    RobotStatus,
    SensorFlag,
)
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.junior.profile import JuniorProfile
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from simdevice.junior.hardware import JuniorHardware
    from simdevice.sumo.world import World


class Bench:
    """A world with faults, and what comes out of it."""

    def __init__(self, faults: str, seed: int = 3) -> None:
        self.world: World = junior_world(WorldSettings(seed=seed, faults=FaultSpec.parse(faults)))
        self.codec = MavlinkCodec(system=255, component=190)
        self.came: list[tuple[float, object]] = []

    @property
    def robot(self) -> JuniorHardware:
        return self.world.device.robot

    def run(self, seconds: float, inbound: bytes = b"") -> None:
        """Let time pass; the host's bytes come first."""
        for _ in range(round(seconds / self.world.period)):
            data, inbound = self.world.step(inbound), b""
            for event in self.codec.receive(data, self.world.now()):
                if isinstance(event, Received) and event.component == 1:
                    self.came.append((event.time, event.message))

    def readings(self) -> list[tuple[float, JuniorSensors]]:
        return [(time, message) for time, message in self.came if isinstance(message, JuniorSensors)]

    def drive(self, left: float, right: float, duration: float = 5.0) -> None:
        """Arm, and set the wheels."""
        self.run(0.01, self.codec.encode(RobotSession(77, 0, 7, 1, 1, 2, 0)))
        self.run(0.01, self.codec.encode(CommandLong(1, 1, Command.ARM_DISARM, param1=1.0, param3=7.0)))
        self.run(0.01, self.codec.encode(JuniorWheels(77, 1, (left, right), duration, 1, 1)))


def test_a_sensor_is_stuck_at_a_value_for_its_time() -> None:
    bench = Bench("stuck:eye_left:700@1+1,stuck:floor_right:900@1+1")
    bench.run(3.0)
    inside = [message for time, message in bench.readings() if 1.03 < time < 2.0]
    outside = [message for time, message in bench.readings() if not 0.98 < time < 2.03]
    assert len(inside) > 40
    assert {message.eye[0] for message in inside} == {700}
    assert {message.floor[1] for message in inside} == {900}
    assert all(message.flags & SensorFlag.EYE_LEFT and message.flags & SensorFlag.OFF_RING_RIGHT for message in inside)
    assert max(message.eye[0] for message in outside) < 700
    assert max(message.floor[1] for message in outside) < 500


def test_a_sensor_is_stuck_at_what_it_told_last_and_the_others_are_not() -> None:
    bench = Bench("stuck:floor_left@1")
    bench.run(3.0)
    values = [message.floor for time, message in bench.readings() if time > 1.03]
    assert len({left for left, _ in values}) == 1
    assert len({right for _, right in values}) > 10
    assert values[0][0] == pytest.approx(120, abs=40)


def test_a_stuck_arm_comes_free_with_what_it_really_feels() -> None:
    bench = Bench("stuck:arm_left:1@0.5+0.5,stuck:arm_right:0")
    bench.run(2.0)
    pressed = [(time, bool(message.flags & SensorFlag.ARM_LEFT)) for time, message in bench.readings()]
    assert all(on for time, on in pressed if 0.56 < time < 1.0)
    assert not any(on for time, on in pressed if time < 0.5 or time > 1.06)


@pytest.mark.parametrize(("faults", "shares"), [("wheel:left", (0.0, 1.0)), ("wheel:right:0.5", (1.0, 0.5)), ("", (1.0, 1.0))])
def test_a_wheel_gives_its_share_and_the_firmware_does_not_know(faults: str, shares: tuple[float, float]) -> None:
    bench = Bench(faults)
    bench.drive(-0.6, -0.6)
    bench.run(0.2)
    assert bench.world.device.wheels == (-0.6, -0.6)
    motors = bench.robot.motors
    free = JuniorProfile().free_speed * 0.6 * 0.2
    assert (-motors.travel_left / free, -motors.travel_right / free) == pytest.approx(shares, abs=0.2)


def test_a_wheel_fails_and_recovers_under_way() -> None:
    bench = Bench("wheel:left@0.15+0.05")
    bench.drive(-0.4, -0.4)
    commanded, given = set(), []
    for _ in range(40):
        bench.run(bench.world.period)
        commanded.add(bench.world.device.wheels)
        given.append(round(bench.robot.motors.commanded[0]))
    assert commanded == {(-0.4, -0.4)}
    dead = [number for number, effort in enumerate(given) if effort == 0]
    assert len(dead) == 10
    assert dead == list(range(dead[0], dead[0] + 10))
    assert set(given) == {0, -400}


def test_a_low_battery_is_read_and_slows_the_wheels_and_recovers() -> None:
    bench = Bench("battery:5@1+1")
    bench.run(3.0)
    low = [message.battery for time, message in bench.readings() if 1.03 < time < 2.0]
    other = [message.battery for time, message in bench.readings() if not 0.98 < time < 2.03]
    assert max(low) == pytest.approx(4.99, abs=0.02)
    assert min(other) > 7.0
    weak, strong = Bench("battery:3.7"), Bench("drop:0")
    for one in (weak, strong):
        one.drive(-0.5, -0.5)
        one.run(0.2)
    assert weak.robot.motors.travel_left == pytest.approx(0.5 * strong.robot.motors.travel_left, rel=0.15)


def test_a_low_battery_outlives_the_bout() -> None:
    bench = Bench("battery:5@0.5")
    bench.run(1.0)
    bench.world.match.reset(9)
    bench.run(0.1)
    assert bench.readings()[-1][1].battery == pytest.approx(4.99, abs=0.02)


def test_a_brown_out_is_dark_silent_and_ends_in_a_boot() -> None:
    bench = Bench("brownout:1+0.5")
    bench.run(1.2)
    assert bench.world.device.wheels == (0.0, 0.0)
    bench.run(2.0)
    times = [time for time, _ in bench.came]
    gap = [(a, b) for a, b in pairwise(times) if b - a > 0.2]
    assert len(gap) == 1
    assert gap[0] == pytest.approx((1.0, 1.5), abs=0.03)
    boots = [message.boot_count for _, message in bench.came if isinstance(message, RobotStatus)]
    assert sorted(set(boots)) == [1, 2]
    assert bench.world.device.uptime == pytest.approx(1.7, abs=0.02)


def test_a_brown_out_takes_the_wheels_from_a_robot_that_drives() -> None:
    bench = Bench("brownout:0.2")
    bench.drive(-0.4, -0.4)
    bench.run(0.1)
    assert bench.world.device.wheels == (-0.4, -0.4)
    bench.run(0.1)
    assert bench.world.device.wheels == (0.0, 0.0)
    bench.run(0.1, bench.codec.encode(JuniorWheels(77, 2, (-0.4, -0.4), 5.0, 1, 1)))  # of the session that is forgotten
    assert bench.world.device.wheels == (0.0, 0.0)
    assert bench.world.device.uptime < 0.2


def test_bytes_for_a_robot_without_power_are_lost() -> None:
    bench = Bench("brownout:0.5+0.5")
    bench.run(0.6)
    bench.run(0.1, bench.codec.encode(RobotSession(77, 0, 7, 1, 1, 2, 0)) * 3)
    bench.run(2.0)
    statuses = [message for _, message in bench.came if isinstance(message, RobotStatus)]
    assert (statuses[-1].boot_count, statuses[-1].session, statuses[-1].good) == (2, 0, 0)


@pytest.mark.parametrize("faults", ["stuck:eye_left@0.4+0.4,wheel:left:0.5@0.6,battery:6@0.2+0.5,brownout:0.9+0.1"])
def test_the_same_faults_do_the_same(faults: str) -> None:
    one, two = Bench(faults), Bench(faults)
    for bench in (one, two):
        bench.drive(-0.3, -0.4)
        bench.run(2.0)
    assert one.came == two.came


def test_a_second_junior_is_spared() -> None:
    world = junior_world(WorldSettings(opponent="junior", seed=1, faults=FaultSpec.parse("wheel:left,wheel:right")))
    for _ in range(400):
        world.step(b"")
    second = world.match.second
    assert second is not None
    assert abs(second.motors.travel_left) + abs(second.motors.travel_right) > 0.05
