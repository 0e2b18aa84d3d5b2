"""A swarm's run in a log: an entry for each message, and the same run again from it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from scripted_swarm import ScriptedSwarm, swarm_of

from firmware_protocol.links.gathering import GatheringLink
from firmware_protocol.links.memory import MemoryLink
from hil.bridge.pump import open_pump
from hil.connecting.connecting_all import GATHER
from hil.mcaplog.reading.reader import LogReader
from hil.recording.process import RecorderProcess
from hil.recording.recorder import Recorder
from hil.swarm.connecting import connect_swarm
from hil.swarm.rounds import Round, SwarmMoves

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from firmware_protocol.address import Address
    from firmware_protocol.faults.spec import FaultSpec
    from firmware_protocol.link import Link
    from hil.bridge.operator import Operator
    from hil.bridge.pump import Pump
    from hil.bridge.reopening import Reopening
    from hil.bridge.taps import Tap
    from hil.connecting.connecting import NetworkOpener
    from hil.swarm.handle import Swarm


class ScriptedOpener:
    """Opens the line of a scripted swarm."""

    def __init__(self, world: ScriptedSwarm, url: str, number: int) -> None:
        self.faults: FaultSpec | None = None
        self.clock = world
        self._numbers = iter(range(1000 * number, 60000))
        self._world = world
        self._url = url

    @property
    def session(self) -> Callable[[], int]:
        return self._numbers.__next__

    def open(self) -> Link:
        return GatheringLink(MemoryLink(self._world, self._url, wire=self._world.wire), self._world, GATHER)

    def let_pass(self, duration: float) -> None:
        for _ in range(round(duration / 0.005)):
            self._world.step(b"")

    def pump(self, link: Link, reopening: Reopening | None, arrived: Callable[[], None] | None, operator: Operator) -> Pump:
        del operator
        return open_pump(link, self.clock, reopening, arrived)

    def signing_time(self) -> int:
        return 0


def mission(swarm: Swarm) -> list[Round]:
    """A few rounds."""
    swarm.arm()
    swarm.sense(radius=0.3)
    rounds = []
    for step in range(2):
        rounds.append(swarm.observe())
        moving = np.arange(len(swarm.there)) % 2 == step % 2
        rounds.append(swarm.move(SwarmMoves(moving, 0.04, heading=0.3 * step)))
    return rounds


def connect(worlds: dict[str, ScriptedSwarm], taps: list[Tap]) -> Swarm:
    """A swarm of scripted lines, by their addresses."""
    openers = {url: ScriptedOpener(world, url, number) for number, (url, world) in enumerate(worlds.items(), 1)}

    def opener_of(address: Address) -> NetworkOpener:
        return openers[address.url]

    expect = sum(len(world.robots) for world in worlds.values())
    return connect_swarm(*worlds, expect=expect, taps=taps, opener_of=opener_of)


def recorded(path: Path, kind: type[Recorder], worlds: dict[str, ScriptedSwarm]) -> list[Round]:
    """A mission, in a log."""
    with (
        kind(path, run={}, config={}, link=next(iter(worlds)), lockstep=True) as recorder,
        connect(worlds, [recorder]) as swarm,
    ):
        rounds = mission(swarm)
        for number, one in enumerate(rounds):
            recorder.round(one, swarm.labels, "move" if number % 2 else "observe", number // 2)
    return rounds


def lines() -> dict[str, ScriptedSwarm]:
    """Two networks, one of them with so many robots that they are heard as arrays."""
    return {"memory://one": swarm_of(50, 15), "memory://two": swarm_of(3)}


@pytest.mark.slow
@pytest.mark.parametrize("kind", [Recorder, RecorderProcess])
def test_every_message_is_an_entry_and_the_run_is_repeated_from_the_log(kind: type[Recorder], tmp_path: Path) -> None:
    path = tmp_path / "swarm.mcap"
    rounds = recorded(path, kind, lines())
    topics: dict[str, int] = {}
    for entry in LogReader(path).entries():
        topics[entry.topic] = topics.get(entry.topic, 0) + 1
    assert topics["/swarm/round"] == 4
    assert topics["/swarm/move"] == sum(int(one.asked.sum()) for one in rounds[1::2])
    assert topics["/swarm/observation"] == 68 * 2 + topics["/swarm/move"]
    with connect_swarm(f"replay://{path}", expect=68) as swarm:
        again = mission(swarm)
    for one, other in zip(rounds, again, strict=True):
        assert (one.reports == other.reports).all()
        assert one.seconds == other.seconds


@pytest.mark.slow
def test_both_recorders_write_the_same_log(tmp_path: Path) -> None:
    one, other = tmp_path / "one.mcap", tmp_path / "other.mcap"
    recorded(one, Recorder, lines())
    recorded(other, RecorderProcess, lines())
    assert one.read_bytes() == other.read_bytes()
