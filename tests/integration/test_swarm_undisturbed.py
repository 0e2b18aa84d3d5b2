"""What a mission comes to is decided by what its robots say to it: not by what the table tells, nor by who else asks."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import pytest

from firmware_protocol.messages import ROBOT_COMPONENT, Command, CommandLong, SwarmObservation, TableState
from firmware_protocol.wire.codec import open_codec
from hil.cli.app import run
from simdevice.swarm.component import TableComponent
from simdevice.swarm.world import SwarmWorld

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

pytestmark = pytest.mark.slow
PLACED: Final = 1.5
"""So long after the table was set up all robots are where they begin, and the first step has not begun, in s."""
PERIOD: Final = 0.005
"""Control period, in s."""
STATION: Final = 250
"""System id of who else asks."""
EVERY: Final = 7
"""Control periods between two questions of it."""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)


def outcome(capsys: pytest.CaptureFixture[str], address: str = "") -> dict[str, Any]:
    """What a mission comes to."""
    options = ["--case", "B1D3R9W3", "--steps", "10", "--seed", "4", "--no-report", "--no-log", "--json", "--quiet"]
    assert run(["swarm", "surround", f"sim://swarm?rangers=9&wilds=3&seed=4{address}", *options]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return {name: value for name, value in found.items() if name not in {"wall_seconds", "table", "run"}}


def test_the_table_may_fall_silent_when_all_are_placed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = outcome(capsys)
    said = []
    say, receive = TableComponent.say, TableComponent.receive
    world = SwarmWorld.set_up
    placed_at = float("inf")

    def set_up(self: SwarmWorld, *wanted: Any) -> Any:  # noqa: ANN401 - as of the world
        nonlocal placed_at
        placed_at = self.now() + PLACED
        return world(self, *wanted)

    def little(self: TableComponent, ticks: int) -> bytes:
        words = say(self, ticks)
        late = ticks * PERIOD > placed_at
        said.append(late)
        return b"" if late else words

    def deaf(self: TableComponent, data: bytes, now: float) -> bytes:
        return b"" if now > placed_at else receive(self, data, now)

    monkeypatch.setattr(SwarmWorld, "set_up", set_up)
    monkeypatch.setattr(TableComponent, "say", little)
    monkeypatch.setattr(TableComponent, "receive", deaf)
    assert outcome(capsys) == whole
    assert sum(said) > 50


def test_the_table_may_tell_another_truth(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    whole = outcome(capsys)
    state = SwarmWorld.state
    told = 0

    def other(self: SwarmWorld) -> TableState:
        nonlocal told
        told += 1
        turned = (-1.0) ** told
        return replace(
            state(self),
            time=1e3 - self.now(),
            box=(turned, 2.0),
            box_heading=turned,
            goal=(3.0, turned),
            contacts=told,
            resets=told,
        )

    monkeypatch.setattr(SwarmWorld, "state", other)
    assert outcome(capsys) == whole
    assert told > 50


@pytest.mark.parametrize("address", ["", "&networks=2"])
def test_who_asks_beside_the_mission_changes_no_decision(
    address: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = outcome(capsys, address)
    run_networks = SwarmWorld.run_networks
    asked = 0
    due = 0.0
    codecs: list[Any] = []

    def beside(self: SwarmWorld, inbound: Sequence[bytes], periods: int) -> list[bytes]:
        """Let a monitor ask in between: now all at once, now one of them."""
        nonlocal asked, due
        periods = min(periods, EVERY)
        if self.now() >= due:
            due = self.now() + EVERY * self.period
            if not codecs:
                codecs.extend(open_codec(self.wire, system=STATION, component=190) for _ in inbound)
            asked += 1
            question = CommandLong(
                asked % 4, ROBOT_COMPONENT, Command.REQUEST_MESSAGE, param1=float(SwarmObservation.ID), param2=float(asked)
            )
            inbound = [data + codec.encode(question) for data, codec in zip(inbound, codecs, strict=True)]
        return run_networks(self, inbound, periods)

    monkeypatch.setattr(SwarmWorld, "run_networks", beside)
    assert outcome(capsys, address) == alone
    assert asked > 200
