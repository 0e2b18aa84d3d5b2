"""Ctrl-C, a polite kill, a closed terminal: a step takes the first one in, and everything else is raised at once."""

from __future__ import annotations

import signal

import pytest

from hil.bridge.operator import INTERRUPT, Operator, OperatorInput
from hil.terminal.interrupts import SIGNALS, interrupts

NUMBERS = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]


def serving() -> Operator:
    """An operator with a bridge that is open."""
    operator = Operator()
    operator.attach(lambda: None)
    return operator


@pytest.mark.parametrize("number", NUMBERS)
def test_the_next_step_takes_it_in(number: signal.Signals) -> None:
    operator = serving()
    with interrupts(operator):
        signal.raise_signal(number)
        assert operator.take() == (OperatorInput(INTERRUPT),)


@pytest.mark.parametrize("second", NUMBERS)
@pytest.mark.parametrize("first", NUMBERS)
def test_a_second_one_is_raised_at_once(first: signal.Signals, second: signal.Signals) -> None:
    operator = serving()
    with interrupts(operator):
        signal.raise_signal(first)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(second)
    assert operator.take() == (OperatorInput(INTERRUPT),)


@pytest.mark.parametrize("operator", [None, Operator()], ids=["nobody", "no bridge"])
@pytest.mark.parametrize("number", NUMBERS)
def test_without_an_open_bridge_it_is_raised_at_once(number: signal.Signals, operator: Operator | None) -> None:
    with interrupts(operator):
        for _ in range(2):
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(number)
    assert operator is None or operator.take() == ()


def test_a_bridge_that_was_closed_takes_nothing_in() -> None:
    def wake() -> None:
        pytest.fail("it is closed")

    operator = Operator()
    operator.attach(wake)
    operator.detach(wake)
    with interrupts(operator), pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("number", NUMBERS)
def test_what_is_ignored_stays_ignored(number: signal.Signals) -> None:
    operator = serving()
    before = signal.signal(number, signal.SIG_IGN)
    try:
        with interrupts(operator):
            signal.raise_signal(number)
            assert signal.getsignal(number) is signal.SIG_IGN
        assert signal.getsignal(number) is signal.SIG_IGN
    finally:
        signal.signal(number, before)
    assert operator.take() == ()


def test_handlers_are_as_they_were_afterwards_also_after_an_error() -> None:
    before = [signal.getsignal(number) for number in NUMBERS]
    with pytest.raises(ZeroDivisionError), interrupts(serving()):
        raise ZeroDivisionError
    assert [signal.getsignal(number) for number in NUMBERS] == before
