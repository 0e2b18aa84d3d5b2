"""Entries of logs that were written before a field was added: read without it, and the same decision in a replay."""

from __future__ import annotations

from dataclasses import fields, replace

import pytest

from hil.mcaplog.reading.decoding import decoder_of
from hil.mcaplog.records import RECORDS, DecisionRecord, SurroundStateRecord
from hil.mcaplog.schemas import record_schema
from hil.mcaplog.writing.encode import compile_encoder
from hil.replaying.comparison import _means_the_same

STATE = SurroundStateRecord(
    seed=1, step=2, steps=9, distance=1.5, ranger_distance=None, share_surrounded=0.5, outside=0.0, ranger_stimuli=(1, 2),
    ranger_behaviours=(3,), wild_stimuli=(), wild_behaviours=(4,), tables="{}", digest="ab", case="B1", area=(10.0, 10.0),
    body=0.1, ranger_positions=(0.5, 0.25), wild_positions=(1.0, 2.0), measures="{}",
)  # fmt: skip


def read_from_before(state: SurroundStateRecord) -> object:
    """What is read of a log that knows none of the added fields."""
    schema = record_schema(SurroundStateRecord)
    before = replace(schema, fields=tuple(field for field in schema.fields if not field.added))
    return decoder_of(before.name, before.data, "protobuf", "protobuf")(compile_encoder(before)(state))


def test_what_a_log_does_not_have_is_as_it_is_by_default() -> None:
    found = read_from_before(STATE)
    assert isinstance(found, SurroundStateRecord)
    assert (found.case, found.area, found.body, found.ranger_positions, found.measures) == ("", (), 0.0, (), "")
    kept = {one.name for one in fields(STATE)} - STATE.ADDED
    assert {name: getattr(found, name) for name in kept} == {name: getattr(STATE, name) for name in kept}


def test_an_added_field_may_be_none() -> None:
    decision = DecisionRecord(7, 2, exam=False, generation=3, tried=1, previous="any", current="left", actions="F B",
                              motive="untried", origin="crossover", parents=("F F",), digest="ab")  # fmt: skip
    schema = record_schema(DecisionRecord)
    before = replace(schema, fields=tuple(field for field in schema.fields if not field.added))
    found = decoder_of(before.name, before.data, "protobuf", "protobuf")(compile_encoder(before)(decision))
    assert found == decision
    assert _means_the_same(found, replace(decision, expected=1.5, error=0.5, mirrored=True))


def test_a_replay_tells_only_what_both_know_apart() -> None:
    before = read_from_before(STATE)
    assert _means_the_same(before, STATE)
    assert not _means_the_same(before, replace(STATE, distance=1.25))
    assert not _means_the_same(replace(STATE, case="B2"), STATE)


@pytest.mark.parametrize("record", [record for record in RECORDS if hasattr(record, "ADDED")])
def test_fields_that_were_added_have_defaults_and_come_last(record: type) -> None:
    names = [one.name for one in fields(record)]
    added = names[-len(record.ADDED) :]  # type: ignore[attr-defined]
    assert set(added) == record.ADDED  # type: ignore[attr-defined]
