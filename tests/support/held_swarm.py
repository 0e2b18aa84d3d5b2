"""Connects a swarm to lines of scripted micro-robots."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.links.gathering import GatheringLink
from firmware_protocol.links.memory import MemoryLink
from hil.bridge.fleet_bridge import FleetBridge
from hil.bridge.networks import Networks
from hil.connecting.connecting_all import GATHER
from hil.swarm.connecting import open_fleet
from hil.swarm.handle import Swarm

if TYPE_CHECKING:
    from scripted_swarm import ScriptedSwarm


def connect(*worlds: ScriptedSwarm, expect: int | None = None, quorum: float = 0.5) -> Swarm:
    """A swarm of all robots of some lines."""
    networks = Networks()
    swarm = Swarm(networks, quorum=quorum)
    for number, world in enumerate(worlds, 1):
        numbers = iter(range(1000 * number, 60000))
        bridge = FleetBridge(
            GatheringLink(MemoryLink(world, f"memory:{number}", wire=world.wire), world, GATHER),
            world,
            fleet=open_fleet(None),
            session=numbers.__next__,
            arrived=networks.wake,
        )
        networks.add(f"memory:{number}", bridge)
    swarm.find(expect=sum(len(world.robots) for world in worlds) if expect is None else expect)
    return swarm
