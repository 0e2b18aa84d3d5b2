"""An emulated bout as the host sees it: bytes in, bytes out, the firmware in between."""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, TypeVar

import pytest

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    AckResult,
    AutopilotVersion,
    BoutOutcome,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    JuniorSensors,
    JuniorWheels,
    OpponentCode,
    ParamSet,
    Phase,
    Reason,
    RefereeReset,
    RefereeState,
    RobotAck,
    RobotAlive,
    RobotSession,
    RobotStatus,
    SensorFlag,
)
from firmware_protocol.wire.fields import Message
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.junior.profile import JuniorProfile
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from simdevice.sumo.world import World

SESSION = 77
T = TypeVar("T", bound=Message)


class Host:
    """The least that a host needs to say."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.codec = MavlinkCodec(system=255, component=190)
        self.sequence = 0
        self.sent = b""
        self.heard: list[Received] = []

    def run(self, seconds: float, *messages: Message, alive: bool = True) -> list[Received]:
        data = b"".join(map(self.codec.encode, messages))
        heard: list[Received] = []
        for step in range(round(seconds / 0.005)):
            if alive and step % 8 == 0:
                data += self.codec.encode(RobotAlive(7))
            out = self.world.step(data)
            self.sent += out
            data = b""
            for event in self.codec.receive(out, self.world.now()):
                assert isinstance(event, Received), event
                heard.append(event)
        self.heard += heard
        return heard

    def arm(self) -> None:
        self.run(0.02, RobotSession(SESSION, 0, 7, 1, 1, 2, 0))
        self.run(0.02, CommandLong(1, 1, Command.ARM_DISARM, param1=1.0, param3=7.0))

    def wheels(self, left: float, right: float, duration: float) -> JuniorWheels:
        self.sequence += 1
        return JuniorWheels(SESSION, self.sequence, (left, right), duration, 1, 1)

    def reset(self, seed: int, opponent: OpponentCode = OpponentCode.KEEP) -> RefereeReset:
        self.sequence += 1
        return RefereeReset(seed, SESSION, self.sequence, 1, 25, opponent)


def only(kind: type[T], heard: list[Received]) -> list[T]:
    return [event.message for event in heard if isinstance(event.message, kind)]


def test_a_robot_and_its_referee_are_heard() -> None:
    host = Host(junior_world())
    heard = host.run(2.0)
    assert {(event.system, event.component) for event in heard} == {(1, 1), (1, 25)}
    assert len(only(JuniorSensors, heard)) == pytest.approx(100, abs=2)
    assert len(only(RefereeState, heard)) == pytest.approx(40, abs=1)
    assert {(state.phase, state.bout, state.outcome) for state in only(RefereeState, heard)} == {(Phase.IDLE, 0, 0)}
    assert host.world.now() == pytest.approx(2.0)


def test_without_a_referee_it_is_as_with_a_physical_robot() -> None:
    heard = Host(junior_world(WorldSettings(referee=False))).run(0.5)
    assert {(event.system, event.component) for event in heard} == {(1, 1)}


def test_the_wheels_move_the_body_and_the_sensors_tell() -> None:
    host = Host(junior_world())
    host.arm()
    body = host.world.match.robot.body
    body.place(-0.2, 0.0, 0.0)
    host.world.match.opponent.place(0.0, 0.15, 0.0)
    heard = host.run(0.5, host.wheels(0.5, 0.5, 0.3))
    last = only(JuniorSensors, heard)[-1]
    assert last.travel[0] == pytest.approx(body.ground, abs=0.01)
    assert body.ground > 0.04
    assert last.flags & SensorFlag.GROUND_ODOMETER
    assert last.flags & SensorFlag.TRAVEL_FROM_ENCODERS
    assert last.battery == pytest.approx(7.5, abs=0.1)
    assert host.world.device.wheels == (0.0, 0.0)


def test_the_firmware_sees_feels_and_notes_the_border() -> None:
    host = Host(junior_world())
    body, block = host.world.match.robot.body, host.world.match.opponent
    body.place(-0.1, 0.0, 0.0)
    block.place(0.0, 0.0, math.pi)
    near = only(JuniorSensors, host.run(0.2))[-1]
    assert near.flags & 15 == SensorFlag.EYE_LEFT | SensorFlag.EYE_RIGHT
    block.place(body.x + 0.0805, 0.0, math.pi)
    touching = only(JuniorSensors, host.run(0.2))[-1]
    assert touching.flags & 15 == 15
    assert touching.flags & SensorFlag.HELD_LEFT
    body.place(0.0, 0.19, 0.0)
    block.place(-0.2, -0.1, 0.0)
    border = only(JuniorSensors, host.run(0.2))[-1]
    assert border.flags & SensorFlag.OFF_RING_LEFT
    assert not border.flags & SensorFlag.OFF_RING_RIGHT


def test_what_is_not_fitted_is_not_told() -> None:
    host = Host(junior_world(WorldSettings(profile=JuniorProfile(encoders=False, ground_odometer=False))))
    host.arm()
    last = only(JuniorSensors, host.run(0.4, host.wheels(0.5, 0.5, 0.2)))[-1]
    assert not last.flags & (SensorFlag.GROUND_ODOMETER | SensorFlag.TRAVEL_FROM_ENCODERS)
    assert last.travel[0] == pytest.approx(0.5 * 0.4 * 0.2, abs=0.005)


def test_the_referee_resets_once_for_each_number() -> None:
    host = Host(junior_world())
    request = host.reset(42, OpponentCode.POINT_LIGHT)
    heard = host.run(0.1, request)
    assert only(RobotAck, heard) == [RobotAck(RefereeReset.ID, SESSION, 1, 255, 190, AckResult.ACCEPTED, Reason.NONE)]
    state = only(RefereeState, heard)[-1]
    assert (state.bout, state.phase, state.opponent_code) == (1, Phase.RUNNING, OpponentCode.POINT_LIGHT)
    heard = host.run(0.1, request)
    assert only(RobotAck, heard) == [RobotAck(RefereeReset.ID, SESSION, 1, 255, 190, AckResult.ACCEPTED, Reason.NONE)]
    assert only(RefereeState, heard)[-1].bout == 1
    assert only(RefereeState, host.run(0.1, host.reset(43)))[-1].bout == 2
    heard = host.run(0.1, request)
    assert only(RobotAck, heard) == [RobotAck(RefereeReset.ID, SESSION, 1, 255, 190, AckResult.REFUSED, Reason.OLD_SEQUENCE)]
    # A restarted host counts anew in another session.
    restarted = RefereeReset(42, SESSION + 1, 1, 1, 25, 0)
    assert only(RobotAck, host.run(0.1, restarted))[0].result == AckResult.ACCEPTED
    assert only(RefereeState, host.run(0.1))[-1].opponent == pytest.approx(state.opponent, abs=2e-4)


def test_the_start_pose_follows_from_the_seed_of_the_bout_alone() -> None:
    poses = []
    for world_seed, waste in ((1, 0.0), (2, 1.0)):
        host = Host(junior_world(WorldSettings(seed=world_seed)))
        host.run(waste)
        state = only(RefereeState, host.run(0.01, host.reset(9)))[0]
        poses.append((state.junior, state.junior_heading, state.opponent, state.opponent_heading))
    assert poses[0] == poses[1]


def test_a_bout_does_not_remember_the_one_before() -> None:
    bouts = []
    for waste in (0, 3):
        host = Host(junior_world(WorldSettings(opponent="corner-light")))
        host.arm()
        for seed in range(waste):
            host.run(1.0, host.reset(seed, OpponentCode.FLAT_HEAVY), host.wheels(1.0, 0.9, 0.5))
        host.run(0.05, host.reset(11, OpponentCode.CORNER_LIGHT), host.wheels(0.0, 0.0, 0.0))
        match = host.world.match
        trace = []
        for _ in range(4):
            host.run(0.5, host.wheels(1.0, 0.8, 0.4))
            trace.append((match.robot.body.x, match.robot.body.angle, match.opponent.x, match.opponent.angle))
        bouts.append(trace)
    assert bouts[0] == bouts[1]


def test_a_reset_stops_the_body_and_leaves_the_firmware_alone() -> None:
    host = Host(junior_world())
    host.arm()
    host.run(0.3, host.wheels(1.0, 1.0, 1.0))
    before = host.world.device.uptime
    host.run(0.005, host.reset(3))
    assert host.world.device.wheels == (1.0, 1.0)
    assert host.world.match.robot.body.body.velocity.length < 0.1
    assert host.world.device.uptime == pytest.approx(before + 0.005)


def test_the_state_of_the_bout_can_be_asked_for() -> None:
    host = Host(junior_world())
    host.run(0.02)
    heard = host.run(0.01, CommandLong(1, 25, Command.REQUEST_MESSAGE, param1=float(RefereeState.ID)))
    assert [type(event.message) for event in heard if event.component == 25] == [CommandAck, RefereeState]
    for command, param, result in (
        (Command.REQUEST_MESSAGE, 30.0, CommandResult.DENIED),
        (Command.ARM_DISARM, 1.0, CommandResult.UNSUPPORTED),
    ):
        heard = host.run(0.01, CommandLong(1, 25, command, param1=param))
        assert [ack.result for ack in only(CommandAck, heard)] == [result]


@pytest.mark.parametrize(("x", "outcome"), [(0.40, BoutOutcome.WIN), (0.0, BoutOutcome.UNDECIDED)])
def test_a_decision_is_told_at_once(x: float, outcome: BoutOutcome) -> None:
    host = Host(junior_world())
    host.run(0.025, host.reset(1))
    host.world.match.opponent.place(x, 0.2, 0.0)
    host.world.match.robot.body.place(0.0, -0.1, 0.0)
    states = only(RefereeState, host.run(0.005))
    if outcome is BoutOutcome.UNDECIDED:
        assert not states
    else:
        assert [(state.outcome, state.phase) for state in states] == [(outcome, Phase.OVER)]
        assert states[0].clearance == pytest.approx(-0.075, abs=1e-3)
    # A decided bout stays decided, whatever happens then.
    host.world.match.robot.body.place(0.0, 0.3, 0.0)
    expected = BoutOutcome.LOSS if outcome is BoutOutcome.UNDECIDED else outcome
    assert only(RefereeState, host.run(0.1))[-1].outcome == expected


def test_the_referee_follows_the_robots_system_id() -> None:
    host = Host(junior_world())
    host.run(0.1, ParamSet(1, 1, "SYS_ID", 5.0))
    host.run(0.1, CommandLong(1, 1, Command.PREFLIGHT_REBOOT, param1=1.0))
    heard = host.run(1.0)
    assert {(event.system, event.component) for event in heard[-20:]} == {(5, 1), (5, 25)}
    assert only(RobotAck, host.run(0.1, RefereeReset(1, 1, 1, 5, 25, 0)))[0].result == AckResult.ACCEPTED


def test_a_reboot_keeps_the_eeprom_and_restarts_the_clock() -> None:
    world = junior_world()
    host = Host(world)
    host.run(0.5, ParamSet(1, 1, "SPD_SLOW", 0.25))
    host.arm()
    host.run(0.1, host.wheels(1.0, 1.0, 1.0))
    heard = host.run(0.01, CommandLong(1, 1, Command.PREFLIGHT_REBOOT, param1=1.0))
    assert only(CommandAck, heard)[0].result == CommandResult.ACCEPTED
    host.run(0.1)
    assert world.device.uptime < 0.2
    assert world.device.wheels == (0.0, 0.0)
    status = only(RobotStatus, host.run(1.2))[-1]
    assert status.boot_count == 2
    # The image of the EEPROM makes the same robot in another run.
    again = junior_world(WorldSettings(nvm=world.device.nvm))
    assert only(RobotStatus, Host(again).run(1.2))[-1].boot_count == 3
    with pytest.raises(ValueError, match="1024"):
        junior_world(WorldSettings(nvm=b"short"))


def test_a_power_cut_stops_the_wheels() -> None:
    host = Host(junior_world())
    host.arm()
    host.run(0.1, host.wheels(1.0, 1.0, 5.0))
    host.world.device.power_cycle()
    host.run(0.01)
    assert host.world.device.wheels == (0.0, 0.0)
    assert host.world.match.robot.motors.travel_left < 0.05


def test_same_seed_same_bytes_other_seed_other_bytes() -> None:
    def play(seed: int) -> bytes:
        host = Host(junior_world(WorldSettings(opponent="corner-light", seed=seed)))
        host.arm()
        host.run(0.02, host.reset(4))
        for _ in range(8):
            host.run(0.4, host.wheels(1.0, 0.8, 0.4))
        return host.sent

    assert play(1) == play(1)
    assert play(1) != play(2)


def test_each_robot_has_an_identity_of_its_own() -> None:
    ids = []
    for world in (
        junior_world(WorldSettings(seed=1)),
        junior_world(WorldSettings(seed=2)),
        junior_world(WorldSettings(profile=JuniorProfile(uid=99))),
    ):
        heard = Host(world).run(0.05, CommandLong(1, 1, Command.REQUEST_MESSAGE, param1=float(AutopilotVersion.ID)))
        ids.append(only(AutopilotVersion, heard)[0].uid)
    assert len(set(ids)) == 3
    assert ids[2] == 99


def test_a_second_junior_plays_from_its_memory_without_a_host() -> None:
    outcomes = []
    for seed in range(6):
        host = Host(junior_world(WorldSettings(opponent="junior")))
        host.run(0.02, host.reset(seed))
        states = only(RefereeState, host.run(15.1))
        moved = sum(math.dist(a.opponent, b.opponent) for a, b in pairwise(states))
        assert moved > 0.3
        outcomes.append(next((state.outcome for state in states if state.phase == Phase.OVER), None))
        assert states[0].opponent_code == OpponentCode.JUNIOR
    # A Junior that stands still is pushed out.
    assert outcomes.count(BoutOutcome.LOSS) >= 4


def test_a_second_junior_comes_and_goes() -> None:
    host = Host(junior_world())
    for opponent in (OpponentCode.JUNIOR, OpponentCode.FLAT_LIGHT, OpponentCode.JUNIOR, OpponentCode.KEEP):
        heard = host.run(1.0, host.reset(5, opponent))
        assert only(RefereeState, heard)[-1].opponent_code == (opponent or OpponentCode.JUNIOR)
    assert host.world.match.second is not None
    assert host.world.match.second.body.body.velocity.length > 0.01


def test_foreign_bytes_do_no_harm() -> None:
    host = Host(junior_world())
    world = host.world
    for chunk in (b"\xfd" * 300, bytes(range(256)) * 4, b""):
        world.step(chunk)
    assert world.device.wheels == (0.0, 0.0)
    host.run(0.5)
    assert only(RobotAck, host.run(0.1, host.reset(1)))


def test_the_profile_is_plain_data() -> None:
    profile = JuniorProfile()
    assert is_dataclass(profile)
    for field in fields(profile):
        assert isinstance(getattr(profile, field.name), int | float | bool | tuple)
