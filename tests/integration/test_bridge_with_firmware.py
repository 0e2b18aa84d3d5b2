"""The bridge against the real firmware in an emulated ring: real bytes, lock-step."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import pytest

from firmware_protocol.errors import RefusedError
from firmware_protocol.events import Event, PeerBack, PeerFound, PeerLost, Received, StreamBack, StreamStopped
from firmware_protocol.links import FaultSpec, FaultyLink, MemoryLink
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    REFEREE_COMPONENT,
    Command,
    CommandLong,
    JuniorManeuverResult,
    JuniorSensors,
    JuniorWheels,
    ManualControl,
    Phase,
    Reason,
    RefereeState,
    RobotAlive,
    RobotStatus,
    State,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from firmware_protocol.peer.timing import HOST_HEARTBEAT
from firmware_protocol.roles.junior import drive, erase_memory, perform, read_memory, write_memory
from firmware_protocol.roles.referee import reset_bout
from firmware_protocol.vocabulary import ANY_STIMULUS, Action, Maneuver, Outcome
from firmware_protocol.wire.mavlink import MavlinkCodec, split_frames
from hil.bridge.bridge import Bridge
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.link import Link
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.peer.peer import Peer
    from firmware_protocol.wire.fields import Message
    from simdevice.sumo.world import World

T = TypeVar("T")
SPIN = Maneuver((Action.R, Action.L), period=0.05, floor_reflex=False)
BAD_LINE = "drop:0.05,corrupt:0.01,jitter:0.02"


class Ring:
    """A bridge to an emulated Junior."""

    def __init__(self, faults: str = "", seed: int = 3) -> None:
        self.world: World = junior_world(WorldSettings(seed=seed))
        self.link: Link = MemoryLink(self.world)
        if faults:
            spec = FaultSpec.parse(faults)
            self.link = FaultyLink(self.link, spec, seed=seed, clock=self.world, split=split_frames)
        self.bridge = Bridge(self.link, self.world, session=iter(range(400, 500)).__next__)
        self.events: list[Event] = []
        self.until(lambda: 1 in self.bridge.peers and self.peer.ready)

    @property
    def peer(self) -> Peer:
        return self.bridge.peers[1]

    def until(self, done: Callable[[], bool], patience: float = 30.0) -> None:
        end = self.world.now() + patience
        while not done() and self.world.now() < end:
            self.events += self.bridge.step(0.1)
        assert done()

    def run(self, time: float) -> None:
        end = self.world.now() + time - 1e-9
        while self.world.now() < end:
            self.events += self.bridge.step(end - self.world.now())

    def ask(self, ticket: Ticket[T]) -> T:
        self.until(lambda: ticket.done)
        return ticket.value()

    def notices(self) -> list[type[Event]]:
        return [type(event) for event in self.events if isinstance(event, PeerFound | PeerLost | PeerBack)]


def test_the_handshake_takes_three_control_periods() -> None:
    ring = Ring()
    assert ring.world.now() == pytest.approx(0.015)
    assert ring.peer.version is not None
    assert ring.peer.version.uid != 0
    assert ring.bridge.host == 400
    assert ring.ask(ring.peer.request(RobotStatus)).session == ring.peer.session == 401


def test_every_parameter_is_there_and_can_be_set() -> None:
    ring = Ring()
    listed = ring.ask(ring.peer.list_parameters())
    assert list(listed) == [parameter.name for parameter in JUNIOR_PARAMETERS]
    assert list(listed.values()) == pytest.approx([parameter.default for parameter in JUNIOR_PARAMETERS])
    assert ring.ask(ring.peer.set_parameter("SPD_SLOW", 0.45)) == pytest.approx(0.45)
    assert ring.ask(ring.peer.read_parameter("SPD_SLOW")) == pytest.approx(0.45)
    for name, value in (("SPD_SLOW", 7.0), ("MEM_SLOTS", 5.0), ("NO_SUCH", 1.0)):
        with pytest.raises(RefusedError):
            ring.ask(ring.peer.set_parameter(name, value))


def test_a_request_is_answered_with_what_is_true_now() -> None:
    ring = Ring()
    ring.run(0.507)
    before = ring.world.now()
    sensors = ring.ask(ring.peer.request(JuniorSensors))
    assert sensors.time == pytest.approx(before, abs=0.0051)
    assert ring.ask(ring.peer.request(RefereeState, REFEREE_COMPONENT)).time == pytest.approx(ring.world.now(), abs=0.0051)


def test_a_maneuver_is_refused_while_disarmed_and_performed_when_armed() -> None:
    ring = Ring()
    refused = perform(ring.peer, SPIN)
    ring.until(lambda: refused.done)
    assert refused.reason is Reason.DISARMED
    ring.ask(ring.peer.arm())
    result = ring.ask(perform(ring.peer, SPIN))
    assert (result.outcome, result.done, result.samples[:3]) == (Outcome.COMPLETED, 2, (10, 10, 0))


def test_the_memory_survives_the_power_switch() -> None:
    ring = Ring()
    ring.ask(write_memory(ring.peer, ANY_STIMULUS, 1, SPIN))
    ring.ask(write_memory(ring.peer, 2, 3, SPIN))
    first = [ring.ask(read_memory(ring.peer, index)) for index in range(2)]
    ring.run(2.0)
    ring.world.device.power_cycle()
    ring.until(lambda: PeerBack in ring.notices())
    again = [ring.ask(read_memory(ring.peer, index)) for index in range(2)]
    assert [entry.checksum for entry in again] == [entry.checksum for entry in first]
    ring.ask(erase_memory(ring.peer))
    gone = read_memory(ring.peer, 0)
    ring.until(lambda: gone.done)
    assert gone.reason is Reason.NOT_FOUND


def test_the_referee_begins_a_bout_once_for_each_request() -> None:
    ring = Ring(BAD_LINE)
    for bout in range(1, 30):
        ring.ask(reset_bout(ring.peer, bout))
    state = ring.ask(ring.peer.request(RefereeState, REFEREE_COMPONENT))
    assert (state.bout, state.phase) == (29, Phase.RUNNING)


def test_a_bad_line_performs_every_maneuver_exactly_once() -> None:
    ring = Ring(BAD_LINE)
    ring.ask(ring.peer.arm())
    for number in range(200):
        if number % 10 == 0:
            ring.ask(reset_bout(ring.peer, number))
        assert ring.ask(perform(ring.peer, SPIN)).done == 2
    status = ring.ask(ring.peer.request(RobotStatus))
    assert status.maneuvers == 200
    results = [e for e in ring.events if isinstance(e, Received) and isinstance(e.message, JuniorManeuverResult)]
    assert len(results) == 200
    assert ring.notices() == [PeerFound]
    assert isinstance(ring.link, FaultyLink)
    assert ring.link.down.dropped + ring.link.down.corrupted > 20
    assert status.bad_checksum == ring.link.down.corrupted


def test_an_armed_robot_is_kept_awake_over_a_bad_line() -> None:
    ring = Ring(BAD_LINE)
    ring.ask(ring.peer.arm())
    ring.ask(perform(ring.peer, Maneuver((Action.R,) * 8, period=1.0, floor_reflex=False)))
    assert ring.peer.heartbeat is not None
    assert ring.peer.armed


def test_a_restart_in_the_middle_of_a_maneuver_is_told_and_gone_on_from() -> None:
    ring = Ring()
    ring.ask(ring.peer.arm())
    ring.run(2.0)
    ticket = perform(ring.peer, Maneuver((Action.R,) * 8, period=0.5))
    ring.run(0.5)
    assert any(ring.world.device.wheels)
    ring.world.device.power_cycle()
    ring.until(lambda: ticket.done)
    assert "has restarted" in str(ticket.error)
    ring.until(lambda: ring.notices()[-1] is PeerBack)
    assert ring.world.device.wheels == (0.0, 0.0)
    assert ring.peer.session == 402
    ring.ask(ring.peer.arm())
    ring.ask(perform(ring.peer, SPIN))


def test_the_emergency_stop_acts_within_one_control_period() -> None:
    ring = Ring()
    ring.ask(ring.peer.arm())
    ticket = perform(ring.peer, Maneuver((Action.R,) * 8, period=0.5))
    ring.run(0.3)
    assert any(ring.world.device.wheels)
    stop = ring.peer.emergency_stop()
    ring.bridge.step(0)
    ring.bridge.step(0.005)
    assert ring.world.device.wheels == (0.0, 0.0)
    ring.ask(stop)
    assert ring.ask(ticket).outcome == Outcome.STOPPED
    assert ring.ask(ring.peer.request(RobotStatus)).state == State.STOPPED


def test_no_damaged_command_moves_a_wheel() -> None:
    ring = Ring()
    ring.ask(ring.peer.arm())
    codec = MavlinkCodec(system=HOST_SYSTEM, component=HOST_COMPONENT)
    spec = FaultSpec(corrupt=1.0)
    damaging = FaultyLink(ring.link, spec, seed=1, clock=ring.world, split=split_frames)
    for sequence in range(1, 3000):
        damaging.write(codec.encode(JuniorWheels(401, sequence, (0.5, -0.5), 0.1, 1, 1)))
        ring.run(0.005)
        assert ring.world.device.wheels == (0.0, 0.0)
    assert ring.peer.armed
    ring.bridge.send(JuniorWheels(401, 3000, (0.5, -0.5), 0.1, 1, 1))
    ring.run(0.01)
    assert ring.world.device.wheels == (0.5, -0.5)


def test_a_second_host_takes_over_and_the_first_is_told() -> None:
    ring = Ring()
    second = Bridge(ring.link, ring.world, session=lambda: 9)
    while not (1 in second.peers and second.peers[1].ready):
        second.step(0.1)
    ticket = erase_memory(ring.peer)
    ring.until(lambda: ticket.done)
    assert ticket.reason is Reason.WRONG_SESSION


class Other:
    """Another program on the same network, with the same ids.

    Args:
        world: The emulated robot.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._codec = MavlinkCodec(system=HOST_SYSTEM, component=HOST_COMPONENT)

    def live(self, seconds: float, *said: Message) -> list[Message]:
        """Let time pass while this program says the same every 20 ms; what the robot says meanwhile."""
        heard: list[Message] = []
        for period in range(round(seconds / 0.005)):
            data = b"".join(map(self._codec.encode, said)) if period % 4 == 0 else b""
            events = self._codec.receive(self._world.step(data), self._world.now())
            heard += [event.message for event in events if isinstance(event, Received)]
        return heard


@pytest.mark.parametrize(
    "said", [[HOST_HEARTBEAT], [RobotAlive(9)], [HOST_HEARTBEAT, RobotAlive(401), ManualControl(1, 500)]], ids=str
)
def test_another_program_of_the_same_system_id_keeps_no_robot_moving_whose_host_is_gone(said: list[Message]) -> None:
    ring = Ring()
    ring.ask(ring.peer.arm())
    perform(ring.peer, Maneuver((Action.R,) * 8, period=1.0, floor_reflex=False))
    ring.run(1.0)
    assert any(ring.world.device.wheels)
    other = Other(ring.world)  # our program has been killed: it says nothing any more
    other.live(0.25 + 0.005, *said)
    assert ring.world.device.wheels == (0.0, 0.0)


def test_a_stop_of_another_program_whose_order_was_heard_does_not_end_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    """Our frame is lost, and the robot accepts what another program asks: the wheels may go on, and we know it."""
    ring = Ring()
    ring.ask(ring.peer.arm())
    perform(ring.peer, Maneuver((Action.R,) * 8, period=1.0, floor_reflex=False))
    ring.run(0.2)
    stop = ring.peer.emergency_stop()
    monkeypatch.setattr(ring.link, "write", lambda _: None)
    ring.bridge.step(0)  # the emergency stop is lost
    monkeypatch.undo()
    other = MavlinkCodec(system=254, component=1)
    ring.link.write(other.encode(CommandLong(1, 1, Command.FLIGHT_TERMINATION, param1=0.0)))  # denied
    ring.bridge.step(0.005)
    ring.bridge.step(0.005)
    assert not bool(stop.done)
    ring.ask(stop)
    assert ring.world.device.wheels == (0.0, 0.0)
    assert ring.ask(ring.peer.request(RobotStatus)).state == State.STOPPED


def test_a_ground_station_takes_the_robot_and_the_host_is_told() -> None:
    ring = Ring()
    ring.ask(ring.peer.arm())
    perform(ring.peer, Maneuver((Action.R,) * 8, period=1.0, floor_reflex=False))
    ring.run(0.2)
    station = Other(ring.world)
    station.live(0.02, CommandLong(1, 1, Command.ARM_DISARM, param1=1.0))
    assert ring.world.device.wheels == (0.0, 0.0), "it has not asked for that motion"
    station.live(1.0, ManualControl(1, 500))
    assert ring.world.device.wheels == (0.5, 0.5)
    station.live(0.26)
    assert ring.world.device.wheels == (0.0, 0.0)
    with pytest.raises(RefusedError, match="another host has taken it over"):
        ring.ask(drive(ring.peer, 0.1, 0.1, 0.1))
    with pytest.raises(RefusedError):
        ring.ask(ring.peer.arm())


def test_a_stream_that_another_client_switches_off_is_on_again() -> None:
    ring = Ring()
    station = MavlinkCodec(system=254, component=1)
    ring.link.write(station.encode(CommandLong(1, 1, Command.SET_MESSAGE_INTERVAL, 0, float(JuniorSensors.ID), -1.0)))
    ring.run(4.0)
    texts = [event.text for event in ring.events if isinstance(event, StreamStopped | StreamBack)]
    assert texts == [
        "robot 1 sends no JUNIOR_SENSORS any more: stopped by another client; asking for it again",
        "robot 1 sends JUNIOR_SENSORS again",
    ]
