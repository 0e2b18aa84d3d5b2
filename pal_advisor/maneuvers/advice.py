"""What Pal hands out when it is done: the best maneuver for every situation, as plain values and back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.vocabulary import (
    ANY,
    ANY_STIMULUS,
    LEAST_PERIOD,
    MAX_ACTIONS,
    MOST_PERIOD,
    Action,
    Maneuver,
    Stimulus,
    spelled_out,
    stimulus_label,
)
from pal_advisor.fields import FieldError, Fields, SettingsError, shown
from pal_advisor.maneuvers.settings import Objective, PalSettings

if TYPE_CHECKING:
    from collections.abc import Mapping

ADVICE_VERSION: Final = 1
MOST_SEED: Final = 2**32 - 1
"""The greatest seed."""
EYES: Final = 3
"""The bits of a stimulus that are eyes."""


class AdviceError(FieldError):
    """An advice has a field that is missing or wrong."""


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
        period: Time an action of it lasts, in s; None: as the settings say.
    """

    previous: int
    current: int
    actions: tuple[Action, ...]
    fitness: float
    evaluations: int
    phase: int = 1
    parents: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    period: float | None = None

    @property
    def in_words(self) -> str:
        """The maneuver in words, and its pace where that is its own: `fast forward, twice; stop; each for 0.08 s`."""
        pace = "" if self.period is None else f"; each for {self.period:g} s"
        return spelled_out(self.actions) + pace

    def to_dict(self) -> dict[str, Any]:
        """The entry as plain values."""
        return {
            "previous": stimulus_label(self.previous),
            "current": stimulus_label(self.current),
            "actions": [action.name for action in self.actions],
            "fitness": self.fitness,
            "evaluations": self.evaluations,
            "phase": self.phase,
            "parents": list(self.parents),
            "names": list(self.names),
            **({} if self.period is None else {"period": self.period}),
        }

    @classmethod
    def from_dict(cls, data: object, path: str = "") -> AdviceEntry:
        """The inverse of `to_dict`.

        Args:
            data: Plain values.
            path: What the entry is within the whole, as `entries[3]`.

        Raises:
            AdviceError: A field is missing, unknown or wrong; its `path` says which.
        """
        fields = Fields(data, path, AdviceError)
        previous = fields.text("previous")
        current = fields.text("current")
        actions = fields.texts("actions")
        if not 1 <= len(actions) <= MAX_ACTIONS:
            raise fields.wrong("actions", f"1 to {MAX_ACTIONS} actions, not {len(actions)}")
        for index, name in enumerate(actions):
            if name not in Action.__members__:
                raise fields.wrong(f"actions[{index}]", f"no action is called {shown(name)}")
        entry = cls(
            previous=ANY_STIMULUS if previous == ANY else _stimulus(previous, fields.at("previous")),
            current=_stimulus(current, fields.at("current")),
            actions=tuple(Action[name] for name in actions),
            fitness=fields.number("fitness"),
            evaluations=fields.integer("evaluations"),
            phase=fields.integer("phase", 1, 2) if fields.has("phase") else 1,
            parents=fields.texts("parents") if fields.has("parents") else (),
            names=fields.texts("names") if fields.has("names") else (),
            period=fields.number("period", LEAST_PERIOD, MOST_PERIOD) if fields.has("period") else None,
        )
        fields.done()
        return entry


@dataclass(frozen=True)
class Advice:
    """The best maneuver for every situation that came up.

    Attributes:
        settings: How it was learnt; options of the maneuvers come from here, and the period where an entry has none of its own.
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
        return make_maneuver(entry.actions, self.settings, entry.period)

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
        return {**data, "settings": self.settings.to_saved(), "entries": [entry.to_dict() for entry in self.entries]}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Advice:
        """The inverse of `to_dict`.

        Raises:
            AdviceError: A field is missing, unknown or wrong; its `path` says which.
        """
        fields = Fields(data, "", AdviceError)
        version = fields.integer("version")
        if version != ADVICE_VERSION:
            raise AdviceError("version", f"{version} is not known; this program reads {ADVICE_VERSION}")
        settings = _settings(fields.take("settings"))
        objective = fields.text("objective")
        if objective != settings.objective:
            raise AdviceError("objective", f"{objective!r} differs from settings.objective, {settings.objective.value!r}")
        opponent = fields.text("opponent") if fields.has("opponent") else ""
        seed = fields.integer("seed", 0, MOST_SEED) if fields.has("seed") else None
        raw = list(fields.items("entries"))
        fields.done()
        entries = tuple(AdviceEntry.from_dict(item, path) for path, item in raw)
        if not entries:
            raise AdviceError("entries", "there is none")
        seen: set[tuple[int, int]] = set()
        for index, entry in enumerate(entries):
            if (entry.previous, entry.current) in seen:
                raise AdviceError(
                    f"entries[{index}]", f"a second entry for {stimulus_label(entry.previous)}, {stimulus_label(entry.current)}"
                )
            seen.add((entry.previous, entry.current))
        return cls(settings, entries, opponent, seed)


def make_maneuver(actions: tuple[Action, ...], settings: PalSettings, period: float | None = None) -> Maneuver:
    """Actions with the period and the options of the settings.

    Args:
        actions: The actions.
        settings: Period and options.
        period: Time an action lasts, in s; None: as the settings say.
    """
    return Maneuver(
        actions,
        period=settings.period if period is None else period,
        floor_reflex=settings.floor_reflex,
        end_on_change=settings.end_on_change,
        arms=settings.arms_in_stimulus,
        hold=settings.hold,
    )


def _settings(data: object) -> PalSettings:
    if not isinstance(data, dict):
        raise AdviceError("settings", f"expected a table, not {shown(data)}")
    try:
        return PalSettings.of_saved(data)
    except SettingsError as error:
        raise AdviceError(f"settings.{error.path}", str(error).partition(": ")[2]) from error


def _stimulus(label: str, path: str) -> int:
    try:
        return int(Stimulus.from_label(label))
    except ValueError as error:
        raise AdviceError(path, str(error) if len(label) <= 60 else f"unknown stimulus {shown(label)}") from error
