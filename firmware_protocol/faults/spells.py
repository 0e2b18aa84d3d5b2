"""What can go wrong with a line or a robot, each for a while or for good."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from typing import ClassVar, Final

from firmware_protocol.errors import FaultSpecError

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
    """A number as text, as short as it reads back equal.

    Args:
        value: The number.
    """
    return repr(float(value)).removesuffix(".0")


def check_line(name: str, value: float) -> None:
    """See that a fault of the line can be.

    Args:
        name: Which, of `LINE_FAULTS`.
        value: A share, a time in s, or a limit in bytes or frames a second.

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
        check_line(self.fault, self.value)

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
