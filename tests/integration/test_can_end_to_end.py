"""Everything that is done over MAVLink is done over CAN: in lock-step with the same results, and served in real time."""

from __future__ import annotations

import os
import threading
from typing import TYPE_CHECKING

import pytest

import hil
from firmware_protocol.errors import AddressError
from firmware_protocol.events import LinkNews
from firmware_protocol.links.can import BUS_OFF, WELL
from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.messages import State
from firmware_protocol.vocabulary import Outcome
from firmware_protocol.wire.fields import CAN
from hil.bridge.bridge import Bridge
from hil.bridge.clock import MonotonicClock
from hil.mcaplog.reading.reader import LogReader
from hil.recording.recorder import Recorder
from hil.sumo.coaching import Coaching, new_pal
from hil.sumo.ring import open_ring
from pal_advisor.maneuvers import PalSettings
from simdevice.serving.opening import open_endpoint
from simdevice.serving.server import serve
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

SETTINGS = PalSettings(budget=120, population=6, elite=1, exam_share=0.2)


def coach(url: str) -> dict[str, object]:
    with hil.connect(url) as junior:
        junior.arm()
        run = Coaching(open_ring(junior), new_pal(SETTINGS, 3), seed=3)
        run.run()
        return run.pal.state_dict()


@pytest.mark.slow
def test_the_same_is_learnt_over_can_as_over_mavlink() -> None:
    url = "sim://junior?opponent=flat-light&seed=3"
    assert coach(f"{url}&wire=can") == coach(url)


@pytest.mark.slow
def test_coaching_over_a_bad_bus_completes() -> None:
    state = coach("sim://junior?seed=3&wire=can&faults=drop:0.02,duplicate:0.02,corrupt:0.01,jitter:0.01")
    assert state


def test_a_wire_that_does_not_exist_is_refused() -> None:
    with pytest.raises(AddressError, match="wire is mavlink or can"):
        hil.connect("sim://junior?wire=string")


@pytest.fixture(
    params=["can://virtual/served", f"can://udp_multicast/239.74.163.2?port={20000 + os.getpid() % 20000}", "slcan"]
)
def served(request: pytest.FixtureRequest) -> Iterator[str]:
    endpoint = open_endpoint(str(request.param))
    stop = threading.Event()
    world = junior_world(WorldSettings(seed=3, wire=endpoint.wire))
    thread = threading.Thread(target=serve, args=(world, endpoint, MonotonicClock(), stop.is_set))
    thread.start()
    yield endpoint.url
    stop.set()
    thread.join()


@pytest.mark.slow
def test_a_robot_served_on_a_bus_is_found_driven_stopped_and_recorded(served: str, tmp_path: Path) -> None:
    path = tmp_path / "can.mcap"
    recorder = Recorder(path, run={}, config={}, link=served, lockstep=False)
    with recorder, hil.connect(served, taps=[recorder]) as junior:
        junior.arm()
        report = junior.perform(["L", "R"], period=0.05)
        assert report.outcome in {Outcome.COMPLETED, Outcome.FLOOR_REFLEX}
        junior.drive(0.1, -0.1, 0.1)
        junior.emergency_stop()
        assert junior.read_sensors().time > 0
        assert junior.status().state == State.STOPPED
        assert junior.parameters()["SYS_ID"] == 1.0
    entries = list(LogReader(path).entries())
    topics = {entry.topic for entry in entries}
    assert {"/wire/rx", "/wire/tx", "/junior/sensors", "/junior/maneuver_result", "/junior/wheels"} <= topics
    assert "/wire/rejected" not in topics


class TroubledLink(MemoryLink):
    """A bus that goes off and comes back."""

    trouble: tuple[str, ...] = (BUS_OFF, WELL)

    def news(self) -> list[str]:
        told, self.trouble = self.trouble, ()
        return list(told)


def test_trouble_on_the_bus_reaches_the_log(tmp_path: Path) -> None:
    world = junior_world(WorldSettings(wire=CAN))
    path = tmp_path / "trouble.mcap"
    with Recorder(path, run={}, config={}, link="can", lockstep=True) as recorder:
        bridge = Bridge(TroubledLink(world, wire=CAN), world, taps=[recorder])
        seen = [event for _ in range(20) for event in bridge.step(0.1) if isinstance(event, LinkNews)]
        bridge.close()
    assert [event.text for event in seen] == [BUS_OFF, WELL]
    told = [str(entry) for entry in LogReader(path).entries() if entry.topic == "/events"]
    assert len(told) >= 2
