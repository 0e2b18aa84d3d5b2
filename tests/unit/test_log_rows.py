"""Entries that are written many at once are those that are written one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from logged import entries_of

from firmware_protocol.events import Received
from firmware_protocol.messages import MESSAGES, CommandAck, RobotStatus, SwarmMove, SwarmObservation
from firmware_protocol.wire.batch import Arrivals, batch_of
from firmware_protocol.wire.fields import wire_fields
from firmware_protocol.wire.rows import ROWS, good_rows, messages_of
from hil.mcaplog.schemas import message_schema
from hil.mcaplog.writing.encode import compile_encoder, sender_suffix
from hil.mcaplog.writing.row_encoding import encodable, encode_rows
from hil.mcaplog.writing.writer import LogWriter
from hil.recording.wire_log import MANY, WireLog
from hil.report.listening import ListeningRecorder

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.rows import Rows

ABOUT: dict[str, Any] = {"run": {}, "config": {}, "link": "sim://swarm", "lockstep": True}
KINDS = [kind for kind in MESSAGES.values() if encodable(kind)]


def some_rows(kind: type[Message], count: int) -> Rows:
    """Rows with whatever their fields can have, but no infinite numbers: half of them with small ones."""
    chance = np.random.default_rng(1)
    data = chance.integers(0, 256, (4000, ROWS[kind].itemsize), np.uint8)
    data[::2] &= 1
    rows = data.view(ROWS[kind]).reshape(-1)
    for name, wire in wire_fields(kind):
        if wire.type == "f32":
            rows[name] = chance.normal(0.0, 1.0, rows[name].shape)
    return rows[good_rows(kind, rows)][:count].copy()


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_rows_are_encoded_as_objects_are(kind: type[Message]) -> None:
    rows = some_rows(kind, 200)
    assert len(rows)
    encode = compile_encoder(message_schema(kind))
    system = np.arange(len(rows)) % 256
    frame = (system * 7 + 3) % 256
    entries = encode_rows(kind, rows, system, 1, frame)
    for number, message in enumerate(messages_of(kind, rows)):
        suffix = sender_suffix(int(system[number]), 1, int(frame[number]))
        assert entries[number].tobytes() == encode(message) + suffix, message


def came() -> Arrivals:
    """Observations and stati by turns, with an answer to a command among them."""
    heard: dict[type[Message], list[tuple[Received, int]]] = {SwarmObservation: [], RobotStatus: []}
    for turn, (kind, found) in enumerate(heard.items()):
        for number, message in enumerate(messages_of(kind, some_rows(kind, 5 * MANY))):
            place = 2 * number + turn
            event = Received(message, 1 + number % 33, 1, place % 256, 0.1 * (number > MANY), b"")
            found.append((event, place + (place > 30)))
    answer = Received(CommandAck(400, 0, target_system=255, target_component=190), 2, 1, 9, 0.1, b"")
    return Arrivals({kind: batch_of(kind, found) for kind, found in heard.items()}, [answer], [31])


def entries(path: Path) -> list[tuple[str, int, bytes]]:
    """What is in a log, in order, but for what is drawn."""
    return [entry for entry in entries_of(path) if entry[0] not in {"/tf", "/arena/scene"}]


def listening(path: Path) -> WireLog:
    """A recorder that gathers for a report, too."""
    return ListeningRecorder(path, writer=LogWriter(path, run={}, long_chunks=True), **ABOUT)


@pytest.mark.parametrize("make", [lambda path: WireLog(path, **ABOUT), listening], ids=["log", "listening"])
def test_a_log_of_many_at_once_is_that_of_one_by_one(tmp_path: Path, make: Callable[[Path], WireLog]) -> None:
    moves = some_rows(SwarmMove, 3 * MANY)
    with make(tmp_path / "many.mcap") as many, WireLog(tmp_path / "single.mcap", **ABOUT) as single:
        for round_ in range(3):
            many.arrived(came())
            many.sent_rows(0.2 + round_, SwarmMove, moves)
            for event in came().objects():
                single.received(event)
            for move in messages_of(SwarmMove, moves):
                single.sent(0.2 + round_, move)
    assert entries(tmp_path / "many.mcap") == entries(tmp_path / "single.mcap")
