"""What a camera's program says of where robots are: good lines become fixes, and nothing else does any harm."""

from __future__ import annotations

import pytest
from held_swarm import connect
from hypothesis import given
from hypothesis import strategies as st
from scripted_swarm import swarm_of

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.link import Link
from firmware_protocol.messages import SwarmFix
from hil.swarm.poses import INTERVAL, PoseFeed, PoseFixes, PoseLine


class Said(Link):
    """A link that brings what is put into it, and then nothing."""

    def __init__(self, *chunks: bytes) -> None:
        self.chunks = list(chunks)
        self.gone = False

    def read(self, timeout: float) -> bytes:
        assert timeout == 0.0, "a step of the bridge waits for nobody's camera"
        if self.gone:
            raise LinkClosedError("udpin://", "gone")
        return self.chunks.pop(0) if self.chunks else b""

    def write(self, data: bytes) -> None:
        raise AssertionError(data)

    def close(self) -> None:
        self.gone = True


def test_a_line_says_which_robot_is_where() -> None:
    assert PoseLine.parse("2 17 -0.5 0.25 3.1 40") == PoseLine(2, 17, (-0.5, 0.25, 3.1), 0.04)


@pytest.mark.parametrize(
    "line",
    [
        "", "1 2 3", "1 2 0 0 0 0 0", "0 2 0 0 0 0", "1 0 0 0 0 0", "1 300 0 0 0 0", "1 2 nan 0 0 0", "1 2 0 inf 0 0",
        "1 2 50 0 0 0", "1 2 0 0 0 -1", "1 2 0 0 0 1e9", "a 2 0 0 0 0", "1 2 0 0 0 " + "0" * 300,
    ],
)  # fmt: skip
def test_a_line_that_says_what_can_not_be_says_nothing(line: str) -> None:
    assert PoseLine.parse(line) is None


def test_of_each_robot_the_newest_line_counts_and_a_line_may_come_in_pieces() -> None:
    feed = PoseFeed(Said(b"1 1 0 0 0 5\n1 1 0.1 0 0 5\n1 2 0", b".5 0 0 5\n1 3 0 0"))
    assert [one.what for one in feed.inputs()] == ["pose 1 1 0.1 0 0 5", "pose 1 2 0.5 0 0 5"]
    assert feed.inputs() == []


def test_a_link_that_is_gone_tells_nothing() -> None:
    link = Said(b"1 1 0 0 0 5\n")
    link.close()
    assert PoseFeed(link).inputs() == []


@given(st.lists(st.binary(max_size=80), max_size=8))
def test_no_bytes_do_any_harm(chunks: list[bytes]) -> None:
    feed = PoseFeed(Said(*[chunk for chunk in chunks if chunk]))
    for one in feed.inputs():
        assert PoseLine.parse(one.what.removeprefix("pose ")) is not None


def test_robots_are_told_where_they_are_at_twenty_hertz() -> None:
    world = swarm_of(3)
    with connect(world) as swarm:
        swarm.arm()
        fixes = PoseFixes(swarm)
        fixes.take(["1 2 0.5 -0.25 1.0 10", "1 9 0 0 0 0", "2 1 0 0 0 0"])
        fixes.take(["1 1 0.1 0 0 0"])
        swarm.wait(INTERVAL + 0.01)
        fixes.take([])
        swarm.wait(0.1)
    told = [[one for one in robot.heard if isinstance(one, SwarmFix)] for robot in world.robots]
    assert [len(each) for each in told] == [1, 1, 0]
    assert told[1][0].position == (0.5, -0.25)
    assert told[1][0].age == pytest.approx(0.01)
    assert told[0][0].age == pytest.approx(0.06, abs=0.011), "what had to wait has grown older"
