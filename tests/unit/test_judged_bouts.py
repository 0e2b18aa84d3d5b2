"""Bouts that a person has judged, as the page tells of them; what a log says of one is not trusted."""

from __future__ import annotations

import json

import pytest

from hil.look.bouts import judged
from hil.mcaplog.records import EventRecord


def ended(end: float, **fields: object) -> tuple[float, EventRecord]:
    return end, EventRecord("bout", "bout", json.dumps(fields))


def test_bouts_are_numbered_in_their_series_and_begin_when_they_began() -> None:
    told = [ended(10.0, outcome="win", time=2.0), ended(20.0, outcome="loss", time=3.0), ended(30.0, outcome="draw", time=1.0)]
    found = judged(told, [(0.0, "chasing"), (25.0, "the advice")])
    assert [(one.name, one.series, one.begin, one.end, one.outcome) for one in found] == [
        ("Bout 1", "chasing", 8.0, 10.0, "won"),
        ("Bout 2", "chasing", 17.0, 20.0, "lost"),
        ("Bout 1", "the advice", 29.0, 30.0, "drawn"),
    ]
    assert found[1].story == "Lost after 3.0 s, by the word of the person who judged."


@pytest.mark.parametrize(
    "fields",
    ["", "[]", "{}", '{"outcome": "win"}', '{"outcome": "win", "time": "1"}', '{"outcome": "win", "time": -1}',
     '{"outcome": "win", "time": NaN}', '{"outcome": "win", "time": 1e300}', '{"outcome": ["win"], "time": 1}',
     '{"outcome": "interrupted", "time": 1}'],
)  # fmt: skip
def test_what_is_no_bout_is_left_out(fields: str) -> None:
    assert judged([(1.0, EventRecord("bout", "bout", fields))], []) == []
