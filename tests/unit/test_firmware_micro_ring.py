"""What a micro-robot's ring makes of whom it finds, against the host's own reckoning (`pal_advisor.ring`)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from firmware_bench import forge
from hypothesis import given, settings
from hypothesis import strategies as st
from micro_bench import MicroBench, Other

from firmware_protocol.messages import ParamRequestRead, ParamValue, Reason, RobotAck, SwarmObservation, SwarmSense
from pal_advisor.ring import SensorRing, count_within, readings

LENGTHS = st.integers(0, 900).map(lambda mm: mm / 1000)


def look(bench: MicroBench) -> SwarmObservation:
    """Ask."""
    bench.request(SwarmObservation, 1)
    return next(o for o in bench.tick() if isinstance(o, SwarmObservation))


def wire(radius: float) -> float:
    """As the wire has it: 65.535 has no end."""
    return min(radius, 65.535)


SETTINGS = st.builds(
    SensorRing,
    radius=LENGTHS,
    increment=st.sampled_from([0.0, 0.007, 0.05, 0.3]),
    limit=st.sampled_from([math.inf, 0.0, 0.4, 0.5]),
    sectors=st.integers(1, 16),
)
ROBOTS = st.tuples(st.integers(0, 1), st.integers(-30_000, 30_000), st.integers(1, 900_999))
"""Class, bearing in 0.1 mrad, distance in um."""


def clear(um: int) -> bool:
    """It lies on no circle, where the host's distances may be rounded to the other side."""
    return 3 < um % 1000 < 997


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.lists(ROBOTS.filter(lambda robot: clear(robot[2])), max_size=12), SETTINGS, st.integers(0, 1))
def test_it_reads_what_the_host_reckons(found: list[tuple[int, int, int]], ring: SensorRing, own: int) -> None:
    bench = MicroBench().armed()
    bench.set(CLASS=own)
    message = bench.sense_message(ring.radius, ring.increment, wire(ring.limit), sectors=ring.sectors)
    assert bench.ask(message) is Reason.NONE
    bench.others = [Other(group, bearing / 10_000, um / 1e6) for group, bearing, um in found]
    observation = look(bench)
    others = [(o.distance * math.cos(o.bearing), o.distance * math.sin(o.bearing), 0.0) for o in bench.others]
    poses, classes = np.array([(0.0, 0.0, 0.0), *others]), np.array([own, *(o.group for o in bench.others)], dtype=np.int64)
    oracle = readings(poses, classes, ring)
    assert observation.radius == pytest.approx(wire(oracle.radius[0]), abs=1e-9)
    assert observation.count == tuple(oracle.count[0])
    assert observation.near == tuple(oracle.near[0])
    assert observation.seen == tuple(oracle.seen[0])
    assert observation.count_before == tuple(count_within(poses, classes, np.full(len(poses), 0.2))[0])


def test_the_radius_grows_until_one_of_the_other_class_is_inside() -> None:
    bench = MicroBench().armed()
    bench.others = [Other(0, 0.0, 0.1), Other(1, 3.0, 0.3)]
    assert look(bench).radius == 0.35, "inside is nearer than the radius"
    bench.others[1] = Other(1, 3.0, 0.299999)
    assert look(bench).radius == 0.3
    bench.set(CLASS=1)
    assert look(bench).radius == 0.2


def test_it_grows_up_to_the_limit_and_without_one_without_end() -> None:
    bench = MicroBench().armed()
    assert look(bench).radius == 65.535
    bench.set(SENSE_LIMIT=0.33)
    assert look(bench).radius == 0.3
    bench.others = [Other(1, 0.0, 60.0)]
    assert look(bench).radius == 0.3
    bench.set(SENSE_LIMIT=0.1)
    assert look(bench).radius == 0.2
    bench.set(SENSE_LIMIT=65.535)
    bench.others = [Other(1, 0.0, 70.0)]
    assert look(bench).radius == 65.535


def test_long_range_sees_all() -> None:
    bench = MicroBench().armed()
    bench.ask(bench.sense_message(65.535, sectors=4))
    bench.others = [Other(1, 0.1, 90.0), Other(0, -0.1, 200.0)]
    observation = look(bench)
    assert (observation.radius, observation.near, observation.count) == (65.535, (0b0001, 0b1000), (1, 1))


def test_it_asks_for_what_it_needs() -> None:
    bench = MicroBench().armed()
    bench.set(SENSE_LIMIT=1.5)
    bench.request(SwarmObservation, 1, 1234)
    assert (bench.io.least, bench.io.step, bench.io.limit) == (200, 50, 1500)
    bench.others = [Other(1, 0.0, 0.81)]
    bench.run(20)
    bench.request(SwarmObservation, 1, 1234)
    assert bench.io.least == 850, "those within the radius of before are counted, too"


def test_what_swarm_sense_says_is_kept_until_a_reboot() -> None:
    bench = MicroBench().armed()
    bench.ask(bench.sense_message(0.5, 0.0))
    bench.set(SENSE_R0=0.3)
    assert look(bench).radius == 0.5
    bench.run(500)
    bench.power_on()
    bench.armed()
    bench.set(SENSE_DR=0.0)
    assert look(bench).radius == 0.3


@pytest.mark.parametrize("changes", [{"sectors": 0}, {"sectors": 17}, {"ranges": 33}])
def test_sectors_and_directions_have_their_ranges(changes: dict[str, int]) -> None:
    bench = MicroBench().armed()
    (ack,) = [a for a in bench.tick(raw=forge(bench.sense_message(), **changes)) if isinstance(a, RobotAck)]
    assert (ack.message, ack.reason) == (SwarmSense.ID, Reason.BAD_VALUE)


def test_it_says_whether_it_has_a_ring() -> None:
    for ring in (False, True):
        bench = MicroBench(ring=ring)
        bench.set(RING=0.5)
        bench.tick(ParamRequestRead(1, 1, "RING", -1))
        assert bench.latest(ParamValue).param_value == float(ring)
