"""Two Juniors with a host each: kernel and Python world say the same on both networks at the same time."""

from __future__ import annotations

import random

from hypothesis import given, settings
from hypothesis import strategies as st
from opening import opening

from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    REFEREE_COMPONENT,
    ROBOT_COMPONENT,
    JuniorManeuver,
    ManeuverOption,
    OpponentCode,
    RefereeReset,
    RobotAlive,
)
from firmware_protocol.vocabulary import MAX_ACTIONS, Action
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN, MAVLINK
from simdevice.kernel.world import KernelWorld
from simdevice.sumo.settings import WorldSettings
from simdevice.sumo.world import World

HOST = 7


class Hosts:
    """The two hosts, who do whatever comes to their minds."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self.wire = self._random.choice([MAVLINK, MAVLINK, CAN])
        self._codecs = [open_codec(self.wire, system=HOST_SYSTEM, component=HOST_COMPONENT) for _ in range(2)]
        self._sequence = 0

    def say(self) -> list[bytes]:
        """What both say now."""
        return [self._say(network) if self._random.random() < 0.7 else b"" for network in range(2)]

    def _say(self, network: int) -> bytes:
        chance, system = self._random, network + 1
        self._sequence += 1
        robot = (system, ROBOT_COMPONENT)
        actions = tuple(int(chance.choice(list(Action))) for _ in range(3)) + (0,) * (MAX_ACTIONS - 3)
        opponent = chance.choice([OpponentCode.JUNIOR] * 3 + [OpponentCode.FLAT_LIGHT])
        message = chance.choice(
            [
                *opening(5, HOST, system),
                RobotAlive(HOST),
                JuniorManeuver(
                    5, self._sequence, 0.1, *robot, ManeuverOption.FLOOR_REFLEX, 3, actions,
                ),
                RefereeReset(chance.randrange(2**32), 5, self._sequence, system, REFEREE_COMPONENT, opponent),
            ]
        )  # fmt: skip
        return self._codecs[network].encode(message)


@settings(deadline=None, max_examples=20, derandomize=True)
@given(st.integers(0, 2**32))
def test_both_say_the_same_on_both_networks(seed: int) -> None:
    hosts = Hosts(seed)
    begins = WorldSettings(opponent="junior", seed=seed, wire=hosts.wire, hosted=True, vary=0.3 * (seed % 2))
    oracle, kernel = World(begins), KernelWorld(begins)
    ends = 0
    for _ in range(12):
        inbound, ends = hosts.say(), ends + 20
        heard: list[list[tuple[float, list[bytes]]]] = [[], []]
        for world, told in zip((oracle, kernel), heard, strict=True):
            waiting = inbound
            while (left := ends - round(world.now() / world.period)) > 0:
                said = world.run_networks(waiting, left if world is kernel else 1)
                waiting = [b"", b""]
                if any(said):
                    told.append((world.now(), said))
        assert heard[0] == heard[1]
