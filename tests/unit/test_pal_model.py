"""What a maneuver is worth, foretold from its parts: compared with the equations written out."""

from __future__ import annotations

import json

import numpy as np
import pytest

from firmware_protocol.vocabulary import FINE_ACTIONS, Action
from pal_advisor.fields import StateError
from pal_advisor.maneuvers.evidence import SAME_MOTION, UNKNOWN
from pal_advisor.maneuvers.model import OWN, PRIOR_CONSTANT, PRIOR_JOINT, PRIOR_MOTION, RENEW_LATEST, Model

MOTIONS = sorted(set(SAME_MOTION) - {int(Action.S)})


def codes(names: str) -> tuple[int, ...]:
    return tuple(int(Action[name]) for name in names.split())


def features(genome: tuple[int, ...]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """The 124 features of four actions, one after the other."""
    motions = np.array([[SAME_MOTION[code] == motion for motion in MOTIONS] for code in genome])
    joints = np.zeros((len(genome) - 1, 5, 5))
    for place in range(len(genome) - 1):
        joints[place, Action(genome[place]).family, Action(genome[place + 1]).family] = 1.0
    return np.concatenate(([1.0], motions.ravel(), joints.ravel())).astype(np.float64)


PRIOR = np.concatenate(([PRIOR_CONSTANT], np.full(48, PRIOR_MOTION), np.full(75, PRIOR_JOINT)))


def some_performances(count: int) -> list[tuple[tuple[int, ...], float]]:
    rng = np.random.default_rng(3)
    pool = [tuple(int(gene) for gene in rng.choice(np.array(FINE_ACTIONS), size=4)) for _ in range(count // 3)]
    return [(pool[int(rng.integers(len(pool)))], float(rng.normal(3.0, 5.0))) for _ in range(count)]


def test_it_foretells_as_the_equations_say() -> None:
    model, performances = Model(4), some_performances(10 * RENEW_LATEST)
    for genome, fitness in performances:
        model.add(genome, fitness)
    model.renew()
    x = np.array([features(genome) for genome, _ in performances])
    y = np.array([fitness for _, fitness in performances])
    inverse = np.linalg.inv(x.T @ x + np.diag(PRIOR))
    wanted = [codes("FF FF FF FF"), codes("S LBRF SB FF"), performances[0][0]]
    groups = [y[[one[0] == genome for one in performances]] for genome in dict.fromkeys(genome for genome, _ in performances)]
    spread = sum(float(((group - group.mean()) ** 2).sum()) for group in groups) / (len(y) - len(groups))
    foretold, doubt = model.foretell(wanted)
    for genome, p, h in zip(wanted, foretold, doubt, strict=True):
        assert p == pytest.approx(float(features(genome) @ inverse @ x.T @ y))
        assert h == pytest.approx(spread * float(features(genome) @ inverse @ features(genome)))

    row = model.enter(performances[0][0])
    own = y[[genome == performances[0][0] for genome, _ in performances]]
    untold, error = spread / OWN + doubt[2], spread / len(own)
    estimates = model.estimates()
    assert estimates.value[row] == pytest.approx((untold * own.mean() + error * foretold[2]) / (untold + error))
    assert estimates.error[row] == pytest.approx(np.sqrt(untold * error / (untold + error)))
    assert estimates.evidence[row] == len(own)


def test_what_was_never_performed_is_foretold_by_its_likes() -> None:
    model = Model(4)
    for _ in range(RENEW_LATEST):
        model.add(codes("FF FF FF FF"), 10.0)
        model.add(codes("SB SB SB SB"), -10.0)
    alike, other = model.enter(codes("FF FF FF SF")), model.enter(codes("SB SB SB FB"))
    found = model.estimates()
    assert found.value[alike] > 3.0 > -3.0 > found.value[other]
    assert found.evidence[alike] == UNKNOWN == model.of(codes("FF FF FF SF"))
    assert model.of(codes("FF FF FF FF")) == RENEW_LATEST


def test_basic_actions_and_the_fine_actions_they_perform_are_one_row() -> None:
    model = Model(4)
    model.add(codes("F L R S"), 1.0)
    assert model.of(codes("MF LBRF LFRB S")) == 1
    assert model.enter(codes("MF LBRF LFRB S")) == model.enter(codes("F L R S"))


def test_what_is_foretold_is_renewed_often_at_first_and_by_and_by_less() -> None:
    model, renewed, before = Model(2), [], 0.0
    for number in range(1, 80):
        model.add(codes("FF FF"), float(number))
        foretold = float(model.foretell([codes("FF FF")])[0][0])
        if foretold != before:
            renewed.append(number)
        before = foretold
    assert renewed == [1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 15, 18, 22, 27, 33, 41, 51, 63, 75]


def test_what_always_gives_the_same_is_foretold_to_give_no_more() -> None:
    """Whatever has come since the last renewal: A and b are of the same performances."""
    model = Model(4)
    for number in range(1, 100):
        model.add(codes("FF FF SF S"), 10.0)
        assert 0.0 < model.foretell([codes("FF FF SF S")])[0][0] <= 10.0 + 1e-9, number
    assert model.foretell([codes("FF FF SF S")])[0][0] == pytest.approx(10.0, abs=0.01)


def test_nothing_known_is_nothing_promised() -> None:
    model = Model(4)
    model.enter(codes("FF FF FF FF"))
    assert model.estimates().value.tolist() == [0.0]
    assert model.estimates().error[0] > 1.0


@pytest.mark.parametrize("cut", [0, 1, RENEW_LATEST - 1, RENEW_LATEST, 3 * RENEW_LATEST + 5])
def test_it_goes_on_from_its_state_bit_for_bit(cut: int) -> None:
    performances = some_performances(5 * RENEW_LATEST)
    whole, first, again = Model(4), Model(4), Model(4)
    for model in (whole, first, again):
        for genome, _ in performances:
            model.enter(genome)
    for genome, fitness in performances:
        whole.add(genome, fitness)
    for genome, fitness in performances[:cut]:
        first.add(genome, fitness)
    again.restore(json.loads(json.dumps(first.to_list())), "evidence", StateError)
    for genome, fitness in performances[cut:]:
        again.add(genome, fitness)
    for name in ("value", "error", "evidence"):
        assert getattr(again.estimates(), name).tobytes() == getattr(whole.estimates(), name).tobytes()
    assert again.to_list() == whole.to_list()


def test_estimates_are_the_same_on_every_machine() -> None:
    """Golden: what is decided by them is digested, and a log may be replayed anywhere."""
    model = Model(4)
    for genome, fitness in some_performances(100):
        model.add(genome, fitness)
    found = model.estimates()
    assert [float(found.value[row]).hex() for row in (0, 7)] == ["0x1.5f4e3c5d28ae3p+2", "0x1.dcae0c56da960p+2"]
    assert [float(found.error[row]).hex() for row in (0, 7)] == ["0x1.d38927ec5a629p+1", "0x1.02a6f3799a2a3p+1"]
