"""The frames of every message at the limits of every field, pinned in files that the C tests read too."""

from __future__ import annotations

from pathlib import Path

import pytest

from firmware_protocol.events import Received
from firmware_protocol.generate.outputs import GOLDEN, ROOT
from firmware_protocol.generate.vectors import Vector, vectors
from firmware_protocol.messages import MESSAGES
from firmware_protocol.wire.mavlink import MavlinkCodec, split_frames

VECTORS = vectors()


@pytest.mark.parametrize("name", GOLDEN)
def test_the_wire_has_not_changed(name: str) -> None:
    assert (ROOT / name).read_bytes() == GOLDEN[name](), "a changed frame is a changed protocol: see generate --golden"


def test_every_message_has_its_three_vectors() -> None:
    names = [vector.name for vector in VECTORS]
    for message in MESSAGES.values():
        assert {f"{message.NAME} {kind}" for kind in ("min", "max", "typical")} <= set(names)


@pytest.mark.parametrize("vector", VECTORS, ids=lambda vector: vector.name)
def test_decodes_to_the_message_whole_and_byte_by_byte_and_with_more_behind(vector: Vector) -> None:
    whole = MavlinkCodec(system=9, component=9).receive(vector.frame, 1.0)
    assert [event.message for event in whole if isinstance(event, Received)] == [vector.message]
    codec = MavlinkCodec(system=9, component=9)
    single = [event for i in range(len(vector.frame)) for event in codec.receive(vector.frame[i : i + 1], 1.0)]
    assert single == whole
    behind = MavlinkCodec(system=9, component=9).receive(vector.frame + b"\xfd\x00trailing", 1.0)
    assert behind[:1] == whole


def test_the_binary_file_is_the_frames_of_the_text_file() -> None:
    lines = (ROOT / "tests/golden/mavlink.txt").read_text(encoding="utf-8").split("\n")
    frames = [bytes.fromhex(line) for line in lines if line.startswith("fd")]
    assert split_frames(Path(ROOT / "tests/golden/mavlink.bin").read_bytes()) == frames
