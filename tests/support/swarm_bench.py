"""A host's end of emulated micro-robots: says things on their networks, and keeps what is answered."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeVar

from opening import opening

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    ROBOT_COMPONENT,
    TABLE_COMPONENT,
    BoxShape,
    RobotAlive,
    SwarmMove,
    TableKind,
    TablePlace,
    TableReset,
)
from firmware_protocol.roles.swarm_table import table_system
from firmware_protocol.vocabulary import MoveOption
from firmware_protocol.wire.codec import open_codec
from simdevice.swarm.settings import SwarmSettings
from simdevice.swarm.world import SwarmWorld

if TYPE_CHECKING:
    from collections.abc import Mapping

    from firmware_protocol.wire.fields import Message

M = TypeVar("M", bound="Message")

HOST: Final = 42
SESSION: Final = 77
BOOTED: Final = 1.1
"""When all have booted, in s."""


class SwarmBench:
    """Robots on a table, and their host.

    Args:
        **settings: As of `SwarmSettings`.

    Attributes:
        world: They.
        heard: What came, with the network it came on, from 0.
        said: Every byte that came, by network.
        times: When each of `heard` came, in s.
    """

    def __init__(self, **settings: object) -> None:
        self.world = SwarmWorld(SwarmSettings(**settings))  # type: ignore[arg-type] # a test's own
        self.wire = self.world.wire
        self.codecs = [open_codec(self.wire, system=HOST_SYSTEM, component=HOST_COMPONENT) for _ in range(self.world.networks)]
        self.heard: list[tuple[int, Received]] = []
        self.said = [b""] * self.world.networks
        self.table = table_system(self.wire)

    def live(self, seconds: float, data: Mapping[int, bytes] | bytes = b"") -> None:
        """Let so much time pass; data comes in first, on the first network or by network."""
        world = self.world
        by_network = {0: data} if isinstance(data, bytes) else data
        inbound = [by_network.get(network, b"") for network in range(world.networks)]
        end = world.now() + seconds - 1e-9
        while world.now() < end:
            said = world.run_networks(inbound, max(1, round((end - world.now()) / world.period)))
            for network, words in enumerate(said):
                self.said[network] += words
                for event in self.codecs[network].receive(words, world.now()):
                    assert isinstance(event, Received), event
                    self.heard.append((network, event))
            inbound = [b""] * world.networks

    def encode(self, *messages: Message, network: int = 0) -> bytes:
        """What goes over the wire."""
        return b"".join(map(self.codecs[network].encode, messages))

    def say(self, *messages: Message, network: int = 0, seconds: float = 0.02) -> None:
        """Say something, and forget what came before."""
        self.heard.clear()
        self.live(seconds, {network: self.encode(*messages, network=network)})

    def of(self, kind: type[M], system: int | None = None, network: int | None = None) -> list[M]:
        """What came of a kind, from a system, on a network."""
        return [
            event.message
            for number, event in self.heard
            if isinstance(event.message, kind) and system in {None, event.system} and network in {None, number}
        ]

    def open(self) -> None:
        """Open a session with every robot, and arm it."""
        settings = self.world.settings
        for row in range(settings.count):
            network, number = divmod(row, settings.per)
            self.say(*opening(SESSION, HOST, number + 1), network=network, seconds=0.03)

    def keep(self, seconds: float) -> None:
        """Let time pass, and keep all robots alive meanwhile."""
        end = self.world.now() + seconds - 1e-9
        while self.world.now() < end:
            data = {network: self.encode(RobotAlive(HOST, 0, 0), network=network) for network in range(self.world.networks)}
            self.live(min(0.1, end - self.world.now()), data)

    def reset(self, sequence: int, **wanted: object) -> TableReset:
        """A TABLE_RESET."""
        values = {
            "seed": 1,
            "session": SESSION,
            "sequence": sequence,
            "size": (2.0, 2.0),
            "target_system": self.table,
            "target_component": TABLE_COMPONENT,
            "wall": 0,
            "kind": TableKind.PLAIN,
            "box": BoxShape.NONE,
            "map": 0,
        }
        return TableReset(**{**values, **wanted})  # type: ignore[arg-type] # likewise

    def place(self, sequence: int, system: int, x: float, y: float, heading: float = 0.0) -> TablePlace:
        """A TABLE_PLACE."""
        return TablePlace(SESSION, sequence, (x, y), heading, self.table, TABLE_COMPONENT, system)

    def move(self, sequence: int, system: int, heading: float, distance: float) -> SwarmMove:
        """A SWARM_MOVE, with the ring read in the end."""
        options = MoveOption.STOP_ON_CONTACT | MoveOption.SENSE
        return SwarmMove(SESSION, sequence, heading, distance, None, 0.0, system, ROBOT_COMPONENT, 0, 0, 0, options)
