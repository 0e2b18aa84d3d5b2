"""The CAN codec under anything a bus may do."""

from __future__ import annotations

from collections import Counter

from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol.events import Received
from firmware_protocol.generate.vectors import can_vectors
from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.can.frame import CanFrame, pack_frames, split_records

VECTORS = can_vectors()
IDENTIFIERS = st.sampled_from([0x685, 0x605, 0x600, 0x585, 0x505, 0x185, 0x285, 0x385, 0x105, 0x005, 0x785])
FRAMES = st.one_of(
    st.builds(CanFrame, IDENTIFIERS, st.binary(max_size=8)),
    st.builds(CanFrame, st.integers(0, 0x7FF), st.binary(max_size=8)),
    st.builds(CanFrame, st.integers(0, 2**29 - 1), st.binary(max_size=8), st.just(True)),  # noqa: FBT003
)
CODECS = st.sampled_from([(255, 190), (42, 1), (42, 25)])


@given(CODECS, st.lists(st.tuples(st.binary(max_size=80), st.floats(0, 0.1))))
def test_no_bytes_raise_and_each_is_accounted_for(node: tuple[int, int], chunks: list[tuple[bytes, float]]) -> None:
    codec = CanCodec(system=node[0], component=node[1])
    now, raw = 0.0, b""
    for data, pause in chunks:
        now += pause
        raw += b"".join(event.raw for event in codec.receive(data, now))
    raw += b"".join(event.raw for event in codec.flush(now + 1))
    assert Counter(raw) == Counter(b"".join(data for data, _ in chunks))


@given(CODECS, st.lists(FRAMES, max_size=60))
def test_each_frame_is_in_exactly_one_event(node: tuple[int, int], frames: list[CanFrame]) -> None:
    codec = CanCodec(system=node[0], component=node[1])
    events = [*codec.receive_frames(frames, 0.0), *codec.flush(1.0)]
    raw = [record for event in events for record in split_records(event.raw)]
    assert Counter(raw) == Counter(frame.pack() for frame in frames)


@settings(max_examples=50)
@given(st.data())
def test_damage_costs_the_messages_that_it_befalls_and_no_other(data: st.DataObject) -> None:
    chosen = data.draw(st.lists(st.sampled_from(range(len(VECTORS))), min_size=1, max_size=12))
    host, robot, referee = (CanCodec(system=s, component=c) for s, c in ((255, 190), (42, 1), (42, 25)))
    listener = CanCodec(system=255, component=190)
    stream: list[CanFrame] = []
    intact = []
    for index in chosen:
        vector = VECTORS[index]
        function = vector.frames[0].identifier >> 7
        codec = host if function % 2 == 0 else referee if function == 11 else robot
        frames = codec.encode_frames(vector.message)
        lost = data.draw(st.none() | st.integers(0, len(frames) - 1))
        if lost is None:
            intact.append(vector.message)
        stream += [frame for place, frame in enumerate(frames) if place != lost]
    events = [*listener.receive(pack_frames(stream), 0.0), *listener.flush(1.0)]
    kinds = [type(event.message) for event in events if isinstance(event, Received)]
    assert kinds == [type(message) for message in intact]
