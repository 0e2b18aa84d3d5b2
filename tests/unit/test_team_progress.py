"""What a terminal shows of several coachings, and how workers tell of them."""

from __future__ import annotations

from io import StringIO

import pytest
from rich.console import Console

from hil.jobs.team_progress import TeamDisplay
from hil.working.progress import NUMBERS, PLACES, ProgressBoard


def shown(display: TeamDisplay) -> str:
    """What is to be seen of a display."""
    console = Console(file=StringIO(), width=100)
    with console.capture() as found:
        console.print(display._render())
    return found.get()


def test_a_bar_for_each_run_then_for_the_exam_then_for_the_bouts() -> None:
    board = ProgressBoard()
    display = TeamDisplay(Console(file=StringIO()), 3, board.read, quiet=False)
    board.tell(1, 0.25, 0.5)
    board.tell(2, 0.1, -1.0)
    lines = shown(display).splitlines()
    assert [line.split()[:2] for line in lines] == [["Run", "1"], ["Run", "2"], ["Run", "3"]]
    assert [line.split("%")[0].split()[-1] for line in lines] == ["0", "25", "10"]
    assert ["won" in line for line in lines] == [False, True, False]
    assert "won 50% of its last bouts" in lines[1]
    display.run_over(0)
    assert "100%" in shown(display).splitlines()[0]
    display.examined(30, 120)
    assert ("Run" in shown(display), "Team exam" in shown(display), "25%" in shown(display)) == (False, True, True)
    display.played(7, 70)
    assert "Team exam" not in shown(display)
    assert "10%" in shown(display)


@pytest.mark.parametrize("place", [-1, PLACES])
def test_tasks_that_have_no_place_are_not_told_of(place: int) -> None:
    board = ProgressBoard()
    board.tell(place, 1.0, 1.0)
    assert board.read(place) == (0.0,) * NUMBERS
    assert all(board.read(other) == (0.0,) * NUMBERS for other in range(PLACES))
