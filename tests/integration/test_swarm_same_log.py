"""The same seed writes the same log, and every kind of a swarm's logs is replayed without a difference."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from at_night import all_by_day_but
from mcap.stream_reader import StreamReader

from hil.cli.app import run
from hil.replaying.host import replay

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.slow
SHORT = ("swarm", "surround", "--case", "B1D3R6W2", "--steps", "3", "--seed", "7", "--no-report", "--json", "--quiet")
KINDS = {
    "no ring": ("sim://swarm?rangers=6&wilds=2&ring=0",),
    "reckoned": ("sim://swarm?rangers=6&wilds=2", "--ring", "positions"),
    "three networks, one of them bad": ("sim://swarm?rangers=6&wilds=2&networks=3&faults=drop:0.05",),
    "a bad line": ("sim://swarm?rangers=6&wilds=2&faults=drop:0.05,corrupt:0.01",),
    "a robot loses its power": ("sim://swarm?rangers=6&wilds=2&faults=brownout:6+1",),
    "spares": ("sim://swarm?rangers=8&wilds=3&faults=brownout:6+1", "--spare"),
    "driven, on a bus": ("sim://swarm?rangers=6&wilds=2&wire=can", "--place", "drive"),
    "long range, within a wall": ("sim://swarm?rangers=6&wilds=2&wall=1", "--case", "B2D4R6W2S2"),
}


BY_NIGHT = {"no ring", "reckoned", "a robot loses its power", "driven, on a bus", "long range, within a wall"}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def outcome(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """What a run says as JSON."""
    assert run([*SHORT, *arguments]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def records(log: Path) -> list[object]:
    """All records of a log in their order, but for the metadata record `run`, and where in the file the others lie."""
    kept: list[object] = []
    with log.open("rb") as file:
        for record in StreamReader(file, skip_magic=False).records:
            if type(record).__name__ in {"MetadataIndex", "AttachmentIndex", "ChunkIndex", "SummaryOffset", "Footer"}:
                continue
            if type(record).__name__ != "Metadata" or record.name != "run":  # type: ignore[attr-defined] # it has one
                kept.append(record)
    return kept


@pytest.mark.parametrize(
    "address", ["", *(pytest.param(more, marks=pytest.mark.nightly) for more in ("&networks=3", "&networks=2&wire=can"))]
)
def test_the_same_seed_writes_the_same_log(address: str, capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    def written(seed: int) -> list[object]:
        found = outcome(capsys, f"sim://swarm?rangers=6&wilds=2&seed={seed}{address}", "--seed", str(seed))
        return records(folder / found["log"])

    one, again, other = map(written, (7, 7, 8))
    assert len(one) > 1000
    assert one == again
    assert one != other


@pytest.mark.parametrize("kind", all_by_day_but(BY_NIGHT, KINDS))
def test_every_kind_of_log_is_replayed_without_a_difference(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    found = outcome(capsys, *KINDS[kind])
    report = replay(found["log"], strict=True)
    assert report.same, str(report)
    assert report.compared > 100
