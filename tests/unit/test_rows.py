"""Rows are what the objects are: the same payloads, the same values, the same refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from fastcrc.crc16 import mcrf4xx
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.errors import EncodeError
from firmware_protocol.generate.vectors import vectors
from firmware_protocol.messages import MESSAGES, AutopilotVersion, ParamValue, RobotAck, SwarmMove, SwarmObservation, TableReset
from firmware_protocol.wire.crc import LONGEST, checksums
from firmware_protocol.wire.fields import Message, wire_fields
from firmware_protocol.wire.mavlink_layout import offsets
from firmware_protocol.wire.payload import PAYLOADS
from firmware_protocol.wire.rows import ROWS, check_rows, column, good_rows, messages_of, rows_of, rows_of_messages

VECTORS = vectors()


@pytest.mark.parametrize("kind", MESSAGES.values(), ids=lambda kind: kind.NAME)
def test_a_row_is_the_payload(kind: type[Message]) -> None:
    fields = ROWS[kind].fields
    assert fields is not None
    assert ROWS[kind].itemsize == PAYLOADS[kind.ID].length
    assert {name: place[1] for name, place in fields.items()} == offsets(kind)
    found = [vector.message for vector in VECTORS if type(vector.message) is kind]
    rows = rows_of_messages(kind, found)
    assert [row.tobytes() for row in rows] == [PAYLOADS[kind.ID].pack(message) for message in found]
    assert [repr(message) for message in messages_of(kind, rows)] == [repr(message) for message in found]
    assert good_rows(kind, rows).all()


@pytest.mark.parametrize("kind", MESSAGES.values(), ids=lambda kind: kind.NAME)
def test_columns_are_the_values_and_make_the_same_rows(kind: type[Message]) -> None:
    found = [vector.message for vector in VECTORS if type(vector.message) is kind]
    rows = rows_of_messages(kind, found)
    columns = {name: column(kind, rows, name) for name, _ in wire_fields(kind)}
    for name, wire in wire_fields(kind):
        for index, message in enumerate(found):
            value = getattr(message, name)
            if isinstance(value, str):
                assert columns[name][index] == value.encode()
            else:
                parts = value if wire.count else (value,)
                expected = [math.nan if part is None else part for part in parts]
                np.testing.assert_array_equal(np.atleast_1d(columns[name][index]), np.array(expected, columns[name].dtype))
    assert rows_of(kind, len(rows), columns).tobytes() == rows.tobytes()


@given(st.binary(min_size=LONGEST - 1, max_size=LONGEST - 1), st.integers(0, LONGEST - 1), st.integers(0, 255))
def test_checksums_are_those_of_one_frame(data: bytes, length: int, seed: int) -> None:
    lengths = np.array([length, LONGEST - 1])
    rows = np.frombuffer(data[:length].ljust(LONGEST - 1, b"\0") + data, np.uint8).reshape(2, LONGEST - 1)
    tail = bytes((seed,))
    assert checksums(rows, lengths, seed).tolist() == [mcrf4xx(data[:length] + tail), mcrf4xx(data + tail)]


@pytest.mark.parametrize("kind", [SwarmObservation, SwarmMove, RobotAck, TableReset, AutopilotVersion, ParamValue])
@given(data=st.data())
def test_a_row_is_good_where_the_object_can_be_read(kind: type[Message], data: st.DataObject) -> None:
    size = ROWS[kind].itemsize
    payload = data.draw(st.binary(min_size=size, max_size=size))
    try:
        PAYLOADS[kind.ID].unpack(payload)
    except ValueError:
        readable = False
    else:
        readable = True
    assert good_rows(kind, np.frombuffer(payload, ROWS[kind])).tolist() == [readable]


@pytest.mark.parametrize(
    ("kind", "columns", "words"),
    [
        (SwarmMove, {"distance": [0.1, 60.001]}, "SWARM_MOVE.distance = 60.001"),
        (SwarmMove, {"heading": 3.3}, "from -3.2767 to 3.2767 rad or None"),
        (SwarmMove, {"sector": 17}, "from 0 to 16"),
        (SwarmMove, {"sector": -1}, "from 0 to 16"),
        (SwarmMove, {"sector": 1.5}, "whole numbers"),
        (SwarmMove, {"effort": math.nan}, "SWARM_MOVE.effort"),
        (SwarmMove, {"speed": math.nan}, "SWARM_MOVE.speed"),
        (SwarmMove, {"session": 65536}, "SWARM_MOVE.session"),
        (SwarmMove, {"angle": 1.0}, "no field angle"),
        (ParamValue, {"param_value": math.inf}, "PARAM_VALUE.param_value"),
        (ParamValue, {"param_value": 1e39}, "PARAM_VALUE.param_value"),
        (ParamValue, {"param_id": "SEVENTEEN_LETTERS"}, "at most 16 bytes"),
    ],
)
def test_what_the_wire_cannot_carry_is_an_error_of_ours(kind: type[Message], columns: dict[str, Any], words: str) -> None:
    with pytest.raises(EncodeError, match=words):
        rows_of(kind, 2, columns)


def test_rows_of_others_are_checked() -> None:
    rows = rows_of(SwarmMove, 3, {"heading": [0.5, math.nan, -0.5], "session": 7, "distance": 0.08})
    assert rows["heading"].tolist() == [5000, -32768, -5000]
    assert rows["face"].tolist() == [-32768] * 3
    check_rows(SwarmMove, rows)
    rows["options"][1] = 64
    with pytest.raises(EncodeError, match=r"SWARM_MOVE.options = 64 \(wire units\) in row 1"):
        check_rows(SwarmMove, rows)
    with pytest.raises(EncodeError, match="no rows of RobotAck"):
        check_rows(RobotAck, rows)
