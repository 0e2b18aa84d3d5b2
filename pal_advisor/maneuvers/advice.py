"""What Pal hands out when it is done: the best maneuver for every situation, as plain values and back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.vocabulary import ANY_STIMULUS, MAX_ACTIONS, Action, Maneuver, Stimulus
from pal_advisor.maneuvers.settings import Objective, PalSettings, SettingsError

if TYPE_CHECKING:
    from collections.abc import Mapping

ADVICE_VERSION: Final = 1
ANY: Final = "any"
"""In a file, "whatever the previous stimulus was"."""
EYES: Final = 3
"""The bits of a stimulus that are eyes."""


class AdviceError(ValueError):
    """An advice has a field that is missing or wrong.

    Attributes:
        path: Which field, as `entries[3].actions[1]`.
    """

    def __init__(self, path: str, message: str) -> None:
        super().__init__(f"{path}: {message}")
        self.path = path


@dataclass(frozen=True)
class AdviceEntry:
    """The maneuver for one situation.

    Attributes:
        previous: Previous stimulus as a wire code, or ANY_STIMULUS.
        current: Current stimulus as a wire code.
        actions: The maneuver's actions.
        fitness: Its mean fitness.
        evaluations: How often it was performed.
        phase: Phase in which it arose.
        parents: Maneuvers it descends from, as action names with spaces between.
        names: What it is called, where it meets a criterion.
    """

    previous: int
    current: int
    actions: tuple[Action, ...]
    fitness: float
    evaluations: int
    phase: int = 1
    parents: tuple[str, ...] = ()
    names: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """The entry as plain values."""
        return {
            "previous": _label(self.previous),
            "current": _label(self.current),
            "actions": [action.name for action in self.actions],
            "fitness": self.fitness,
            "evaluations": self.evaluations,
            "phase": self.phase,
            "parents": list(self.parents),
            "names": list(self.names),
        }


@dataclass(frozen=True)
class Advice:
    """The best maneuver for every situation that came up.

    Attributes:
        settings: How it was learnt; period and options of the maneuvers come from here.
        entries: One per situation.
        opponent: Against whom.
        seed: Seed of the coaching; None where it is not known.
    """

    settings: PalSettings
    entries: tuple[AdviceEntry, ...]
    opponent: str = ""
    seed: int | None = None

    @property
    def objective(self) -> Objective:
        """What a good maneuver was taken to be."""
        return self.settings.objective

    def maneuver(self, entry: AdviceEntry) -> Maneuver:
        """An entry as a maneuver that a robot can be given."""
        return make_maneuver(entry.actions, self.settings)

    def find(self, current: int, previous: int | None = None) -> AdviceEntry:
        """The entry that fits a situation best.

        In this order: the very pair; this current stimulus after any; this current stimulus with the most evaluations;
        the same for what the eyes see, arms left aside; the entry with the most evaluations.

        Args:
            current: Current stimulus.
            previous: Previous stimulus; None where there was none.

        Raises:
            LookupError: The advice has no entry at all.
        """
        for stimulus in (current, current & EYES):
            here = [entry for entry in self.entries if entry.current == stimulus]
            for wanted in (previous, ANY_STIMULUS):
                for entry in here:
                    if entry.previous == wanted:
                        return entry
            if here:
                return max(here, key=lambda entry: entry.evaluations)
        if not self.entries:
            raise LookupError("this advice has no entry")
        return max(self.entries, key=lambda entry: entry.evaluations)

    def choose(self, current: int, previous: int | None = None) -> Maneuver:
        """The maneuver for a situation; see `find`."""
        return self.maneuver(self.find(current, previous))

    def to_dict(self) -> dict[str, Any]:
        """The advice as plain values."""
        data: dict[str, Any] = {"version": ADVICE_VERSION, "objective": self.objective.value, "opponent": self.opponent}
        if self.seed is not None:
            data["seed"] = self.seed
        return {**data, "settings": self.settings.to_dict(), "entries": [entry.to_dict() for entry in self.entries]}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Advice:
        """The inverse of `to_dict`.

        Raises:
            AdviceError: A field is missing, unknown or wrong; its `path` says which.
        """
        reader = _Reader(data, "")
        version = reader.take("version", int)
        if version != ADVICE_VERSION:
            raise AdviceError("version", f"{version} is not known; this program reads {ADVICE_VERSION}")
        settings = _settings(reader.take("settings", dict))
        objective = reader.take("objective", str)
        if objective != settings.objective:
            raise AdviceError("objective", f"{objective!r} differs from settings.objective, {settings.objective.value!r}")
        opponent = reader.take("opponent", str, "")
        seed = reader.take("seed", int, -1)
        raw = reader.take("entries", list)
        reader.done()
        entries = tuple(_entry(item, f"entries[{index}]") for index, item in enumerate(raw))
        if not entries:
            raise AdviceError("entries", "there is none")
        seen: set[tuple[int, int]] = set()
        for index, entry in enumerate(entries):
            if (entry.previous, entry.current) in seen:
                raise AdviceError(f"entries[{index}]", f"a second entry for {_label(entry.previous)}, {_label(entry.current)}")
            seen.add((entry.previous, entry.current))
        return cls(settings, entries, opponent, None if seed < 0 else seed)


def make_maneuver(actions: tuple[Action, ...], settings: PalSettings) -> Maneuver:
    """Actions with the period and the options of the settings."""
    return Maneuver(
        actions,
        period=settings.period,
        floor_reflex=settings.floor_reflex,
        end_on_change=settings.end_on_change,
        arms=settings.arms_in_stimulus,
        hold=settings.hold,
    )


class _Reader:
    """Takes fields from a table, and names the wrong one."""

    def __init__(self, data: object, path: str) -> None:
        if not isinstance(data, dict):
            raise AdviceError(path or "advice", f"expected a table, not {data!r}")
        self._data = dict(data)
        self._path = path

    def at(self, name: str) -> str:
        return f"{self._path}.{name}" if self._path else name

    def take(self, name: str, kind: type, default: object = None) -> Any:  # noqa: ANN401
        if name not in self._data:
            if default is None:
                raise AdviceError(self.at(name), "missing")
            return default
        value = self._data.pop(name)
        if kind is float and type(value) is int:
            value = float(value)
        if type(value) is not kind:
            raise AdviceError(self.at(name), f"expected {kind.__name__}, not {value!r}")
        return value

    def strings(self, name: str) -> tuple[str, ...]:
        values = self.take(name, list, [])
        for index, value in enumerate(values):
            if not isinstance(value, str):
                raise AdviceError(f"{self.at(name)}[{index}]", f"expected a text, not {value!r}")
        return tuple(values)

    def done(self) -> None:
        for name in self._data:
            raise AdviceError(self.at(str(name)), "no field has this name")


def _settings(data: dict[str, Any]) -> PalSettings:
    try:
        return PalSettings.from_dict(data)
    except SettingsError as error:
        raise AdviceError(f"settings.{error.field}", str(error).partition(": ")[2]) from error


def _entry(data: object, path: str) -> AdviceEntry:
    reader = _Reader(data, path)
    previous = reader.take("previous", str)
    current = reader.take("current", str)
    actions = reader.strings("actions")
    if not 1 <= len(actions) <= MAX_ACTIONS:
        raise AdviceError(reader.at("actions"), f"1 to {MAX_ACTIONS} actions, not {len(actions)}")
    for index, name in enumerate(actions):
        if name not in Action.__members__:
            raise AdviceError(f"{reader.at('actions')}[{index}]", f"no action is called {name!r}")
    entry = AdviceEntry(
        previous=ANY_STIMULUS if previous == ANY else _stimulus(previous, reader.at("previous")),
        current=_stimulus(current, reader.at("current")),
        actions=tuple(Action[name] for name in actions),
        fitness=reader.take("fitness", float),
        evaluations=reader.take("evaluations", int),
        phase=reader.take("phase", int, 1),
        parents=reader.strings("parents"),
        names=reader.strings("names"),
    )
    reader.done()
    return entry


def _stimulus(label: str, path: str) -> int:
    try:
        return int(Stimulus.from_label(label))
    except ValueError as error:
        raise AdviceError(path, str(error)) from error


def _label(code: int) -> str:
    return ANY if code == ANY_STIMULUS else Stimulus(code).label
