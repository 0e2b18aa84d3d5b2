"""The saved state of the learner: gone on from when it is right, and its first wrong field named when it is not."""

from __future__ import annotations

import copy
import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from firmware_protocol.vocabulary import ActionTally
from hil.sumo.coaching import CheckpointError, load_checkpoint
from pal_advisor.fields import FieldError, Fields, is_number, shown
from pal_advisor.maneuvers import Advice, AdviceError, Pal, PalSettings, Performance, SettingsError, StateError
from pal_advisor.maneuvers.settings import BEFORE

if TYPE_CHECKING:
    from pathlib import Path

SETTINGS = PalSettings(budget=60, population=4, rounds=1)


def learnt(settings: PalSettings = SETTINGS, tells: int = 40) -> Pal:
    pal, rng = Pal(settings, np.random.default_rng(1)), np.random.default_rng(2)
    for _ in range(tells):
        trial = pal.ask(int(rng.integers(4)), None)
        tally = ActionTally(30, (20, 0), (1, 0), (0.1, 0.0), 0.01)
        pal.tell(trial, Performance((tally,) * 4, 4, progress=float(rng.normal()), over=bool(rng.random() < 0.1), duration=0.7))
    return pal


PLAIN = PalSettings.from_dict({**SETTINGS.to_dict(), **BEFORE})
STATE = json.loads(json.dumps(learnt(PLAIN).state_dict()))
MODELLED = json.loads(json.dumps(learnt().state_dict()))
CHECKPOINT = {
    "version": 1, "seed": 3, "opponent": "flat-light", "bouts": 9, "wins": 4, "losses": 2, "robot_seconds": 31.5, "pal": STATE,
}  # fmt: skip


def changed(data: Any, path: tuple[Any, ...], value: object) -> Any:  # noqa: ANN401 - plain values
    data = copy.deepcopy(data)
    place = data
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = value
    return data


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        (("used",), 61, "used: expected a whole number, 0 to 60"),
        (("used",), -5, "used"),
        (("asked",), 0, "asked"),
        (("greedy",), 1, "greedy: expected true or false"),
        (("rng", "state", "state"), -1, "rng.state.state"),
        (("rng", "state", "state"), 2**128, "rng.state.state: expected a whole number"),
        (("rng", "has_uint32"), 2, "rng.has_uint32"),
        (("rng", "bit_generator"), "os", "rng.bit_generator"),
        (("rng",), [], "rng: expected a table"),
        (("history", 0, "best"), float("nan"), "history[0].best"),
        (("history", 0, "category"), [-7, 900], "history[0].category[0]"),
        (("history", 0, "extra"), 1, "history[0].extra: no field has this name"),
        (("populations", 0, "category"), [255, 4], "populations[0].category[1]: expected a stimulus, 0 to 3"),
        (("populations", 0, "category"), [255], "populations[0].category"),
        (("populations", 1, "category"), STATE["populations"][0]["category"], "populations[1].category: a second population"),
        (("populations", 0, "phase"), 0, "populations[0].phase"),
        (("populations", 0, "members", 2), [99, 0, 0, 0], "populations[0].members[2][0]: expected an action code"),
        (("populations", 0, "members", 2), [0, 0, 0], "populations[0].members[2]: expected a list of 4 action codes"),
        (("populations", 0, "members"), [], "populations[0].members: expected 4, not 0"),
        (("populations", 0, "archive"), [], "populations[0].members[0]: it is not in the archive"),
        (("populations", 0, "archive", 0, 3), -5, "populations[0].archive[0].performed"),
        (("populations", 0, "archive", 0, 4), [0] * 7, "populations[0].archive[0].engagement: expected a list of 8"),
        (("populations", 0, "evidence", 0), -1, "populations[0].evidence.count"),
        (("populations", 0, "evidence", 1), float("inf"), "populations[0].evidence.total"),
        (("populations", 0, "evidence", 3, 0, 0), [99], "populations[0].evidence.nodes[0].path[0]"),
        (("populations", 0, "evidence", 3, 0, 1), -1, "populations[0].evidence.nodes[0].ended"),
        (("trace",), [[[255, 0], [0] * 4, 5, 1.0, 1.0, 1]], "trace[0].performed"),
        (("trace",), [[[0, 0], [0] * 4, 4, 1.0, 1.0, 1]], "trace[0].category: there is no population of [0, 0]"),
        (("settings", "population"), 10**9, "settings.population"),
        (("settings", "period"), 10**400, "settings.period"),
        (("version",), 4, "version: 4 is not known"),
    ],
)  # fmt: skip
def test_the_first_wrong_field_is_named(path: tuple[Any, ...], value: object, named: str) -> None:
    with pytest.raises(StateError) as caught:
        Pal.from_state(changed(STATE, path, value))
    assert str(caught.value).startswith(named)
    assert caught.value.path == named.partition(": ")[0] or caught.value.path.startswith(named)


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        (("kept",), [[[255, 3], [0] * 4, 0]], "kept[0].genome: it is not in the archive"),
        (("kept",), [[[0, 0], [0] * 4, 1]], "kept[0].category: there is no population of [0, 0]"),
        (("populations", 0, "evidence"), [], "populations[0].evidence: expected a list of"),
        (("populations", 0, "evidence", 0), -1, "populations[0].evidence[0]: expected a list of 5"),
        (("populations", 0, "evidence", 0, 0), -1, "populations[0].evidence[0].performed"),
        (("populations", 0, "evidence", 0, 1), 10**6, "populations[0].evidence[0].renewed: expected a whole number, 0 to"),
        (("populations", 0, "evidence", 0, 2), float("inf"), "populations[0].evidence[0].total"),
        (("populations", 0, "evidence", 0, 3), -1.0, "populations[0].evidence[0].squares"),
        (("populations", 0, "category"), [255, 2], "populations[0].category: [255, 2] has no population of its own"),
        (
            ("populations", 0, "archive", 1),
            MODELLED["populations"][0]["archive"][0],
            "populations[0].archive[1]: this maneuver",
        ),
    ],
)
def test_the_first_wrong_field_of_a_model_is_named(path: tuple[Any, ...], value: object, named: str) -> None:
    with pytest.raises(StateError) as caught:
        Pal.from_state(changed(MODELLED, path, value))
    assert str(caught.value).startswith(named)


@pytest.mark.parametrize("name", ["used", "rng", "populations", "trace", "settings", "version"])
def test_a_missing_field_is_named(name: str) -> None:
    with pytest.raises(StateError, match=f"^{name}: missing"):
        Pal.from_state({key: value for key, value in STATE.items() if key != name})


@pytest.mark.parametrize(
    ("bits", "path", "value"),
    [
        (np.random.MT19937, ("state", "pos"), 625),
        (np.random.MT19937, ("state", "key"), [0] * 623),
        (np.random.MT19937, ("state", "key"), [2**32] * 624),
        (np.random.Philox, ("buffer_pos",), 5),
        (np.random.Philox, ("state", "counter"), [1, 2]),
        (np.random.SFC64, ("state", "state"), [2**64, 0, 0, 0]),
    ],
)
def test_a_generator_is_given_nothing_that_it_would_believe(
    bits: type[np.random.BitGenerator], path: tuple[str, ...], value: object
) -> None:
    state = json.loads(json.dumps(Pal(SETTINGS, np.random.Generator(bits(1))).state_dict()))
    with pytest.raises(StateError, match=r"^rng"):
        Pal.from_state(changed(state, ("rng", *path), value))


def test_a_right_state_goes_on_as_it_would_have() -> None:
    assert Pal.from_state(STATE).ask(3, None) == learnt(PLAIN).ask(3, None)
    assert Pal.from_state(MODELLED).ask(3, None) == learnt().ask(3, None)
    for state in (STATE, MODELLED):
        assert json.loads(json.dumps(Pal.from_state(state).state_dict())) == state


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        (("robot_seconds",), float("nan"), "NaN is no number"),
        (("robot_seconds",), -1.0, "robot_seconds: expected a number, not negative"),
        (("opponent",), "nobody", "opponent: expected one of flat-light"),
        (("opponent",), "keep", "opponent: expected one of"),
        (("bouts",), 4, "bouts: 4 are fewer than were won and lost"),
        (("bouts",), 1.5, "bouts: expected a whole number"),
        (("seed",), -1, "seed"),
        (("pal", "populations", 0, "members", 0, 1), 99, "pal: populations[0].members[0][1]: expected an action code"),
        (("pal",), None, "pal: the whole: expected a table"),
        (("extra",), 1, "extra: no field has this name"),
        (("version",), 2, "is no checkpoint of version 1"),
    ],
)
def test_a_checkpoint_with_something_wrong_is_refused_at_once(
    tmp_path: Path, path: tuple[Any, ...], value: object, named: str
) -> None:
    file = tmp_path / "run.checkpoint.json"
    file.write_text(json.dumps(CHECKPOINT))
    assert load_checkpoint(file).progress.bouts == 9
    file.write_text(json.dumps(changed(CHECKPOINT, path, value)))
    with pytest.raises(CheckpointError) as caught:
        load_checkpoint(file)
    assert str(file) in str(caught.value)
    assert named in str(caught.value)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("fitness", float("nan")), ("fitness", float("inf")), ("fitness", 10**400), ("evaluations", -5), ("evaluations", True),
        ("phase", 3), ("names", ["\x1b[2J"]), ("names", ["a" * 1001]), ("actions", ["FF"] * 9), ("current", "any"),
    ],
)  # fmt: skip
def test_an_entry_of_advice_with_a_monstrous_value_is_refused(field: str, value: object) -> None:
    data = learnt().advice().to_dict()
    data["entries"][1][field] = value
    with pytest.raises(AdviceError) as caught:
        Advice.from_dict(data)
    assert caught.value.path.startswith(f"entries[1].{field}")
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize(
    ("name", "value"), [("objective", []), ("win", 10**400), ("rounds", 31), ("loss", 1e7), ("phases", "x" * 999)]
)
def test_settings_have_upper_bounds_and_short_words(name: str, value: object) -> None:
    with pytest.raises(SettingsError, match=f"^{name}: ") as caught:
        PalSettings.from_dict({name: value})
    assert len(str(caught.value)) < 200


def test_values_are_shown_in_short() -> None:
    assert shown("x" * 100) == repr("x" * 57 + "...")
    assert shown([1, [2]]) == "[1, [2]]"
    assert shown(list(range(9))) == "a list of 9"
    assert shown({"a": 1}) == "a table"
    assert shown(-(10**5000)).startswith("a number of 166")
    assert not is_number(10**400)
    assert not is_number(True)  # noqa: FBT003 - that is the question
    with pytest.raises(FieldError, match="the whole: expected a table"):
        Fields([])
