"""Every random choice derives from one seed, and each use from a branch of its own."""

from __future__ import annotations

from hil.seeds import Branch, bout_seed, generator, run_seed


def test_the_same_seed_gives_the_same_numbers_in_every_version() -> None:
    assert generator(1, Branch.PAL).integers(2**32, size=3).tolist() == [2228177951, 1425381069, 1555561066]
    assert [bout_seed(1, Branch.COACHING_BOUTS, number) for number in (1, 2, 3)] == [830043460, 3866241594, 3822189696]


def test_branches_seeds_and_numbers_are_apart() -> None:
    first = {(seed, branch): int(generator(seed, branch).integers(2**63)) for seed in range(50) for branch in Branch}
    assert len(set(first.values())) == len(first)
    bouts = [bout_seed(seed, branch, number) for seed in range(5) for branch in Branch for number in range(100)]
    assert len(set(bouts)) >= len(bouts) - 1  # 3000 draws out of 2^32: one pair in a thousand such lists
    assert all(0 <= seed < 2**32 for seed in bouts)


def test_no_pose_is_in_two_branches() -> None:
    """Poses that an advice is chosen by are none that it was learnt from, and none that it is judged by; of any run."""
    for seed in range(20):
        runs = [run_seed(seed, number) for number in range(1, 9)]
        assert runs[0] == seed
        learnt = {bout_seed(run, Branch.COACHING_BOUTS, number) for run in runs for number in range(1, 301)}
        chosen = {bout_seed(seed, Branch.VALIDATION, number) for number in range(1, 61)}
        judged = {bout_seed(seed, Branch.HELD_OUT_BOUTS, number) for number in range(1, 101)}
        played = {bout_seed(seed, Branch.BOUTS, number) for number in range(1, 101)}
        tested = {bout_seed(seed, Branch.CHALLENGE, number) for number in range(1, 21)}
        branches = (learnt, chosen, judged, played, tested)
        assert len(set.union(*branches)) == sum(map(len, branches))


def test_branches_keep_their_numbers() -> None:
    """Renumbering one would change every run that a user can repeat now."""
    assert {branch.name: int(branch) for branch in Branch} == {
        "PAL": 1,
        "COACHING_BOUTS": 2,
        "HELD_OUT_BOUTS": 3,
        "BOUTS": 4,
        "SESSION": 5,
        "CONTROLLER": 6,
        "SURROUND": 7,
        "START_PLACES": 8,
        "SEARCH": 9,
        "VALIDATION": 10,
        "TOURNAMENT": 11,
        "RUNS": 12,
        "CHALLENGE": 13,
        "RIVALS": 14,
    }
