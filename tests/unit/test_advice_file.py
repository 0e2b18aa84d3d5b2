"""Advice files: written whole, read back the same, and a wrong field named with its line."""

from __future__ import annotations

import json
from copy import deepcopy
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
import tomli_w

from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from hil.files.outputs import OutputExistsError
from hil.sumo.advice_file import AdviceFileError, load_advice, save_advice
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

ADVICE = Advice(
    PalSettings(budget=40),
    (
        AdviceEntry(
            ANY_STIMULUS, 0, (Action.L, Action.LBRF, Action.S, Action.FF), 1.5, 3, 2, ("L L L L", "S S S S"), ("a turn",)
        ),
        AdviceEntry(ANY_STIMULUS, 1, (Action.MF,) * 4, -0.25, 7),
        AdviceEntry(ANY_STIMULUS, 3, (Action.FF,) * 4, 20.0, 9),
    ),
    opponent="flat-light",
    seed=12,
)


@pytest.mark.parametrize("name", ["x.advice.toml", "x.json", "x"])
def test_what_is_saved_is_loaded(tmp_path: Path, name: str) -> None:
    save_advice(ADVICE, tmp_path / name)
    if name != "x":
        assert load_advice(tmp_path / name) == ADVICE
    first = (tmp_path / name).read_bytes()
    with pytest.raises(OutputExistsError, match="there already"):
        save_advice(replace(ADVICE, seed=99), tmp_path / name)
    assert (tmp_path / name).read_bytes() == first
    save_advice(ADVICE, tmp_path / name, overwrite=True)
    assert (tmp_path / name).read_bytes() == first


def test_a_file_begins_with_words_for_a_person(tmp_path: Path) -> None:
    save_advice(ADVICE, tmp_path / "x.toml")
    text = (tmp_path / "x.toml").read_text()
    assert text.startswith("# Advice for Junior")
    assert '    "LBRF",' in text or '"LBRF"' in text


def entry(number: int, **changes: object) -> Callable[[dict[str, Any]], None]:
    return lambda data: data["entries"][number].update(changes)


def settings(**changes: object) -> Callable[[dict[str, Any]], None]:
    return lambda data: data["settings"].update(changes)


def top(**changes: object) -> Callable[[dict[str, Any]], None]:
    return lambda data: data.update(changes)


def without(*path: str | int) -> Callable[[dict[str, Any]], None]:
    def change(data: Any) -> None:  # noqa: ANN401 - plain data of any shape
        for step in path[:-1]:
            data = data[step]
        del data[path[-1]]

    return change


@pytest.mark.parametrize("suffix", ["toml", "json"])
@pytest.mark.parametrize(
    ("change", "named", "on"),
    [
        (entry(2, current="up"), "entries[2].current", '"up"'),
        (entry(1, actions=["FF", "FF", "XX", "FF"]), "entries[1].actions[2]", '"XX"'),
        (entry(1, actions=[]), "entries[1].actions", "actions"),
        (entry(0, evaluations=1.5), "entries[0].evaluations", "1.5"),
        (entry(1, colour="red"), "entries[1].colour", '"red"'),
        (entry(1, current="none"), "entries[1]: a second entry", ""),
        (settings(period=99.0), "settings.period", "99.0"),
        (settings(colour=1), "settings.colour", "colour"),
        (top(version=2), "version", "version"),
        (top(objective="contact"), "objective", '"contact"'),
        (top(seed="x"), "seed", '"x"'),
        (top(entries=[]), "entries: there is none", "entries"),
        (without("entries", 1, "fitness"), "entries[1].fitness: missing", ""),
    ],
)
def test_a_wrong_field_is_named_with_its_line(
    tmp_path: Path, change: Callable[[dict[str, Any]], None], named: str, on: str, suffix: str
) -> None:
    data = deepcopy(ADVICE.to_dict())
    change(data)
    path = tmp_path / f"x.{suffix}"
    text = tomli_w.dumps(data) if suffix == "toml" else json.dumps(data, indent=2)
    path.write_text(text)
    with pytest.raises(AdviceFileError) as told:
        load_advice(path)
    head, _, rest = str(told.value).partition(f"{path}, line ")
    assert head == ""
    number, _, words = rest.partition(": ")
    assert words.startswith(named)
    line = text.splitlines()[int(number) - 1]
    if on:
        assert on in line
    else:  # the field's table, the second entry
        assert line.strip() in {"[[entries]]", "{"}
        before = text.splitlines()[: int(number) - 1]
        assert sum('current = "none"' in other or '"current": "none"' in other for other in before) == 1


@pytest.mark.parametrize("suffix", ["toml", "json"])
@pytest.mark.parametrize("name", ["version", "objective", "settings", "entries"])
def test_a_missing_field_of_the_whole_has_no_line(tmp_path: Path, name: str, suffix: str) -> None:
    data = deepcopy(ADVICE.to_dict())
    del data[name]
    path = tmp_path / f"x.{suffix}"
    path.write_text(tomli_w.dumps(data) if suffix == "toml" else json.dumps(data, indent=2))
    with pytest.raises(AdviceFileError) as told:
        load_advice(path)
    assert str(told.value) == f"{path}: {name}: missing"


def test_json_in_one_line_is_read_and_its_fields_named(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_text(json.dumps(ADVICE.to_dict()))
    assert load_advice(path) == ADVICE
    data = ADVICE.to_dict()
    data["entries"][1]["current"] = "up"
    path.write_text(json.dumps(data))
    with pytest.raises(AdviceFileError, match=r"x\.json: entries\[1\]\.current: "):
        load_advice(path)


@pytest.mark.parametrize("suffix", ["toml", "json"])
@pytest.mark.parametrize("content", [b"", b"\x00\xff", b"[[[", b"a = ", b"[" * 100_000, b"[1]", b"3", b"{}"])
def test_junk_is_named_by_its_file(tmp_path: Path, content: bytes, suffix: str) -> None:
    path = tmp_path / f"x.{suffix}"
    path.write_bytes(content)
    with pytest.raises(AdviceFileError, match=rf"x\.{suffix}"):
        load_advice(path)


def test_a_place_that_cannot_be_written_leaves_no_trace(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(AdviceFileError, match="cannot write"):
        save_advice(ADVICE, tmp_path / "file" / "x.toml")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
