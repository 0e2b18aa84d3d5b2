"""Layouts and blueprints that come with the package show what logs have, and the commands that open a log are right."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import rerun_blueprints
from report_logs import coaching_log

from firmware_protocol.messages import MESSAGES
from hil.cli.app import run
from hil.cli.log_viewers import epoch_offset, rerun_commands
from hil.look.viewers.layouts import JUNIOR, SWARM, blueprint_for, kind_of, layout_of
from hil.mcaplog.making.recovery import recover
from hil.mcaplog.making.slimming import pack, slim
from hil.mcaplog.records import StepRecord, SurroundStateRecord
from hil.mcaplog.schemas import message_schema, record_schema

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from hil.mcaplog.making.recovery import CopiedLog

LOG = Path(__file__).parents[1] / "golden" / "small.mcap"
SCHEMAS = {schema.topic: schema for schema in map(message_schema, MESSAGES.values())} | {
    "/pal/generation": record_schema(StepRecord),
    "/surround/state": record_schema(SurroundStateRecord),
}
_PATH = re.compile(r'(/[\w/]+)(?:\{\w+=="\w+"\})?\.(\w+)(?:\[(\d)\])?')


def check(topic: str, field: str, index: int | None) -> None:
    """A field is there, and has such an element."""
    (found,) = [one for one in SCHEMAS[topic].fields if one.name == field]
    assert (found.count == 0) if index is None else (found.count > index)


def texts(value: Any) -> Iterator[str]:  # noqa: ANN401 - JSON
    """All texts in a layout that name a field of a topic."""
    if isinstance(value, dict):
        for name, inner in value.items():
            if name == "value":
                yield inner
            else:
                yield from texts(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from texts(inner)


def placed(value: Any) -> Iterator[str]:  # noqa: ANN401 - JSON
    """The panels that a layout has a place for."""
    if isinstance(value, str):
        yield value
    else:
        yield from (panel for side in ("first", "second") for panel in placed(value[side]))


@pytest.mark.parametrize("kind", [JUNIOR, SWARM])
def test_a_layout_names_fields_that_logs_have_and_every_panel_has_a_place(kind: str) -> None:
    layout = json.loads(layout_of(kind).read_text(encoding="utf-8"))
    fields = list(texts(layout["configById"]))
    assert len(fields) >= 5
    for text in fields:
        found = _PATH.fullmatch(text)
        assert found, text
        check(found[1], found[2], None if found[3] is None else int(found[3]))
    assert sorted(placed(layout["layout"])) == sorted(layout["configById"])


@pytest.mark.parametrize("kind", [JUNIOR, SWARM])
def test_a_blueprint_plots_fields_that_logs_have(kind: str) -> None:
    for curves in rerun_blueprints.CURVES[kind]:
        schema = SCHEMAS[curves.topic]
        assert schema.name == f"hil.{curves.schema}"
        for text, _ in curves.fields:
            field, _, index = text.partition("[")
            check(curves.topic, field, int(index[0]) if index else None)


def test_whose_log_it_is_is_told_by_its_topics() -> None:
    assert kind_of(["/tf", "/junior/sensors"]) == JUNIOR
    assert kind_of(["/tf", "/swarm/move"]) == SWARM
    assert blueprint_for(["/swarm/move"]).name == "swarm.rbl"


@pytest.mark.parametrize(
    ("about", "offset"),
    [
        ({"wall_clock": "1795890398.5", "log_clock": "100.25"}, 1_795_890_298_250_000_000),
        ({"wall_clock": "1795890398.5"}, 1_795_890_398_500_000_000),
        ({}, None),
        ({"wall_clock": "noon"}, None),
        ({"wall_clock": "nan"}, None),
        ({"wall_clock": "1e300"}, None),
        ({"wall_clock": "5", "log_clock": "6"}, None),
    ],
)
def test_the_log_says_what_makes_its_times_dates(about: dict[str, str], offset: int | None) -> None:
    assert epoch_offset(about) == offset


def test_commands_survive_any_name_and_a_log_that_was_cut_off() -> None:
    convert, view = rerun_commands(Path("a b;c/log.mcap"), Path("x.rbl"), None, whole=False)
    assert shlex.split(convert)[3:6] == ["a b;c/log.mcap", "-o", "a b;c/log.rrd"]
    assert "--recover" in shlex.split(convert)
    assert "--timestamp-offset-ns" not in convert
    assert shlex.split(view) == ["rerun", "--bind", "127.0.0.1", "a b;c/log.rrd", "x.rbl"]


def test_the_verb_names_files_that_are_there(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["log", "viewers", str(LOG), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert Path(said["layout"]).is_file()
    assert Path(said["blueprint"]).read_bytes().startswith(b"RRF2")
    assert run(["log", "viewers", str(LOG)]) == 0
    shown = capsys.readouterr().out
    assert said["layout"] in shown
    assert "recover" not in shown


@pytest.mark.parametrize("make", [slim, pack])
def test_of_a_log_without_an_index_it_says_how_to_have_one(
    make: Callable[..., CopiedLog], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    coaching_log(tmp_path / "log.mcap", budget=4)
    make(tmp_path / "log.mcap", tmp_path / "small.mcap")
    assert run(["log", "viewers", str(tmp_path / "small.mcap")]) == 0
    assert "hil log recover" in capsys.readouterr().out
    recover(tmp_path / "small.mcap", tmp_path / "indexed.mcap")
    assert run(["log", "viewers", str(tmp_path / "indexed.mcap")]) == 0
    assert "recover" not in capsys.readouterr().out
