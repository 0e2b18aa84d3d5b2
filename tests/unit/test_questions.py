"""What a run asks of a person: by keys, on the live page, once each; and rings beside which a person stands."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

import hil
from firmware_protocol.errors import RefusedError
from firmware_protocol.messages import BoutOutcome
from firmware_protocol.vocabulary import Action, Maneuver
from hil.bridge.operator import CHOICES, DRAWN, LOST, PAUSE, READY, RESUME, WON, Operator
from hil.look.live.choices import Choices
from hil.look.live.overhearing import Overheard
from hil.mcaplog.records import EventRecord
from hil.operator_words import INPUTS
from hil.questions import ASKED, KEYS, Questions
from hil.sumo.attended import JudgedRing, PausedRing
from hil.sumo.ring import OpenRing, open_ring

if TYPE_CHECKING:
    from collections.abc import Callable

STILL = Maneuver((Action.S,), period=0.1, floor_reflex=False)


def test_every_choice_has_a_key_of_its_own_and_words() -> None:
    assert set(KEYS) == CHOICES
    assert len(set(KEYS.values())) == len(CHOICES)
    assert set(INPUTS) >= CHOICES


@pytest.mark.parametrize("said", [WON, f"key {KEYS[WON]}"])
def test_an_answer_is_taken_once_and_only_where_it_was_asked_for(said: str) -> None:
    operator, told = Operator(), list[str]()
    questions = Questions(operator, None, told.append)
    questions.ask("How does it end?", (WON, LOST))
    assert told == ["How does it end? (w: won, l: lost)"]
    operator.ask(DRAWN)
    operator.ask(said)
    assert questions.answer() == ""
    operator.take()
    assert questions.answer() == WON
    operator.ask(said)
    operator.take()
    assert questions.answer() == ""


def test_what_was_said_before_is_no_answer_and_keys_are_not_where_nobody_is_at_the_terminal() -> None:
    operator = Operator()
    questions = Questions(operator, None, None)
    operator.ask(WON)
    operator.take()
    questions.ask("How does it end?", (WON,))
    operator.ask("key w")
    operator.take()
    assert questions.answer() == ""


def asked(text: str, *choices: str, kind: str = ASKED) -> Overheard:
    """An entry that asks."""
    event = EventRecord(kind, text, json.dumps({"choices": choices}))
    return Overheard("/events", 1.0, ASKED.encode(), lambda _: (event, None))


def test_the_page_may_answer_what_is_asked_for_and_nobody_answers_twice() -> None:
    passed, told = list[str](), list[dict[str, Any]]()
    choices = Choices(passed.append, lambda text: told.append(json.loads(text)))
    assert set(choices.inputs) == CHOICES
    assert choices.choose(WON) == {"taken": False}
    choices.hear([asked("Bout 1", WON, LOST, "format"), asked("won", WON, kind="bout")])
    assert told == [{"text": "Bout 1", "choices": [WON, LOST]}]
    assert choices.choose(READY) == {"taken": False}
    assert choices.inputs[WON]() == {"taken": True}
    assert choices.inputs[LOST]() == {"taken": False}
    assert passed == [WON]


class Person:
    """Answers each question when it is asked: by what is said of it."""

    def __init__(self, *answers: str) -> None:
        self.operator = Operator()
        self.junior = hil.connect("sim://junior?seed=2", operator=self.operator)
        self.questions = Questions(self.operator, None, None)
        self.answers = list(answers)
        self.armed: list[bool | None] = []
        self.junior.between = self._between
        self._open: tuple[str, ...] = ()

    def _between(self) -> None:
        if self.questions.open and self.questions.open is not self._open and self.answers:
            self._open = self.questions.open
            self.armed.append(self.junior.armed)
            self.operator.ask(self.answers.pop(0))


@pytest.mark.parametrize(("verdict", "outcome"), [(WON, BoutOutcome.WIN), (LOST, BoutOutcome.LOSS), (DRAWN, BoutOutcome.DRAW)])
def test_a_person_sets_the_ring_up_and_says_how_the_bout_ends(verdict: str, outcome: BoutOutcome) -> None:
    person = Person(READY, verdict)
    with person.junior as junior:
        junior.arm()
        ring = JudgedRing(junior, person.questions, "flat-light")
        before = junior.now()
        ring.begin(1)
        assert junior.now() - before >= 5.0  # the countdown
        done = ring.engage(STILL)
        assert (done.outcome, done.progress, person.questions.open) == (outcome, None, ())
        assert done.elapsed == pytest.approx(0.1, abs=0.1)
        assert person.armed == [False, True]


def test_a_person_is_asked_to_place_both_robots_as_before_where_the_poses_are_to_be_the_same() -> None:
    person = Person(READY, WON, READY, WON, READY)
    with person.junior as junior:
        asked = list[str]()
        person.questions = Questions(person.operator, None, asked.append)
        ring = JudgedRing(junior, person.questions)
        for seed in (1, 2, 2):
            ring.begin(seed)
    assert [text.partition(",")[0] for text in asked if "set up" in text] == [
        "Bout 1: set up both robots",
        "Bout 2: set up both robots",
        "Bout 3: set up both robots as for the bout before",
    ]


def test_a_bout_goes_on_until_somebody_says_how_it_ended() -> None:
    person = Person(READY)
    with person.junior as junior:
        ring = JudgedRing(junior, person.questions)
        ring.begin(1)
        assert [ring.engage(STILL).outcome for _ in range(3)] == [BoutOutcome.UNDECIDED] * 3


def test_an_emergency_stop_ends_the_wait_and_is_not_released_by_setting_the_ring_up() -> None:
    person = Person()
    with person.junior as junior:
        ring = JudgedRing(junior, person.questions)

        def press() -> None:
            if person.questions.open and not junior.stopped:
                junior.ask_emergency_stop()

        junior.between = press
        for _ in range(2):
            with pytest.raises(RefusedError, match="emergency stop"):
                ring.begin(1)
        junior.wait(1.0)
        assert junior.state.name == "STOPPED"


@pytest.mark.parametrize("kind", [open_ring, OpenRing])
def test_a_pause_begins_before_the_next_bout_or_maneuver_and_disarms(kind: Callable[..., Any]) -> None:
    person = Person(PAUSE, RESUME)
    with person.junior as junior:
        junior.arm()
        ring = PausedRing(kind(junior), junior, person.questions)
        ring.begin(1)
        ring.engage(STILL)
        if ring.refereed:
            assert person.armed == [True]
            ring.begin(2)
        else:
            ring.engage(STILL)
        assert person.armed == [True, False]
        assert junior.armed
        assert person.questions.open == (PAUSE,)
