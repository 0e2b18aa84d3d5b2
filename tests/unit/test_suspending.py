"""Ctrl-Z: the signals come in by the steps, the robots are told before the program stops, and are begun with anew."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING, cast

import pytest

import hil.terminal.suspending as suspending_module
from firmware_protocol.errors import PeerLostError
from firmware_protocol.peer.exchanges.exchange import Ticket
from hil.bridge.operator import CONTINUE, SUSPEND, Operator, OperatorInput
from hil.terminal.suspending import CAUSE, GAP, STOP_WAIT, STUCK, Suspension, around_stop

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil.bridge.bridge import Bridge
    from hil.sumo.junior import Junior

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGTSTP"), reason="this system has no such signals")


@pytest.fixture(autouse=True)
def _reads_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(suspending_module, "_READING", 0.0)


class Dumb:
    """A robot that never acknowledges the stop; a bridge whose link is not in lock-step, and the link itself.

    Attributes:
        told: Times it was asked to stop and disarm.
        begun: Causes for which it was begun with anew.
    """

    lockstep = False

    def __init__(self) -> None:
        self.told = 0
        self.begun: list[str] = []

    @property
    def link(self) -> Dumb:
        return self

    def ask_to_end(self) -> Ticket[object]:
        self.told += 1
        return Ticket("the stop")

    def begin_anew(self, cause: str) -> None:
        self.begun.append(cause)


class Rig:
    """A suspension, and steps that take in what is asked for as a bridge's do.

    Attributes:
        log: What was done, in order; of stopping this process there is only the note.
        during: Called in every step.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, replayed: bool = False) -> None:
        self.operator = Operator()
        self.dumb = Dumb()
        self.time = 0.0
        self.log: list[str] = []
        self.during: Callable[[], None] = lambda: None
        raise_signal = signal.raise_signal

        def raised(number: int) -> None:
            if number != signal.SIGTSTP or signal.getsignal(number) is not signal.SIG_DFL:
                raise_signal(number)
            else:
                self.log.append("stopped")

        monkeypatch.setattr(signal, "raise_signal", raised)
        self.suspension = Suspension(
            self.operator,
            lambda: [cast("Junior", self.dumb)],
            lambda: [cast("Bridge", self.dumb)],
            self.step,
            lambda: self.time,
            replayed=replayed,
        )

    def step(self, wait: float) -> tuple[OperatorInput, ...]:
        """Serve for so long, in s."""
        self.log.append("step")
        self.time += wait
        taken = self.operator.take()
        self.during()
        self.suspension.attend()
        return taken


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Rig:
    return Rig(monkeypatch)


def no_timer() -> bool:
    return signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_nothing_is_done_before_a_step_has_taken_the_signal_in(rig: Rig) -> None:
    with rig.suspension:
        signal.raise_signal(signal.SIGTSTP)
        rig.suspension.attend()
        assert (rig.dumb.told, rig.log) == (0, [])
        assert rig.step(0.05) == (OperatorInput(SUSPEND),)
        assert rig.dumb.told == 1
    assert rig.log.count("stopped") == 1
    assert rig.log[0] == "step"
    assert rig.dumb.begun == [CAUSE]
    assert no_timer()


def test_the_robots_have_half_a_second_to_acknowledge_it_before_the_program_stops(rig: Rig) -> None:
    with rig.suspension:
        signal.raise_signal(signal.SIGTSTP)
        rig.step(0.0)
    assert rig.log.index("stopped") == len(rig.log) - 1
    assert rig.time == pytest.approx(STOP_WAIT)


def test_robots_that_are_gone_do_not_keep_it_from_stopping(rig: Rig) -> None:
    def gone() -> None:
        if rig.dumb.told:
            raise PeerLostError("gone")

    rig.during = gone
    with rig.suspension:
        signal.raise_signal(signal.SIGTSTP)
        rig.step(0.05)
    assert rig.log == ["step", "step", "stopped"]
    assert rig.dumb.begun == [CAUSE]


def test_that_it_goes_on_is_told_and_begins_nothing_a_second_time(rig: Rig) -> None:
    with rig.suspension:
        signal.raise_signal(signal.SIGTSTP)
        rig.step(0.05)
        rig.time += 100.0
        assert rig.step(0.05) == (OperatorInput(CONTINUE),)
        assert rig.step(0.05) == ()
    assert rig.dumb.begun == [CAUSE]


def test_two_signals_before_it_is_stopped_stop_it_once(rig: Rig) -> None:
    rig.during = lambda: signal.raise_signal(signal.SIGTSTP)
    with rig.suspension:
        signal.raise_signal(signal.SIGTSTP)
        rig.step(0.05)
        rig.suspension.attend()
        assert no_timer()
    assert rig.log.count("stopped") == 1


def test_a_second_signal_stops_a_program_that_is_stuck_in_stopping_its_robots(rig: Rig) -> None:
    def stuck() -> None:
        if rig.dumb.told and "stopped" not in rig.log:
            signal.raise_signal(signal.SIGTSTP)
            assert signal.getitimer(signal.ITIMER_REAL)[0] == pytest.approx(STUCK, abs=0.5)
            signal.raise_signal(signal.SIGALRM)  # the time is over

    rig.during = stuck
    with rig.suspension:
        signal.raise_signal(signal.SIGTSTP)
        rig.step(0.05)
    assert rig.log[:3] == ["step", "step", "stopped"]
    assert rig.log.count("stopped") == 1
    assert rig.dumb.begun == [CAUSE]


def test_a_program_that_does_not_step_is_stopped_without_a_word_to_the_robots(rig: Rig) -> None:
    with rig.suspension:
        signal.raise_signal(signal.SIGTSTP)
        assert not no_timer()
        signal.raise_signal(signal.SIGALRM)
        assert (rig.log, rig.dumb.told) == (["stopped"], 0)
        rig.time += 5.0
        assert rig.step(0.05) == (OperatorInput(CONTINUE),)  # no step is told to stop it once more
    assert rig.log == ["stopped", "step"]
    assert (rig.dumb.told, rig.dumb.begun) == (0, [CAUSE])


def test_one_that_is_stuck_after_a_step_has_taken_the_signal_in_is_stopped_once(rig: Rig) -> None:
    def stuck() -> None:
        if "stopped" not in rig.log:
            signal.raise_signal(signal.SIGALRM)

    rig.during = stuck
    with rig.suspension:
        signal.raise_signal(signal.SIGTSTP)
        rig.step(0.05)
        assert rig.log.count("stopped") == 1
        assert (rig.dumb.told, rig.dumb.begun) == (1, [CAUSE])  # as a log has it, in which the signal is
        rig.step(0.05)
        signal.raise_signal(signal.SIGTSTP)
        rig.step(0.05)
    assert rig.log.count("stopped") == 2


@pytest.mark.parametrize(("gap", "begun"), [(GAP - 0.1, []), (GAP + 0.1, [CAUSE])])
def test_one_that_was_stopped_by_others_for_long_begins_anew(rig: Rig, gap: float, begun: list[str]) -> None:
    with rig.suspension:
        rig.step(0.05)
        signal.raise_signal(signal.SIGCONT)
        rig.step(gap)
    assert (rig.dumb.begun, rig.dumb.told) == (begun, 0)


def test_robots_that_play_a_contest_are_left_alone(rig: Rig) -> None:
    rig.suspension.plays_on = True
    with rig.suspension:
        signal.raise_signal(signal.SIGTSTP)
        rig.step(0.05)
    assert rig.log == ["step", "stopped"]
    assert (rig.dumb.told, rig.dumb.begun) == (0, [])


def test_robots_in_lock_step_stop_when_the_program_does(rig: Rig) -> None:
    rig.dumb.lockstep = True
    with rig.suspension:
        signal.raise_signal(signal.SIGTSTP)
        rig.step(0.05)
    assert rig.log == ["step", "stopped"]
    assert (rig.dumb.told, rig.dumb.begun) == (0, [])


def test_the_signals_of_a_log_stop_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch, replayed=True)
    monkeypatch.setattr(suspending_module, "_READING", float("inf"))  # nor does it wait
    before = [signal.getsignal(number) for number in (signal.SIGTSTP, signal.SIGCONT, signal.SIGALRM)]
    with rig.suspension:
        assert [signal.getsignal(number) for number in (signal.SIGTSTP, signal.SIGCONT, signal.SIGALRM)] == before
        rig.operator.ask(SUSPEND)
        rig.step(0.05)
        rig.time += 100.0
        rig.operator.ask(CONTINUE)
        rig.step(0.05)
    assert "stopped" not in rig.log
    assert (rig.dumb.told, rig.dumb.begun) == (1, [CAUSE])


def test_what_is_to_be_as_it_was_meanwhile_is_given_back_and_taken_again(rig: Rig) -> None:
    with (
        rig.suspension,
        around_stop(lambda: rig.log.append("outer back"), lambda: rig.log.append("outer again")),
        around_stop(lambda: rig.log.append("inner back"), lambda: rig.log.append("inner again")),
    ):
        signal.raise_signal(signal.SIGTSTP)
        signal.raise_signal(signal.SIGALRM)
    assert rig.log == ["inner back", "outer back", "stopped", "outer again", "inner again"]


def test_handlers_are_as_they_were_afterwards(rig: Rig) -> None:
    before = [signal.getsignal(number) for number in (signal.SIGTSTP, signal.SIGCONT, signal.SIGALRM)]
    with rig.suspension:
        signal.raise_signal(signal.SIGTSTP)
    assert [signal.getsignal(number) for number in (signal.SIGTSTP, signal.SIGCONT, signal.SIGALRM)] == before
    assert no_timer()


def test_a_shell_that_has_the_signal_ignored_is_obeyed(rig: Rig) -> None:
    before = signal.signal(signal.SIGTSTP, signal.SIG_IGN)
    try:
        with rig.suspension:
            signal.raise_signal(signal.SIGTSTP)
            assert rig.step(0.05) == ()
    finally:
        signal.signal(signal.SIGTSTP, before)
    assert rig.log == ["step"]
