"""Who answers on a line: robots, other vehicles, adapters, chatter and silence; and that nobody is disturbed by the look."""

from __future__ import annotations

import os
import random
import threading
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st
from probed_lines import Driven, Rated, Shared
from scripted_robot import ScriptedRobot
from signed_pair import KEY, NOW, OTHER_KEY, signed_codec

from firmware_protocol.errors import AddressError, LinkClosedError, LinkOpenError
from firmware_protocol.events import Received
from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.messages import (
    ROBOT_COMPONENT,
    Command,
    CommandLong,
    Heartbeat,
    JuniorWheels,
    Ping,
    RobotSession,
    State,
)
from firmware_protocol.peer.timing import HOST_HEARTBEAT
from firmware_protocol.wire.can.frame import CanFrame
from firmware_protocol.wire.fields import CAN, MAVLINK
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.signing import Signing
from hil.bridge.witness import framing, printable
from hil.connecting.discovery import Finding, Status, probe, survey
from hil.connecting.listening import Listener, Signed
from hil.connecting.places import Place, named
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from probed_lines import Device

    from firmware_protocol.clock import Clock
    from firmware_protocol.link import Link
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.signing import SigningKey
    from simdevice.sumo.world import World

SERIAL = Place("serial", "/dev/test", "serial:///dev/test:115200")


def look(device: Device, *, wire: str = MAVLINK, timeout: float = 5.0, url: str = "tcp://test:1") -> Finding:
    """Probe a device in lock-step."""
    return probe(Place("address", url, url), timeout, lambda url: (MemoryLink(device, url, wire=wire), device))


def look_at(line: Rated, timeout: float = 5.0) -> Finding:
    """Probe a serial line in lock-step."""
    finding = probe(SERIAL, timeout, lambda _: (line, line.clock))
    assert line.closed
    assert line.clock.now() <= timeout + 0.06
    return finding


def messages(data: bytes) -> list[tuple[int, Message]]:
    """What bytes say, and who says it."""
    events = MavlinkCodec(system=9, component=9).receive(data, 0.0)
    return [(event.system, event.message) for event in events if isinstance(event, Received)]


# --- Robots ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wire", [MAVLINK, CAN])
def test_a_robot_is_found_and_told(wire: str) -> None:
    world = junior_world(WorldSettings(wire=wire))
    finding = look(world, wire=wire)
    assert finding.status is Status.ROBOT
    (robot,) = finding.robots
    assert (robot.system, robot.junior, robot.armed, robot.state) == (1, True, False, State.DISARMED)
    assert (robot.firmware, robot.protocol) == ("0.1", "2.1")
    assert robot.uid == f"{int(robot.uid or '', 16):016x}"
    assert robot.battery == pytest.approx(7.5, abs=0.05)
    assert str(robot) == "Junior, system 1, disarmed, firmware 0.1, battery 7.5 V"
    assert finding.address(robot) == finding.url == "tcp://test:1"
    assert world.now() < 2.5  # as soon as everybody has been heard


def test_several_robots_on_a_line_are_told_apart() -> None:
    finding = look(Shared(*(ScriptedRobot(system=system) for system in (3, 1, 2))))
    assert [robot.system for robot in finding.robots] == [1, 2, 3]
    assert finding.address(finding.robots[1]) == "tcp://test:1?system=2"
    bus = Finding(finding.place, finding.status, "can://socketcan/can0?bitrate=1", finding.robots)
    assert bus.address(finding.robots[2]) == "can://socketcan/can0?bitrate=1&node=3"
    named = Finding(finding.place, finding.status, "tcp://test:1?system=3", finding.robots)
    assert named.address(finding.robots[0]) == "tcp://test:1?system=1"


def test_a_robot_of_another_protocol_is_told_and_does_not_count() -> None:
    finding = look(ScriptedRobot(version=(3, 3)))
    assert finding.status is Status.VEHICLE
    assert "speaks protocol 3.3, this software 2.1" in str(finding.robots[0])


def test_a_robot_that_does_not_say_its_version_is_still_found() -> None:
    finding = look(ScriptedRobot(deaf=lambda message: isinstance(message, CommandLong)))
    assert finding.status is Status.ROBOT
    assert str(finding.robots[0]) == "Junior, system 1, disarmed, battery 7.4 V"


# --- Keys ------------------------------------------------------------------------------------------------------------


def signing_line(key: SigningKey | None, ours: SigningKey | None) -> tuple[Finding, World]:
    """Look with a key of ours at a robot with one."""
    world = junior_world(WorldSettings(signing_key=key, referee=False))
    place = Place("address", "tcp://test:1", "tcp://test:1")
    return probe(place, 5.0, lambda url: (MemoryLink(world, url), world), key=ours), world


def test_a_robot_that_signs_is_told_as_such_and_left_alone() -> None:
    finding, world = signing_line(KEY, None)
    assert finding.status is Status.VEHICLE
    assert "docs/signing.md" in finding.remedy
    (robot,) = finding.robots
    assert (robot.signed, robot.usable, robot.firmware) == (Signed.UNKNOWN_KEY, False, None)
    assert str(robot).endswith("signs; pass --signing-key")
    assert world.now() < 2.5


def test_with_its_key_a_robot_is_found_like_any_other() -> None:
    finding, _ = signing_line(KEY, KEY)
    assert finding.status is Status.ROBOT
    assert str(finding.robots[0]) == "Junior, system 1, disarmed, firmware 0.1, battery 7.5 V, signs with this key"


def test_a_robot_with_another_key_and_one_with_none() -> None:
    finding, _ = signing_line(OTHER_KEY, KEY)
    assert (finding.status, finding.robots[0].signed) == (Status.VEHICLE, Signed.OTHER_KEY)
    finding, _ = signing_line(None, KEY)
    assert (finding.status, finding.robots[0].signed, finding.robots[0].firmware) == (Status.ROBOT, Signed.NOT, "0.1")


def test_on_a_bus_a_key_changes_nothing() -> None:
    world = junior_world(WorldSettings(wire=CAN))
    place = Place("address", "can://test", "can://test")
    finding = probe(place, 5.0, lambda url: (MemoryLink(world, url, wire=CAN), world), key=KEY)
    assert (finding.status, finding.robots[0].signed) == (Status.ROBOT, Signed.NOT)


def test_what_is_said_in_the_name_of_a_robot_that_signs_is_not_heard() -> None:
    armed = Heartbeat(type=10, autopilot=0, base_mode=128, custom_mode=State.READY, system_status=4, mavlink_version=3)
    calm = replace(armed, base_mode=0, custom_mode=State.DISARMED)
    listener = Listener(MAVLINK, 0.0, Signing(KEY, lambda: NOW))
    robot = signed_codec(system=1, component=ROBOT_COMPONENT)
    said = robot.encode(calm)
    listener.take(said, 0.1)
    listener.take(MavlinkCodec(system=1, component=ROBOT_COMPONENT).encode(armed), 0.2)
    listener.take(signed_codec(OTHER_KEY, system=1, component=ROBOT_COMPONENT).encode(armed), 0.3)
    assert [(found.armed, found.signed) for found in listener.robots] == [(False, Signed.OUR_KEY)]
    assert listener.behind == 0
    listener.take(said, 0.4)
    assert listener.behind == 1
    listener.take(robot.encode(armed), 0.5)
    assert listener.robots[0].armed


def test_a_robot_whose_time_stays_behind_is_told() -> None:
    old = signed_codec(system=1, component=ROBOT_COMPONENT, now=NOW)
    beat = Heartbeat(type=10, autopilot=0, base_mode=0, custom_mode=0, system_status=4, mavlink_version=3)
    line = Rated(lambda now, _: old.encode(beat) if round(now / 0.005) % 40 == 0 else b"")
    line.lockstep = False  # signed by the calendar, then
    finding = probe(SERIAL, 1.5, lambda _: (line, line.clock), key=KEY)
    assert (finding.status, finding.robots) == (Status.VEHICLE, ())
    assert "signs with this key, at times that have been" in finding.reason


# --- Nobody is disturbed ---------------------------------------------------------------------------------------------


def driver(stop: float = 1e9) -> Callable[[float], Sequence[Message]]:
    """A host that opens a session, arms and drives, until it falls silent at `stop`."""

    def say(now: float) -> Sequence[Message]:
        tick = round(now / 0.005)
        match tick:
            case 2:
                return [RobotSession(77, 0, 7, 1, ROBOT_COMPONENT, major=2, minor=0)]
            case 4:
                return [CommandLong(1, ROBOT_COMPONENT, Command.ARM_DISARM, param1=1.0, param3=7.0)]
            case _ if now < stop and tick > 4 and tick % 8 == 0:
                return [JuniorWheels(77, tick, (0.2, -0.2), 0.5, 1, ROBOT_COMPONENT)]
            case _:
                return []

    return say


def place(driven: Driven) -> tuple[float, float, float]:
    """Where the robot is."""
    body = driven.world.match.robot.body
    return body.x, body.y, body.angle


@pytest.mark.parametrize(("wire", "overheard"), [(MAVLINK, False), (CAN, True)])
def test_a_robot_that_somebody_drives_goes_on_driving(wire: str, overheard: bool) -> None:  # noqa: FBT001
    driven = Driven(junior_world(WorldSettings(wire=wire)), driver(), overheard=overheard)
    while driven.now() < 0.5:
        driven.step(b"")
    finding = look(driven, wire=wire)
    (robot,) = finding.robots
    assert (robot.armed, robot.state, robot.firmware) == (True, State.DRIVING, None)
    assert "armed: somebody may be driving it" in str(robot)
    alone = Driven(junior_world(WorldSettings(wire=wire)), driver(), overheard=overheard)
    while alone.now() < driven.now():
        alone.step(b"")
    assert place(driven) == place(alone)  # to the last digit: the look has changed nothing
    if wire == CAN:
        assert not driven.inbound  # not a frame on a bus where another host speaks
    else:
        assert {type(message) for _, message in messages(driven.inbound)} == {Heartbeat}
        assert {system for system, _ in messages(driven.inbound)} == {254}


def test_a_look_does_not_keep_a_robot_awake_whose_host_has_died() -> None:
    driven = Driven(junior_world(), driver(stop=1.0))
    while driven.now() < 0.9:
        driven.step(b"")
    finding = look(driven)
    assert finding.robots[0].state is State.READY  # the watchdog has stopped its wheels
    assert finding.robots[0].armed


def test_a_session_survives_a_look() -> None:
    driven = Driven(junior_world(), lambda now: driver()(now) if now < 0.018 else [])
    while driven.now() < 0.1:
        driven.step(b"")
    look(driven)
    answer = driven.world.step(
        MavlinkCodec(system=255, component=190).encode(CommandLong(1, 1, Command.REQUEST_MESSAGE, param1=47109))
    )
    status = [message for _, message in messages(answer) if type(message).__name__ == "RobotStatus"]
    assert status
    assert status[-1].session == 77  # type: ignore[attr-defined]


# --- What is no robot ------------------------------------------------------------------------------------------------


def vehicle(version: str, names: Sequence[str] = ("heartbeat", "attitude")) -> Callable[[float, int], bytes]:
    """Another vehicle, as pymavlink's `common` dialect makes it speak."""
    dialect = pytest.importorskip(f"pymavlink.dialects.{version}.common")
    mav = dialect.MAVLink(None, srcSystem=4, srcComponent=1)

    def say(now: float, rate: int) -> bytes:
        if rate != 115200:
            return b""
        out = b""
        tick = round(now / 0.005)
        if "heartbeat" in names and tick % 200 == 1:
            out += mav.heartbeat_encode(2, 3, 81, 5, 4, 3).pack(mav)
        if "attitude" in names and tick % 10 == 0:
            out += mav.attitude_encode(tick, 0.1, 0.2, 0.3, 0, 0, 0).pack(mav)
        return bytes(out)

    return say


def test_another_vehicle_is_no_junior() -> None:
    finding = look_at(Rated(vehicle("v20")))
    assert finding.status is Status.VEHICLE
    assert str(finding.robots[0]) == "system 4 speaks MAVLink but is no Junior"


def test_a_vehicle_of_a_foreign_dialect_is_recognized_by_its_framing() -> None:
    finding = look_at(Rated(vehicle("v20", ("attitude",))))
    assert (finding.status, finding.robots) == (Status.VEHICLE, ())
    assert "no robot says it is there" in finding.reason


def test_mavlink_1_is_told_from_noise() -> None:
    line = Rated(vehicle("v10"))
    finding = look_at(line)
    assert finding.status is Status.VEHICLE
    assert finding.reason == "MAVLink 1 is spoken there"
    assert line.rates == [115200]


def scrambled(world: Device, true_rate: int) -> Callable[[float, int], bytes]:
    """A robot whose bytes are garbage at any rate but one."""
    noise = random.Random(5)

    def say(_: float, rate: int) -> bytes:
        data = world.step(b"")
        return data if rate == true_rate else noise.randbytes(len(data))

    return say


@pytest.mark.parametrize("rate", [57600, 1000000])
def test_a_robot_at_another_rate_is_found_there(rate: int) -> None:
    line = Rated(scrambled(ScriptedRobot(), rate))
    finding = look_at(line, timeout=8.0)
    assert finding.status is Status.ROBOT
    assert finding.url == f"serial:///dev/test:{rate}"
    assert line.rates[0] == 115200
    assert line.rates[-1] == rate


def test_noise_at_every_rate_is_called_noise() -> None:
    line = Rated(scrambled(ScriptedRobot(), 0))
    finding = look_at(line)
    assert finding.status is Status.NOISE
    assert finding.reason == "bytes come, but no MAVLink at any usual rate"
    assert len(set(line.rates)) == 10


def test_noise_while_a_board_starts_does_not_hide_its_robot() -> None:
    robot = ScriptedRobot()
    noise = random.Random(5)
    line = Rated(lambda now, rate: noise.randbytes(20) if now < 0.6 else robot.step(b"") if rate == 115200 else b"")
    finding = look_at(line, timeout=8.0)
    assert finding.status is Status.ROBOT
    assert finding.url == "serial:///dev/test:115200"


def test_text_is_shown() -> None:
    finding = look_at(Rated(lambda now, _: b"eye 12, arm 0\r\n" if round(now / 0.005) % 20 == 0 else b""))
    assert finding.status is Status.NOISE
    assert finding.reason == "it prints text: 'eye 12, arm 0'"


@pytest.mark.parametrize(
    "line",
    [
        Rated(lambda _now, _rate: b"", lambda sent: b"\a\aV1013\r" if b"V\r" in sent else b""),
        Rated(lambda now, _: b"t1812ABCD\rt28100\r" if now > 0.2 else b""),
    ],
    ids=["asked", "open"],
)
def test_a_serial_can_adapter_is_recognized(line: Rated) -> None:
    finding = look_at(line)
    assert finding.status is Status.ADAPTER
    assert "can://slcan//dev/test?bitrate=500000" in finding.remedy


def test_silence() -> None:
    line = Rated(lambda _now, _rate: b"")
    assert look_at(line, timeout=3.0).status is Status.SILENT
    assert line.rates == [115200]


def test_a_line_that_only_echoes_is_told() -> None:
    finding = look_at(Rated(lambda _now, _rate: b"", bytes), timeout=3.0)
    assert (finding.status, finding.reason) == (Status.NOISE, "it sends back what is sent to it")


def test_frames_of_others_on_a_bus_are_no_robot() -> None:
    frame = CanFrame(0x123, bytes(8)).pack()

    class Bus:
        ticks = 0

        def now(self) -> float:
            return self.ticks * 0.005

        def step(self, inbound: bytes) -> bytes:
            assert not inbound  # nothing is sent to whom we do not know
            self.ticks += 1
            return frame

    finding = look(Bus(), wire=CAN, timeout=2.0)
    assert finding.status is Status.SILENT


# --- Ports that do not open, and that end ----------------------------------------------------------------------------


def test_a_place_with_an_obstacle_is_not_opened() -> None:
    place = Place("can", "can0", "can://socketcan/can0", obstacle="the interface is down", remedy="bring it up")

    def opener(url: str) -> tuple[Link, Clock]:
        raise AssertionError(url)

    finding = probe(place, 1.0, opener)
    assert (finding.status, finding.reason, finding.remedy) == (Status.UNAVAILABLE, "the interface is down", "bring it up")


def test_why_a_port_does_not_open_is_told() -> None:
    def opener(url: str) -> tuple[Link, Clock]:
        raise LinkOpenError(url, "you are not allowed to open it", "Join the group")

    finding = probe(SERIAL, 1.0, opener)
    assert (finding.status, finding.reason, finding.remedy) == (
        Status.UNAVAILABLE,
        "you are not allowed to open it",
        "Join the group",
    )


def test_a_port_that_is_pulled_while_we_look_is_told() -> None:
    def say(now: float, _: int) -> bytes:
        if now > 0.3:
            raise LinkClosedError("serial:///dev/test:115200", "the port is gone (unplugged?)")
        return b""

    finding = look_at(Rated(say))
    assert finding.status is Status.UNAVAILABLE
    assert finding.reason == "the port is gone (unplugged?)"


@pytest.mark.slow
def test_a_port_whose_opening_hangs_does_not_hold_up_the_others() -> None:
    release = threading.Event()

    def opener(url: str) -> tuple[Link, Clock]:
        if "hangs" in url:
            release.wait()
            raise LinkOpenError(url, "too late")
        robot = ScriptedRobot()
        return MemoryLink(robot, url), robot

    try:
        found = survey(named(["tcp://hangs:1", "tcp://works:1"]), 0.2, opener, grace=0.5)
    finally:
        release.set()
    assert [finding.reason for finding in found] == ["opening it takes too long", ""]
    assert found[0].status is Status.UNAVAILABLE
    assert found[1].robots


def test_nothing_to_look_at_is_no_mistake() -> None:
    assert survey([], 1.0) == []
    with pytest.raises(AddressError):
        named(["nonsense"])


# --- Bytes of any kind -----------------------------------------------------------------------------------------------


@given(st.lists(st.binary(max_size=60), max_size=8))
def test_nothing_that_comes_raises(chunks: list[bytes]) -> None:
    listener = Listener(MAVLINK, 0.0)
    for number, chunk in enumerate(chunks):
        listener.take(chunk, number * 0.01)
        listener.due(number * 0.01)
    assert listener.witness.received == sum(map(len, chunks))
    assert isinstance(listener.witness.text, str)
    assert listener.witness.mavlink in {0, 1, 2}


def test_framing_needs_frames_that_follow_each_other() -> None:
    codec = MavlinkCodec(system=1, component=1)
    frames = [codec.encode(HOST_HEARTBEAT), codec.encode(Ping(1, 2)), codec.encode(HOST_HEARTBEAT)]
    assert framing(b"".join(frames)) == 2
    assert framing(b"\x01\x02" + b"".join(frames[:2]) + frames[2][:1]) == 2
    assert framing(frames[0]) == 0
    assert framing(os.urandom(0)) == 0
    assert framing(bytes(range(200))) == 0


def test_text_is_printable_and_whole() -> None:
    assert printable(b"one\r\ntwo\r\nthr") == "two"
    assert printable(b"\x1b[31mred\x1b[0m and more of it\n") == "[31mred[0m and more of it"
    assert printable(b"short") == ""
    assert printable(bytes(range(128, 200))) == ""
