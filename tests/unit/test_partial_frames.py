"""What has come in part: given up after silence, and by a codec that begins anew."""

from __future__ import annotations

import pytest
from scripted_robot import ScriptedRobot

from firmware_protocol.events import Received, Rejected, RejectReason
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import Ping
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN, MAVLINK
from firmware_protocol.wire.mavlink import SILENCE, MavlinkCodec
from hil.bridge.bridge import Bridge

PING = Ping(7, 1, 255, 190)


class Stuttering(ScriptedRobot):
    """A robot that says what it is given to say, and nothing of its own."""

    mouth = b""

    def step(self, inbound: bytes) -> bytes:
        super().step(inbound)
        said, self.mouth = self.mouth, b""
        return said


def test_a_bridge_gives_a_part_of_a_frame_up_when_nothing_comes_any_more() -> None:
    robot = Stuttering(stream=False)
    frame = MavlinkCodec(system=1, component=1).encode(PING)
    with Bridge(MemoryLink(robot), robot, session=lambda: 77) as bridge:
        bridge.step(0.01)
        robot.mouth = frame[:12]
        bridge.step(0.005)
        came = robot.now()
        rejected: list[Rejected] = []
        while not rejected and robot.now() < came + 1.0:
            rejected += [event for event in bridge.step(0.005) if isinstance(event, Rejected)]
        assert robot.now() - came == pytest.approx(SILENCE + 0.005, abs=0.0051)
        assert [(event.reason, event.raw) for event in rejected] == [(RejectReason.INCOMPLETE, frame[:12])]
        robot.mouth = frame
        assert [type(event) for event in bridge.step(0.005)] == [Received]


@pytest.mark.parametrize("wire", [MAVLINK, CAN])
def test_a_codec_that_begins_anew_knows_nothing_of_what_had_come(wire: str) -> None:
    robot, host = open_codec(wire, system=1, component=1), open_codec(wire, system=255, component=190)
    first = robot.encode(PING)
    cut = 16 if wire == CAN else 12
    assert host.receive(first[:cut], 1.0) == []
    host.reset()
    assert not [event for event in host.receive(first[cut:], 1.001) if isinstance(event, Received)]
    robot.reset()
    assert robot.encode(PING) == first, "frames and transfers are numbered from 0 again"


@pytest.mark.parametrize("wire", [MAVLINK, CAN])
def test_a_link_that_has_ended_leaves_nothing_half_heard(wire: str) -> None:
    robot, host = open_codec(wire, system=1, component=1), open_codec(wire, system=255, component=190)
    cut = 16 if wire == CAN else 12
    part = robot.encode(PING)[:cut]
    assert host.receive(part, 1.0) == []
    assert host.flush(1.001) == []
    (event,) = host.flush(1.001, ended=True)
    assert isinstance(event, Rejected)
    assert (event.reason, event.raw) == (RejectReason.INCOMPLETE, part)
    assert host.flush(9.0, ended=True) == []
