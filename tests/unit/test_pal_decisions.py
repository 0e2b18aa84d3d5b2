"""What Pal decides, as it is told: why, of what parents, what is credited to which, and the digest that chains."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from firmware_protocol.vocabulary import ANY_STIMULUS, Action, ActionTally
from hil.sumo.coaching import load_checkpoint
from pal_advisor.maneuvers import (
    Credit,
    Motive,
    Origin,
    Pal,
    PalSettings,
    Performance,
    StateError,
    Telling,
    Trial,
    state_digest,
)
from pal_advisor.maneuvers.decisions import START, asked_digest, generator_bytes, told_digest
from pal_advisor.maneuvers.mirror import home_of, reflected
from pal_advisor.maneuvers.population import UNBORN, Candidate
from pal_advisor.maneuvers.settings import BEFORE

if TYPE_CHECKING:
    from collections.abc import Callable

SETTINGS = PalSettings.from_dict(
    {**PalSettings(budget=120, population=4, elite=1).to_dict(), "credit": 0.5, "objective": "contact"}
)
PLAIN = PalSettings.from_dict({**SETTINGS.to_dict(), **BEFORE, "loss": 12.0})
"""As it was coached before there were a model and mirror images."""
NOTHING = ActionTally(200, (0, 0), (0, 0), (0.0, 0.0), 0.0)
PUSH = ActionTally(200, (200, 200), (0, 0), (0.5, 0.5), 0.0)
BITS = [np.random.PCG64, np.random.PCG64DXSM, np.random.MT19937, np.random.Philox, np.random.SFC64]


def new_pal(seed: int = 1, settings: PalSettings = SETTINGS) -> Pal:
    return Pal(settings, np.random.default_rng(seed))


def performance(*, held: bool = True, **changes: Any) -> Performance:  # noqa: ANN401 - any field
    """A second of doing something or nothing: half of what follows it counts."""
    return Performance((PUSH if held else NOTHING,), 4, **{"duration": 1.0, **changes})


def coach(pal: Pal, until: int = SETTINGS.budget) -> tuple[list[Trial], list[Credit]]:
    """Coach by a fixed course, whose every number is the same on any machine: bouts of seven maneuvers, one in five won."""
    trials, credits_ = [], []
    while pal.used < until:
        step = pal.used
        trial = pal.ask((3, 1, 2)[step % 3], None)
        held = trial.maneuver.actions[0] in {Action.F, Action.FF}
        pal.tell(trial, performance(held=held, over=step % 7 == 6, won=step % 35 == 6))
        assert pal.credited is not None
        trials.append(trial)
        credits_.append(pal.credited)
    return trials, credits_


TRIALS, CREDITS = coach(new_pal())


# --- why, and of whom ------------------------------------------------------------------------------------------------


def test_the_first_trial_says_what_it_is() -> None:
    pal = new_pal()
    trial = pal.ask(3, None)
    assert (trial.id, trial.category, trial.phase, trial.exam, trial.generation) == (1, (ANY_STIMULUS, 3), 1, False, 0)
    assert (trial.motive, trial.origin, trial.parents, trial.tried) == (Motive.UNTRIED, Origin.RANDOM, (), 0)
    assert trial.digest != START == pal.digest


@pytest.mark.parametrize("settings", [PalSettings.from_dict({**SETTINGS.to_dict(), "rounds": 3}), PLAIN])
def test_every_reason_comes_up_and_is_true(settings: PalSettings) -> None:
    pal, seen = new_pal(settings=settings), set()
    performed: dict[tuple[object, ...], int] = {}
    kept: dict[object, object] = {}
    while not pal.finished:
        step = pal.used
        best = {(entry.previous, entry.current): entry.actions for entry in pal.advice().entries}
        trial = pal.ask((3, 1, 2)[step % 3], None)
        actions = tuple(int(action) for action in trial.maneuver.actions)
        home = (home_of(trial.category)[0], reflected(actions)) if trial.mirrored else (trial.category, actions)
        maneuver = home if settings.mirror else (trial.category, actions)
        assert trial.tried == performed.get(maneuver, 0)
        if trial.motive is Motive.AGAIN:
            assert kept[home[0]] == home[1]
        kept[home[0]] = home[1]
        if step % 7 == 6:
            kept.clear()
        assert (trial.motive is Motive.EXAM) == trial.exam
        if trial.motive is Motive.UNTRIED:
            assert trial.tried == 0
        if trial.motive is Motive.BEST:
            assert best[trial.category] == trial.maneuver.actions
        performed[maneuver] = trial.tried + 1
        seen.add(trial.motive)
        pal.tell(trial, performance(over=step % 7 == 6))
    assert seen == set(Motive) - (set() if settings.again else {Motive.AGAIN})


def test_a_generation_that_waits_for_its_ratings_says_so() -> None:
    """With a long memory nothing is final before the bout ends: each of four is performed, and then one again."""
    pal = new_pal(
        settings=PalSettings.from_dict({**SETTINGS.to_dict(), "credit": 0.99, "greedy": 0.0, "rounds": 1, "again": 0})
    )
    trials = []
    for _ in range(5):
        trials.append(pal.ask(3, None))
        pal.tell(trials[-1], performance())
    assert [trial.motive for trial in trials] == [Motive.UNTRIED] * 4 + [Motive.DONE]
    assert trials[4].tried == 1


def test_generations_are_counted_and_parents_named() -> None:
    for trial in TRIALS:
        assert (trial.origin is Origin.RANDOM) == (not trial.parents)
        assert all(len(parent.split()) == 4 for parent in trial.parents)
        names = " ".join(action.name for action in trial.maneuver.actions)
        if trial.origin is Origin.MUTATION:
            assert len(trial.parents) == 1
            assert names not in trial.parents
        if trial.origin is Origin.REFINED:
            families = [Action[name].family for name in trial.parents[0].split()]
            assert families == [action.family for action in trial.maneuver.actions]
    assert {trial.generation for trial in TRIALS if trial.phase == 1} >= {0, 1}
    assert {trial.origin for trial in TRIALS} >= {Origin.RANDOM, Origin.REFINED, Origin.CROSSOVER}


@pytest.mark.parametrize(
    ("genome", "parents", "born", "origin"),
    [
        ((1, 2, 3), (), 0, Origin.RANDOM),
        ((1, 2, 3), ((1, 1, 1),), 0, Origin.REFINED),
        ((1, 2, 3), ((1, 1, 3),), 1, Origin.MUTATION),
        ((1, 2, 3), ((1, 2, 0), (0, 0, 3)), 1, Origin.CROSSOVER),
        ((1, 2, 3), ((1, 0, 0), (0, 2, 3)), 5, Origin.CROSSOVER),
        ((1, 2, 3), ((0, 2, 3), (1, 0, 0)), 5, Origin.CROSSED_MUTANT),
        ((1, 2, 4), ((1, 2, 0), (0, 0, 3)), 1, Origin.CROSSED_MUTANT),
        ((1, 2, 3), ((1, 1, 3),), UNBORN, Origin.UNKNOWN),
    ],
)
def test_how_a_maneuver_arose(genome: tuple[int, ...], parents: tuple[tuple[int, ...], ...], born: int, origin: Origin) -> None:
    assert Candidate(genome, parents, born=born).origin is origin


# --- what is credited to which ---------------------------------------------------------------------------------------


def test_what_follows_is_credited_to_those_before() -> None:
    pal, worth = new_pal(), []
    for held in (False, True, True):
        trial = pal.ask(1, None)
        pal.tell(trial, performance(held=held))
        assert pal.credited is not None
        worth.append(pal.credited.credits[-1])
    assert worth[0] == 0.0 < worth[1] == worth[2]
    credit = pal.credited
    assert credit is not None
    assert (credit.telling, credit.trial, credit.trials) == (Telling.PERFORMED, 3, (1, 2, 3))
    assert credit.credits == (worth[2] * 0.25, worth[2] * 0.5, worth[2])
    assert (credit.rated, credit.fitness) == ((), ())
    pal.tell(pal.ask(1, None), performance(held=False, over=True))
    credit = pal.credited
    assert credit is not None
    assert credit.credits == (0.0,) * 4
    assert credit.rated == (1, 2, 3, 4)
    assert credit.fitness == (worth[2] * 0.75, worth[2] * 1.5, worth[2], 0.0)
    assert credit.digest == pal.digest


def test_what_has_faded_is_rated_alone() -> None:
    pal = new_pal()
    rated = []
    for _ in range(7):
        pal.tell(pal.ask(1, None), performance())
        assert pal.credited is not None
        rated.append(pal.credited.rated)
    assert rated == [(), (), (), (), (1,), (2,), (3,)]  # 0.5^5 < 0.05


def test_a_win_is_credited_on_top() -> None:
    pal = new_pal()
    pal.tell(pal.ask(1, None), performance())
    pal.tell(pal.ask(1, None), performance(won=True))
    credit = pal.credited
    assert credit is not None
    assert credit.trials == (1, 2, 1, 2)
    assert credit.credits[2] == pytest.approx(credit.credits[3] / 2)
    assert credit.credits[3] > 0.0
    assert credit.fitness[1] == credit.credits[1] + credit.credits[3]


def test_a_bout_broken_off_rates_those_that_waited_and_credits_nobody() -> None:
    pal = new_pal()
    pal.tell(pal.ask(1, None), performance())
    before = pal.digest
    pal.interrupt()
    credit = pal.credited
    assert credit is not None
    assert (credit.telling, credit.trial, credit.trials, credit.rated) == (Telling.INTERRUPTED, 0, (), (1,))
    assert before != credit.digest == pal.digest


def test_a_trial_discarded_leaves_the_digest_as_it_was() -> None:
    pal = new_pal()
    pal.tell(pal.ask(1, None), performance())
    before = pal.digest
    pal.discard(pal.ask(1, None))
    assert pal.credited == Credit(Telling.DISCARDED, 2, (), (), (), (), before)
    assert pal.digest == before


def test_all_that_is_credited_adds_up_to_the_final_fitness() -> None:
    earned: dict[int, float] = {}
    for credit in CREDITS:
        for trial, share in zip(credit.trials, credit.credits, strict=True):
            earned[trial] = earned.get(trial, 0.0) + share
        for trial, fitness in zip(credit.rated, credit.fitness, strict=True):
            assert earned.pop(trial) == fitness
    assert earned == {}


# --- the digest ------------------------------------------------------------------------------------------------------

ASKED: dict[str, Any] = {
    "before": "0123456789abcdef", "trial": 7, "category": (ANY_STIMULUS, 3), "genome": (1, 2, 3, 4), "phase": 1, "exam": False,
    "generation": 2, "motive": Motive.UNTRIED,
}  # fmt: skip
TOLD: dict[str, Any] = {
    "before": "0123456789abcdef", "telling": Telling.PERFORMED, "trial": 7, "trials": (6, 7), "credits": (0.0, 1.5),
    "rated": (6,), "fitness": (2.5,),
}  # fmt: skip
STATE: dict[str, Any] = {
    "bit_generator": "PCG64", "state": {"state": 2**127 + 12345, "inc": 2**126 + 1}, "has_uint32": 0, "uinteger": 99,
}  # fmt: skip
ODD_NAN = struct.unpack("<d", bytes.fromhex("010000000000f87f"))[0]


def generator(**changes: object) -> np.random.Generator:
    bits = np.random.PCG64()
    state: Any = {**STATE, **changes}
    bits.state = state
    return np.random.Generator(bits)


@pytest.mark.parametrize(
    ("digest", "fields", "name", "value"),
    [
        *((asked_digest, ASKED, name, value) for name, value in (
            ("before", "0123456789abcdee"), ("trial", 8), ("category", (0, 3)), ("category", (ANY_STIMULUS, 2)),
            ("genome", (1, 2, 3, 5)), ("genome", (1, 2, 3)), ("genome", (2, 1, 3, 4)), ("phase", 2), ("exam", True),
            ("generation", 3), ("generation", 2**40), ("motive", Motive.EVIDENCE),
        )),
        *((told_digest, TOLD, name, value) for name, value in (
            ("before", "0123456789abcdee"), ("telling", Telling.INTERRUPTED), ("trial", 8), ("trials", (5, 7)),
            ("trials", (7, 6)), ("credits", (-0.0, 1.5)), ("credits", (1.5, 0.0)), ("credits", (0.0, 1.5000000000000002)),
            ("credits", (0.0, float("nan"))), ("credits", (0.0, ODD_NAN)), ("rated", (7,)), ("fitness", (-2.5,)),
        )),
    ],
)  # fmt: skip
def test_every_input_counts(digest: Callable[..., str], fields: dict[str, Any], name: str, value: object) -> None:
    def of(fields: dict[str, Any], rng: np.random.Generator) -> str:
        rest = {key: item for key, item in fields.items() if key != "before"}
        return digest(fields["before"], rng, **rest)

    assert of(fields, generator()) == of(fields, generator())
    assert of({**fields, name: value}, generator()) != of(fields, generator())


def test_two_nans_of_other_bits_are_told_apart() -> None:
    def of(value: float) -> str:
        return told_digest(START, generator(), **{**{k: v for k, v in TOLD.items() if k != "before"}, "fitness": (value,)})

    assert of(float("nan")) == of(float("nan")) != of(ODD_NAN)


@pytest.mark.parametrize(
    "changes",
    [
        {"state": {"state": 2**127 + 12344, "inc": 2**126 + 1}}, {"state": {"state": 12345, "inc": 2**126 + 1}},
        {"state": {"state": 2**127 + 12345, "inc": 2**126 + 3}}, {"has_uint32": 1}, {"uinteger": 98},
    ],
)  # fmt: skip
def test_all_of_the_generators_state_counts(changes: dict[str, object]) -> None:
    assert generator_bytes(generator(**changes)) != generator_bytes(generator())
    rest = {key: value for key, value in ASKED.items() if key != "before"}
    assert asked_digest(START, generator(**changes), **rest) != asked_digest(START, generator(), **rest)


@pytest.mark.parametrize("bits", BITS)
def test_any_generator_of_numpy_is_digested_and_every_draw_shows(bits: type[np.random.BitGenerator]) -> None:
    one, two = np.random.Generator(bits(1)), np.random.Generator(bits(1))
    assert generator_bytes(one) == generator_bytes(two)
    one.random()
    assert generator_bytes(one) != generator_bytes(two)


def test_arrays_in_a_generator_are_little_endian() -> None:
    bits = np.random.SFC64()
    state: Any = {
        "bit_generator": "SFC64",
        "state": {"state": np.arange(1, 5, dtype=np.uint64)},
        "has_uint32": 0,
        "uinteger": 7,
    }
    bits.state = state
    expected = b"\x05SFC64" + struct.pack("<QQ", 0, 0) + struct.pack("<4Q", 1, 2, 3, 4) + struct.pack("<QQ", 7, 0)
    assert generator_bytes(np.random.Generator(bits)) == expected


def test_the_same_numbers_of_another_kind_of_generator_are_another_state() -> None:
    bits = np.random.PCG64DXSM()
    state: Any = {**STATE, "bit_generator": "PCG64DXSM"}
    bits.state = state
    assert generator_bytes(np.random.Generator(bits)) != generator_bytes(generator())


def test_a_digest_is_the_same_on_every_machine() -> None:
    """Golden: whoever changes what is digested, or how it is packed, makes the digests of all logs before worthless."""
    asked = {key: value for key, value in ASKED.items() if key != "before"}
    told = {key: value for key, value in TOLD.items() if key != "before"}
    assert asked_digest(ASKED["before"], generator(), **asked) == "234fa959b9f5da88"
    assert told_digest(TOLD["before"], generator(), **told) == "ffeb7acf75f74765"
    assert state_digest({"b": [1, 0.1, -0.0], "a": None}) == "513dc584b3e64341"


def test_a_run_of_the_learner_is_what_it_was() -> None:
    """Golden: this changes when Pal decides otherwise, or numpy draws otherwise; new constants say that it was meant."""
    pal = new_pal()
    coach(pal)
    assert (TRIALS[0].digest, CREDITS[0].digest) == ("82e8eb30f4e5b664", "827214ed2676a4af")
    assert (pal.digest, pal.state_digest()) == ("cacbc7c8c421e18e", "c2c23996d0169f93")


def test_a_run_with_settings_of_before_is_what_it_was() -> None:
    """Golden: so a run that was begun then is gone on with, and its log replayed."""
    pal = new_pal(settings=PLAIN)
    coach(pal)
    assert (pal.digest, pal.state_digest()) == ("df75352bca2eb90b", "f10ddb55d157db49")


def test_the_digests_chain() -> None:
    digests = [digest for trial, credit in zip(TRIALS, CREDITS, strict=True) for digest in (trial.digest, credit.digest)]
    assert len(set(digests)) == len(digests) == 2 * SETTINGS.budget


def test_the_first_wrong_decision_shows_and_everything_after_it() -> None:
    pal = new_pal()
    trials, credits_ = coach(pal, 50)
    assert (trials, credits_) == (TRIALS[:50], CREDITS[:50])
    pal.tell(pal.ask(3, None), performance(held=True, progress=0.001, over=True))
    more, _ = coach(pal)
    assert not {trial.digest for trial in more} & {trial.digest for trial in TRIALS}


# --- saved and gone on from ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cut", [0, 1, 24, 48, 49, 96, 119])
@pytest.mark.parametrize("asked", [False, True])
def test_a_run_cut_and_resumed_decides_the_same(cut: int, asked: bool) -> None:  # noqa: FBT001
    pal = new_pal()
    coach(pal, cut)
    if asked:  # cut between asking and telling: it is asked for again, by the same number
        pal.ask((3, 1, 2)[cut % 3], None)
    state = json.loads(json.dumps(pal.state_dict()))
    resumed = Pal.from_state(state)
    assert resumed.state_digest() == pal.state_digest() == state_digest(state)
    assert coach(resumed) == (TRIALS[cut:], CREDITS[cut:])


def test_the_digest_of_a_state_tells_of_any_change() -> None:
    pal = new_pal()
    before = pal.state_digest()
    assert before == new_pal().state_digest() != new_pal(2).state_digest()
    pal.ask(3, None)  # a population was begun
    assert pal.state_digest() != before


def as_version_1(state: dict[str, Any]) -> dict[str, Any]:
    """What a program of before would have saved, of a run without a model."""
    old: dict[str, Any] = json.loads(json.dumps(state))
    old["version"] = 1
    del old["digest"]
    old["trace"] = [row[:-1] for row in old["trace"]]
    for population in old["populations"]:
        population["archive"] = [row[:-1] for row in population["archive"]]
    return old


def test_a_state_of_before_is_gone_on_from_with_a_chain_begun_anew() -> None:
    pal = new_pal(settings=PLAIN)
    coach(pal, 30)
    resumed = Pal.from_state(as_version_1(pal.state_dict()))
    assert (resumed.digest, resumed.used) == (START, 30)
    trials, credits_ = coach(resumed)
    whole, all_credits = coach(new_pal(settings=PLAIN))
    assert [trial.maneuver for trial in trials] == [trial.maneuver for trial in whole[30:]]
    assert [credit.credits for credit in credits_] == [credit.credits for credit in all_credits[30:]]
    assert trials[0].origin is Origin.UNKNOWN
    assert credits_[0].trials[-1] == 31
    assert set(credits_[0].trials[:-1]) == {0}, "numbers that nobody kept"
    assert Pal.from_state(resumed.state_dict()).state_digest() == resumed.state_digest()


def test_a_state_of_before_there_was_a_model_goes_on_without_one() -> None:
    pal = new_pal(settings=PLAIN)
    coach(pal, 30)
    state = json.loads(json.dumps(pal.state_dict()))
    assert state["version"] == 2
    assert not {*BEFORE, "curiosity"} & set(state["settings"])
    resumed = Pal.from_state(state)
    assert resumed.settings == PLAIN
    coach(resumed)
    assert resumed.digest == "df75352bca2eb90b"


def test_a_checkpoint_of_protocol_1_is_read() -> None:
    saved = load_checkpoint(Path(__file__).parents[1] / "golden" / "protocol1" / "checkpoint.json")
    assert (saved.pal.used, saved.pal.digest) == (8, START)
    assert saved.pal.state_dict()["version"] == 2
    assert not saved.pal.settings.mirror


@pytest.mark.parametrize("value", ["", "0" * 15, "0" * 17, "0" * 15 + "g", "0" * 15 + "A", "0" * 15 + "٣", 0, None])
def test_a_digest_that_is_none_is_refused(value: object) -> None:
    with pytest.raises(StateError, match=r"^digest: "):
        Pal.from_state({**new_pal().state_dict(), "digest": value})


@pytest.mark.parametrize("version", [1, 2, 3])
def test_a_version_has_its_own_fields_and_no_others(version: int) -> None:
    pal = new_pal(settings=PLAIN)
    coach(pal, 3)
    new = json.loads(json.dumps(pal.state_dict()))
    mixed = {1: {**new, "version": 1}, 2: {**as_version_1(new), "version": 2}, 3: {**new, "version": 3}}[version]
    with pytest.raises(StateError):
        Pal.from_state(mixed)
