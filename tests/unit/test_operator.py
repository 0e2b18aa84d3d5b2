"""What a person or a signal asks for: it waits for a step, which takes it in once, and is then seen to once."""

from __future__ import annotations

import threading

import pytest

from hil.bridge.operator import CONTINUE, GUEST_STOP, INTERRUPT, INTERRUPTED, PARAMETERS, STOP, SUSPEND, Operator, OperatorInput


def test_nothing_is_asked_for_at_first() -> None:
    operator = Operator()
    assert (operator.serving, operator.waiting) == (False, False)
    assert (operator.take(), operator.pressed(), operator.signals()) == ((), [], [])


def test_what_is_asked_for_is_taken_in_once_and_in_order() -> None:
    operator = Operator()
    operator.ask("key w", "robot 2")
    operator.ask(SUSPEND)
    operator.ask("key x")
    assert bool(operator.waiting)
    assert operator.take() == (OperatorInput("key w", "robot 2"), OperatorInput(SUSPEND), OperatorInput("key x"))
    assert not bool(operator.waiting)
    assert operator.take() == ()


def test_nothing_is_seen_to_before_it_is_taken_in() -> None:
    operator = Operator()
    operator.ask("key w", "robot 2")
    operator.ask(SUSPEND)
    assert (operator.pressed(), operator.signals()) == ([], [])
    operator.take()
    assert operator.pressed() == [OperatorInput("key w", "robot 2")]
    assert operator.signals() == [SUSPEND]


def test_keys_and_signals_are_kept_apart_until_each_is_asked_for_and_told_once() -> None:
    operator = Operator()
    for what in ("key a", CONTINUE, "key b", SUSPEND):
        operator.ask(what)
        operator.take()
    assert operator.signals() == [CONTINUE, SUSPEND]
    assert operator.signals() == []
    assert [key.what for key in operator.pressed()] == ["key a", "key b"]
    assert operator.pressed() == []


@pytest.mark.parametrize("what", [INTERRUPT, INTERRUPTED])
def test_an_interrupt_is_neither_key_nor_signal(what: str) -> None:
    operator = Operator()
    operator.ask(what)
    assert operator.take() == (OperatorInput(what),)
    assert (operator.pressed(), operator.signals()) == ([], [])


def test_pressed_keys_are_fetched_when_a_step_takes_them_in() -> None:
    operator = Operator()
    strokes = [[OperatorInput("key w")], [], [OperatorInput("key a"), OperatorInput("key d", "robot 3")]]
    operator.keys = lambda: strokes.pop(0)
    assert operator.take() == (OperatorInput("key w"),)
    assert operator.take() == ()
    operator.ask(SUSPEND)
    assert operator.take() == (OperatorInput(SUSPEND), OperatorInput("key a"), OperatorInput("key d", "robot 3"))
    assert operator.pressed() == [OperatorInput("key w"), OperatorInput("key a"), OperatorInput("key d", "robot 3")]


def test_every_open_bridge_is_woken() -> None:
    operator = Operator()
    woken: list[str] = []
    first, second = (lambda: woken.append("first")), (lambda: woken.append("second"))
    operator.attach(first)
    operator.attach(second)
    operator.ask("key w")
    assert woken == ["first", "second"]
    operator.detach(first)
    operator.detach(first)
    assert bool(operator.serving)
    operator.ask("key w")
    assert woken == ["first", "second", "second"]
    operator.detach(second)
    assert not bool(operator.serving)
    operator.ask("key w")
    assert woken == ["first", "second", "second"]


def test_what_is_asked_for_can_be_seen_by_who_is_woken() -> None:
    operator = Operator()
    seen: list[tuple[OperatorInput, ...]] = []
    operator.attach(lambda: seen.append(operator.take()))
    operator.ask("key w")
    assert seen == [(OperatorInput("key w"),)]


def test_what_has_been_seen_to_otherwise_is_withdrawn_once() -> None:
    operator = Operator()
    for what in (SUSPEND, "key w", SUSPEND):
        operator.ask(what)
    operator.withdraw(SUSPEND)
    assert operator.take() == (OperatorInput("key w"), OperatorInput(SUSPEND))
    operator.withdraw(SUSPEND)  # it is taken in: too late, and no error
    assert operator.signals() == [SUSPEND]


def test_a_program_that_was_interrupted_between_two_steps_says_so_and_one_interrupted_by_a_step_does_not() -> None:
    between, by = Operator(), Operator()
    between.interrupted()
    assert between.take() == (OperatorInput(INTERRUPTED),)
    by.ask(INTERRUPT)
    by.take()
    by.interrupted()
    assert by.take() == ()


def test_nothing_is_lost_that_other_threads_ask_for() -> None:
    operator = Operator()

    def press(key: str) -> None:
        for number in range(500):
            operator.ask(f"key {key}", str(number))

    threads = [threading.Thread(target=press, args=(key,)) for key in "abcd"]
    for thread in threads:
        thread.start()
    taken: list[OperatorInput] = []
    while any(thread.is_alive() for thread in threads):
        taken += operator.take()
    taken += operator.take()
    for name in "abcd":
        assert [one.robot for one in taken if one.what == f"key {name}"] == [str(number) for number in range(500)]
    assert operator.pressed() == taken


def test_a_stop_is_one_whoever_asks_for_it() -> None:
    for what in (STOP, GUEST_STOP):
        operator = Operator()
        operator.ask(what)
        assert not operator.stops()
        operator.take()
        assert operator.stops()
        assert not operator.stops()


def test_parameters_are_read_of_the_robots_that_were_named() -> None:
    operator = Operator()
    for robot in ("3", "9", "3"):
        operator.ask(PARAMETERS, robot)
    assert operator.unread() == frozenset()
    operator.take()
    assert operator.unread() == {"3", "9"}
    assert operator.unread() == frozenset()
