"""What is asked of a robot on a slow line, by its rate."""

from __future__ import annotations

import pytest

from firmware_protocol.messages import JuniorSensors
from firmware_protocol.peer.pacing import BITS_PER_BYTE, SHARE, bytes_per_second, pace_for, spared
from firmware_protocol.roles.junior import JUNIOR


@pytest.mark.parametrize(("baud", "interval"), [(9600, 0.160), (19200, 0.055), (38400, 0.025)])
def test_readings_come_as_often_as_half_of_the_line_carries(baud: int, interval: float) -> None:
    pace = pace_for(JUNIOR, baud / BITS_PER_BYTE, signed=False)
    assert pace is not None
    assert pace.streams[JuniorSensors] == pytest.approx(interval)
    assert f"every {interval * 1e3:.0f} ms, not 20, and for SYS_STATUS every 10 s" in pace.text
    said = bytes_per_second({**spared(JUNIOR), JuniorSensors: interval}, signed=False)
    assert said <= SHARE * pace.capacity


def test_a_line_that_carries_all_is_not_spared() -> None:
    assert pace_for(JUNIOR, 115200 / BITS_PER_BYTE, signed=False) is None
