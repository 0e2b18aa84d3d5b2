"""How fast an emulated bout runs: simulated seconds per wall second, and what each layer takes of it.

The floor is the same pymunk world stepped with nothing around it. Run it on an idle machine:

    python benchmarks/sumo_loop.py [--seconds 60] [--opponent flat-light] [--profile]

Each figure is the best of several rounds; layers are measured in one run, so that their ratios mean something.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
from time import perf_counter
from typing import TYPE_CHECKING

from firmware_protocol.messages import (
    Command,
    CommandLong,
    JuniorManeuver,
    RefereeReset,
    RobotAlive,
    RobotSession,
)
from firmware_protocol.vocabulary import Action
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.match import Match, opponent_code
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.wire.fields import Message

SESSION = 7
ALIVE_PERIODS = 8
"""Control periods between two ROBOT_ALIVE of the host."""
MANEUVER_PERIODS = 200
BOUT_PERIODS = 800
ACTIONS = (Action.FF, Action.MF, Action.LFRS, Action.LSRF)


def host_frames(codec: MavlinkCodec, steps: int, opponent: str) -> list[bytes]:
    """What a coaching host would say in each control period: keep-alive, a maneuver a second, a new bout every 4 s."""
    code = opponent_code(opponent)
    actions = tuple(int(action) for action in ACTIONS) + (0,) * 4
    frames = []
    sequence = 0
    for step in range(steps):
        messages: list[Message] = []
        if step % BOUT_PERIODS == 4:
            sequence += 1
            messages.append(RefereeReset(step, SESSION, sequence, 1, 25, code))
        if step % MANEUVER_PERIODS == 10:
            sequence += 1
            messages.append(JuniorManeuver(SESSION, sequence, 0.25, 5, 1, 1, len(ACTIONS), actions))
        if step % ALIVE_PERIODS == 0:
            messages.append(RobotAlive(7))
        frames.append(b"".join(map(codec.encode, messages)))
    frames[0] += codec.encode(RobotSession(SESSION, 0, 7, 1, 1, 2, 0))
    frames[1] += codec.encode(CommandLong(1, 1, Command.ARM_DISARM, param1=1.0, param3=7.0))
    return frames


def best(run: Callable[[], object], steps: int, rounds: int = 3) -> float:
    """Time of one step in us, the best of some rounds."""
    times = []
    for _ in range(rounds):
        start = perf_counter()
        run()
        times.append(perf_counter() - start)
    return min(times) / steps * 1e6


def measure(opponent: str, steps: int) -> dict[str, float]:
    """Time per control period of each layer, in us."""
    world = junior_world(WorldSettings(opponent=opponent))
    host = MavlinkCodec(system=255, component=190)
    frames = host_frames(host, steps, opponent)

    def everything() -> None:
        step, receive, now = world.step, host.receive, world.now
        for frame in frames:
            sent = step(frame)
            if sent:
                receive(sent, now())

    def undecoded() -> None:
        step = world.step
        for frame in frames:
            step(frame)

    match = Match(opponent)

    def bodies() -> None:
        for step in range(steps):
            if step % BOUT_PERIODS == 0:
                match.reset(step)
                match.robot.motors.command(700, 700)
            match.arena.step()

    def floor() -> None:
        for step in range(steps):
            if step % BOUT_PERIODS == 0:
                match.reset(step)
            match.arena.space.step(match.period)

    return {
        "World.step, and the host decoding all of it": best(everything, steps),
        "World.step": best(undecoded, steps),
        "bodies, motors, friction (Arena.step)": best(bodies, steps),
        "the same pymunk world, nothing around it": best(floor, steps),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0, help="simulated seconds a round")
    parser.add_argument("--opponent", default="flat-light")
    parser.add_argument("--profile", action="store_true", help="print where World.step spends its time")
    options = parser.parse_args()
    period = WorldSettings().period
    steps = round(options.seconds / period)
    figures = measure(options.opponent, steps)
    floor = figures["the same pymunk world, nothing around it"]
    print(f"{options.opponent}, {options.seconds:g} s of emulation a round, control period {period * 1e3:g} ms")
    for name, figure in figures.items():
        speed = period / figure * 1e6
        print(f"  {name:44s} {figure:7.2f} us a step  {speed:7.0f} x real time  {floor / figure:5.2f} of the floor")
    if options.profile:
        world = junior_world(WorldSettings(opponent=options.opponent))
        frames = host_frames(MavlinkCodec(system=255, component=190), steps, options.opponent)
        profile = cProfile.Profile()
        profile.runcall(lambda: [world.step(frame) for frame in frames])
        pstats.Stats(profile).sort_stats("tottime").print_stats(25)


if __name__ == "__main__":
    main()
