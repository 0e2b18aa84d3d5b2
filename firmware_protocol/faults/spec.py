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

from dataclasses import dataclass, field, fields, replace
from math import inf
from typing import TYPE_CHECKING, ClassVar, Final

from firmware_protocol.errors import FaultSpecError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

SENSORS: Final = ("eye_left", "eye_right", "floor_left", "floor_right", "arm_left", "arm_right")
"""Sensors that can be stuck."""
SIDES: Final = ("left", "right")
SHARES: Final = ("drop", "corrupt", "corrupt_bytes", "duplicate", "reorder")
"""Faults of the line that befall a share of the frames."""
TIMES: Final = ("delay", "jitter")
"""Faults of the line that are a time."""
RATES: Final = ("rate", "frame_rate")
"""Faults of the line that are a limit."""
LINE_FAULTS: Final = SHARES + TIMES + RATES
ADC_MAX: Final = 1023
MOST: Final = 1e9
"""Times, rates and voltages are less than this, so that they print without an exponent's plus sign."""


def number_text(value: float) -> str:
    """A number as short as it reads back equal."""
    return repr(float(value)).removesuffix(".0")


def _check_line(name: str, value: float) -> None:
    """See that a fault of the line can be.

    Raises:
        FaultSpecError: It can't.
    """
    if name in SHARES and not 0 <= value <= 1:
        raise FaultSpecError(f"fault {name!r} is a share of frames, 0 to 1, not {value:g}")
    if name in TIMES and not 0 <= value < MOST:
        raise FaultSpecError(f"fault {name!r} is a time in s, not {value:g}")
    if name in RATES and not value > 0:
        unit = "bytes" if name == "rate" else "frames"
        raise FaultSpecError(f"fault {name!r} is a positive number of {unit} per second, not {value:g}")


@dataclass(frozen=True, kw_only=True)
class Spell:
    """A time during which something is wrong.

    Attributes:
        at: When it begins, in s.
        lasts: How long it goes on, in s; infinite is to the end.

    Raises:
        FaultSpecError: A time is negative or no time.
    """

    at: float = 0.0
    lasts: float = inf
    kind: ClassVar[str] = ""
    """Its name in text and tables."""

    def __post_init__(self) -> None:
        for name in ("at", "lasts"):
            value = getattr(self, name)
            if not (0 <= value < MOST or (name == "lasts" and value == inf)):
                raise FaultSpecError(f"{name!r} of fault {self.kind!r} is a time in s, not {value:g}")

    @property
    def ends(self) -> float:
        """When it is over, in s; infinite is never."""
        return self.at + self.lasts

    def on(self, time: float) -> bool:
        """Whether it goes on at this time, in s."""
        return self.at <= time < self.ends

    def _span(self) -> str:
        """When, as text: nothing for always."""
        lasts = "" if self.lasts == inf else f"+{number_text(self.lasts)}"
        return f"@{number_text(self.at)}{lasts}" if lasts or self.at else ""


@dataclass(frozen=True)
class LineSpell(Spell):
    """A fault of the line for a while; meanwhile it stands in the place of the one that is always there.

    Attributes:
        fault: Which, of `LINE_FAULTS`.
        value: As of the field of `FaultSpec` of that name.
    """

    kind = "line"
    fault: str
    value: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.fault not in LINE_FAULTS:
            raise FaultSpecError(f"{self.fault!r} is no fault of a line: known are {', '.join(LINE_FAULTS)}")
        _check_line(self.fault, self.value)

    def __str__(self) -> str:
        value = "" if self.fault == "reorder" and self.value == 1 else f":{number_text(self.value)}"
        return f"{self.fault}{value}{self._span() or '@0'}"


@dataclass(frozen=True)
class Unplug(Spell):
    """The line is cut."""

    kind = "unplug"

    def __str__(self) -> str:
        return f"unplug:{self._span().removeprefix('@') or '0'}"


@dataclass(frozen=True)
class Brownout(Spell):
    """The robot loses its power for `lasts` s, and boots again: it forgets all but its EEPROM."""

    kind = "brownout"
    lasts: float = field(default=0.0, kw_only=True)

    def __str__(self) -> str:
        return f"brownout:{number_text(self.at)}" + (f"+{number_text(self.lasts)}" if self.lasts else "")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.lasts == inf:
            raise FaultSpecError("'lasts' of fault 'brownout' is a time in s: power that never returns is no brown-out")


@dataclass(frozen=True)
class StuckSensor(Spell):
    """A sensor tells the same, whatever happens.

    Attributes:
        sensor: Which, of `SENSORS`.
        value: What it tells: ADC counts, 0..1023; of an arm 1 pressed, 0 not. None is what it told last.
    """

    kind = "stuck"
    sensor: str
    value: int | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.sensor not in SENSORS:
            raise FaultSpecError(f"there is no sensor {self.sensor!r} to be stuck: known are {', '.join(SENSORS)}")
        most = 1 if self.sensor.startswith("arm") else ADC_MAX
        if self.value is not None and (not 0 <= self.value <= most or self.value != int(self.value)):
            raise FaultSpecError(f"sensor {self.sensor!r} is stuck at a whole number 0 to {most}, not {self.value:g}")

    def __str__(self) -> str:
        return f"stuck:{self.sensor}{'' if self.value is None else f':{self.value}'}{self._span()}"


@dataclass(frozen=True)
class WeakWheel(Spell):
    """A wheel gives a share of the effort it is asked for.

    Attributes:
        side: `left` or `right`.
        effort: The share; 0 is a dead wheel.
    """

    kind = "wheel"
    side: str
    effort: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.side not in SIDES:
            raise FaultSpecError(f"there is no wheel {self.side!r}: known are {', '.join(SIDES)}")
        if not 0 <= self.effort <= 1:
            raise FaultSpecError(f"a weak wheel gives a share of its effort, 0 to 1, not {self.effort:g}")

    def __str__(self) -> str:
        return f"wheel:{self.side}{f':{number_text(self.effort)}' if self.effort else ''}{self._span()}"


@dataclass(frozen=True)
class LowBattery(Spell):
    """The battery gives this voltage, less what the load takes.

    Attributes:
        voltage: Without load, in V.
    """

    kind = "battery"
    voltage: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.voltage <= 65:  # what 16 bits of millivolts hold
            raise FaultSpecError(f"a battery has a voltage in V, 0 to 65, not {self.voltage:g}")

    def __str__(self) -> str:
        return f"battery:{number_text(self.voltage)}{self._span()}"


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
            _check_line(name, getattr(self, name))

    @classmethod
    def parse(cls, text: str) -> FaultSpec:
        """Read a specification from an address or a command line: see `firmware_protocol.faults.text.parse_faults`."""
        from firmware_protocol.faults.text import parse_faults  # noqa: PLC0415 - which needs this module

        return parse_faults(text)

    @classmethod
    def from_table(cls, table: Mapping[str, object]) -> FaultSpec:
        """Read a specification from a table: see `firmware_protocol.faults.text.faults_from_table`."""
        from firmware_protocol.faults.text import faults_from_table  # noqa: PLC0415

        return faults_from_table(table)

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
