"""A codec of arrays says of any CAN frames what the codec of objects says, in the same order."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from batch_words import all_in_words, told
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol.errors import EncodeError
from firmware_protocol.generate.vectors import can_vectors, example
from firmware_protocol.messages import (
    MESSAGES,
    AutopilotVersion,
    Heartbeat,
    JuniorSensors,
    RobotAck,
    RobotResultAck,
    RobotSession,
    RobotStatus,
    SetupSigning,
    Statustext,
    SwarmMove,
    SwarmObservation,
    SwarmRanges,
    SwarmSense,
    TablePlace,
    TableState,
)
from firmware_protocol.wire.can import batch as can_batch
from firmware_protocol.wire.can.batch import CanBatchCodec
from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.can.frame import RECORD_LENGTH, CanFrame, split_records
from firmware_protocol.wire.fields import Direction
from firmware_protocol.wire.rows import messages_of, rows_of, rows_of_messages

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from firmware_protocol.wire.fields import Message

VECTORS = can_vectors()
ALL = tuple(message for message in MESSAGES.values() if message is not SetupSigning)
SOME = (SwarmObservation, SwarmRanges, RobotAck, RobotStatus)
SAID = (SwarmObservation, SwarmRanges, RobotAck, RobotStatus, Statustext, Heartbeat, AutopilotVersion, JuniorSensors)


@pytest.fixture(autouse=True, scope="module")
def _never_few() -> Iterator[None]:
    """Even one frame is done as arrays are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(can_batch, "FEW", 1)
        yield


def same(kinds: Iterable[type[Message]], chunks: Iterable[tuple[bytes, float]], **who: int) -> int:
    """Compare; returns how many messages came as arrays."""
    ends = who or {"system": 255, "component": 190}
    objects, arrays = CanCodec(**ends), CanBatchCodec(**ends, kinds=kinds)
    count = 0
    for data, now in chunks:
        arrived = arrays.receive_batches(data, now)
        assert told(arrived) == all_in_words(objects.receive(data, now))
        count += sum(len(batch.rows) for batch in arrived.batches.values())
    assert (arrays.good, arrays.signed, arrays.rejected) == (objects.good, objects.signed, objects.rejected)
    assert all_in_words(arrays.flush(1e9)) == all_in_words(objects.flush(1e9))
    state = ("_next", "_counts", "_times", "_sessions", "_sectors", "_partials", "_digests")
    assert [getattr(arrays, name) for name in state] == [getattr(objects, name) for name in state]
    return count


class Robots:
    """Robots on one bus, and the table beside them."""

    def __init__(self) -> None:
        self.codecs = {
            (node, component): CanCodec(system=node, component=component)
            for node, component in ((1, 1), (2, 1), (3, 1), (3, 25), (127, 25))
        }

    def say(self, who: tuple[int, int], kind: type[Message], how: str) -> bytes:
        return self.codecs[who].encode(example(kind, how))


@pytest.mark.parametrize("kinds", [ALL, SOME, ()], ids=["all", "some", "none"])
def test_golden_vectors_whole_and_in_halves(kinds: tuple[type[Message], ...]) -> None:
    data = b"".join(frame.pack() for vector in VECTORS for frame in vector.frames)
    wanted = sum(type(vector.message) in kinds for vector in VECTORS)
    assert same(kinds, [(data, 0.0)]) == wanted
    assert same(kinds, [(data, 0.0)], system=9, component=1) == wanted
    for cut in range(0, len(data), 41 * RECORD_LENGTH + 3):
        same(kinds, [(data[:cut], 0.0), (data[cut:], 0.001)])


def test_what_is_plain_and_good_is_no_object(monkeypatch: pytest.MonkeyPatch) -> None:
    robots = Robots()
    data = b"".join(robots.say((node, 1), kind, "typical") for node in (1, 2, 3) for kind in SOME for _ in range(9))
    arrays = CanBatchCodec(system=255, component=190, kinds=SOME)
    monkeypatch.setattr(CanBatchCodec, "_take_record", None)
    arrived = arrays.receive_batches(data, 0.0)
    assert {kind: len(batch.rows) for kind, batch in arrived.batches.items()} == dict.fromkeys(SOME, 27)
    assert not arrived.events


def test_a_last_frame_under_another_nodes_identifier_completes_nothing() -> None:
    robots = Robots()
    records = split_records(robots.say((1, 1), SwarmObservation, "typical"))
    records[-1] = bytes((records[-1][0] + 1,)) + records[-1][1:]
    assert same(SOME, [(b"".join(records), 0.0)]) == 0


def test_a_status_of_what_stands_beside_a_robot_sets_the_robots_clock_as_ever() -> None:
    robots = Robots()
    status = robots.say((3, 25), RobotStatus, "typical")
    assert same(SOME, [(status + robots.say((3, 1), JuniorSensors, "min") + status, 0.0)]) == 2


SPOKEN = st.tuples(
    st.sampled_from([(1, 1), (2, 1), (3, 1), (3, 25), (127, 25)]),
    st.sampled_from(SAID),
    st.sampled_from(["min", "max", "typical"]),
)


RUNS = (
    st.lists(SPOKEN, max_size=12),
    st.lists(
        st.tuples(
            st.integers(0, 10**6),
            st.sampled_from(["drop", "twice", "swap", "flip", "other"]),
            st.binary(min_size=8, max_size=8),
        ),
        max_size=3,
    ),
    st.lists(st.tuples(st.integers(0, 1000), st.sampled_from([0.0, 0.01, 0.06])), max_size=3),
    st.sampled_from([ALL, SOME]),
    st.randoms(use_true_random=False),
)


def compare(
    spoken: list[tuple[tuple[int, int], type[Message], str]],
    changes: list[tuple[int, str, bytes]],
    cuts: list[tuple[int, float]],
    kinds: tuple[type[Message], ...],
    random: Any,  # noqa: ANN401 - hypothesis's own generator
) -> None:
    robots = Robots()
    waiting = dict.fromkeys(robots.codecs, b"")
    for who, kind, how in spoken:
        waiting[who] += robots.say(who, kind, how)
    queues = [split_records(data) for data in waiting.values() if data]
    records: list[bytes] = []
    while queues:  # a bus mixes what several nodes say, and keeps the order of each
        queue = random.choice(queues)
        records += queue[: random.choice((1, 8))]
        del queue[: 1 if len(records) % 2 else 8]
        queues = [queue for queue in queues if queue]
    for place, change, data in changes:
        if not records:
            break
        at = place % len(records)
        match change:
            case "drop":
                del records[at]
            case "twice":
                records.insert(at, records[at])
            case "swap":
                records[at], records[-1] = records[-1], records[at]
            case "flip":
                changed = bytearray(records[at])
                changed[data[0] % RECORD_LENGTH] ^= data[1] | 1
                records[at] = bytes(changed)
            case _:
                records.insert(at, CanFrame(int.from_bytes(data[:2], "little") & 0x7FF, data[: data[2] % 9]).pack())
    chunks, at, now = [], 0, 0.0
    for size, wait in cuts:
        chunks.append((b"".join(records[at : at + size]), now))
        at, now = at + size, now + wait
    same(kinds, [*chunks, (b"".join(records[at:]), now)])


@given(*RUNS)
def test_hostile_frames(spoken: Any, changes: Any, cuts: Any, kinds: Any, random: Any) -> None:  # noqa: ANN401 - as `compare`
    compare(spoken, changes, cuts, kinds, random)


@pytest.mark.nightly
@settings(max_examples=5000)
@given(*RUNS)
def test_very_many_hostile_frames(
    spoken: Any,  # noqa: ANN401 - as `compare`
    changes: Any,  # noqa: ANN401
    cuts: Any,  # noqa: ANN401
    kinds: Any,  # noqa: ANN401
    random: Any,  # noqa: ANN401
) -> None:
    compare(spoken, changes, cuts, kinds, random)


@given(st.binary(max_size=400), st.sampled_from([(255, 190), (9, 1)]))
def test_any_bytes(data: bytes, who: tuple[int, int]) -> None:
    same(ALL, [(data, 0.0)], system=who[0], component=who[1])


@pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind.NAME)
def test_what_goes_out_is_what_the_objects_are(kind: type[Message]) -> None:
    upward = kind.DIRECTION is Direction.UP
    ends = {"system": 9 if upward else 255, "component": 1 if upward else 190}
    objects, arrays = CanCodec(**ends), CanBatchCodec(**ends, kinds=())
    found = [vector.message for vector in VECTORS if type(vector.message) is kind] * 3
    rows = rows_of_messages(kind, found)
    assert arrays.encode_batch(kind, rows) == b"".join(objects.encode(message) for message in found)
    assert arrays.encode_batch(kind, rows[:2]) == b"".join(objects.encode(message) for message in found[:2])


def test_moves_are_single_frames_where_they_fit() -> None:
    objects, arrays = CanCodec(system=255, component=190), CanBatchCodec(system=255, component=190, kinds=())
    nodes = np.arange(1, 31)
    columns: dict[str, Any] = {"session": 7, "sequence": nodes, "target_system": nodes, "target_component": 1}
    told_sectors = np.where(nodes % 3, 8, 16)
    said: list[tuple[type[Message], Any]] = [
        (RobotSession, rows_of(RobotSession, 30, columns | {"host": 5, "major": 2, "minor": 1, "sequence": 0})),
        (SwarmSense, rows_of(SwarmSense, 30, columns | {"radius": 0.2, "limit": 65.535, "sectors": told_sectors})),
        (SwarmMove, rows_of(SwarmMove, 30, columns | {"heading": 0.5, "distance": 0.08, "options": 16})),
        (SwarmMove, rows_of(SwarmMove, 30, columns | {"sector": 3, "sectors": 8, "distance": 0.08})),
        (SwarmMove, rows_of(SwarmMove, 30, columns | {"heading": 0.5, "face": np.where(nodes % 2, np.nan, 1.0)})),
        (RobotResultAck, rows_of(RobotResultAck, 30, columns)),
    ]
    for kind, rows in said:
        expected = b"".join(objects.encode(message) for message in messages_of(kind, rows))
        assert arrays.encode_batch(kind, rows) == expected
    assert len(arrays.encode_batch(*said[2])) == 30 * RECORD_LENGTH


def test_what_has_no_place_on_the_bus_is_an_error_of_ours() -> None:
    arrays = CanBatchCodec(system=255, component=190, kinds=())
    columns: dict[str, Any] = {"target_system": [1, 254], "target_component": 25, "system": 3}
    with pytest.raises(EncodeError, match="system 254 has no place"):
        arrays.encode_batch(TablePlace, rows_of(TablePlace, 2, columns))
    with pytest.raises(EncodeError, match="by the host"):
        arrays.encode_batch(TableState, rows_of(TableState, 1, {}))
    with pytest.raises(EncodeError, match="nothing is signed"):
        arrays.encode_batch(SetupSigning, rows_of(SetupSigning, 1, {}))
