"""Performances pooled by what was really performed."""

from __future__ import annotations

import json
import math

import pytest

from firmware_protocol.vocabulary import Action
from pal_advisor.maneuvers.evidence import LEAN, UNKNOWN, Evidence


def codes(names: str) -> tuple[int, ...]:
    return tuple(int(Action[name]) for name in names.split())


def test_a_maneuver_cut_short_is_a_performance_of_all_that_begin_like_it() -> None:
    evidence = Evidence()
    for _ in range(3):
        evidence.add(codes("FF FF"), 10.0)
    same, other = codes("FF FF FB SB"), codes("FF FB FB SB")
    assert evidence.of(same) == 3
    assert evidence.of(other) == pytest.approx(UNKNOWN)


def test_basic_actions_and_the_fine_actions_they_perform_are_one() -> None:
    evidence = Evidence()
    evidence.add(codes("F L R B S"), 10.0)
    assert evidence.of(codes("MF LBRF LFRB MB S")) == 1
    assert evidence.of(codes("FF LBRF LFRB MB S")) < 1


def test_an_estimate_leans_on_its_beginning_and_less_so_with_evidence() -> None:
    evidence = Evidence()
    for _ in range(20):
        evidence.add(codes("FF FF FF FF"), 20.0)
        evidence.add(codes("SB SB SB SB"), 0.0)
    good, bad, near_good = evidence.estimates([codes("FF FF FF FF"), codes("SB SB SB SB"), codes("FF FF FF SB")])
    assert 18.0 < good.value <= 20.0
    assert 0.0 <= bad.value < 2.0
    assert near_good.value > 10.0
    assert near_good.error > good.error
    assert good.evidence == 20
    assert near_good.evidence < 1


def test_the_error_falls_as_the_root_of_the_repetitions() -> None:
    def error(repetitions: int) -> float:
        evidence = Evidence()
        for index in range(2 * repetitions):
            evidence.add(codes("FF FF"), 10.0 + (-1) ** index)
        return evidence.estimates([codes("FF FF")])[0].error

    assert error(200) == pytest.approx(1.0 / math.sqrt(400), rel=0.05)
    assert error(200) < error(50) < error(5)


def test_a_rare_branch_that_is_unknown_hardly_matters() -> None:
    evidence = Evidence()
    for _ in range(30):
        evidence.add(codes("FF"), 10.0)
    evidence.add(codes("FF SB"), 0.0)
    assert evidence.of(codes("FF FB")) > 10


def test_nothing_known_is_nothing_promised() -> None:
    estimate = Evidence().estimates([codes("FF FF")])[0]
    assert estimate.value == 0.0
    assert estimate.evidence == UNKNOWN
    assert LEAN > 0


def test_evidence_survives_json() -> None:
    evidence = Evidence()
    for index in range(10):
        evidence.add(codes("FF SB LBRF S")[: 1 + index % 4], index / 3)
    again = Evidence.from_list(json.loads(json.dumps(evidence.to_list())))
    wanted = [codes("FF SB LBRF S"), codes("FF FF"), codes("MF")]
    assert again.estimates(wanted) == evidence.estimates(wanted)
