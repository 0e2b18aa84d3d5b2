"""Signed frames of ours are believed by pymavlink, and the other way round."""

from __future__ import annotations

import contextlib
import importlib
import io
from typing import Any

import pytest
from signed_pair import KEY, NOW, OTHER_KEY, signed_codec

from firmware_protocol.events import Received, Rejected, RejectReason
from firmware_protocol.generate.vectors import Vector, vectors
from firmware_protocol.messages import STANDARD_MESSAGES, Ping
from firmware_protocol.wire.mavlink_layout import SIGNATURE_LENGTH

STANDARD = [v for v in vectors() if type(v.message) in STANDARD_MESSAGES and v.name != "TIMESYNC typical"]
common: Any = importlib.import_module("pymavlink.dialects.v20.common")


def pymavlink_end(secret: bytes, *, system: int = 7, component: int = 8) -> Any:  # noqa: ANN401 - of a generated module
    """An end made of pymavlink's own class."""
    end = common.MAVLink(io.BytesIO(), srcSystem=system, srcComponent=component)
    end.robust_parsing = True
    end.signing.secret_key = secret
    end.signing.sign_outgoing = True
    end.signing.timestamp = NOW
    return end


@pytest.mark.parametrize("vector", STANDARD, ids=lambda vector: vector.name)
def test_pymavlink_believes_ours(vector: Vector) -> None:
    end = pymavlink_end(KEY.secret)
    (message,) = end.parse_buffer(signed_codec().encode(vector.message))
    assert message.get_type() == type(vector.message).NAME
    assert end.signing.goodsig_count == 1
    (refused,) = pymavlink_end(OTHER_KEY.secret).parse_buffer(signed_codec().encode(vector.message))
    assert refused.get_type() == "BAD_DATA"


@pytest.mark.parametrize("vector", STANDARD, ids=lambda vector: vector.name)
def test_we_believe_pymavlinks(vector: Vector) -> None:
    reader = common.MAVLink(io.BytesIO())
    with contextlib.redirect_stdout(io.StringIO()):
        (message,) = reader.parse_buffer(vector.frame)
    end = pymavlink_end(KEY.secret)
    frame = bytes(message.pack(end))
    (event,) = signed_codec().receive(frame, 0.0)
    assert isinstance(event, Received)
    assert (event.system, event.component, event.raw) == (7, 8, frame)
    other = signed_codec(OTHER_KEY)
    events = other.receive(frame, 0.0) + other.flush(1.0)
    assert all(isinstance(event, Rejected) for event in events)
    assert (other.good, other.rejected[RejectReason.BAD_SIGNATURE]) == (0, 1)


def test_both_follow_the_other_ones_time() -> None:
    ours, theirs = signed_codec(now=NOW - 10**9), pymavlink_end(KEY.secret)
    late = ours.encode(Ping(1, 1))
    (refused,) = theirs.parse_buffer(late)
    assert refused.get_type() == "BAD_DATA"
    ours.receive(bytes(common.MAVLink_ping_message(1, 1, 0, 0).pack(theirs)), 0.0)
    assert theirs.parse_buffer(ours.encode(Ping(1, 2)))[0].seq == 2
    assert int.from_bytes(ours.encode(Ping(1, 3))[1 - SIGNATURE_LENGTH : -6], "little") >= NOW
