"""A crew: results in order, batch after batch, by the same processes; who dies costs time, who always dies ends it."""

from __future__ import annotations

import multiprocessing
import os
from contextlib import closing
from pathlib import Path

import pytest
from crew_tasks import complain, die, die_once, process_of, wait_or_not

from firmware_protocol.errors import AddressError
from hil.working import Crew, WorkerError, open_crew
from hil.working.crew import MOST_DEATHS

pytestmark = pytest.mark.slow  # processes are started


@pytest.mark.parametrize("workers", [1, 2])
def test_batches_are_done_in_order_by_the_same_processes(workers: int) -> None:
    with open_crew(workers) as crew:
        assert list(crew.in_order(abs, [])) == []
        assert list(crew.in_order(abs, [-3, 2, -1, 4, -5])) == [3, 2, 1, 4, 5]
        first = {child.pid for child in multiprocessing.active_children()}
        assert len(first) == workers
        assert set(crew.in_order(process_of, range(9))) <= first
        assert os.getpid() not in first
    assert not multiprocessing.active_children()


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("workers", [1, 2])
def test_a_worker_that_dies_costs_only_time(workers: int, tmp_path: Path) -> None:
    with open_crew(workers) as crew:
        tasks = [(tmp_path / "died", number) for number in range(6)]
        assert list(crew.in_order(die_once, tasks)) == [0, 1, 4, 9, 16, 25]
        assert (tmp_path / "died").exists()
        assert list(crew.in_order(abs, [-1])) == [1]
    assert not multiprocessing.active_children()


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_task_that_always_kills_its_worker_is_given_up_when_all_before_it_has_been_had(tmp_path: Path) -> None:
    with open_crew(1) as crew:
        results = crew.in_order(die, [(tmp_path, number) for number in range(5)])
        had = [next(results) for _ in range(3)]
        with pytest.raises(WorkerError, match=r"3 of 5 tasks had been done\. Try again, with fewer --workers") as caught:
            next(results)
        assert caught.value.status == 1
        assert had == [0, 1, 2]
        assert list(crew.in_order(abs, [-1])) == [1]  # the crew is none the worse for it
    assert len(list(tmp_path.iterdir())) == MOST_DEATHS


def test_errors_of_a_task_pass_through_or_are_put_in_words() -> None:
    with open_crew(1) as crew:
        with pytest.raises(WorkerError, match="so it is") as caught:
            list(crew.in_order(complain, ["told"]))
        assert caught.value.status == 4
        with pytest.raises(AddressError, match=r"nowhere: is no place\. Look elsewhere") as other:
            list(crew.in_order(complain, ["ours"]))
        assert (other.value.url, other.value.remedy) == ("nowhere", "Look elsewhere")
        with pytest.raises(WorkerError, match="UntoldError: not told of"):
            list(crew.in_order(complain, ["told of"]))
        with pytest.raises(TypeError):
            list(crew.in_order(int, [[]]))  # type: ignore[arg-type]


def test_closing_breaks_off_what_is_left_and_the_crew_goes_on(tmp_path: Path) -> None:
    def begun(crew: Crew) -> None:
        tasks = [tmp_path / "a", tmp_path / "b"]
        with closing(crew.in_order(wait_or_not, [tmp_path / "not", *tasks])) as results:
            assert next(results) == "not"

    with open_crew(2) as crew:
        begun(crew)
        assert list(crew.in_order(abs, [-2])) == [2]
    assert not multiprocessing.active_children()


def fail_with(crew: Crew, mark: Path) -> None:
    """Fail while a worker is at a task without end."""
    results = crew.in_order(wait_or_not, [mark.with_name("not"), mark])
    assert next(results) == "not"
    raise ZeroDivisionError


def test_an_error_of_the_caller_ends_the_workers(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), open_crew(2) as crew:
        fail_with(crew, tmp_path / "a")
    assert not multiprocessing.active_children()
