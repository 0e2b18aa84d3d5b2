"""Fault specifications: every way of writing one means the same, and what is wrong in one is named with its place."""

from __future__ import annotations

import json
from math import inf
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.errors import FaultSpecError
from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.faults.spells import (
    LINE_FAULTS,
    SENSORS,
    SHARES,
    SIDES,
    TIMES,
    Brownout,
    LineSpell,
    LowBattery,
    StuckSensor,
    Unplug,
    WeakWheel,
)
from hil.files.fault_file import load_faults, read_faults

EVERYTHING = FaultSpec(
    drop=0.05,
    corrupt=0.01,
    corrupt_bytes=0.02,
    duplicate=0.03,
    reorder=0.1,
    delay=0.005,
    jitter=0.02,
    rate=5760,
    frame_rate=200,
    spells=(LineSpell("drop", 0.3, at=10, lasts=2), LineSpell("reorder", 1.0, at=15)),
    unplugs=(Unplug(at=20, lasts=3), Unplug(at=90)),
    brownouts=(Brownout(at=30), Brownout(at=31, lasts=0.5)),
    stuck=(StuckSensor("eye_left", 60, at=5, lasts=3), StuckSensor("arm_right", at=7)),
    wheels=(WeakWheel("left", at=40), WeakWheel("right", 0.5)),
    batteries=(LowBattery(6.2, at=50),),
)
EVERYTHING_TEXT = (
    "drop:0.05,corrupt:0.01,corrupt_bytes:0.02,duplicate:0.03,reorder:0.1,delay:0.005,jitter:0.02,rate:5760,frame_rate:200,"
    "drop:0.3@10+2,reorder@15,unplug:20+3,unplug:90,brownout:30,brownout:31+0.5,stuck:eye_left:60@5+3,stuck:arm_right@7,"
    "wheel:left@40,wheel:right:0.5,battery:6.2@50"
)
EVERYTHING_TOML = """\
drop = [0.05, {value = 0.3, at = 10, lasts = 2}]
corrupt = 0.01
corrupt_bytes = 0.02
duplicate = 0.03
delay = 0.005
jitter = 0.02
rate = 5760
frame_rate = 200
brownout = [30, {at = 31, lasts = 0.5}]

[[reorder]]
value = 0.1
[[reorder]]
value = true
at = 15

[[unplug]]
at = 20
lasts = 3
[[unplug]]
at = 90

[[stuck]]
sensor = "eye_left"
value = 60
at = 5
lasts = 3

[[stuck]]
sensor = "arm_right"
at = 7

[[wheel]]
side = "left"
at = 40
[[wheel]]
side = "right"
effort = 0.5

[battery]
voltage = 6.2
at = 50
"""


def test_text_table_file_and_constructor_mean_the_same(tmp_path: Path) -> None:
    toml = tmp_path / "bad-day.toml"
    toml.write_text(EVERYTHING_TOML, encoding="utf-8")
    table = {
        "drop": [0.05, {"value": 0.3, "at": 10, "lasts": 2}],
        "reorder": [0.1, {"value": True, "at": 15}],
        "unplug": [{"at": 20, "lasts": 3}, 90],
        "brownout": [30, {"at": 31, "lasts": 0.5}],
        "stuck": [{"sensor": "eye_left", "value": 60.0, "at": 5, "lasts": 3}, {"sensor": "arm_right", "at": 7}],
        "wheel": [{"side": "left", "at": 40}, {"side": "right", "effort": 0.5}],
        "battery": {"voltage": 6.2, "at": 50},
        "corrupt": 0.01,
        "corrupt_bytes": 0.02,
        "duplicate": 0.03,
        "delay": 0.005,
        "jitter": 0.02,
        "rate": 5760,
        "frame_rate": 200,
    }
    (tmp_path / "bad-day.json").write_text(json.dumps(table, indent=2), encoding="utf-8")
    assert str(EVERYTHING) == EVERYTHING_TEXT
    assert FaultSpec.parse(EVERYTHING_TEXT) == EVERYTHING
    assert load_faults(toml) == EVERYTHING
    assert read_faults(f"@{toml}") == read_faults(str(toml)) == EVERYTHING
    assert read_faults(f"@{tmp_path / 'bad-day.json'}") == EVERYTHING
    assert read_faults(EVERYTHING_TEXT) == EVERYTHING


def test_the_file_on_the_page_is_one(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "faults.md").read_text(encoding="utf-8")
    (tmp_path / "page.toml").write_text(page.partition("```toml\n")[2].partition("```")[0], encoding="utf-8")
    assert str(load_faults(tmp_path / "page.toml")) == (
        "drop:0.02,jitter:0.02,drop:0.5@10+2,unplug:20+3,brownout:30+0.5,brownout:90,stuck:eye_left:900@5,"
        "wheel:left:0.5@40+10,battery:6.2@50"
    )


def test_nothing_is_nothing() -> None:
    assert FaultSpec.parse("") == FaultSpec.parse(" , ") == FaultSpec.from_table({}) == FaultSpec()
    assert str(FaultSpec()) == ""
    assert not FaultSpec().late()
    assert FaultSpec().of_device == ()


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("drop=0.05, corrupt=0.01, jitter=0.02,", "drop:0.05,corrupt:0.01,jitter:0.02"),
        ("reorder:false", ""),
        ("reorder:true", "reorder"),
        ("reorder:1", "reorder"),
        ("unplug@20+3", "unplug:20+3"),
        ("unplug:20 3", "unplug:20+3"),  # as a plus sign arrives from an address
        ("stuck:eye_left:60@5 3", "stuck:eye_left:60@5+3"),
        ("brownout@30", "brownout:30"),
        ("unplug:0", "unplug:0"),
        ("unplug:1e+2+2e1", "unplug:100+20"),
        ("drop:0.5@0", "drop:0.5@0"),
        ("wheel:left:0", "wheel:left"),
    ],
)
def test_other_ways_of_writing(text: str, same: str) -> None:
    assert str(FaultSpec.parse(text)) == same


TIME = st.floats(0, 1e6, allow_subnormal=False)
SHARE = st.floats(0, 1)
SPAN = {"at": TIME, "lasts": st.one_of(st.just(inf), TIME)}
LINE_VALUE = {name: SHARE if name in SHARES else TIME if name in TIMES else st.floats(0.01, 1e6) for name in LINE_FAULTS}


def several(strategy: st.SearchStrategy[object]) -> st.SearchStrategy[tuple[object, ...]]:
    return st.lists(strategy, max_size=2).map(tuple)


@given(
    st.builds(
        FaultSpec,
        **LINE_VALUE,
        spells=several(st.one_of(*(st.builds(LineSpell, st.just(name), LINE_VALUE[name], **SPAN) for name in LINE_FAULTS))),
        unplugs=several(st.builds(Unplug, **SPAN)),
        brownouts=several(st.builds(Brownout, at=TIME, lasts=TIME)),
        stuck=several(st.builds(StuckSensor, st.sampled_from(SENSORS), st.sampled_from([None, 0, 1]), **SPAN)),
        wheels=several(st.builds(WeakWheel, st.sampled_from(SIDES), SHARE, **SPAN)),
        batteries=several(st.builds(LowBattery, st.floats(0.01, 65), **SPAN)),
    )
)
def test_a_specification_survives_being_written_down(spec: FaultSpec) -> None:
    assert FaultSpec.parse(str(spec)) == spec


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("drop:2", "share of frames"),
        ("drop:-0.1", "share of frames"),
        ("drop:nan", "share of frames"),
        ("delay:-1", "time in s"),
        ("jitter:inf", "time in s"),
        ("rate:0", "positive number of bytes"),
        ("frame_rate:-3", "positive number of frames"),
        ("drop", "needs a number"),
        ("drop:", "needs a number, not ''"),
        ("drop:0.1,drop:0.2", "item 2, 'drop:0.2': fault 'drop' is given twice"),
        ("drop:0.1@x", "needs a number, not 'x'"),
        ("drop:0.1@1+", "needs a number, not ''"),
        ("drop:0.1@-1", "'at' of fault 'line' is a time"),
        ("drop:0.1:0.2", "does not take '0.2'"),
        ("loss:0.1", "unknown fault 'loss'"),
        ("reorder:perhaps", "on or off"),
        ("unplug", "needs its 'at'"),
        ("unplug:1+", "needs a number"),
        ("unplug:1+-2", "time in s"),
        ("replug:1", "unknown fault 'replug'"),
        ("brownout:30+inf", "no brown-out"),
        ("stuck", "needs its 'sensor'"),
        ("stuck:nose@3", "no sensor 'nose'"),
        ("stuck:eye_left:2000", "whole number 0 to 1023"),
        ("stuck:eye_left:1.5", "whole number 0 to 1023"),
        ("stuck:arm_left:2", "whole number 0 to 1,"),
        ("drop:0.1,stuck:eye_left:nan", "item 2, 'stuck:eye_left:nan': sensor"),
        ("wheel:middle", "no wheel 'middle'"),
        ("wheel:left:1.5", "share of its effort"),
        ("battery:0", "voltage in V"),
        ("battery", "needs its 'voltage'"),
    ],
)
def test_what_is_wrong_in_text_is_named(text: str, said: str) -> None:
    with pytest.raises(FaultSpecError, match=said):
        FaultSpec.parse(text)


@pytest.mark.parametrize(
    ("toml", "said"),
    [
        ("corrupt = 0.1\ndrop = 2\n", "line 2: drop: fault 'drop' is a share"),
        ("corrupt = 0.1\nloss = 2\n", "line 2: unknown fault 'loss'"),
        (
            "[[stuck]]\nsensor = 'eye_left'\n\n[[stuck]]\nat = 2\nsensor = 3\n",
            "line 6: stuck[1].sensor: fault 'stuck' needs a name",
        ),
        ("[[stuck]]\nsensor = 'eye_left'\n\n[[stuck]]\nsensor = 'nose'\n", "line 4: stuck[1]: there is no sensor 'nose'"),
        ("[[wheel]]\nside = 'left'\nspeed = 1\n", "line 3: wheel[0].speed: unknown field 'speed'"),
        ("[[battery]]\nat = 1\n", "line 1: battery[0]: fault 'battery' needs its 'voltage'"),
        ("drop = 'much'\n", "line 1: drop: fault 'drop' needs a number"),
        ("drop = true\n", "line 1: drop: fault 'drop' needs a number"),
        ("drop = \n", "line 1: this is no valid TOML: Invalid value"),
    ],
)
def test_what_is_wrong_in_a_file_is_named_with_its_line(toml: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(toml, encoding="utf-8")
    with pytest.raises(FaultSpecError) as caught:
        read_faults(str(path))
    assert str(caught.value).startswith(str(path))
    assert said in str(caught.value)


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(FaultSpecError, match="cannot read the fault file"):
        read_faults(f"@{tmp_path / 'nothing'}")
    (tmp_path / "binary.toml").write_bytes(b"drop\xff")
    with pytest.raises(FaultSpecError, match="no text file"):
        read_faults(str(tmp_path / "binary.toml"))
    (tmp_path / "list.json").write_text("[1, 2]", encoding="utf-8")
    with pytest.raises(FaultSpecError, match="table of names"):
        read_faults(str(tmp_path / "list.json"))
    (tmp_path / "deep.json").write_text("[" * 50_000, encoding="utf-8")
    with pytest.raises(FaultSpecError, match="nested too deeply"):
        read_faults(str(tmp_path / "deep.json"))


def test_the_line_at_a_time() -> None:
    spec = FaultSpec.parse("drop:0.1,drop:0.5@2+2,jitter:0.02@3+2,drop:0.9@3+0.5")
    assert spec.line_changes() == [2, 3, 3.5, 4, 5]
    assert [(line.drop, line.jitter) for line in map(spec.line_at, (0, 2, 3, 3.5, 4, 5))] == [
        (0.1, 0),
        (0.5, 0),
        (0.9, 0.02),
        (0.5, 0.02),
        (0.1, 0.02),
        (0.1, 0),
    ]
    assert spec.late()
    assert not FaultSpec.parse("drop:0.1,wheel:left").late()
