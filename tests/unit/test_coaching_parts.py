"""The coaching loop on paper: what counts, what is saved when, what a cut leaves."""

from __future__ import annotations

import json
from copy import deepcopy
from typing import TYPE_CHECKING, Any

import pytest
from paper_ring import PaperRing, encounter

from firmware_protocol.errors import HilError, LinkClosedError, PeerGoneError, PeerLostError, RefusedError
from firmware_protocol.messages import BoutOutcome, Reason
from firmware_protocol.vocabulary import Outcome, Stimulus
from hil.seeds import Branch, bout_seed
from hil.sumo.coaching import CheckpointError, Coaching, check_objective, load_checkpoint, new_pal
from hil.sumo.ring import RingError
from pal_advisor.maneuvers import Objective, PalSettings, Telling

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from firmware_protocol.vocabulary import Maneuver
    from hil.sumo.bouts import Bout
    from hil.sumo.ring import Encounter
    from pal_advisor.maneuvers import Credit, GenerationRecord, Performance, Trial

SETTINGS = PalSettings(budget=20, population=4, elite=1)


class Notes:
    """An observer that keeps everything."""

    def __init__(self) -> None:
        self.decisions: list[Trial] = []
        self.credits: list[Credit] = []
        self.checkpoints: list[tuple[int, str]] = []
        self.trials: list[Performance] = []
        self.bouts: list[Bout] = []
        self.interruptions: list[tuple[int, str]] = []
        self.generations: list[GenerationRecord] = []

    def decision(self, trial: Trial) -> None:
        self.decisions.append(trial)

    def credit(self, credit: Credit) -> None:
        self.credits.append(credit)

    def checkpoint(self, used: int, digest: str) -> None:
        self.checkpoints.append((used, digest))

    def trial(
        self,
        trial: Trial,  # noqa: ARG002
        encounter: Encounter,  # noqa: ARG002
        performance: Performance,
        fitness: float,  # noqa: ARG002
    ) -> None:
        self.trials.append(performance)

    def generation(self, record: GenerationRecord) -> None:
        self.generations.append(record)

    def interrupted(self, bout: int, error: str) -> None:
        self.interruptions.append((bout, error))

    def bout(self, bout: Bout) -> None:
        self.bouts.append(bout)


def coaching(ring: PaperRing, path: Path | None = None, *, save_on_cut: bool = False) -> tuple[Coaching, Notes]:
    notes = Notes()
    pal = new_pal(SETTINGS, 1)
    return Coaching(ring, pal, seed=1, checkpoint=path, observers=(notes,), save_on_cut=save_on_cut), notes


def test_the_budget_is_used_to_the_last_maneuver_and_no_further() -> None:
    ring = PaperRing(encounter(), encounter(), encounter(BoutOutcome.WIN))  # the third decides, and all that follow
    run, notes = coaching(ring)
    run.run()
    assert len(ring.performed) == len(notes.trials) == run.pal.used == 20
    assert run.progress.wins == len(notes.bouts) == 18
    assert [performance.over for performance in notes.trials[:3]] == [False, False, True]
    assert run.progress.robot_seconds == pytest.approx(20 * 0.25)
    assert ring.begun == [bout_seed(1, Branch.COACHING_BOUTS, number) for number in range(1, 19)]


def test_a_maneuver_that_was_cut_short_by_silence_is_not_rated() -> None:
    silent = encounter(ended=Outcome.STOPPED, reason=Reason.WATCHDOG)
    run, notes = coaching(PaperRing(silent, silent, encounter()))
    run.run()
    assert len(notes.trials) == run.pal.used == 20


def test_one_that_the_end_of_the_bout_cut_short_is_rated() -> None:
    run, notes = coaching(PaperRing(encounter(BoutOutcome.LOSS, ended=Outcome.STOPPED, reason=Reason.BY_COMMAND)))
    run.run()
    assert notes.trials[0].lost
    assert run.progress.losses == 20


def test_an_emergency_stop_ends_the_run() -> None:
    ring = PaperRing(encounter(), encounter(ended=Outcome.STOPPED, reason=Reason.EMERGENCY_STOP))
    run, notes = coaching(ring)
    with pytest.raises(RefusedError, match="emergency stop"):
        run.run()
    assert len(notes.trials) == 1


@pytest.mark.parametrize("error", [LinkClosedError("tcp://x", "gone"), KeyboardInterrupt()])
@pytest.mark.parametrize(("save_on_cut", "kept"), [(True, 2), (False, 0)])
def test_a_cut_run_leaves_its_checkpoint(tmp_path: Path, error: BaseException, save_on_cut: bool, kept: int) -> None:  # noqa: FBT001
    path = tmp_path / "x.checkpoint.json"
    run, _ = coaching(PaperRing(encounter(), encounter(), error), path, save_on_cut=save_on_cut)
    with pytest.raises(type(error)):
        run.run()
    saved = load_checkpoint(path)
    assert (saved.pal.used, saved.seed, saved.opponent) == (kept, 1, "flat-light")
    assert saved.progress.bouts == 0


def test_every_decision_is_told_before_its_maneuver_and_credited_after_it(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    ring = PaperRing(encounter(), encounter(), encounter(BoutOutcome.WIN))
    run, notes = coaching(ring, path)
    told: list[int] = []
    engage = ring.engage

    def watched(maneuver: Maneuver) -> Encounter:
        told.append(len(notes.decisions))
        assert notes.decisions[-1].maneuver == maneuver
        return engage(maneuver)

    ring.engage = watched  # type: ignore[method-assign]
    run.run()
    assert told == [trial.id for trial in notes.decisions] == [credit.trial for credit in notes.credits] == list(range(1, 21))
    assert {credit.telling for credit in notes.credits} == {Telling.PERFORMED}
    assert notes.credits[-1].digest == run.pal.digest
    assert notes.checkpoints[0] == (0, new_pal(SETTINGS, 1).state_digest())
    assert notes.checkpoints[-1] == (20, load_checkpoint(path).pal.state_digest())


def test_what_was_not_rated_is_told_as_discarded_and_a_bout_broken_off_as_such() -> None:
    silent = encounter(ended=Outcome.STOPPED, reason=Reason.WATCHDOG)
    run, notes = coaching(PaperRing(encounter(), silent, LOST, encounter()), save_on_cut=True)
    run.run()
    assert [(credit.telling, credit.trial) for credit in notes.credits[:5]] == [
        (Telling.PERFORMED, 1),
        (Telling.DISCARDED, 2),
        (Telling.DISCARDED, 3),
        (Telling.INTERRUPTED, 0),
        (Telling.PERFORMED, 4),
    ]
    assert notes.credits[0].digest == notes.credits[1].digest == notes.credits[2].digest != notes.credits[3].digest
    assert len(notes.trials) == 20


def test_a_checkpoint_that_nobody_could_write_is_told_of_all_the_same(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    notes, words = Notes(), list[str]()
    ring = PaperRing(encounter(BoutOutcome.WIN))
    pal = new_pal(SETTINGS, 1)
    Coaching(ring, pal, seed=1, checkpoint=blocked / "x.json", observers=(notes,), on_unsaved=words.append).run()
    assert len(words) == 1
    assert [used for used, _ in notes.checkpoints] == [0, 20]


LOST = PeerLostError("robot 1 is out of reach")


def test_in_lockstep_a_bout_is_played_up_to_where_it_was_and_nothing_is_rated_twice() -> None:
    ring = PaperRing(encounter(), encounter(), LOST, encounter(), encounter(), encounter(BoutOutcome.WIN))
    run, notes = coaching(ring)
    run.run()
    assert notes.interruptions == [(1, "robot 1 is out of reach")]
    assert ring.performed[3:5] == ring.performed[:2]  # the way again
    assert ring.performed[5] == ring.performed[2]  # and the one whose result was lost
    assert len(notes.trials) == run.pal.used == 20
    assert len(ring.performed) == 20 + 3
    assert notes.bouts[0].maneuvers == 3
    assert ring.begun[:3] == [bout_seed(1, Branch.COACHING_BOUTS, number) for number in (1, 1, 2)]
    undisturbed, _ = coaching(PaperRing(encounter(), encounter(), encounter(BoutOutcome.WIN)))
    undisturbed.run()
    assert run.pal.state_dict() == undisturbed.pal.state_dict()


def test_in_real_time_it_goes_on_from_the_start_pose_and_keeps_what_was_rated() -> None:
    ring = PaperRing(encounter(), encounter(), LOST, encounter(), encounter(BoutOutcome.WIN))
    run, notes = coaching(ring, save_on_cut=True)
    run.run()
    assert len(notes.trials) == run.pal.used == 20
    assert len(ring.performed) == 20 + 1
    assert notes.bouts[0].maneuvers == 4
    assert ring.recovered == 1


def test_without_a_referee_nothing_is_played_again() -> None:
    ring = PaperRing(encounter(elapsed=None), LOST, encounter(elapsed=None), refereed=False)
    notes = Notes()
    alone = PalSettings(budget=5, population=4, elite=1, objective=Objective.CONTACT)
    Coaching(ring, new_pal(alone, 1), seed=1, observers=(notes,)).run()
    assert (len(ring.performed), len(notes.trials)) == (6, 5)


def test_a_way_that_leads_elsewhere_is_left() -> None:
    other = encounter(after=Stimulus.EYE_RIGHT)
    ring = PaperRing(encounter(), encounter(), LOST, other, encounter())
    run, notes = coaching(ring)
    run.run()
    assert len(notes.trials) == run.pal.used == 20
    assert len(ring.performed) == 20 + 2


def test_a_way_that_ends_the_bout_begins_it_again() -> None:
    ring = PaperRing(encounter(), LOST, encounter(BoutOutcome.LOSS), encounter())
    run, notes = coaching(ring)
    run.run()
    assert ring.begun == [ring.begun[0]] * 3
    assert len(notes.trials) == run.pal.used == 20


def test_a_loss_at_the_very_beginning_of_a_bout_and_one_while_it_recovers(monkeypatch: pytest.MonkeyPatch) -> None:
    ring = PaperRing(encounter(BoutOutcome.WIN))
    ring.recovers = [LOST, None]
    begin, losses = ring.begin, [LOST]

    def losing(seed: int) -> Stimulus:
        if losses:
            raise losses.pop()
        return begin(seed)

    monkeypatch.setattr(ring, "begin", losing)
    run, notes = coaching(ring)
    run.run()
    assert (ring.recovered, len(notes.interruptions), run.pal.used) == (2, 2, 20)


def test_a_robot_that_gets_nowhere_is_given_up_and_the_checkpoint_kept(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    ring = PaperRing(encounter(), LOST)
    run, notes = coaching(ring, path, save_on_cut=True)
    with pytest.raises(PeerLostError, match="out of reach"):
        run.run()
    assert (ring.recovered, len(notes.trials)) == (5, 1)
    assert load_checkpoint(path).pal.used == 1


@pytest.mark.parametrize(
    "error", [LinkClosedError("tcp:", "it did not come back within 30 s"), PeerGoneError("it did not come back within 30 s")]
)
def test_one_that_does_not_come_back_ends_the_run(tmp_path: Path, error: HilError) -> None:
    path = tmp_path / "x.json"
    ring = PaperRing(encounter(), LOST)
    ring.recovers = [error]
    run, _ = coaching(ring, path, save_on_cut=True)
    with pytest.raises(type(error), match="30 s"):
        run.run()
    assert ring.recovered == 1
    assert load_checkpoint(path).pal.used == 1


def test_without_a_referee_the_checkpoint_is_written_between_maneuvers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil.sumo.coaching.CHECKPOINT_EVERY", 1.0)
    path = tmp_path / "x.json"
    alone = PalSettings(budget=20, population=4, elite=1, objective=Objective.CONTACT)
    script: list[Encounter | BaseException] = [encounter(elapsed=None)] * 7
    ring = PaperRing(*script, LinkClosedError("tcp://x", "gone"), refereed=False)
    with pytest.raises(LinkClosedError):
        Coaching(ring, new_pal(alone, 1), seed=1, checkpoint=path).run()
    assert load_checkpoint(path).pal.used == 4  # after 4 x 0.25 s


def test_a_checkpoint_that_cannot_be_written_is_told_before_anything_moves(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    ring = PaperRing(encounter())
    run, _ = coaching(ring, blocked / "x.json")
    with pytest.raises(CheckpointError, match="cannot write the checkpoint"):
        run.run()
    assert ring.performed == []


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        ({"version": 99}, "no checkpoint of version"),
        ({"bouts": "many"}, "damaged"),
        ({"pal": {}}, "damaged"),
        ({"pal": None}, "damaged"),
        ({"robot_seconds": None}, "damaged"),
    ],
)
def test_a_checkpoint_with_a_wrong_field_is_refused(tmp_path: Path, damage: dict[str, object], words: str) -> None:
    path = tmp_path / "x.json"
    run, _ = coaching(PaperRing(encounter(BoutOutcome.WIN)), path)
    run.run()
    path.write_text(json.dumps({**json.loads(path.read_text()), **damage}))
    with pytest.raises(CheckpointError, match=words):
        load_checkpoint(path)


@pytest.mark.parametrize("content", [b"\xff\xfe", b"[" * 100_000, b"{", b'"x"', b""])
def test_what_is_no_checkpoint_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.json"
    path.write_bytes(content)
    with pytest.raises(CheckpointError, match=r"x\.json"):
        load_checkpoint(path)


def test_a_folder_or_nothing_is_no_checkpoint(tmp_path: Path) -> None:
    with pytest.raises(CheckpointError, match="cannot read"):
        load_checkpoint(tmp_path)
    with pytest.raises(CheckpointError, match=r"there is no checkpoint .*none\.json"):
        load_checkpoint(tmp_path / "none.json")


def test_only_the_outcome_needs_a_referee() -> None:
    alone = PaperRing(encounter(), refereed=False)
    with pytest.raises(RingError, match="--objective contact"):
        check_objective(Objective.OUTCOME, alone)
    check_objective(Objective.CONTACT, alone)
    check_objective(Objective.EFFECTIVE, alone)
    check_objective(Objective.OUTCOME, PaperRing(encounter()))


def test_a_checkpoint_damaged_anywhere_is_refused_or_makes_sense(tmp_path: Path) -> None:
    """Every value in turn is replaced by others: never anything but a checkpoint or a CheckpointError."""
    path = tmp_path / "x.json"
    run, _ = coaching(PaperRing(encounter(BoutOutcome.WIN)), path)
    run.run()
    whole = json.loads(path.read_text())
    refused = 0
    for place in places(whole):
        others: tuple[object, ...] = (None, "x", -1, 1e999, [], {}, [[1]], True)
        for value in others:
            damaged = deepcopy(whole)
            at: Any = damaged
            for step in place[:-1]:
                at = at[step]
            at[place[-1]] = value
            path.write_text(json.dumps(damaged))
            try:
                load_checkpoint(path)
            except CheckpointError:
                refused += 1
    assert refused > 100


def places(data: object, path: tuple[str | int, ...] = (), *, most: int = 2) -> Iterator[tuple[str | int, ...]]:
    """Where values stand in plain data; of a long list only the first `most` elements."""
    if path:
        yield path
    items: Iterable[tuple[str | int, object]] = ()
    if isinstance(data, dict):
        items = data.items()
    elif isinstance(data, list):
        items = list(enumerate(data))[:most]
    for key, value in items:
        yield from places(value, (*path, key))
