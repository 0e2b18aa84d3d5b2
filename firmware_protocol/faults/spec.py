"""Faults as data: what goes wrong with a line or a robot, when, and for how long.

    FaultSpec                  everything that goes wrong in one run
     ├── drop=0.05, rate=...   faults of the line that are always there
     ├── LineSpell             a fault of the line for a while
     ├── Unplug                the line is cut for a while, or for good
     ├── Brownout              the robot loses its power, and boots again
     ├── StuckSensor           a sensor tells the same whatever happens
     ├── WeakWheel             a wheel gives a share of its effort; a dead one gives none
     └── LowBattery            the battery gives this voltage

A specification is written as text (`drop:0.05,stuck:eye_left@5+3`: an address or a command line holds it), as a table (a
TOML or JSON file), or made here; printed, it is text that reads back equal. Nothing here does anything:
`links/faulty.py` does it to frames, `simdevice` to emulated hardware. Times are counted from the opening of the link, of an
emulated robot from its first power-on; both in s.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import inf
from typing import TYPE_CHECKING

from firmware_protocol.faults.spells import (
    LINE_FAULTS,
    Brownout,
    LineSpell,
    LowBattery,
    Spell,
    StuckSensor,
    Unplug,
    WeakWheel,
    check_line,
    number_text,
)
from firmware_protocol.faults.text import read_table, read_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping


@dataclass(frozen=True)
class FaultSpec:
    """Everything that goes wrong. What befalls frames does so on each way, unless a link is given one for each.

    Attributes:
        drop: Share of frames lost, 0 to 1.
        corrupt: Share of frames in which one to three bits of the payload are flipped; on CAN, whose controllers check
            frames and drop the damaged ones, they are lost.
        corrupt_bytes: Share of frames in which one to three bytes, of head and checksum too, become others; likewise.
        duplicate: Share of frames that arrive twice.
        reorder: Share of frames that leave their place in the line: they come later by up to the jitter, or by up to 40 ms
            where there is none, and those behind pass them. All others keep their order, as on a wire.
        delay: Time every frame is late, in s.
        jitter: Further lateness, drawn for each frame uniformly from 0 to this, in s.
        rate: The line carries this many bytes a second; what would wait longer than 1 s is lost.
        frame_rate: The line carries this many frames a second; likewise.
        spells: Faults of the line for a while; the last one that goes on counts.
        unplugs: When the line is cut.
        brownouts: When the robot loses its power.
        stuck: Sensors that are stuck.
        wheels: Wheels that are weak or dead.
        batteries: What the battery gives.

    Raises:
        FaultSpecError: A share outside 0 to 1, a negative time, a rate that is not positive.
    """

    drop: float = 0.0
    corrupt: float = 0.0
    corrupt_bytes: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    rate: float = inf
    frame_rate: float = inf
    spells: tuple[LineSpell, ...] = ()
    unplugs: tuple[Unplug, ...] = ()
    brownouts: tuple[Brownout, ...] = ()
    stuck: tuple[StuckSensor, ...] = ()
    wheels: tuple[WeakWheel, ...] = ()
    batteries: tuple[LowBattery, ...] = ()

    def __post_init__(self) -> None:
        for name in LINE_FAULTS:
            check_line(name, getattr(self, name))

    @classmethod
    def parse(cls, text: str) -> FaultSpec:
        """Read a specification from an address or a command line: see `firmware_protocol.faults.text.read_text`."""
        return cls(**read_text(text))

    @classmethod
    def from_table(cls, table: Mapping[str, object]) -> FaultSpec:
        """Read a specification from a table: see `firmware_protocol.faults.text.read_table`."""
        return cls(**read_table(table))

    def __str__(self) -> str:
        """The specification as `parse` reads it."""
        items = []
        for line in fields(self)[: len(LINE_FAULTS)]:
            value = getattr(self, line.name)
            if value != line.default:
                items.append("reorder" if line.name == "reorder" and value == 1 else f"{line.name}:{number_text(value)}")
        return ",".join([*items, *map(str, self.all_spells())])

    @property
    def of_device(self) -> tuple[Spell, ...]:
        """What befalls the robot itself: only an emulated one can be told."""
        return (*self.brownouts, *self.stuck, *self.wheels, *self.batteries)

    def all_spells(self) -> Iterator[Spell]:
        """Everything with a time of its own, of line and robot."""
        yield from self.spells
        yield from self.unplugs
        yield from self.of_device

    def line_at(self, time: float) -> FaultSpec:
        """What befalls frames at a time, in s, with no spells any more."""
        now = {spell.fault: spell.value for spell in self.spells if spell.on(time)}
        return replace(self, spells=(), **now)  # type: ignore[arg-type]

    def line_changes(self) -> list[float]:
        """When `line_at` becomes another, in s, in order."""
        return sorted({time for spell in self.spells for time in (spell.at, spell.ends) if 0 < time < inf})

    def late(self) -> bool:
        """Some frames may be held up, now or in a spell."""
        lines = [self, *(self.line_at(spell.at) for spell in self.spells)]
        return any(line.delay or line.jitter or line.reorder or min(line.rate, line.frame_rate) < inf for line in lines)

    def timeline(self) -> list[tuple[float, str]]:
        """When what begins and ends, for a log: times in s, in order, with words."""
        told = []
        for spell in self.all_spells():
            told.append((spell.at, f"fault begins: {spell}"))
            if spell.ends < inf:
                told.append((spell.ends, f"fault ends: {spell}"))
        return sorted(told, key=lambda one: one[0])
