"""The referee's word over a line that changes the order of frames."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import pytest

from firmware_protocol.errors import PeerError
from firmware_protocol.messages import BoutOutcome, Phase, RefereeState
from firmware_protocol.peer.exchanges.commands import Numbering
from hil.sumo.referee import LOOKS, NOBODY, RefereeHandle

RUNNING = replace(NOBODY, time=10.0, bout=3, elapsed=2.0, phase=Phase.RUNNING)
OVER = replace(RUNNING, time=11.0, elapsed=3.0, phase=Phase.OVER, outcome=BoutOutcome.WIN)
NEXT = replace(RUNNING, time=11.3, bout=4, elapsed=0.0)


class Robot:
    """A robot whose referee gives these answers, the last one for ever."""

    def __init__(self, *answers: RefereeState) -> None:
        self.answers = list(answers)
        self.asked = 0
        self.peer = self
        self.system = 1
        self.numbering = Numbering()

    def ask(self, *_: object) -> None:
        pass

    def request(self, *_: object) -> RefereeState:
        self.asked += 1
        return self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]

    def finish(self, answer: RefereeState | None) -> RefereeState | None:
        return answer


def referee(*answers: RefereeState) -> tuple[RefereeHandle, Robot]:
    robot = Robot(*answers)
    return RefereeHandle(cast("Any", robot)), robot


def test_what_was_overtaken_on_the_line_is_not_news() -> None:
    one, _ = referee(NEXT)
    for state in (RUNNING, OVER, NEXT):
        one.heard(state)
    one.heard(OVER)  # held up
    assert one.latest == NEXT
    one.heard(replace(NEXT, time=11.25))
    assert one.latest == NEXT


def test_an_emulator_that_was_started_anew_is_believed() -> None:
    one, _ = referee(NEXT)
    one.heard(NEXT)
    anew = replace(RUNNING, time=0.5, bout=1)
    one.heard(anew)
    assert one.latest == anew


def test_of_a_bout_that_is_over_the_first_word_counts() -> None:
    one, _ = referee(OVER)
    one.heard(OVER)
    one.heard(replace(OVER, time=11.1, clearance=-1.0))
    assert one.latest == OVER


def test_a_new_bout_is_looked_for_behind_a_late_word_of_the_last() -> None:
    one, robot = referee(OVER, replace(OVER, time=11.2), NEXT)
    one.heard(OVER)
    assert one.reset(5) == NEXT
    assert robot.asked == 3


def test_a_bout_that_does_not_begin_is_an_error() -> None:
    one, robot = referee(OVER)
    one.heard(OVER)
    with pytest.raises(PeerError, match="still number 3"):
        one.reset(5)
    assert robot.asked == LOOKS


def test_an_answer_older_than_what_is_known_does_not_count() -> None:
    one, _ = referee(replace(RUNNING, time=9.9, clearance=0.5))
    one.heard(RUNNING)
    assert one.state() == RUNNING
