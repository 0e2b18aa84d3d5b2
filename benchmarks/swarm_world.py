"""How fast emulated micro-robots live with their firmware, without a host: real-time factor, and where the time goes.

    python benchmarks/swarm_world.py [--counts 1 20 33 100 500 1000] [--seconds 20] [--period 5] [--wire mavlink]

Two loads, both with the ring read before and after each move and default noise: *moves* is one move of 80 mm after the other,
begun every 0.8 s, as in a mission; *short* ten moves of 15 mm a second. Frames to the robots are made before the clock starts.
*table* is bodies and sensors alone (`benchmarks/swarm_table.py` has more on it), *wire* what it takes to cut frames and hand
them out; the rest is the firmware, its rings, and what it sends.
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from time import process_time
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    PROTOCOL_MAJOR,
    PROTOCOL_MINOR,
    ROBOT_COMPONENT,
    Command,
    CommandLong,
    RobotAlive,
    RobotSession,
    SwarmMove,
    SwarmObservation,
)
from firmware_protocol.vocabulary import MoveOption
from firmware_protocol.wire.codec import open_codec
from simdevice.swarm.settings import MOST_ROBOTS, SwarmSettings
from simdevice.swarm.table import SwarmTable
from simdevice.swarm.world import SwarmWorld

if TYPE_CHECKING:
    from collections.abc import Callable

HOST: Final = 42
SESSION: Final = 7
ALIVE: Final = 0.08
"""Between two ROBOT_ALIVE, in s."""
LOADS: Final = {"idle": (0.0, 0.0), "moves": (0.8, 0.08), "short": (0.1, 0.015)}
"""Time between two moves in s, and their length in m."""
BEGIN: Final = 1.5
"""When all have booted, in s."""


class Load:
    """What a host would say to everybody, made beforehand.

    Args:
        settings: Who is there.
        every: Time between two moves, in s; 0: there is none.
        distance: Their length, in m.
        seconds: For how long.
    """

    def __init__(self, settings: SwarmSettings, every: float, distance: float, seconds: float) -> None:
        self._codecs = [
            open_codec(settings.wire, system=HOST_SYSTEM, component=HOST_COMPONENT) for _ in range(settings.networks)
        ]
        self._settings = settings
        self._random = np.random.default_rng(1)
        self.opening = self._each(self._open)
        self.said: dict[int, list[bytes]] = {}
        alive = RobotAlive(HOST, 0, 0)
        for number in range(round(seconds / ALIVE)):
            at = round(number * ALIVE / settings.period)
            self._add(at, [codec.encode(alive) for codec in self._codecs])
        for number in range(round(seconds / every) if every else 0):
            at = round(number * every / settings.period)
            self._add(at, self._round(number + 1, distance))

    def _add(self, at: int, data: list[bytes]) -> None:
        before = self.said.get(at, [b""] * len(data))
        self.said[at] = [one + more for one, more in zip(before, data, strict=True)]

    def _each(self, say: Callable[[int, int], bytes]) -> list[bytes]:
        settings = self._settings
        places = [divmod(row, settings.per) for row in range(settings.count)]
        return [
            b"".join([say(network, number + 1) for network, number in places if network == wanted])
            for wanted in range(settings.networks)
        ]

    def _open(self, network: int, system: int) -> bytes:
        session = RobotSession(SESSION, 0, HOST, system, ROBOT_COMPONENT, PROTOCOL_MAJOR, PROTOCOL_MINOR)
        arm = CommandLong(system, ROBOT_COMPONENT, Command.ARM_DISARM, param1=1.0, param3=float(HOST))
        return self._codecs[network].encode(session) + self._codecs[network].encode(arm)

    def _round(self, number: int, distance: float) -> list[bytes]:
        ask = CommandLong(
            0,
            ROBOT_COMPONENT,
            Command.REQUEST_MESSAGE,
            param1=float(SwarmObservation.ID),
            param2=float(number),
            param3=float(HOST),
        )
        options = MoveOption.STOP_ON_CONTACT | MoveOption.SENSE
        heading = number * np.pi / 2 % np.pi if distance > 0.05 else 0.0

        def move(network: int, system: int) -> bytes:
            wanted = SwarmMove(SESSION, number, heading, distance, None, 0.0, system, ROBOT_COMPONENT, 0, 0, 0, options)
            return self._codecs[network].encode(wanted)

        asked = [codec.encode(ask) for codec in self._codecs]
        return [one + more for one, more in zip(asked, self._each(move), strict=True)]


def lived(settings: SwarmSettings, load: Load, seconds: float) -> tuple[float, float, int]:
    """Let a swarm live.

    Returns:
        Time that took, of it what cutting and handing out took, in s, and how many bytes were said.
    """
    world = SwarmWorld(settings)
    nothing = [b""] * settings.networks
    while world.now() < BEGIN:
        world.run_networks(nothing, 1000)
    world.run_networks(load.opening, 1)
    wire = [0.0]
    for hub in world._hubs:  # noqa: SLF001 - it is measured
        setattr(hub, "take", _timed(hub.take, wire))  # noqa: B010 - for this run alone
    ticks, at, said = round(seconds / settings.period), 0, 0
    due = [*sorted(load.said), ticks]
    begin = process_time()
    for here, then in pairwise(due):
        data = load.said[here]
        while at < then:
            before = world.now()
            said += sum(map(len, world.run_networks(data, then - at)))
            at += round((world.now() - before) / settings.period)
            data = nothing
    return process_time() - begin, wire[0], said


def _timed(call: Callable[[bytes, int], bytes], spent: list[float]) -> Callable[[bytes, int], bytes]:
    def timed(data: bytes, ticks: int) -> bytes:
        begin = process_time()
        found = call(data, ticks)
        spent[0] += process_time() - begin
        return found

    return timed


def table_alone(settings: SwarmSettings, seconds: float) -> float:
    """Time that bodies and sensors take without firmware, in s: half of the time everybody drives."""
    table = SwarmTable([0] * settings.count, period=settings.period)
    table.reset(1)
    spent = 0.0
    for number in range(round(seconds / 0.4)):
        table.arrays.command[:] = 0.2 * (-1) ** (number // 2) if number % 2 else 0.0
        begin = process_time()
        table.run(round(0.4 / settings.period))
        spent += process_time() - begin
    return spent


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--counts", type=int, nargs="+", default=[1, 20, 33, 100, 500, 1000])
    parser.add_argument("--seconds", type=float, default=20.0, help="of robot time")
    parser.add_argument("--period", type=int, choices=(5, 10), default=5, help="ms")
    parser.add_argument("--wire", choices=tuple(MOST_ROBOTS), default="mavlink")
    parser.add_argument("--rounds", type=int, default=3, help="of which the fastest counts")
    given = parser.parse_args()
    print("robots   load  real time  us/robot, period:  table   wire   rest  kB/s up")
    for count in given.counts:
        settings = SwarmSettings(
            rangers=count - count // 4,
            wilds=count // 4,
            networks=-(-count // MOST_ROBOTS[given.wire]),
            wire=given.wire,
            period=given.period / 1000,
        )
        alone = min(table_alone(settings, given.seconds) for _ in range(given.rounds))
        per = given.seconds / settings.period * count * 1e-6
        for name, (every, distance) in LOADS.items():
            load = Load(settings, every, distance, given.seconds)
            total, wire, said = min(lived(settings, load, given.seconds) for _ in range(given.rounds))
            rest = total - alone - wire
            print(
                f"{count:6} {name:>6} {given.seconds / total:10.1f} {total / per:18.3f} {alone / per:6.3f} {wire / per:6.3f} "
                f"{rest / per:6.3f} {said / given.seconds / 1000:8.1f}"
            )


if __name__ == "__main__":
    main()
