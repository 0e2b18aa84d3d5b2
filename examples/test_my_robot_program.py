"""What your own repository would hold: a robot program, and the tests that run it on an emulated Junior.

The fixtures `junior`, `junior_world` and `junior_pty` come with the package; there is nothing to set up:

    pip install junior-hil pytest
    pytest test_my_robot_program.py

The same tests on the robot on your desk (those that need to look into the emulated one are skipped):

    pytest test_my_robot_program.py --hil-link serial:///dev/ttyACM0:115200

And the program by itself, on a robot or on an emulated one:

    python test_my_robot_program.py serial:///dev/ttyACM0:115200
"""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

import hil
from firmware_protocol.messages import BoutOutcome, SensorFlag
from hil import Outcome, Stimulus

if TYPE_CHECKING:
    from hil import Junior
    from hil.pytest_plugin import ServedJunior
    from simdevice.sumo.world import World

# --- The program: in your repository it would have a file of its own -------------------------------------------------

SPEED, TURN = 0.8, 0.35
OFF_RING = SensorFlag.OFF_RING_LEFT | SensorFlag.OFF_RING_RIGHT
BOTH = Stimulus.EYE_LEFT | Stimulus.EYE_RIGHT


def steer(eyes: Stimulus) -> tuple[float, float]:
    """Wheel speeds for what the eyes see: ahead, towards the side that sees, or round and round."""
    match eyes & BOTH:
        case Stimulus.EYE_LEFT:
            return 0.0, TURN
        case Stimulus.EYE_RIGHT:
            return TURN, 0.0
        case Stimulus.NONE:
            return -TURN, TURN
        case _:
            return SPEED, SPEED


def hunt(robot: Junior, duration: float) -> int:
    """Hunt the opponent, and keep off the border.

    Args:
        robot: An armed robot.
        duration: How long, in s.

    Returns:
        How often the border was met.
    """
    met = 0
    end = robot.now() + duration
    while robot.now() < end:
        if robot.flags & OFF_RING:
            met += 1
            robot.perform(["B", "B", "L"], period=0.15)
        else:
            robot.drive(*steer(robot.stimulus), duration=0.15)
            robot.wait(0.04)
    robot.stop()
    return met


def main(url: str) -> None:
    """Hunt for two seconds."""
    with hil.connect(url) as robot:
        robot.arm()
        print(f"met the border {hunt(robot, 2.0)} times")


# --- The tests -------------------------------------------------------------------------------------------------------


def test_it_turns_to_the_side_that_sees() -> None:
    """Needs no robot at all."""
    assert steer(Stimulus.EYE_LEFT) == (0.0, TURN)
    assert steer(Stimulus.EYE_RIGHT | Stimulus.ARM_LEFT) == (TURN, 0.0)


def test_it_hunts_and_stops(junior: Junior) -> None:
    """Runs on any robot."""
    junior.arm()
    hunt(junior, 2.0)
    junior.wait(0.3)  # it coasts for a moment
    before = junior.read_sensors().travel
    junior.wait(0.5)
    after = junior.read_sensors().travel
    assert after == pytest.approx(before, abs=0.002)


@pytest.mark.junior(opponent="flat-light", seed=3)
def test_it_pushes_a_light_opponent_out(junior: Junior) -> None:
    """An emulated ring has a referee, who knows."""
    if junior.referee is None:
        pytest.skip("needs a referee")
    junior.arm()
    hunt(junior, 8.0)
    assert junior.referee.state().outcome == BoutOutcome.WIN


@pytest.mark.junior(faults="drop:0.05,corrupt:0.01,jitter:0.02", seed=3)
def test_it_copes_with_a_bad_line(junior: Junior, junior_world: World) -> None:
    """Looks into the emulated world, where the firmware's word about its wheels is to be seen."""
    junior.arm()
    hunt(junior, 8.0)
    assert junior.peer.counters.lost > 0
    assert junior_world.device.wheels == (0.0, 0.0)


@pytest.mark.junior(left_armed=True)
def test_the_wheels_stop_when_the_program_hangs(junior: Junior, junior_world: World) -> None:
    """The robot's own watchdog, which no program can forget."""
    junior.arm()
    junior.drive(0.5, 0.5, duration=0.5)
    for _ in range(51):  # who armed it is silent for 250 ms, a control period is 5 ms
        junior_world.step(b"")
    assert junior_world.device.wheels == (0.0, 0.0)


def test_the_border_ends_a_maneuver(junior: Junior, junior_world: World) -> None:
    """The floor reflex, on board too."""
    junior.arm()
    outcomes = [junior.perform(["FF"] * 8, period=0.5).outcome for _ in range(3)]
    assert Outcome.FLOOR_REFLEX in outcomes
    assert junior_world.device.wheels == (0.0, 0.0)


def test_the_program_runs_on_a_serial_port(junior_pty: ServedJunior) -> None:
    """In real time, as a process of its own, on a port that it opens itself."""
    done = subprocess.run(  # noqa: S603
        [sys.executable, __file__, junior_pty.url], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "met the border" in done.stdout


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "sim://junior")
