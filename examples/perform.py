"""The Python API in one go: connect, read sensors and parameters, arm, perform a maneuver, drive, stop.

Run it on an emulated robot, which needs nothing:

    python examples/perform.py

or on a robot of yours; it turns its wheels for about two seconds, so put it on its ring or on blocks:

    python examples/perform.py serial:///dev/ttyACM0:115200
"""

from __future__ import annotations

import sys

import hil


def main(url: str) -> None:
    """Do one of everything.

    Args:
        url: Address of the robot.
    """
    # Leaving the block stops and disarms the robot, whatever happens inside. No motion exceeds the limits.
    with hil.connect(url, limits=hil.Limits(speed=0.8)) as junior:
        print(junior.description)

        sensors = junior.read_sensors()
        print(f"eyes {sensors.eye} counts, floor {sensors.floor} counts, battery {sensors.battery:.2f} V")
        print(f"it senses: {junior.stimulus.label}")

        parameters = junior.parameters()
        print(f"{len(parameters)} parameters, SPD_FAST is {parameters['SPD_FAST']:g}")
        print(f"EYE_HYST was {parameters['EYE_HYST']:g}, is {junior.set_parameter('EYE_HYST', 25):g} now")
        junior.set_parameter("EYE_HYST", parameters["EYE_HYST"])

        junior.arm()

        # A maneuver: up to eight actions that the robot performs and times itself. This one looks left and right.
        report = junior.perform(["L", "R", "R", "L"], period=0.2)
        print(f"maneuver: {report.outcome.name.lower()}, {report.done} actions done, it senses {report.after.label} now")
        for tally in report.tallies:
            print(f"  {tally.samples} control periods, left eye saw in {tally.eyes[0]}, right eye in {tally.eyes[1]}")

        # Driving: a command holds for its duration only, so it has to be repeated.
        before = junior.sensors.travel
        for _ in range(5):
            junior.drive(0.5, 0.4, duration=0.2)
            junior.wait(0.1)
        after = junior.read_sensors().travel
        print(f"the wheels travelled {after[0] - before[0]:.3f} m and {after[1] - before[1]:.3f} m")

        junior.stop()
        junior.disarm()
    print("stopped and disarmed")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "sim://junior?opponent=flat-light&seed=1")
