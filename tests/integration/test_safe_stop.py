"""The wheels stop: on silence, on the emergency stop, on every way out of the program. Read from the device itself."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Final

import pytest

import hil
from firmware_protocol.errors import LinkClosedError, PeerError, RefusedError
from firmware_protocol.links import FaultSpec, FaultyLink, MemoryLink
from firmware_protocol.messages import (
    Command,
    CommandLong,
    ContestCommand,
    JuniorContest,
    JuniorManeuver,
    JuniorWheels,
    ManualControl,
    State,
)
from firmware_protocol.roles.junior import perform
from firmware_protocol.wire.mavlink import MavlinkCodec, split_frames
from hil.bridge.bridge import Bridge
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Callable

PERIOD: Final = 0.005
"""Control period, in s."""
WATCHDOG: Final = 0.25
"""Longest silence of the host, in s."""
AHEAD: Final = hil.Maneuver((hil.Action.FF,) * 8, period=0.5, floor_reflex=False)
LONG: Final = hil.Limits(duration=5.0)


class Watched:
    """A world that remembers when it last heard the host, and what its wheels did since.

    Attributes:
        heard: Time at which the last bytes of the host were taken in, in s.
        moved: The time of every control period in which a wheel was turned on, in s.
        deaf: It does not get what the host says.
    """

    def __init__(self) -> None:
        self.world = junior_world(WorldSettings(seed=5))
        self.sessions = count(1)
        self.heard = 0.0
        self.moved: list[float] = []
        self.deaf = False

    def now(self) -> float:
        return self.world.now()

    def step(self, inbound: bytes) -> bytes:
        out = self.world.step(b"" if self.deaf else inbound)
        if inbound:
            self.heard = self.now()
        if self.wheels != (0.0, 0.0):
            self.moved.append(self.now())
        return out

    @property
    def wheels(self) -> tuple[float, float]:
        return self.world.device.wheels

    def pass_time(self, seconds: float) -> None:
        """The host is silent."""
        for _ in range(round(seconds / PERIOD)):
            self.step(b"")


def connect(watched: Watched, limits: hil.Limits = LONG, faults: str = "") -> hil.Junior:
    """A handle on the watched world."""
    link: MemoryLink | FaultyLink = MemoryLink(watched)
    if faults:
        link = FaultyLink(link, FaultSpec.parse(faults), seed=1, clock=watched, split=split_frames)
    junior = hil.Junior(Bridge(link, watched, session=watched.sessions.__next__), limits)
    junior.find()
    return junior


def driving(watched: Watched, faults: str = "") -> hil.Junior:
    """Connected, armed, and with its wheels on for five seconds to come."""
    junior = connect(watched, faults=faults)
    junior.arm()
    junior.drive(0.8, 0.6, 5.0)
    junior.wait(0.4)
    assert watched.wheels == (0.8, 0.6)
    return junior


def performing(watched: Watched) -> hil.Junior:
    """Connected, armed, and 0.4 s into a maneuver of four."""
    junior = connect(watched)
    junior.arm()
    perform(junior.peer, AHEAD)
    junior.wait(0.4)
    assert watched.wheels == (1.0, 1.0)
    return junior


def state(watched: Watched) -> State:
    """What the robot itself says it does."""
    watched.pass_time(1.2)
    with Bridge(MemoryLink(watched), watched, open_sessions=False) as bridge:
        while 1 not in bridge.peers or (heartbeat := bridge.peers[1].heartbeat) is None:
            bridge.step(1.5)
        return State(heartbeat.custom_mode)


@pytest.mark.parametrize("begin", [driving, performing])
def test_the_wheels_stop_when_the_host_falls_silent(begin: Callable[[Watched], hil.Junior]) -> None:
    watched = Watched()
    begin(watched)
    watched.pass_time(watched.heard + WATCHDOG - PERIOD - watched.now())
    assert watched.wheels != (0.0, 0.0)  # it is the watchdog that stops them, and not something before
    watched.pass_time(1.0)
    assert watched.wheels == (0.0, 0.0)
    assert watched.moved[-1] - watched.heard <= WATCHDOG + PERIOD + 1e-9


@pytest.mark.parametrize("begin", [driving, performing])
def test_the_emergency_stop_stops_them_in_the_control_period_it_arrives_in(begin: Callable[[Watched], hil.Junior]) -> None:
    watched = Watched()
    junior = begin(watched)
    junior.bridge.send(CommandLong(1, 1, Command.FLIGHT_TERMINATION, param1=1.0))
    junior.step(PERIOD)
    assert watched.wheels == (0.0, 0.0)
    assert watched.now() - watched.moved[-1] <= PERIOD + 1e-9


def test_the_emergency_stop_holds_until_disarmed_and_armed_again() -> None:
    watched = Watched()
    junior = driving(watched)
    junior.emergency_stop()
    stopped = watched.now()
    with pytest.raises(RefusedError, match="emergency stop is engaged"):
        junior.arm()
    with pytest.raises(RefusedError, match="emergency stop"):
        junior.drive(1.0, 1.0)
    with pytest.raises(RefusedError, match="emergency stop"):
        junior.perform(["FF"])
    assert watched.moved[-1] <= stopped
    junior.disarm()
    junior.arm()
    junior.drive(0.5, 0.5)
    assert watched.wheels == (0.5, 0.5)


def test_leaving_does_not_release_an_emergency_stop() -> None:
    watched = Watched()
    with driving(watched) as junior:
        junior.emergency_stop()
    with connect(watched) as junior, pytest.raises(RefusedError, match="emergency stop is engaged"):
        junior.arm()
    with connect(watched) as junior:
        with pytest.raises(RefusedError, match="emergency stop is engaged"):
            junior.arm()
        junior.disarm()
        junior.arm()


def test_an_emergency_stop_that_nobody_heard_leaves_no_robot_armed() -> None:
    watched = Watched()
    with driving(watched) as junior:
        watched.deaf = True
        with pytest.raises(PeerError):
            junior.emergency_stop()
        watched.deaf = False
        junior.arm()
        junior.drive(0.5, 0.5)
    with Bridge(MemoryLink(watched), watched, open_sessions=False) as looking:
        while 1 not in looking.peers:
            looking.step(PERIOD)
        heartbeat = looking.peers[1].heartbeat
    assert heartbeat is not None
    assert heartbeat.custom_mode == State.DISARMED


class Bang(Exception):  # noqa: N818 - a mistake in the user's program
    """What a user's program may raise."""


@pytest.mark.parametrize("error", [None, Bang, KeyboardInterrupt, SystemExit])
@pytest.mark.parametrize("begin", [driving, performing])
def test_every_way_out_of_the_with_block_stops_and_disarms(
    begin: Callable[[Watched], hil.Junior], error: type[BaseException] | None
) -> None:
    watched = Watched()
    left = 0.0

    def program() -> None:
        nonlocal left
        with begin(watched):
            left = watched.now()
            if error is not None:
                raise error

    if error is None:
        program()
    else:
        with pytest.raises(error):
            program()
    assert watched.wheels == (0.0, 0.0)
    assert watched.moved[-1] - left <= PERIOD + 1e-9
    assert state(watched) is State.DISARMED
    assert watched.moved[-1] - left <= PERIOD + 1e-9


def test_an_exception_in_the_middle_of_a_wait_stops_it_too() -> None:
    watched = Watched()

    def listener(event: object) -> None:
        if watched.now() > 0.5:
            raise Bang(event)

    with pytest.raises(Bang), connect(watched) as junior:  # noqa: PT012 - the block is what is tested
        junior.arm()
        junior.listen(listener)
        junior.perform(AHEAD)
    assert watched.wheels == (0.0, 0.0)
    assert watched.now() < 0.6


def test_closing_twice_is_closing() -> None:
    watched = Watched()
    junior = driving(watched)
    junior.close()
    closed = watched.now()
    junior.close()
    assert watched.now() == closed
    assert watched.wheels == (0.0, 0.0)
    assert state(watched) is State.DISARMED
    with pytest.raises(LinkClosedError):
        junior.drive(1.0, 1.0)


def test_when_the_link_dies_the_robot_stops_by_itself() -> None:
    watched = Watched()
    with pytest.raises(LinkClosedError, match="unplugged"), driving(watched, "unplug:1.0") as junior:
        junior.wait(5.0)
    died = watched.now()
    assert died == pytest.approx(1.0, abs=0.06)
    watched.pass_time(1.0)
    assert watched.wheels == (0.0, 0.0)
    assert watched.moved[-1] - watched.heard <= WATCHDOG + PERIOD + 1e-9
    assert watched.moved[-1] - died <= WATCHDOG + PERIOD + 1e-9


def test_leaving_over_a_bad_line_disarms_all_the_same() -> None:
    watched = Watched()
    with driving(watched, "drop:0.3,jitter:0.02"):
        left = watched.now()
    assert watched.wheels == (0.0, 0.0)
    assert watched.moved[-1] - left < WATCHDOG + PERIOD + 1e-9
    assert state(watched) is State.DISARMED


def test_nothing_moves_a_robot_that_is_disarmed() -> None:
    watched = Watched()
    junior = connect(watched)
    with pytest.raises(RefusedError, match="not armed"):
        junior.drive(0.5, 0.5)
    with pytest.raises(RefusedError, match="not armed"):
        junior.perform(["FF"])
    codec = MavlinkCodec(system=255, component=190)
    session = junior.peer.session
    assert session is not None
    actions = (1, 2, 3, 4, 5, 6, 7, 8)
    for number in range(10, 210):
        pushes = (
            JuniorWheels(session, number * 4, (1.0, -1.0), 1.0, 1, 1),
            JuniorManeuver(session, number * 4 + 1, 0.1, 12, 1, 1, 8, actions),
            JuniorContest(session, number * 4 + 2, 0.0, 1, 1, ContestCommand.START),
            ManualControl(1, 1000, 1000, 1000, 1000, 0),
        )
        watched.step(b"".join(map(codec.encode, pushes)))
    junior.wait(10.0)
    assert watched.moved == []


def test_connecting_stops_and_disarms_what_another_program_left_running() -> None:
    watched = Watched()
    driving(watched)
    connect(watched)
    assert watched.wheels == (0.0, 0.0)
    assert state(watched) is State.DISARMED


def test_a_newcomer_takes_the_robot_over_and_the_first_host_is_told() -> None:
    watched = Watched()
    first = driving(watched)
    connect(watched)
    with pytest.raises(RefusedError, match="another host"):
        first.drive(1.0, 1.0)
    assert watched.wheels == (0.0, 0.0)


def test_limits_bound_what_is_asked_for_and_say_so() -> None:
    watched = Watched()
    junior = connect(watched, hil.Limits(speed=0.5, duration=0.2, maneuver=0.4))
    junior.arm()
    assert junior.drive(1.0, -0.5, 60.0) == (0.5, -0.25, 0.2)
    assert watched.wheels == (0.5, -0.25)
    begun = watched.moved[0]
    junior.wait(1.0)
    assert watched.moved[-1] - begun <= 0.2 + 1e-9
    watched.moved.clear()
    report = junior.perform(AHEAD)
    assert report.outcome is hil.Outcome.COMPLETED
    assert watched.moved[-1] - watched.moved[0] <= 0.4 + 1e-9


@pytest.mark.parametrize(
    "command",
    [(float("nan"), 0.0, 0.1), (0.0, float("nan"), 0.1), (0.5, 0.5, float("nan")), (float("inf"), 0.0, 0.1), (0.5, 0.5, -1.0)],
)
def test_what_is_no_number_is_not_sent(command: tuple[float, float, float]) -> None:
    watched = Watched()
    junior = connect(watched)
    junior.arm()
    with pytest.raises(ValueError, match="finite"):
        junior.drive(*command)
    junior.wait(0.1)
    assert watched.moved == []
