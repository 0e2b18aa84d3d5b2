"""The micro-robot's and the table's messages: what they weigh, what they take, and whose every message is."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from firmware_protocol.errors import EncodeError
from firmware_protocol.events import Received
from firmware_protocol.generate.vectors import example
from firmware_protocol.messages import (
    JUNIOR_MESSAGES,
    MESSAGES,
    REFEREE_MESSAGES,
    ROBOT_MESSAGES,
    STANDARD_MESSAGES,
    SWARM_MESSAGES,
    TABLE_COMPONENT,
    TABLE_MESSAGES,
    TABLE_NODE,
    RobotSession,
    SwarmFix,
    SwarmMove,
    SwarmObservation,
    SwarmRanges,
    SwarmSense,
    TablePlace,
    TableReset,
    TableState,
)
from firmware_protocol.vocabulary import Move, MoveOption, ObservationFlag, RobotClass, SwarmOutcome
from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.fields import Message, Party, Wire, wire_fields
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.mavlink_layout import payload_length
from firmware_protocol.wire.payload import PAYLOADS

if TYPE_CHECKING:
    from firmware_protocol.wire.can.frame import CanFrame

SIZES = {
    SwarmMove: (47200, 18),
    SwarmSense: (47201, 14),
    SwarmObservation: (47202, 47),
    SwarmRanges: (47203, 87),
    SwarmFix: (47204, 12),
    TableReset: (47310, 18),
    TablePlace: (47311, 13),
    TableState: (47312, 22),
}
PARTIES = {
    Party.ROBOT: (*STANDARD_MESSAGES, *ROBOT_MESSAGES),
    Party.JUNIOR: JUNIOR_MESSAGES,
    Party.SWARM: SWARM_MESSAGES,
    Party.REFEREE: REFEREE_MESSAGES,
    Party.TABLE: TABLE_MESSAGES,
}
PLAIN = SwarmMove(4711, 7, 1.25, 0.08, None, 0.0, 9, 1, 0, 0, 0, MoveOption.STOP_ON_CONTACT)


@pytest.mark.parametrize("kind", SIZES, ids=lambda kind: kind.NAME)
def test_ids_and_sizes_are_those_that_were_agreed(kind: type[Message]) -> None:
    assert (kind.ID, payload_length(kind)) == SIZES[kind]


def test_every_message_says_whose_it_is() -> None:
    assert {message: message.PARTY for message in MESSAGES.values()} == {
        message: party for party, messages in PARTIES.items() for message in messages
    }
    assert [party for party in Party if not party.robot] == [Party.REFEREE, Party.TABLE]


def test_a_transfer_of_ranges_is_fourteen_frames() -> None:
    robot = CanCodec(system=9, component=1)
    assert len(robot.encode_frames(example(SwarmRanges, "typical"))) == 14
    assert len(MavlinkCodec(system=9, component=1).encode(example(SwarmObservation, "max"))) == 59


@pytest.mark.parametrize(
    "change",
    [
        {"distance": 60.001},
        {"sector": 17},
        {"sectors": 17},
        {"effort": 101},
        {"options": 64},
        {"heading": 3.2768},
        {"heading": -3.2768},
        {"face": -3.2768},
        {"speed": -0.001},
    ],
    ids=str,
)
def test_a_move_out_of_range_is_not_sent(change: dict[str, float]) -> None:
    with pytest.raises(EncodeError, match="SWARM_MOVE"):
        PAYLOADS[SwarmMove.ID].pack(replace(PLAIN, **change))  # type: ignore[arg-type]


def test_what_there_is_none_of_is_none_and_nothing_else_is() -> None:
    observed = example(SwarmObservation, "none")
    assert isinstance(observed, SwarmObservation)
    assert (observed.box_bearing, observed.box_distance, observed.goal_bearing, observed.fix_age) == (None,) * 4
    assert PAYLOADS[SwarmObservation.ID].unpack(PAYLOADS[SwarmObservation.ID].pack(observed)) == observed
    for wrong in (replace(observed, box_distance=65.535), replace(observed, fix_age=65.535)):
        with pytest.raises(EncodeError):
            PAYLOADS[SwarmObservation.ID].pack(wrong)


def test_the_codes_are_those_that_were_agreed() -> None:
    assert [each.name for each in SwarmOutcome] == [
        "NONE", "ARRIVED", "BLOCKED", "STOPPED", "REFUSED", "TIMED_OUT", "REPLACED",
    ]  # fmt: skip
    assert {each.name: each.value for each in MoveOption} == {
        "BODY": 1, "STOP_ON_CONTACT": 2, "PUSH": 4, "BACKWARD": 8, "SENSE": 16, "RANGES": 32,
    }  # fmt: skip
    assert {each.name: each.value for each in ObservationFlag} == {
        "CONTACT_AHEAD": 1, "CONTACT": 2, "TOUCHES_BOX": 4, "DEAD_RECKONING": 8, "RING_NOT_READ": 16,
    }  # fmt: skip
    assert (RobotClass.RANGER, RobotClass.WILD) == (0, 1)


def move_over_can(host: CanCodec, robot: CanCodec, move: SwarmMove) -> tuple[list[CanFrame], SwarmMove]:
    frames = host.encode_frames(move)
    (event,) = robot.receive_frames(frames, 0.0)
    assert isinstance(event, Received)
    assert isinstance(event.message, SwarmMove)
    return frames, event.message


def pair() -> tuple[CanCodec, CanCodec]:
    """A host, and the robot that it has opened a session with."""
    host, robot = CanCodec(system=255, component=190), CanCodec(system=9, component=1)
    robot.receive_frames(host.encode_frames(RobotSession(4711, 0, 5, 9, 1, 2, 1)), 0.0)
    return host, robot


def test_a_plain_move_is_one_frame_of_function_4() -> None:
    host, robot = pair()
    frames, heard = move_over_can(host, robot, PLAIN)
    assert [frame.identifier for frame in frames] == [4 << 7 | 9]
    assert heard == PLAIN


@pytest.mark.parametrize(
    "change",
    [{"face": 0.0}, {"speed": 0.1}, {"effort": 50}, {"sectors": 8}, {"heading": None, "sector": 3, "sectors": 8}],
    ids=str,
)
def test_any_other_move_is_a_transfer(change: dict[str, float | None]) -> None:
    host, robot = pair()
    move = replace(PLAIN, **change)  # type: ignore[arg-type]
    frames, heard = move_over_can(host, robot, move)
    assert len(frames) == 3
    assert heard == move


def test_a_sector_is_one_of_those_that_were_told_last_in_the_session() -> None:
    host, robot = pair()
    sense = SwarmSense(4711, 1, 0.2, 0.05, 65.535, 9, 1, 8, 0)
    robot.receive_frames(host.encode_frames(sense), 0.0)
    by_sector = replace(PLAIN, heading=None, sector=3, sectors=8)
    frames, heard = move_over_can(host, robot, by_sector)
    assert (len(frames), heard) == (1, by_sector)
    frames, heard = move_over_can(host, robot, replace(by_sector, sectors=16))
    assert (len(frames), heard.sectors) == (3, 16)
    robot.receive_frames(host.encode_frames(RobotSession(4712, 0, 5, 9, 1, 2, 1)), 0.0)
    frames, heard = move_over_can(host, robot, replace(by_sector, session=4712))
    assert (len(frames), heard) == (3, replace(by_sector, session=4712))


def test_the_table_is_a_node_of_its_own() -> None:
    host, table = CanCodec(system=255, component=190), CanCodec(system=TABLE_NODE, component=TABLE_COMPONENT)
    place = TablePlace(1, 2, (0.5, -0.5), 1.5, TABLE_NODE, TABLE_COMPONENT, 9)
    frames = host.encode_frames(place)
    assert {frame.identifier for frame in frames} == {10 << 7 | 127}
    assert [event.message for event in table.receive_frames(frames, 0.0) if isinstance(event, Received)] == [place]
    state = TableState(1.0, (0.1, 0.2), 0.5, (1.0, 1.0), 5, 1)
    frames = table.encode_frames(state)
    assert {frame.identifier for frame in frames} == {11 << 7 | 127}
    (event,) = host.receive_frames(frames, 0.0)
    assert isinstance(event, Received)
    assert (event.message, event.system, event.component) == (state, 127, 25)


def test_elements_have_as_many_names_as_there_are() -> None:
    with pytest.raises(TypeError, match="left, right"):
        Wire("u8", count=3, elements=("left", "right"))
    for message in MESSAGES.values():
        for _, wire in wire_fields(message):
            assert len(wire.elements) in {0, wire.count}


@pytest.mark.parametrize(
    "wrong",
    [
        {"distance": -0.1, "heading": 0.0},
        {"distance": 60.1, "heading": 0.0},
        {},
        {"heading": 0.0, "sector": 1, "sectors": 8},
        {"sector": 9, "sectors": 8},
        {"sector": 1},
        {"sector": 17, "sectors": 17},
        {"heading": 0.0, "effort": 101},
        {"heading": math.inf},
        {"heading": 0.0, "face": math.nan},
    ],
    ids=str,
)
def test_a_move_that_there_can_not_be_is_not_made(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"move|sector"):
        Move(**wrong)  # type: ignore[arg-type]


def test_a_heading_is_the_same_after_any_number_of_turns() -> None:
    move = Move(heading=0.3 + 5 * math.tau, face=3.5)
    assert move.heading == pytest.approx(0.3)
    assert move.face == pytest.approx(3.5 - math.tau)
