"""What is shown runs beside: it gives way to whoever controls, and a part that takes long delays no word on the stop."""

from __future__ import annotations

import os
import sys
import threading

import pytest

from hil.look.live.showing import NICENESS, give_way, last_of_each_series
from hil.look.live.unfolding import Episode


@pytest.mark.skipif(sys.platform != "linux", reason="threads have no rank of their own")
def test_a_thread_gives_way_and_no_other() -> None:
    before = os.getpriority(os.PRIO_PROCESS, 0)
    ranks: list[int] = []

    def run() -> None:
        give_way()
        ranks.append(os.getpriority(os.PRIO_PROCESS, threading.get_native_id()))

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert ranks == [max(NICENESS, before)]
    assert os.getpriority(os.PRIO_PROCESS, 0) == before


def test_of_each_series_of_bouts_the_last_is_told() -> None:
    over = [Episode(float(at), at + 1.0, [], series=series) for at, series in enumerate(["a", "a", "b", "b", "c"])]
    assert [one.since for one in last_of_each_series(over)] == [1.0, 3.0, 4.0]
    assert last_of_each_series([]) == []
