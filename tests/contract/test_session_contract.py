"""One suite for a robot at the other end of every link, on a good line and on a bad one."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

import pytest
from link_kinds import socketcan_url
from serving import MULTICAST, served

import hil
from firmware_protocol.errors import RefusedError
from firmware_protocol.messages import State
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from firmware_protocol.vocabulary import Outcome

if TYPE_CHECKING:
    from collections.abc import Iterator

SERVED: Final = {
    "pty": "pty",
    "tcp": "tcp://127.0.0.1:0",
    "udp": "udp://127.0.0.1:0",
    "virtual": "can://virtual/session",
    "udp_multicast": MULTICAST,
    "slcan": "slcan",
    "socketcan": "",
}
"""Where the emulator serves, by kind of link."""
MEMORY: Final = {"memory": "sim://junior", "memory_can": "sim://junior?wire=can"}
GOOD: Final = ""
BAD_BYTES: Final = "faults=drop:0.05,corrupt:0.03,duplicate:0.05&seed=5"
BAD_BUS: Final = "faults=drop:0.01,corrupt:0.005,duplicate:0.05&seed=5"
"""Of a message on a bus all frames must come: four to eighteen."""


@contextmanager
def reached(kind: str) -> Iterator[str]:
    """The address of an emulated robot, in lock-step or served."""
    if kind in MEMORY:
        yield MEMORY[kind]
        return
    with served(SERVED[kind] or socketcan_url()) as url:
        yield url


@pytest.fixture(
    params=[
        *(f"{kind}{how}" for kind in MEMORY for how in ("", "-bad")),
        *(pytest.param(f"{kind}{how}", marks=pytest.mark.slow) for kind in SERVED for how in ("", "-bad")),
    ]
)
def url(request: pytest.FixtureRequest) -> Iterator[str]:
    """The address of a robot, on a good line or a bad one."""
    kind, _, bad = str(request.param).partition("-")
    with reached(kind) as address:
        faults = (BAD_BYTES if kind in {"memory", "pty", "tcp", "udp"} else BAD_BUS) if bad else ""
        yield f"{address}{'&' if '?' in address else '?'}{faults}" if faults else address


def test_a_session_goes_its_way(url: str) -> None:
    with hil.connect(url, timeout=15.0) as junior:  # this chance loses the first four heartbeats of a host's
        # the handshake has found who it is; now its parameters, all of them and one that is set
        found = junior.parameters()
        assert set(found) == {parameter.name for parameter in JUNIOR_PARAMETERS}
        assert junior.set_parameter("SPD_SLOW", 0.25) == pytest.approx(0.25)
        assert junior.parameter("SPD_SLOW") == pytest.approx(0.25)
        # nothing moves before it is armed
        with pytest.raises(RefusedError):
            junior.perform(["L"], period=0.05)
        junior.arm()
        # three maneuvers, each performed once, whatever the line does to them and to their results
        before = junior.status().maneuvers
        for _ in range(3):
            report = junior.perform(["L", "R"], period=0.03)
            assert report.outcome in {Outcome.COMPLETED, Outcome.FLOOR_REFLEX}
        assert junior.status().maneuvers == before + 3
        # an emergency stop is latched: disarming clears it
        junior.drive(0.2, -0.2, 2.0)
        junior.emergency_stop()
        assert junior.status().state == State.STOPPED
        with pytest.raises(RefusedError):
            junior.arm()
        junior.disarm()
        junior.arm()
        assert junior.status().state == State.READY
