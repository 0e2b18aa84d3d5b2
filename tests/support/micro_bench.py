"""A micro-robot's firmware on a bench: wheels that roll without slip, contacts and neighbours by hand."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypedDict, Unpack

import numpy as np
from firmware_bench import BLANK, TICK, FirmwareBench

from firmware_protocol.messages import (
    Command,
    CommandLong,
    ParamSet,
    Reason,
    RobotResultAck,
    SwarmFix,
    SwarmMove,
    SwarmObservation,
    SwarmSense,
)
from firmware_protocol.vocabulary import MoveOption
from simdevice._host import ffi, lib

if TYPE_CHECKING:
    from collections.abc import Iterable

    from firmware_protocol.wire.fields import Message

TURN: Final = 65536
TRACK: Final = 0.03
FULL_SPEED: Final = 0.4
LAG: Final = 0.03
"""Of the wheels that the bench turns: m, m/s, s."""
SENSE: Final = int(MoveOption.SENSE)


class MoveFields(TypedDict, total=False):
    """Fields of SWARM_MOVE that have a value of their own."""

    face: float | None
    speed: float
    sector: int
    sectors: int
    effort: int
    options: int
    sequence: int


@dataclass(frozen=True)
class Other:
    """A robot that the ring finds: class, bearing from the nose (rad), distance (m)."""

    group: int
    bearing: float
    distance: float


class MicroBench(FirmwareBench):
    """One micro-robot on a table of its own.

    Attributes:
        x: Where it is, in m.
        y: Likewise.
        angle: Its heading, in rad.
        own_fix: It finds its position itself, and how often, in ms; 0: it does not.
        others: Whom its ring finds.
        held: The wheels stand, whatever they are commanded.
        readings: How often its ring has been read.
    """

    STREAMS = ("Heartbeat", "SysStatus", "RobotStatus")

    def __init__(self, nvm: bytes = BLANK, *, own_fix: int = 50, ring: bool = True) -> None:
        self.x = self.y = self.angle = 0.0
        self.own_fix = own_fix
        self.ring = ring
        self.others: list[Other] = []
        self.held = False
        self.readings = 0
        self._rim = np.zeros(2)
        self._travel = np.zeros(2)
        self._seen: tuple[Any, ...] = ()
        super().__init__(nvm)

    def power_on(self, nvm: bytes | None = None) -> None:
        """Cut the power and give it back."""
        self.io.role = 2
        self.io.has_pose = self.own_fix > 0
        self.io.has_ring = self.ring
        self.io.ready = 1
        super().power_on(nvm)

    def tick(self, *messages: Message, raw: bytes = b"") -> list[Message]:
        """One control period: wheels turn as they were commanded, then the firmware runs."""
        self._roll()
        if self.own_fix and self.now % self.own_fix == 0:
            self.io.fix_um = [round(self.x * 1e6), round(self.y * 1e6)]
            self.io.fix_heading = round(self.angle / math.tau * TURN) % TURN
            self.io.fix_age = 0
            self.io.fix_new = 1
        self._look()
        return super().tick(*messages, raw=raw)

    def _roll(self) -> None:
        command = np.array(self.wheels) / 1000 * FULL_SPEED
        self._rim = np.zeros(2) if self.held else self._rim + (command - self._rim) * TICK / 1000 / LAG
        self._travel += self._rim * TICK / 1000
        self.io.travel_um = [int(way * 1e6) for way in self._travel]
        forward, turn = self._rim.mean(), (self._rim[1] - self._rim[0]) / TRACK
        middle = self.angle + turn * TICK / 2000
        self.x += forward * math.cos(middle) * TICK / 1000
        self.y += forward * math.sin(middle) * TICK / 1000
        self.angle = math.remainder(self.angle + turn * TICK / 1000, math.tau)

    def _look(self) -> None:
        if self.io.asked and self.io.ready:
            self.readings += 1
        groups = ffi.new("uint8_t[]", [other.group for other in self.others])
        bearings = ffi.new("uint16_t[]", [math.floor(other.bearing / math.tau * TURN) % TURN for other in self.others])
        distances = ffi.new("uint32_t[]", [round(other.distance * 1e6) for other in self.others])
        self._seen = (groups, bearings, distances)
        lib.host_see(self.robot, len(self.others), *self._seen)

    # --- what a host says -------------------------------------------------------------------------------------------

    def move_message(self, heading: float | None = None, distance: float = 0.0, **fields: Unpack[MoveFields]) -> SwarmMove:
        """A move; what is not named is as SWARM_MOVE has it where there is none, and the ring is read."""
        return SwarmMove(
            session=self.session,
            sequence=fields["sequence"] if "sequence" in fields else self.next(),
            heading=heading,
            distance=distance,
            face=fields.get("face"),
            speed=fields.get("speed", 0.0),
            target_system=1,
            target_component=1,
            sector=fields.get("sector", 0),
            sectors=fields.get("sectors", 0),
            effort=fields.get("effort", 0),
            options=int(fields.get("options", SENSE)),
        )

    def move(self, heading: float | None = None, distance: float = 0.0, **fields: Unpack[MoveFields]) -> None:
        """Begin a move, which is accepted."""
        assert self.ask(self.move_message(heading, distance, **fields)) is Reason.NONE

    def sense_message(
        self, radius: float = 0.2, increment: float = 0.05, limit: float = 65.535, *, sectors: int = 8, ranges: int = 0
    ) -> SwarmSense:
        """How the ring is to be read."""
        return SwarmSense(self.session, self.next(), radius, increment, limit, 1, 1, sectors, ranges)

    def fix_message(self, x: float, y: float, heading: float, age: float = 0.0, *, session: int | None = None) -> SwarmFix:
        """Where it is, by a camera."""
        return SwarmFix(self.session if session is None else session, (x, y), heading, age, 1, 1)

    def request(self, message: type[Message], count: int, host: int = 0, *, system: int = 1) -> list[Message]:
        """Ask for an observation or ranges; returns what comes back in this period."""
        asking = CommandLong(
            target_system=system, target_component=1, command=int(Command.REQUEST_MESSAGE),
            param1=message.ID, param2=count, param3=host,
        )  # fmt: skip
        return self.tick(asking)

    def acknowledge(self, observation: SwarmObservation) -> list[Message]:
        """Say that an observation has come."""
        return self.tick(
            RobotResultAck(session=observation.session, sequence=observation.sequence, target_system=1, target_component=1)
        )

    def set(self, **values: float) -> None:
        """Set parameters."""
        self.tick(*(ParamSet(1, 1, name, value) for name, value in values.items()))

    def finish(self, longest: int = 5000) -> SwarmObservation:
        """Let time pass until the move is over; returns its observation."""
        self.clear()
        for _ in range(longest // TICK):
            self.run(TICK)
            if found := [o for o in self.got(SwarmObservation) if o.outcome]:
                return found[-1]
        raise AssertionError("it never ends")

    def observations(self) -> Iterable[SwarmObservation]:
        """What has come of them."""
        return self.got(SwarmObservation)

    def armed(self) -> MicroBench:
        """Open a session and arm."""
        super().armed()
        return self
