"""Coaching against robots over the whole stack in lock-step: whom it meets, what a bout follows from, cut and resumed runs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest
from known_players import CHARGE, DRIVEN

from firmware_protocol.errors import PeerLostError
from hil.cli.app import run
from hil.connecting.connecting_all import connect_all_as
from hil.mcaplog.checking import check_log
from hil.policies import save_policy
from hil.replaying.host import replay
from hil.sumo.advice_file import load_advice, save_advice
from hil.sumo.bouts import Bout, play
from hil.sumo.coaching import CheckpointError, Coaching, checkpoint_of, load_checkpoint, new_pal
from hil.sumo.controllers import ChaseController
from hil.sumo.ring import Encounter, RingError
from hil.sumo.rivals.pair import Pair
from hil.sumo.rivals.ring import RivalRing
from hil.sumo.rivals.rivals import FREEZE_EVERY, Rivals
from hil.sumo.tournament.entrants import Entrant, EntrantKind
from pal_advisor.maneuvers import Advice, PalSettings

if TYPE_CHECKING:
    from firmware_protocol.vocabulary import Maneuver
    from hil.sumo.coaching import Checkpoint

URL: Final = "sim://junior?networks=2&seed=1"
FIELD: Final = (
    Entrant("charge", EntrantKind.ADVICE, CHARGE),
    Entrant("charge", EntrantKind.MEMORY, CHARGE),
    Entrant("driver", EntrantKind.POLICY, policy=DRIVEN),
    Entrant("random", EntrantKind.RANDOM),
    Entrant("hobby", EntrantKind.HOBBY),
)
SETTINGS: Final = PalSettings(budget=110, population=6, elite=1, exam_share=0.2)


def bouts(rivals: Rivals, seeds: list[int], idle: float = 0.0) -> list[Bout]:
    with connect_all_as(Pair, URL) as pair:
        pair.wait(idle)
        pair.home.arm()
        return list(play(RivalRing(pair, rivals), ChaseController(), seeds))


def played(bout: Bout) -> tuple[object, ...]:
    return bout.outcome, bout.time, bout.maneuvers


def test_a_bout_follows_from_its_seed_whoever_plays_and_whatever_was_before() -> None:
    rivals = Rivals(FIELD)
    seeds = {rivals.drawn(seed).kind: seed for seed in range(30)}
    assert len(seeds) == len(FIELD)
    driven = seeds.pop(EntrantKind.POLICY)  # it sees how far its wheels have gone in whole mm, of which there were some before
    everybody = list(seeds.values())
    alone = {seed: played(bouts(rivals, [seed])[0]) for seed in [*everybody, driven]}
    after = bouts(rivals, [*everybody[::-1], driven], idle=0.333)
    assert {bout.seed: played(bout) for bout in after[:-1]} == {seed: alone[seed] for seed in everybody}
    assert played(bouts(rivals, [driven], idle=0.015)[0]) == alone[driven]
    assert len(set(alone.values())) == len(alone)


class Cut(Exception):  # noqa: N818 - what a Ctrl-C is to the run
    """Ends a run in the middle."""


class FlawedRing(RivalRing):
    """A ring in which, after so many maneuvers, something goes wrong."""

    left: float = float("inf")
    wrong: BaseException

    def engage(self, maneuver: Maneuver) -> Encounter:
        self.left -= 1
        if self.left == 0:
            raise self.wrong
        return super().engage(maneuver)


def by_turns() -> Rivals:
    """Self-play in which another one is met in between."""
    return Rivals(FIELD[-1:], self_play=True)


def coached(checkpoint: Path | None = None, saved: Checkpoint | None = None, wrong: BaseException | None = None) -> bytes:
    """Coach in self-play to the end, from its beginning or from what was saved, and give all that decides."""
    rivals = by_turns() if saved is None else saved.rivals
    assert rivals is not None
    with connect_all_as(Pair, URL) as pair:
        pair.home.arm()
        ring = FlawedRing(pair, rivals)
        if wrong is not None:
            ring.left, ring.wrong = 90, wrong
        pal, progress = (new_pal(SETTINGS, 3), None) if saved is None else (saved.pal, saved.progress)
        run = Coaching(ring, pal, seed=3, checkpoint=checkpoint, progress=progress, rivals=rivals)
        run.run()
        return run.checkpoint()


@pytest.fixture(scope="module")
def whole() -> bytes:
    """What self-play comes to that was not cut."""
    return coached()


@pytest.fixture(scope="module")
def cut(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The checkpoint of self-play that was cut in the middle, which nobody changes."""
    checkpoint = tmp_path_factory.mktemp("cut") / "cut.json"
    with pytest.raises(Cut):
        coached(checkpoint, wrong=Cut())
    return checkpoint


def test_self_play_meets_what_was_learnt_frozen_and_the_checkpoint_holds_it(whole: bytes) -> None:
    saved = checkpoint_of(whole)
    assert saved.progress.bouts > FREEZE_EVERY
    assert saved.rivals is not None
    assert saved.opponent == saved.rivals.name == "hobby,self"
    met = {entrant.name: entrant for entrant in map(saved.rivals.drawn, range(20))}
    assert met["self"].kind is EntrantKind.ADVICE
    first = {entrant.name: entrant for entrant in map(by_turns().drawn, range(20))}
    assert first["self"].kind is EntrantKind.RANDOM


def test_a_run_cut_and_resumed_equals_the_run_not_cut(whole: bytes, cut: Path, tmp_path: Path) -> None:
    assert cut.read_bytes() != whole
    assert coached(tmp_path / "run.json", load_checkpoint(cut)) == whole


def test_a_run_whose_robot_was_lost_for_a_moment_equals_one_in_which_it_was_not(whole: bytes, tmp_path: Path) -> None:
    assert coached(tmp_path / "run.json", wrong=PeerLostError("lost")) == whole


def test_two_robots_are_needed_and_a_referee() -> None:
    with connect_all_as(Pair, "sim://junior") as one, pytest.raises(RingError, match="there are 1"):
        RivalRing(one, Rivals(FIELD))
    with connect_all_as(Pair, f"{URL}&referee=0") as two, pytest.raises(RingError, match="no referee with the first robot"):
        RivalRing(two, Rivals(FIELD))


@pytest.mark.parametrize(
    ("entrants", "self_play", "frozen", "what"),
    [
        ((), False, None, "1 to 16 others in turn, not 0"),
        ((FIELD[0], FIELD[0]), False, None, "advice:charge is named twice: give one another name, as other=charge"),
        (FIELD, False, CHARGE, "something frozen, and no self-play"),
    ],
)
def test_who_can_not_be_met_is_said(entrants: tuple[Entrant, ...], self_play: bool, frozen: Advice | None, what: str) -> None:  # noqa: FBT001
    with pytest.raises(ValueError, match=what):
        Rivals(entrants, self_play=self_play, frozen=frozen)


@pytest.mark.parametrize(
    ("place", "value", "what"),
    [
        ("opponent", "chase", "expected one of hobby,self, not 'chase'"),
        ("entrants", [], "opponent"),
        ("frozen", {"version": 9}, "rivals.frozen.version: 9 is not known"),
        ("frozen", 5, "rivals.frozen"),
        ("self_play", "yes", "rivals.self_play"),
    ],
)
def test_a_damaged_checkpoint_says_where(whole: bytes, place: str, value: object, what: str) -> None:
    document = json.loads(whole)
    (document if place == "opponent" else document["rivals"])[place] = value
    with pytest.raises(CheckpointError, match=what):
        checkpoint_of(json.dumps(document).encode())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with files that entrants play by."""
    monkeypatch.chdir(tmp_path)
    save_advice(CHARGE, Path("charge.toml"))
    save_policy(DRIVEN, Path("driver.json"))
    return tmp_path


@pytest.mark.slow
def test_the_log_of_a_coaching_against_robots_holds_all_that_decides(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    field = "charge.toml,memory:charge.toml,driver.json,hobby,self"
    asked = ["coach", "--opponent", field, "--budget", "8", "--held-out", "1", "--no-report", "--quiet", "--json"]
    assert run([*asked, "--out", "first"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["opponent"] == "advice:charge,memory:charge+memory,policy:driver,hobby,self"
    assert found["held_out"]["trials"] == sum(tally["trials"] for tally in found["held_out_by_rival"]) == 1
    assert ",".join(tally["opponent"] for tally in found["held_out_by_rival"]) == found["opponent"]
    assert load_advice(Path("first/advice.toml")).opponent == found["opponent"]
    assert check_log(Path("first/log.mcap")).passed
    for file in folder.glob("*.*"):
        file.unlink()
    assert replay(Path("first/log.mcap"), strict=True).same


@pytest.mark.slow
def test_a_coaching_against_robots_is_gone_on_with_by_its_checkpoint_alone(
    whole: bytes, cut: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["coach", "--resume-from", str(cut), "--held-out", "0", "--no-report", "--quiet"]
    assert run([*asked, "--opponent", "chase"]) == 2
    assert "begun with opponent hobby,self, not chase" in capsys.readouterr().err
    assert run([*asked, "--opponent", "hobby,self", "--out", "more"]) == 0
    assert (folder / "more/checkpoint.json").read_bytes() == whole
    assert replay(Path("more/log.mcap"), strict=True).same


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["--opponent", "chaze"], "there is no opponent 'chaze'"),
        (["--opponent", "flat-light,chase"], "flat-light is an opponent of its own"),
        (["--opponent", "chase,nobody.toml"], "--opponent chase,nobody.toml: there is no entrant 'nobody.toml'"),
        (["--opponent", "chase,chase"], "chase is named twice"),
        (["--opponent", "chase", "--runs", "2"], "against robots it is one run"),
        (["tcp://127.0.0.1:1", "--opponent", "chase"], "both robots have to be emulated in this process"),
        (["sim://junior?opponent=curved-light", "--opponent", "self"], "both robots have to be emulated in this process"),
    ],
)
def test_rivals_that_can_not_be_had_are_a_mistake(arguments: list[str], what: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["coach", *arguments]) == 2
    assert what in capsys.readouterr().err
    assert not Path("runs").exists()
