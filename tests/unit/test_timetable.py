"""Who is due next: as if everybody were asked."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import pytest
from scripted_crowd import ScriptedCrowd

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import JuniorSensors, RobotStatus
from firmware_protocol.peer.timetable import NEVER, NOW, Timetable
from firmware_protocol.roles.junior import drive
from hil.bridge.bridge import Bridge

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.peer.peer import Peer


def test_the_soonest_is_that_of_all_whatever_is_planned_and_whoever_leaves() -> None:
    rng, table, model = random.Random(3), Timetable(), dict[int, float]()
    order: list[int] = []
    for _ in range(5000):
        system = rng.randrange(1, 12)
        match rng.randrange(12):
            case 0 if system not in model:
                table.enter(system)
                order.append(system)
                model[system] = NEVER
            case 1 if rng.random() < 0.3 and system in model:
                table.leave(system)
                order.remove(system)
                del model[system]
            case 2:
                now = rng.uniform(-1, 10)
                assert table.take(now) == [one for one in order if model[one] <= now]
                model = {one: NEVER if due <= now else due for one, due in model.items()}
            case _:
                due = rng.choice((NOW, NEVER, 1.0, 2.0, rng.uniform(0, 10)))
                table.plan(system, due)
                if system in model:
                    model[system] = due
        assert table.soonest == min(model.values(), default=NEVER)


def test_what_is_planned_again_and_again_does_not_pile_up() -> None:
    table = Timetable()
    table.enter(1)
    table.enter(2)
    table.plan(1, 5.0)
    for number in range(10_000):
        table.plan(2, 6.0 + number)
        table.plan(1, NOW)
        table.plan(1, 5.0)
    assert len(table._heap) < 100
    assert table.soonest == 5.0


def test_only_who_takes_part_is_kept_moving() -> None:
    table = Timetable()
    table.keep(1, moving=True)
    assert not table.kept
    table.enter(1)
    table.keep(1, moving=True)
    assert table.kept == {1}
    table.keep(1, moving=False)
    assert not table.kept
    table.keep(1, moving=True)
    table.leave(1)
    assert not table.kept


ORDERS: tuple[Callable[[Peer, Bridge], object], ...] = (
    lambda peer, _: peer.arm(),
    lambda peer, _: peer.disarm(),
    lambda peer, _: peer.emergency_stop(),
    lambda peer, _: drive(peer, 0.1, 0.2, 0.3),
    lambda peer, _: drive(peer, 0.0, 0.0, 0.0),
    lambda peer, _: peer.request(RobotStatus),
    lambda peer, _: peer.message_interval(JuniorSensors, 0.1),
    lambda peer, _: peer.list_parameters(),
    lambda peer, _: peer.reboot(),
    lambda peer, bridge: peer.take(bridge.now),
    lambda peer, bridge: (peer.unplugged(LinkClosedError("memory:", "gone"), bridge.now), peer.plugged_in(bridge.now)),
)


@pytest.mark.parametrize("ours", [False, True])
def test_a_bridge_is_due_when_the_first_of_its_robots_is(*, ours: bool) -> None:
    rng, crowd = random.Random(5), ScriptedCrowd.of(range(1, 6))
    bridge = Bridge(MemoryLink(crowd), crowd, open_sessions=ours, session=lambda: 77)
    armed = 0

    def check() -> None:
        nonlocal armed
        if bridge.peers:
            kept = any(peer.kept for peer in bridge.peers.values())
            soonest = min(peer.next_due() for peer in bridge.peers.values())
            assert bridge.next_due() == (min(soonest, bridge._alive_due) if kept else soonest)
            assert bridge.urgent == any(peer.urgent for peer in bridge.peers.values())
            armed += kept

    for turn in range(1500):
        bridge.step(0.05)
        check()
        if bridge.peers and rng.random() < 0.3:
            rng.choice(ORDERS)(rng.choice(list(bridge.peers.values())), bridge)
            check()
        if turn == 1200:
            bridge.keep([2, 3])
            check()
        if turn % 400 == 300:
            crowd.robots[rng.randrange(1, 6)].silent = rng.random() < 0.7
    assert set(bridge.peers) == {2, 3}
    assert armed > 100
