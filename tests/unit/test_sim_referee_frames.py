"""The referee decodes only what may be for it, and misses nothing for that."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    REFEREE_COMPONENT,
    Heartbeat,
    OpponentCode,
    RefereeReset,
    RobotAck,
    RobotResultAck,
)
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.sumo.match import Match
from simdevice.sumo.referee import Referee

OTHERS = (
    Heartbeat(type=6, autopilot=8, base_mode=0, custom_mode=0, system_status=4),
    RobotResultAck(session=3, sequence=4, target_system=1, target_component=1),
)


def reset(sequence: int) -> RefereeReset:
    return RefereeReset(5, 1, sequence, 1, REFEREE_COMPONENT, OpponentCode.KEEP)


def answered(referee: Referee, pieces: list[bytes]) -> list[int]:
    """Sequences of the resets that the referee acknowledges when these pieces come, 5 ms apart."""
    codec = MavlinkCodec(system=255, component=190)
    answers = b"".join(referee.receive(piece, 0.005 * number) for number, piece in enumerate(pieces))
    events = codec.receive(answers, 0.0)
    return [event.message.sequence for event in events if isinstance(event, Received) and isinstance(event.message, RobotAck)]


@pytest.fixture(scope="module")
def stream() -> bytes:
    """Twelve resets with other messages and noise between."""
    codec = MavlinkCodec(system=255, component=190)
    parts = []
    for number in range(12):
        parts += [codec.encode(OTHERS[number % 2])] * (number % 3) + [codec.encode(reset(number + 1))]
        parts += [b"\x00\xfd"] if number == 6 else []
    return b"".join(parts)


@given(cuts=st.lists(st.integers(1, 60), max_size=60))
def test_however_the_bytes_are_cut_no_reset_is_missed(stream: bytes, cuts: list[int]) -> None:
    referee, pieces, at = Referee(Match()), [], 0
    for cut in cuts:
        pieces.append(stream[at : at + cut])
        at += cut
    assert answered(referee, [*pieces, stream[at:]]) == list(range(1, 13))
    assert referee.bout == 12


def test_what_is_for_others_changes_nothing(stream: bytes) -> None:
    referee = Referee(Match())
    codec = MavlinkCodec(system=255, component=190)
    others = b"".join(map(codec.encode, OTHERS))
    assert answered(referee, [others, others, stream, others]) == list(range(1, 13))
    assert answered(referee, [others[:-3], others[-3:] + codec.encode(reset(13))]) == [13]
