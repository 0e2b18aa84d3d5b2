"""A run of the surround task as a function: the same in any thread, as picklable values, with nothing left running."""

from __future__ import annotations

import pickle
import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial

from hil.swarm.missions.surround_run import play
from hil.swarm.missions.surround_settings import SurroundSettings
from pal_advisor.surround import Case

CASE = Case.parse("R5W2")
SETTINGS = SurroundSettings(steps=2)


def test_the_same_comes_out_in_every_thread_and_none_is_left() -> None:
    before = threading.active_count()
    here = play(SETTINGS, CASE, 3)
    assert threading.active_count() == before
    with ThreadPoolExecutor(2) as pool:
        for there in pool.map(partial(play, SETTINGS, CASE), [3] * 4):  # two at once
            assert pickle.dumps(there) == pickle.dumps(here)
    assert here[1].to_dict() != play(SETTINGS, CASE, 4)[1].to_dict()


def test_every_state_comes_with_its_time() -> None:
    states, outcome = play(SETTINGS, CASE, 1)
    assert [state.step for state in states] == [0, 1, 2]
    assert 0.0 < states[0].seconds < states[1].seconds < states[2].seconds == outcome.history.seconds
    assert [state.distance for state in states] == outcome.history.series["distance"]


def test_the_case_is_what_is_played_whatever_the_settings_name() -> None:
    long = Case.parse("R5W2S2")
    _, outcome = play(SurroundSettings(case="S1", steps=1), long, 1)
    _, named = play(SurroundSettings(case="R5W2S2", steps=1), long, 1)
    assert outcome.case == long
    assert outcome.to_dict() == named.to_dict()
