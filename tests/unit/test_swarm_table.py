"""The table of micro-robots: how they drive, what they feel and see, and what a reset restores."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from simdevice.swarm.profile import PROFILES, MicroProfile
from simdevice.swarm.table import NEVER, SwarmTable

QUIET = PROFILES["none"]


def quiet(count: int = 1, **changes: float) -> SwarmTable:
    return SwarmTable([0] * count, profile=replace(QUIET, **changes))


def drive(table: SwarmTable, row: int, left: float, right: float) -> None:
    table.arrays.command[2 * row : 2 * row + 2] = left, right


def test_wheels_take_up_their_speed_within_30_ms_and_the_body_follows() -> None:
    table = quiet()
    drive(table, 0, 0.2, 0.2)
    table.run(6)
    assert table.arrays.rim[0] == pytest.approx(0.2 * (1 - math.exp(-1)))
    table.run(194)
    assert table.arrays.vx[0] == pytest.approx(0.2)
    assert table.arrays.travel[0] == pytest.approx(0.2 * (1.0 - 0.03), abs=0.001)
    assert table.arrays.x[0] == pytest.approx(table.arrays.travel[0], abs=0.0015)


def test_opposite_wheels_turn_on_the_spot() -> None:
    table = quiet()
    drive(table, 0, -0.0942, 0.0942)
    table.run(200)
    assert table.arrays.spin[0] == pytest.approx(6.28)
    assert math.hypot(table.arrays.x[0], table.arrays.y[0]) < 1e-9


def test_traction_brakes_no_harder_than_it_may() -> None:
    table = quiet(lag=1e-6)
    drive(table, 0, 0.4, 0.4)
    table.run(1)
    assert table.arrays.vx[0] == pytest.approx(0.6 / 0.05 * 0.005)


def test_effort_limits_thrust() -> None:
    table = quiet(lag=1e-6)
    table.arrays.effort[0] = 0.25
    drive(table, 0, 0.4, 0.4)
    table.run(1)
    assert table.arrays.vx[0] == pytest.approx(0.25 * 0.6 / 0.05 * 0.005)


def test_a_robot_pushes_the_box_and_the_box_stops_without_it() -> None:
    table = quiet()
    table.reset(1, box="cylinder")
    table.place(0, -0.1005, 0.0, 0.0)
    drive(table, 0, 0.1, 0.1)
    table.run(400)
    moved = table.state().box[0]
    assert 0.1 < moved < 0.21
    assert table.state().contacts == 1
    drive(table, 0, 0.0, 0.0)
    table.run(200)
    stopped = table.state().box[0]
    table.run(100)
    assert table.state().box[0] == stopped < moved + 0.01


def test_half_the_effort_moves_no_box() -> None:
    table = quiet()
    table.reset(1, box="cube")
    table.place(0, -0.1005, 0.0, 0.0)
    table.arrays.effort[0] = 0.5
    drive(table, 0, 0.2, 0.2)
    table.run(200)
    assert abs(table.state().box[0]) < 5e-4  # it is nudged, no more
    assert table.arrays.travel[0] > 0.15  # its wheels slip


def test_a_dead_wheel_stands_and_the_robot_turns() -> None:
    table = quiet()
    table.arrays.gain[0] = 0.0
    drive(table, 0, 0.1, 0.1)
    table.run(100)
    assert table.arrays.travel[0] == 0.0
    assert table.arrays.spin[0] == pytest.approx(0.1 / 0.03)


@pytest.mark.parametrize(("bearing", "sector"), [(math.radians(22 + 45 * number), number + 1) for number in range(8)])
def test_contact_is_told_by_sectors_of_the_body(bearing: float, sector: int) -> None:
    table = quiet(2)
    heading = 0.7
    table.place(0, 0.3, 0.2, heading)
    table.place(1, 0.3 + 0.0415 * math.cos(heading + bearing), 0.2 + 0.0415 * math.sin(heading + bearing), heading + math.pi)
    bumps = table.contacts()
    assert bumps.tolist() == [1 << 8 - sector] * 2  # the other one looks the other way
    table.place(1, 0.3 + 0.0425 * math.cos(heading + bearing), 0.2 + 0.0425 * math.sin(heading + bearing), 0.0)
    assert not table.contacts().any()


def test_a_wall_is_felt_and_holds() -> None:
    table = quiet()
    table.reset(1, size=(0.4, 0.4), wall=True)
    drive(table, 0, 0.2, 0.2)
    table.run(400)
    assert table.arrays.x[0] == pytest.approx(0.18, abs=0.001)
    assert table.contacts()[0] in {0x80, 0x01}


def test_without_a_wall_a_robot_drives_off() -> None:
    table = quiet()
    table.reset(1, size=(0.4, 0.4))
    drive(table, 0, 0.2, 0.2)
    table.run(400)
    assert table.arrays.x[0] > 0.3


def test_the_ring_grows_to_the_nearest_of_the_other_class() -> None:
    table = SwarmTable([0, 0, 1, 1], profile=QUIET)
    for row, x in enumerate((0.0, 0.31, 0.34, 0.9)):
        table.place(row, x, 0.0, 0.0)
    assert table.ring(0, 0.2).rows.tolist() == []
    assert table.ring(0, 0.2, step=0.05).rows.tolist() == [1, 2]
    assert table.ring(0, 0.2, step=0.05, limit=0.32).rows.tolist() == [1]
    assert table.ring(0, 65.0).groups.tolist() == [0, 1, 1]
    assert table.ring(0, 65.0).distances == pytest.approx([0.31, 0.34, 0.9])


def test_who_stands_behind_another_is_hidden_where_that_is_asked_for() -> None:
    for occlusion, seen in ((False, [1, 2]), (True, [1])):
        table = SwarmTable([0, 0, 0], profile=QUIET, occlusion=occlusion)
        for row, x in enumerate((0.0, 0.2, 0.4)):
            table.place(row, x, 0.0, 0.0)
        assert table.ring(0, 1.0).rows.tolist() == seen


def test_ranges_are_measured_from_the_centre_to_surfaces() -> None:
    table = quiet(2)
    table.reset(1, size=(2.0, 2.0), wall=True, box="cube")
    table.place_box(0.5, 0.0, 0.0)
    table.place(0, 0.0, 0.0, math.pi / 2)
    table.place(1, 0.0, -0.3, 0.0)
    ranges, robots = table.ranges(0, 4, 2.5)
    assert ranges == pytest.approx([1.0, 1.0, 0.28, 0.42])
    assert robots.tolist() == [False, False, True, False]
    assert table.ranges(0, 4, 0.3)[0][0] == math.inf


def test_bearings_of_box_and_goal() -> None:
    table = quiet()
    assert all(map(math.isnan, (*table.box_bearing(0), table.goal_bearing(0))))
    table.reset(1, box="cylinder")
    table.place_box(0.0, 0.5, 0.0)
    table.place_goal(-1.0, 0.0)
    table.place(0, 0.0, 0.0, math.pi / 2)
    assert table.box_bearing(0) == pytest.approx((0.0, 0.42))
    assert table.goal_bearing(0) == pytest.approx(math.pi / 2)


def test_fixes_come_at_20_hz_from_the_reset_on() -> None:
    table = quiet()
    assert table.arrays.fix_age[0] == NEVER
    ages = []
    for _ in range(21):
        table.run(1)
        ages.append(int(table.arrays.fix_age[0]))
    assert ages == [*range(10), *range(10), 0]


def test_fixes_drop_out_for_half_a_second() -> None:
    table = SwarmTable([0] * 200, profile=MicroProfile(dropout=0.5))
    table.run(10)
    longest = np.zeros(200, int)
    lost = np.zeros(200, bool)
    for turn in range(40):
        table.run(10)
        lost |= (table.arrays.lost > 0) & (turn < 30)
        longest = np.maximum(longest, np.where(table.arrays.fix_age == NEVER, 1000, table.arrays.fix_age))
    assert longest[lost].min() >= 109  # ten fixes in a row
    assert longest[~lost].max() < 110
    assert lost.mean() == pytest.approx(0.65, abs=0.12)  # in a second and a half


def test_noise_is_as_large_as_the_profile_says() -> None:
    table = SwarmTable([0] * 400)
    drive_all = np.full(800, 0.2)
    table.arrays.command[:] = drive_all
    places = table.arrays.x.copy(), table.arrays.y.copy()
    table.run(200)
    ways = table.arrays.travel[::2]
    assert (table.arrays.x - table.arrays.fix_x)[table.arrays.fix_age == 9].std() == pytest.approx(0.001, rel=0.5)
    free = table.arrays.bump == 0
    along, aside = table.arrays.x - places[0], table.arrays.y - places[1]
    assert (along / ways)[free].std() == pytest.approx(0.02, rel=0.25)
    assert np.arctan2(aside, along)[free].std() == pytest.approx(math.radians(1.0), rel=0.25)


def test_noise_depends_on_seed_and_row_and_on_nobody_else() -> None:
    def live(count: int, seed: int, *, busy: bool) -> list[float]:
        table = SwarmTable([0] * count)
        table.reset(seed)
        for row in range(count):
            table.place(row, row * 1.0, 0.0, 0.0)
        for turn in range(100):
            drive(table, 1, 0.1, 0.1 if turn % 2 else 0.0)
            if busy:
                drive(table, 0, 0.1 * (turn % 3), 0.1)
                table.ranges(0, 32, 2.5)
            table.run(5)
        return [*table.arrays.travel[2:4], table.arrays.x[1], table.arrays.fix_x[1], *table.ranges(1, 8, 0.5)[0]]

    assert live(2, 7, busy=False) == live(5, 7, busy=True)
    assert live(2, 7, busy=False) != live(2, 8, busy=False)


def test_a_reset_restores_everything() -> None:
    def live(table: SwarmTable) -> bytes:
        table.reset(5, wall=True, box="cylinder")
        table.arrays.command[:] = np.resize([0.2, 0.1], 2 * table.count)
        table.run(300)
        arrays = table.arrays
        return b"".join(
            array.tobytes() for array in (arrays.x, arrays.y, arrays.angle, arrays.travel, arrays.fix_x, arrays.bump)
        )

    table = SwarmTable([0, 1] * 10)
    table.run(77)
    assert live(table) == live(table) == live(SwarmTable([0, 1] * 10))
    assert table.state().resets == 2


def test_a_placed_robot_is_at_rest() -> None:
    table = quiet()
    drive(table, 0, 0.3, 0.3)
    table.run(50)
    table.place(0, 0.5, -0.5, 1.0)
    table.run(100)
    assert (table.arrays.x[0], table.arrays.y[0], table.arrays.angle[0]) == (0.5, -0.5, 1.0)


def test_two_robots_on_one_point_part() -> None:
    table = quiet(3)
    for row in range(3):
        table.place(row, 0.1, 0.1, 0.0)
    table.contacts()
    table.ring(0, 0.5, step=0.05)
    table.ranges(0, 32, 2.5)
    table.run(2000)
    x, y = table.arrays.x, table.arrays.y
    gaps = np.hypot(x[:, None] - x, y[:, None] - y)[np.triu_indices(3, 1)]
    assert gaps.min() > 0.039


@pytest.mark.parametrize(
    "what",
    [
        lambda: SwarmTable([]),
        lambda: SwarmTable([0], period=0.02),
        lambda: quiet().reset(1, size=(0.0, 1.0)),
        lambda: quiet().reset(1, box="sphere"),
        lambda: quiet(100).reset(1, size=(0.5, 0.5), wall=True),
        lambda: quiet().reset(1, size=(0.02, 0.5), wall=True),
        lambda: quiet().place(1, 0.0, 0.0, 0.0),
        lambda: quiet().place(0, math.nan, 0.0, 0.0),
        lambda: quiet().place_box(0.0, 0.0, 0.0),
        lambda: quiet().place_goal(math.inf, 0.0),
        lambda: MicroProfile(mass=0.0),
        lambda: MicroProfile(fix_sd=-1.0),
        lambda: MicroProfile(dropout=1.5),
        lambda: MicroProfile.from_table({"weight": 1.0}),
    ],
)
def test_what_no_table_can_be_is_refused(what: object) -> None:
    assert callable(what)
    with pytest.raises(ValueError, match=r"\w"):
        what()


def test_a_profile_comes_from_a_file() -> None:
    assert MicroProfile.from_table({"fix_sd": 0, "dropout": 0.1}) == MicroProfile(fix_sd=0.0, dropout=0.1)


def test_more_readings_than_there_is_noise_for_are_noticed() -> None:
    table = SwarmTable([0])
    for _ in range(20):
        table.arrays.lib.table_ranges(table.arrays.struct, 0, 32, 2.5)
    with pytest.raises(RuntimeError, match="more often than noise was drawn for"):
        table.run(1)


def test_a_heap_holds_within_its_wall_in_either_period() -> None:
    for period in (0.005, 0.01):
        table = SwarmTable([0] * 60, profile=QUIET, period=period)
        table.reset(1, size=(1.0, 1.0), wall=True)
        table.arrays.command[:] = 0.4
        table.run(round(5 / period))
        assert table.arrays.x.max() < 0.48 + 0.004
        x, y = table.arrays.x, table.arrays.y
        gaps = np.hypot(x[:, None] - x, y[:, None] - y)[np.triu_indices(60, 1)]
        assert gaps.min() > 0.039
