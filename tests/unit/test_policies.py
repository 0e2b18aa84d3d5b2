"""Policies, their files, and what they are told."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from firmware_protocol.messages import JuniorSensors, SensorFlag
from hil.policies import (
    HIGH,
    LOW,
    NAMES,
    Perception,
    Policy,
    PolicyDriver,
    PolicyFileError,
    load_policy,
    policy_of,
    save_policy,
)
from hil.policies.policy import act

if TYPE_CHECKING:
    from pathlib import Path

READING = JuniorSensors(
    3.0, (1.0, -2.0), (1023, 0), (120, 880), 7.5, SensorFlag.EYE_LEFT | SensorFlag.OFF_RING_RIGHT | SensorFlag.GROUND_ODOMETER
)


def policy(seed: int = 1, hidden: int = 4) -> Policy:
    return Policy(np.random.default_rng(seed).normal(0, 0.5, Policy.size(hidden)), hidden, "flat-heavy", "drawn by chance")


# --- what it is told -------------------------------------------------------------------------------------------------


def test_a_reading_becomes_numbers_about_one() -> None:
    told = dict(zip(NAMES, Perception().observe(READING).tolist(), strict=True))
    assert told["eye.left"] == 1.0
    assert told["floor.right"] == pytest.approx(880 / 1023)
    assert told["battery"] == pytest.approx(0.75)
    assert [name for name in NAMES if name.startswith("flags") and told[name]] == [
        "flags.eye_left",
        "flags.off_ring_right",
        "flags.ground_odometer",
    ]
    assert (told["travel.left"], told["travel.right"], told["time"]) == (0.0, 0.0, 0.0)


def test_way_and_time_are_counted_from_the_bout_s_first_reading() -> None:
    perception = Perception()
    perception.observe(READING)
    later = perception.observe(replace(READING, time=3.02, travel=(1.008, -2.004)))
    assert later[NAMES.index("travel.left")] == 1.0
    assert later[NAMES.index("travel.right")] == -0.5
    assert later[-1] == pytest.approx(0.02 / 15)
    far = perception.observe(replace(READING, time=3.04, travel=(9.0, -9.0)))
    assert (far >= LOW).all()
    assert (far <= HIGH).all()
    perception.begin()
    assert perception.observe(replace(READING, time=3.06, travel=(9.1, -9.0)))[NAMES.index("travel.left")] == 0.0


def test_a_robot_that_booted_goes_on_where_it_was() -> None:
    perception = Perception()
    perception.observe(READING)
    before = perception.observe(replace(READING, time=4.5))
    after = perception.observe(replace(READING, time=0.3, travel=(0.004, 0.0)))
    assert after[-1] == before[-1]
    assert after[NAMES.index("travel.left")] == 0.5
    assert perception.observe(replace(READING, time=0.45))[-1] == pytest.approx((1.5 + 0.15) / 15)


# --- what it does ----------------------------------------------------------------------------------------------------


def test_many_at_once_do_what_each_does_alone() -> None:
    rng, policies = np.random.default_rng(2), [policy(seed) for seed in range(3)]
    weights = np.stack([one.weights for one in policies])
    memories, own = np.zeros((3, 4)), [one.begin() for one in policies]
    for _ in range(5):
        observations = rng.uniform(LOW, HIGH, (3, len(NAMES))).astype(np.float32)
        actions, memories = act(weights, observations, memories)
        for number, one in enumerate(policies):
            wheels, own[number] = one.act(observations[number], own[number])
            np.testing.assert_allclose(actions[number], wheels, atol=1e-12)
    assert (np.abs(actions) < 1).all()


def test_a_driver_forgets_the_bout_before() -> None:
    driver, readings = PolicyDriver(policy()), [replace(READING, time=3.0 + 0.02 * number) for number in range(3)]
    bouts = []
    for _ in range(2):
        driver.begin()
        bouts.append([driver.drive(reading) for reading in readings])
    assert bouts[0] == bouts[1]
    assert len(set(bouts[0])) == 3


# --- its file --------------------------------------------------------------------------------------------------------


def test_a_file_holds_the_whole_policy(tmp_path: Path) -> None:
    path, made = tmp_path / "heavy.json", policy()
    save_policy(made, path)
    found = load_policy(path)
    np.testing.assert_array_equal(found.weights, made.weights)
    assert (found.hidden, found.opponent, found.note) == (4, "flat-heavy", "drawn by chance")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"format": "advice"}, "format: expected 'junior-policy', not 'advice'"),
        ({"version": 2}, "version: expected 1, not 2: it is of another version"),
        ({"inputs": ["eye.left"]}, "inputs: expected those that JUNIOR_SENSORS gives: eye.left"),
        ({"hidden": 0}, "hidden: expected a whole number"),
        ({"hidden": 5}, "weights: expected 132 numbers, which 5 hidden take, not 102"),
        ({"weights": ["1"]}, "weights.*: expected a number"),
        ({"weights": [1e30]}, "weights.*: expected a number"),
        ({"weights": 3}, "weights: expected a list"),
        ({"code": "1 + 1"}, "code: no field has this name"),
    ],
)
def test_a_file_that_is_wrong_says_where(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    path = tmp_path / "bad.json"
    path.write_text(json.dumps({**policy().to_dict(), **changes}), encoding="utf-8")
    with pytest.raises(PolicyFileError, match=rf"bad\.json.*{said}"):
        load_policy(path)


@pytest.mark.parametrize("text", ["", "[]", "{", '{"format": "junior-policy"}', '{"weights": [NaN]}'])
def test_what_is_no_policy_is_refused(text: str) -> None:
    with pytest.raises(PolicyFileError, match="the policy"):
        policy_of(text.encode())
