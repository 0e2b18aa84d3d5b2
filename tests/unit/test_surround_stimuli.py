"""Stimuli: which patterns are alike, how they are numbered, and which sector a behaviour means."""

from __future__ import annotations

import numpy as np
import pytest

from pal_advisor.surround import stimuli_of
from pal_advisor.surround.stimuli import mirrored, turned

EIGHT = stimuli_of(8)
ALL = np.arange(256)
BEHAVIOURS = np.arange(1, 9)


def symmetries(pattern: str) -> list[tuple[int, ...]]:
    """The ways of a pattern onto itself, as places of the sectors, by trying all 2 N rotations and reflections as text."""
    count = len(pattern)
    ways = [tuple((place + step) % count for place in range(count)) for step in range(count)]
    ways += [tuple(reversed(way)) for way in ways]
    return [way for way in ways if "".join(pattern[place] for place in way) == pattern]


def sectors_of(pattern: int) -> list[int]:
    """The sectors that B1 to B8 mean."""
    return [int(sector) for sector in EIGHT.to_sector(np.full(8, pattern), BEHAVIOURS)]


@pytest.mark.parametrize(
    ("sectors", "count"), [(1, 2), (2, 3), (3, 4), (4, 6), (5, 8), (6, 13), (7, 18), (8, 30), (9, 46), (16, 2250)]
)
def test_so_many_stimuli_there_are(sectors: int, count: int) -> None:
    stimuli = stimuli_of(sectors)
    assert len(stimuli) == count
    assert set(stimuli.number.tolist()) == set(range(1, count + 1))


@pytest.mark.parametrize("sectors", range(1, 10))
def test_the_canonical_pattern_is_the_smallest_of_all_rotations_and_reflections(sectors: int) -> None:
    stimuli = stimuli_of(sectors)
    for value in range(1 << sectors):
        text = f"{value:0{sectors}b}"
        alike = [each[step:] + each[:step] for each in (text, text[::-1]) for step in range(sectors)]
        assert stimuli.text(int(stimuli.number[value])) == min(alike)


@pytest.mark.parametrize("sectors", range(1, 10))
def test_stimuli_are_numbered_by_ones_and_then_by_value(sectors: int) -> None:
    patterns = stimuli_of(sectors).patterns.tolist()
    assert patterns == sorted(patterns, key=lambda value: (value.bit_count(), value))


@pytest.mark.parametrize(
    ("number", "pattern"),
    [(1, "00000000"), (2, "00000001"), (3, "00000011"), (4, "00000101"), (7, "00000111"), (8, "00001011"), (13, "00010111")],
)
def test_the_numbers_are_those_of_the_book(number: int, pattern: str) -> None:
    assert EIGHT.text(number) == pattern
    assert EIGHT.number[int(pattern, 2)] == number


def test_the_books_stimulus_25_has_the_number_23() -> None:
    number = int(EIGHT.number[0b01110101])
    assert (number, EIGHT.text(number)) == (23, "01010111")


def test_a_ring_has_1_to_16_sectors() -> None:
    for sectors in (0, 17):
        with pytest.raises(ValueError, match=f"1 to 16 sectors, not {sectors}"):
            stimuli_of(sectors)


@pytest.mark.parametrize("sectors", [1, 2, 5, 8, 9])
def test_the_sector_of_a_behaviour_lies_to_the_pattern_as_the_behaviour_to_the_canonical_one(sectors: int) -> None:
    stimuli = stimuli_of(sectors)
    for value in range(1 << sectors):
        place = stimuli.to_sector(np.full(sectors, value), np.arange(1, sectors + 1)).tolist()
        seen = f"{value:0{sectors}b}"
        assert "".join(seen[sector - 1] for sector in place) == stimuli.text(int(stimuli.number[value]))
        steps = {(after - before) % sectors for before, after in zip(place, place[1:] + place[:1], strict=True)}
        assert len(steps) == 1
        assert steps <= {1 % sectors, sectors - 1}


@pytest.mark.parametrize(
    ("pattern", "sectors"),
    [
        ("00000001", [1, 2, 3, 4, 5, 6, 7, 8]),  # canonical as it is
        ("10000000", [2, 3, 4, 5, 6, 7, 8, 1]),  # unreflected, although its mirror image is canonical with less shift
        ("00011000", [6, 7, 8, 1, 2, 3, 4, 5]),  # Fig. 6.9 b
        ("00001101", [4, 3, 2, 1, 8, 7, 6, 5]),  # only its mirror image 10110000 gets to 00001011, by a shift of 4
        ("00010001", [1, 2, 3, 4, 5, 6, 7, 8]),  # by a shift of 0, and by one of 4
        ("10001000", [2, 3, 4, 5, 6, 7, 8, 1]),
    ],
)
def test_of_several_ways_the_unreflected_come_first_then_the_smallest_shift(pattern: str, sectors: list[int]) -> None:
    assert sectors_of(int(pattern, 2)) == sectors


def test_96_patterns_of_8_have_a_frame_of_their_own() -> None:
    assert sum(len(symmetries(f"{value:08b}")) == 1 for value in range(256)) == 96


@pytest.mark.parametrize("step", range(8))
def test_turning_the_world_against_the_robot_turns_its_moves(step: int) -> None:
    """The sectors shift along with the pattern; where the pattern is its own rotation, up to that."""
    for value, after in zip(ALL.tolist(), turned(ALL, step, 8).tolist(), strict=True):
        rotations = [way for way in symmetries(f"{value:08b}") if (way[1] - way[0]) % 8 == 1]
        moved = [(sector - 1 - step) % 8 + 1 for sector in sectors_of(value)]
        allowed = [[(sector - 1 + way[0]) % 8 + 1 for sector in moved] for way in rotations]
        assert sectors_of(after) in allowed


def test_mirroring_the_world_mirrors_the_moves() -> None:
    """Exactly where the canonical frame is unique, and up to the pattern's own symmetry elsewhere."""
    exact = 0
    for value, after in zip(ALL.tolist(), mirrored(ALL, 8).tolist(), strict=True):
        ways = symmetries(f"{value:08b}")
        images = [[way[sector - 1] + 1 for sector in sectors_of(value)] for way in ways]
        allowed = [[9 - sector for sector in image] for image in images]
        assert sectors_of(after) in allowed
        exact += len(ways) == 1
    assert exact == 96


def test_turning_and_mirroring_are_those_of_the_book() -> None:
    assert turned(np.array([0b00010110]), 3, 8).tolist() == [0b10110000]
    assert mirrored(np.array([0b00010110]), 8).tolist() == [0b01101000]
