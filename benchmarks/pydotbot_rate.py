"""How fast PyDotBot's simulator lives: run by `swarm_speed.py --pydotbot PYTHON`, with an interpreter that has `pydotbot`.

Every robot gets ten commands a second, as frames, and says two; there is no ring of sensors. Prints a line for each number of
robots: how many there are, and how many simulated seconds pass in a second of processor time.

    PYTHON benchmarks/pydotbot_rate.py SECONDS COUNT [COUNT ...]
"""

from __future__ import annotations

import sys
from random import seed
from time import process_time

from dotbot import GATEWAY_ADDRESS_DEFAULT  # type: ignore[import-not-found, unused-ignore]
from dotbot.area import Area  # type: ignore[import-not-found, unused-ignore]
from dotbot.dotbot_simulator import (  # type: ignore[import-not-found, unused-ignore]
    DotBotSimulatorCommunicationInterface,
    fleet_init_state,
)
from dotbot.protocol import PayloadCommandWheelVelocity  # type: ignore[import-not-found, unused-ignore]
from dotbot_utils.protocol import Frame, Header, Packet  # type: ignore[import-not-found, unused-ignore]

STEPS = 10
"""Of 10 ms between two commands."""
BEGIN = 100
"""Steps that are not counted."""


def rate(count: int, seconds: float) -> float:
    """Let robots drive.

    Args:
        count: How many.
        seconds: For how long, of simulated time.

    Returns:
        Simulated seconds in a second of processor time.
    """
    seed(1)
    side = max(2000, round(250 * count**0.5) + 250)
    said: list[object] = []
    area = Area(name="", x=0, y=0, w=side, h=side)
    robots = DotBotSimulatorCommunicationInterface(said.append, fleet_init_state(count, area=area))
    heads = [Header(destination=int(address, 16), source=int(GATEWAY_ADDRESS_DEFAULT, 16)) for address in robots.addresses]
    begun_at = [robot.pos_y for robot in robots.dotbots]
    used = 0.0
    for number in range(BEGIN + round(seconds * 100)):
        begun = process_time()
        if number % STEPS == 0:
            ahead = 150 if number // 200 % 2 == 0 else -150
            for head in heads:
                command = PayloadCommandWheelVelocity(left_mm_s=ahead, right_mm_s=ahead)
                robots.write(Frame(header=head, packet=Packet().from_payload(command)).to_bytes())
        robots.step()
        if number >= BEGIN:
            used += process_time() - begun
    if not said or any(robot.pos_y == before for robot, before in zip(robots.dotbots, begun_at, strict=True)):
        raise SystemExit("a robot has not moved, or none has said anything")
    return seconds / used


if __name__ == "__main__":
    for given in sys.argv[2:]:
        print(given, rate(int(given), float(sys.argv[1])), flush=True)
