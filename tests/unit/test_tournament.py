"""Tournaments on paper: entrants, who meets whom, standings, checkpoints, and words."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from known_players import DRIVEN
from rich.console import Console

from firmware_protocol.messages import BoutOutcome
from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from hil.cli.tournament_words import entrant_of, matrix_table, seat_line, standings_table
from hil.policies import save_policy
from hil.sumo.advice_file import AdviceFileError, save_advice
from hil.sumo.driving import DriverPlayer
from hil.sumo.tournament.checkpoint import TournamentCheckpoint, TournamentCheckpointError, load_checkpoint
from hil.sumo.tournament.entrants import Entrant, EntrantKind
from hil.sumo.tournament.players import HostPlayer, MemoryPlayer
from hil.sumo.tournament.schedule import PART, Tournament, TournamentBout
from hil.sumo.tournament.standings import Score, Standings
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings

if TYPE_CHECKING:
    from pathlib import Path

ADVICE = Advice(PalSettings(actions=1, period=0.15), (AdviceEntry(ANY_STIMULUS, 3, (Action.FF,), 1.0, 5),))
BUILT_IN = tuple(Entrant(name, EntrantKind(name)) for name in ("chase", "hobby", "random"))


def bout(number: int, home: int, away: int, outcome: BoutOutcome, time: float = 2.0) -> TournamentBout:
    return TournamentBout(number, home, away, outcome, time, (3, 4))


def all_bouts(tournament: Tournament) -> list[TournamentBout]:
    """The first of two always wins."""
    return [
        bout(number, home, away, BoutOutcome.WIN if home < away else BoutOutcome.LOSS)
        for part in tournament.parts()
        for number, home, away in part.fixtures
    ]


def test_everybody_meets_everybody_equally_often_in_both_seats() -> None:
    tournament = Tournament(BUILT_IN, 24, 1)
    fixtures = [fixture for part in tournament.parts() for fixture in part.fixtures]
    assert len(fixtures) == tournament.total == 72
    assert len(set(fixtures)) == 72
    for home in range(3):
        for away in range(3):
            assert [number for number, *seats in fixtures if seats == [home, away]] == list(range(1, 13)) * (home != away)
    assert max(part.size for part in tournament.parts()) == PART


def test_both_seats_of_a_round_begin_alike_and_no_two_rounds_do() -> None:
    tournament = Tournament(BUILT_IN, 24, 1)
    seeds = {fixture: tournament.seed_of(*fixture) for part in tournament.parts() for fixture in part.fixtures}
    assert all(seeds[number, home, away] == seeds[number, away, home] for number, home, away in seeds)
    assert len(set(seeds.values())) == len(seeds) / 2
    assert Tournament(BUILT_IN, 24, 2).seed_of(1, 0, 1) != tournament.seed_of(1, 0, 1)


@pytest.mark.parametrize(
    ("entrants", "bouts", "told"),
    [
        (BUILT_IN[:1], 20, "2 to 64 entrants, not 1"),
        ((*BUILT_IN, BUILT_IN[0]), 20, "two entrants are called chase: give one another name, as other=chase"),
        (BUILT_IN, 7, "an even number of bouts"),
    ],
)
def test_what_is_no_tournament_is_said_to_be_none(entrants: tuple[Entrant, ...], bouts: int, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        Tournament(entrants, bouts, 1)


def test_an_entrant_plays_by_what_it_has() -> None:
    assert isinstance(Entrant("a", EntrantKind.MEMORY, ADVICE).player(1, 0), MemoryPlayer)
    assert isinstance(Entrant("a", EntrantKind.ADVICE, ADVICE).player(1, 0), HostPlayer)
    assert isinstance(Entrant("a", EntrantKind.HOBBY).player(1, 0), HostPlayer)
    assert isinstance(Entrant("a", EntrantKind.POLICY, policy=DRIVEN).player(1, 0), DriverPlayer)
    with pytest.raises(ValueError, match="takes an advice, and there is nothing"):
        Entrant("a", EntrantKind.MEMORY)
    with pytest.raises(ValueError, match="takes nothing, and there is an advice"):
        Entrant("a", EntrantKind.CHASE, ADVICE)
    with pytest.raises(ValueError, match="takes a policy, and there is an advice"):
        Entrant("a", EntrantKind.POLICY, ADVICE)
    with pytest.raises(ValueError, match="takes an advice, and there is an advice and a policy"):
        Entrant("a", EntrantKind.ADVICE, ADVICE, DRIVEN)


@pytest.mark.parametrize("name", ["", "../x", "a b", "-x", "x" * 41, "a/b"])
def test_a_name_can_be_part_of_a_files_name(name: str) -> None:
    with pytest.raises(ValueError, match="a name has up to 40"):
        Entrant(name, EntrantKind.CHASE)


def test_entrants_are_named_on_the_command_line(tmp_path: Path) -> None:
    run = tmp_path / "20261128-130501-coach-flat-heavy"
    run.mkdir()
    for path in (run / "advice.toml", tmp_path / "mine.advice.toml"):
        save_advice(ADVICE, path)
    assert entrant_of("chase2") == Entrant("chase2", EntrantKind.CHASE2)
    assert entrant_of("fast=chase2").name == "fast"
    assert entrant_of(str(run)) == Entrant("flat-heavy", EntrantKind.ADVICE, ADVICE)
    assert entrant_of(str(run / "advice.toml")).name == "flat-heavy"
    assert entrant_of(f"memory:{run}") == Entrant("flat-heavy+memory", EntrantKind.MEMORY, ADVICE)
    assert entrant_of(f"me=memory:{tmp_path / 'mine.advice.toml'}") == Entrant("me", EntrantKind.MEMORY, ADVICE)
    assert entrant_of(str(tmp_path / "mine.advice.toml")).name == "mine"
    save_advice(ADVICE, tmp_path / "other.json")
    assert entrant_of(str(tmp_path / "other.json")) == Entrant("other", EntrantKind.ADVICE, ADVICE)
    save_policy(DRIVEN, tmp_path / "learnt.json")
    found = entrant_of(str(tmp_path / "learnt.json"))
    assert (found.name, found.kind) == ("learnt", EntrantKind.POLICY)
    (tmp_path / "nothing.toml").write_text("version = 9\n")
    with pytest.raises(AdviceFileError, match=r"nothing\.toml"):
        entrant_of(str(tmp_path / "nothing.toml"))
    with pytest.raises(ValueError, match="there is no entrant 'chases'"):
        entrant_of("chases")


def test_standings_count_both_seats_and_name_the_surprises() -> None:
    tournament = Tournament(BUILT_IN, 6, 1)
    bouts = all_bouts(tournament)
    surprise = next(index for index, one in enumerate(bouts) if (one.home, one.away) == (2, 0))
    bouts[surprise] = bout(bouts[surprise].round, 2, 0, BoutOutcome.WIN, 9.0)
    drawn = next(index for index, one in enumerate(bouts) if (one.home, one.away) == (0, 1))
    bouts[drawn] = bout(bouts[drawn].round, 0, 1, BoutOutcome.DRAW)
    standings = Standings.of(tournament, bouts)
    assert [standings.name(one) for one in standings.order] == ["chase", "hobby", "random"]
    assert standings.matrix[0][1] == Score(5, 1, 0)
    assert standings.matrix[1][0] == Score(0, 1, 5)
    assert standings.score(0) == Score(10, 1, 1)
    assert standings.seats == Score(9, 1, 8)
    assert standings.median_time_to_win(2) == 9.0
    assert [upset.bout for upset in standings.upsets(5)] == [bouts[surprise]]
    assert standings.upsets(5)[0].probability < 0.3
    assert standings.upsets(0) == []


def test_a_document_says_all_of_it() -> None:
    tournament = Tournament(BUILT_IN, 2, 7)
    document = json.loads(json.dumps(Standings.of(tournament, all_bouts(tournament)).to_dict()))
    assert document["bouts"] == 6
    assert document["seed"] == 7
    assert [row["name"] for row in document["table"]] == ["chase", "hobby", "random"]
    assert document["table"][0]["won"] == 4
    assert document["matrix"]["random"] == {
        "chase": {"won": 0, "drawn": 0, "lost": 2},
        "hobby": {"won": 0, "drawn": 0, "lost": 2},
    }
    assert document["home_seat"]["won"] == 3


def test_tables_and_words_show_it() -> None:
    tournament = Tournament(BUILT_IN, 2, 7)
    standings = Standings.of(tournament, all_bouts(tournament))
    console = Console(width=100)
    with console.capture() as caught:
        console.print(standings_table(standings))
        console.print(matrix_table(standings, 100))
    text = caught.get()
    assert "6 bouts, 2 of each pairing" in text
    assert "1.000" in text
    assert "2-0-0" in text
    with console.capture() as caught:
        console.print(matrix_table(standings, 30))
    assert "Share of the points" in caught.get()
    assert "100" in caught.get()
    assert "2-0-0" not in caught.get()
    assert "wins 0.50 of the bouts that are decided" in seat_line(standings)


def test_a_checkpoint_comes_back_as_it_was(tmp_path: Path) -> None:
    tournament = Tournament((*BUILT_IN, Entrant("mine", EntrantKind.MEMORY, ADVICE)), 12, 3)
    saved = TournamentCheckpoint(tournament, tuple(all_bouts(tournament)[:20]))
    path = tmp_path / "checkpoint.json"
    path.write_bytes(saved.to_bytes())
    assert load_checkpoint(path) == saved
    policy = Tournament((*BUILT_IN, Entrant("learnt", EntrantKind.POLICY, policy=DRIVEN)), 12, 3)
    path.write_bytes(TournamentCheckpoint(policy).to_bytes())
    assert load_checkpoint(path).to_bytes() == path.read_bytes()
    assert not saved.finished
    assert TournamentCheckpoint(tournament, tuple(all_bouts(tournament))).finished


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [
        ("version", 2, "no checkpoint of a tournament of version 1"),
        ("mission", "surround", "no checkpoint of a tournament"),
        ("bouts", 5, "even number of bouts"),
        ("seed", -1, "seed"),
        ("played", [[1, 0, 2, "win", 1.0, 0, 0]], "not those of this tournament, in order"),
        ("played", [[1, 0, 1, "won", 1.0, 0, 0]], "expected one of win, loss, draw"),
        ("played", [[1, 0, 9, "win", 1.0, 0, 0]], "expected a whole number"),
        ("played", [[1, 0, 1, "win"]], "expected a list of 7"),
        ("entrants", [{"name": "a", "kind": "advice", "advice": None, "policy": None}] * 2, "takes an advice"),
        ("entrants", [{"name": "a", "kind": "chases", "advice": None, "policy": None}] * 2, "expected one of"),
        ("entrants", [{"name": "a", "kind": "policy", "advice": None, "policy": {"format": "x"}}] * 2, "policy.format"),
        ("more", 1, "no field has this name"),
    ],
)
def test_a_damaged_checkpoint_is_refused(tmp_path: Path, field: str, value: object, told: str) -> None:
    data = json.loads(TournamentCheckpoint(Tournament(BUILT_IN, 2, 1)).to_bytes())
    data[field] = value
    path = tmp_path / "checkpoint.json"
    path.write_text(json.dumps(data))
    with pytest.raises(TournamentCheckpointError, match=told):
        load_checkpoint(path)
