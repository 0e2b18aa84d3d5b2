"""Advice: choosing for a situation, and reading what a person may have edited."""

from __future__ import annotations

import copy
import json
from typing import Any

import pytest

from firmware_protocol.vocabulary import ANY_STIMULUS, Action, Stimulus
from pal_advisor.maneuvers import Advice, AdviceEntry, AdviceError, PalSettings

BOTH = int(Stimulus.EYE_LEFT | Stimulus.EYE_RIGHT)
HOLDING = BOTH | int(Stimulus.ARM_LEFT | Stimulus.ARM_RIGHT)


def entry(previous: int, current: int, action: Action, evaluations: int = 5) -> AdviceEntry:
    return AdviceEntry(previous, current, (action,) * 4, 10.5, evaluations, 2, ("F F F F",), ("straight push",))


ADVICE = Advice(
    PalSettings(period=0.15, end_on_change=True, arms_in_stimulus=True),
    (
        entry(ANY_STIMULUS, 0, Action.LBRF),
        entry(ANY_STIMULUS, BOTH, Action.MF),
        entry(0, BOTH, Action.SF),
        entry(0, 1, Action.LSRF, 3),
        entry(2, 1, Action.LBRS, 30),
    ),
    "flat-light",
    7,
)


@pytest.mark.parametrize(
    ("current", "previous", "action"),
    [
        (BOTH, 0, Action.SF),
        (BOTH, 1, Action.MF),
        (BOTH, None, Action.MF),
        (1, 0, Action.LSRF),
        (1, 3, Action.LBRS),
        (HOLDING, 0, Action.SF),
        (HOLDING, 1, Action.MF),
        (2, 0, Action.LBRS),
    ],
)
def test_the_closest_situation_is_chosen(current: int, previous: int | None, action: Action) -> None:
    chosen = ADVICE.choose(Stimulus(current), previous)
    assert chosen.actions == (action,) * 4
    assert (chosen.period, chosen.end_on_change, chosen.arms, chosen.floor_reflex) == (0.15, True, True, True)
    assert chosen.hold, "maneuvers of an advice follow one another"


def test_advice_survives_json() -> None:
    assert Advice.from_dict(json.loads(json.dumps(ADVICE.to_dict()))) == ADVICE


def test_advice_without_a_seed_survives() -> None:
    advice = Advice(ADVICE.settings, ADVICE.entries)
    assert Advice.from_dict(advice.to_dict()) == advice


WRONG: list[tuple[tuple[str | int, ...], object, str]] = [
    (("entries", 3, "actions", 1), "XX", "entries[3].actions[1]"),
    (("entries", 3, "actions", 1), 7, "entries[3].actions[1]"),
    (("entries", 0, "actions"), [], "entries[0].actions"),
    (("entries", 1, "current"), "behind", "entries[1].current"),
    (("entries", 1, "previous"), "behind", "entries[1].previous"),
    (("entries", 2, "fitness"), "high", "entries[2].fitness"),
    (("entries", 2, "evaluations"), True, "entries[2].evaluations"),
    (("entries", 2, "unheard"), 1, "entries[2].unheard"),
    (("entries", 2), "FF", "entries[2]"),
    (("entries", 2, "previous"), "any", "entries[2]"),
    (("entries",), [], "entries"),
    (("settings", "period"), 9.0, "settings.period"),
    (("settings", "unheard"), 9.0, "settings.unheard"),
    (("objective",), "contact", "objective"),
    (("version",), 99, "version"),
    (("unheard",), 1, "unheard"),
]


@pytest.mark.parametrize(("where", "value", "path"), WRONG)
def test_a_wrong_field_is_named(where: tuple[str | int, ...], value: object, path: str) -> None:
    data: Any = copy.deepcopy(ADVICE.to_dict())
    place = data
    for step in where[:-1]:
        place = place[step]
    place[where[-1]] = value
    with pytest.raises(AdviceError) as caught:
        Advice.from_dict(data)
    assert caught.value.path == path
    assert str(caught.value).startswith(f"{path}: ")


def test_a_missing_field_is_named() -> None:
    data = ADVICE.to_dict()
    del data["entries"][4]["actions"]
    with pytest.raises(AdviceError, match=r"entries\[4\]\.actions"):
        Advice.from_dict(data)


def test_something_else_altogether_is_refused() -> None:
    with pytest.raises(AdviceError, match="expected a table"):
        Advice.from_dict([1, 2])  # type: ignore[arg-type]


def test_empty_advice_has_nothing_to_choose() -> None:
    with pytest.raises(LookupError):
        Advice(PalSettings(), ()).choose(0)
