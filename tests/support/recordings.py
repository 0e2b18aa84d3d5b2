"""What the tests of the recorder's own process share: calls to record, and what a log is worth after a kill."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

from mcap.exceptions import McapError
from mcap.records import Message
from mcap.stream_reader import StreamReader

from firmware_protocol.events import Received, Rejected, RejectReason
from firmware_protocol.messages import JuniorSensors, RobotAlive

if TYPE_CHECKING:
    from pathlib import Path

    from hil.recording.wire_log import WireLog

ABOUT: dict[str, Any] = {"run": {"command": "a test"}, "config": {"seed": "1"}, "link": "memory:"}
FRAME = bytes(range(48))


def step(recorder: WireLog, number: int, *, period: float = 0.01) -> None:
    """One step as most are: a chunk with a message, and something said.

    Args:
        recorder: Records it.
        number: Of the step.
        period: Log time between steps, in s.
    """
    time = number * period
    recorder.step(time, [(time, FRAME)])
    recorder.wire_rx(time, FRAME)
    sensors = JuniorSensors(time, (0.1 * time, -0.1), (number % 1000, 4), (41, 42), 7.4, number % 512)
    recorder.received(Received(sensors, 1, 1, number & 0xFF, time, FRAME))
    if number % 4 == 0:
        recorder.wire_tx(time, FRAME)
        recorder.sent(time, RobotAlive(1))
    if number % 50 == 0:
        recorder.received(Rejected(RejectReason.NOISE, b"\x07", time, "one byte"))
        recorder.note("link", f"step {number}", number=number)


def last_time(path: Path) -> float:
    """Log time of the last entry that the stock reader reads of a log that may be cut off, in s; -1 where there is none.

    Args:
        path: The log.
    """
    last = -1.0
    with path.open("rb") as file:
        try:
            for record in StreamReader(file, skip_magic=False, validate_crcs=True).records:
                if isinstance(record, Message):
                    last = max(last, record.log_time / 1e9)
        except (McapError, EOFError, struct.error):  # cut within a record's head
            pass
    return last
