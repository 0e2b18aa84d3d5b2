"""How the first difference between two entries is found, and told."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM, JuniorManeuver, RobotAlive, SetupSigning
from firmware_protocol.wire.mavlink import MavlinkCodec
from hil.mcaplog.records import CreditRecord, EventRecord, TrialRecord, WireBytes
from hil.replaying.difference import LONGEST, TOPICS, Difference, first_field, in_words, messages_in, parting

WIRE = "mavlink"
CREDIT = CreditRecord(7, "performed", (6, 7), (0.5, 1.5), (), (), "0" * 16)
MANEUVER = JuniorManeuver(1, 2, 0.15, 5, 1, 1, 2, (1, 5, 0, 0, 0, 0, 0, 0))


def sent(*messages: object) -> WireBytes:
    codec = MavlinkCodec(system=HOST_SYSTEM, component=HOST_COMPONENT)
    return WireBytes("tx", "", b"".join(codec.encode(message) for message in messages))  # type: ignore[arg-type]


def test_a_field_of_a_record_with_what_it_means_and_the_others() -> None:
    found = first_field(CREDIT, replace(CREDIT, trials=(7,), credits=(1.5,), digest="1" * 16), WIRE)
    assert found.name == "trials"
    assert found.values == ("(6, 7)", "(7,)")
    assert "trials credited" in found.meaning
    assert found.others == ("credits: (0.5, 1.5), now (1.5,) (what each of these was credited with)",)
    assert in_words("/pal/credit", CREDIT, WIRE).startswith("/pal/credit CreditRecord(trial=7, telling='performed', ")
    assert "digest" not in in_words("/pal/credit", CREDIT, WIRE)


def test_a_digest_is_told_where_nothing_else_differs() -> None:
    assert first_field(CREDIT, replace(CREDIT, digest="1" * 16), WIRE).name == "digest"


def test_a_value_that_is_no_number_equals_itself() -> None:
    trial = TrialRecord(1, "any", "left", 1, False, "L", 0.1, math.nan, 1, False, False, None, 0.2, "completed")  # noqa: FBT003
    assert first_field(trial, replace(trial, fitness=float("nan")), WIRE).name == ""
    assert first_field(trial, replace(trial, fitness=float("nan"), duration=0.3), WIRE).name == "duration"


def test_a_field_of_a_message_with_its_unit_and_names() -> None:
    found = first_field(sent(MANEUVER), sent(replace(MANEUVER, period=0.2)), WIRE)
    assert (found.name, found.values) == ("data: JuniorManeuver.period", ("0.15", "0.2"))
    assert found.meaning.endswith("in s")
    found = first_field(sent(MANEUVER), sent(replace(MANEUVER, actions=(1, 1, 0, 0, 0, 0, 0, 0))), WIRE)
    assert found.name == "data: JuniorManeuver.actions"
    assert [value.split()[:2] for value in found.values] == [["F", "FF"], ["F", "F"]]


def test_another_message_and_one_too_many() -> None:
    alive = RobotAlive(1, 0, 0)
    assert first_field(sent(alive), sent(MANEUVER), WIRE).name == "data: RobotAlive or JuniorManeuver"
    assert first_field(sent(alive), sent(alive, alive), WIRE).name == "data: 1 messages or 2"
    other = sent(alive)
    spoilt = WireBytes("tx", "", other.data[:-1] + bytes([other.data[-1] ^ 1]))
    assert first_field(spoilt, replace(spoilt, data=spoilt.data[:-1]), WIRE).name == "data"


@pytest.mark.parametrize(
    ("now", "name"),
    [
        (EventRecord("bout", "won", json.dumps({"number": 1, "seed": 4})), "fields: seed"),
        (EventRecord("bout", "won", json.dumps({"number": 1})), "fields: seed"),
        (EventRecord("bout", "won", "[" * 100_000), "fields: "),
        (EventRecord("link", "won", "{}"), "kind"),
        (CREDIT, ""),
    ],
)
def test_events_and_what_is_no_event(now: object, name: str) -> None:
    assert first_field(EventRecord("bout", "won", json.dumps({"number": 1, "seed": 3})), now, WIRE).name == name


def test_long_values_are_told_from_where_they_part() -> None:
    texts = "x" * 1000 + "left" + "y" * 1000, "x" * 1000 + "right" + "y" * 1000
    found = first_field(EventRecord("a", texts[0], "{}"), EventRecord("a", texts[1], "{}"), WIRE)
    assert "left" in found.values[0]
    assert "right" in found.values[1]
    assert max(map(len, found.values)) <= LONGEST + 1
    assert parting(*texts) == 1000


def test_a_key_is_never_told() -> None:
    setup = sent(SetupSigning(1, 1, tuple(range(1, 33)), 5))
    assert [type(message) for message in messages_in(setup.data, WIRE)] == [SetupSigning]
    shown = in_words("/wire/tx", setup, WIRE)
    assert shown == "/wire/tx SetupSigning"
    found = first_field(setup, sent(SetupSigning(1, 1, tuple(range(2, 34)), 5)), WIRE)
    assert found.name == "data: SetupSigning.secret_key"
    assert set(found.values) == {"not shown: it is secret"}


def test_the_text() -> None:
    found = first_field(CREDIT, replace(CREDIT, trials=(7,)), WIRE)
    difference = Difference(
        5, 0.25, "/pal/credit", found.name, "A", "B", ("before",), (), found.values, found.meaning, found.others
    )
    assert str(difference).splitlines() == [
        "first difference: /pal/credit differs at step 5 (0.250000 s), field trials",
        f"  /pal/credit is {TOPICS['/pal/credit']}",
        f"  trials is: {found.meaning}",
        "  recorded: (6, 7)",
        "  now:      (7,)",
        "  in",
        "    recorded: A",
        "    now:      B",
        "  decisions before, which were the same:",
        "    before",
    ]
    assert difference.head_of("a.mcap") == "/pal/credit differs at step 5 (0.250000 s) of a.mcap, field trials"
    since = replace(difference, received=("said",))
    assert str(since).splitlines()[-2:] == ["  received since the last of them:", "    said"]
    missing = Difference(0, 0.0, "/bridge/step", "", "nothing: the log ends here", "the run goes on")
    assert str(missing).splitlines()[-2:] == ["  recorded: nothing: the log ends here", "  now:      the run goes on"]
