"""An advice as slots of a robot's memory, and what happens when they do not read back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.memory_table import MemorySlot, memory_checksum
from firmware_protocol.roles.junior import write_memory
from firmware_protocol.vocabulary import ANY_STIMULUS, BASIC_ACTIONS, Action, Maneuver
from hil.sumo import deploying
from hil.sumo.connecting import connect
from hil.sumo.deploying import DeployError, deploy, plan_memory, read_memory
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings

if TYPE_CHECKING:
    from hil.sumo.junior import Junior

EYES = 3
MANY = 300


def make_advice(*entries: tuple[int, int, str], arms: bool = False) -> Advice:
    """An advice from (previous, current, actions); the later an entry, the more often it was tried."""
    made = tuple(
        AdviceEntry(previous, current, tuple(Action[name] for name in actions.split()), 1.0, tried)
        for tried, (previous, current, actions) in enumerate(entries, start=1)
    )
    return Advice(PalSettings(arms_in_stimulus=arms), made)


SMALL = make_advice((ANY_STIMULUS, 0, "L L"), (ANY_STIMULUS, 1, "L F"), (ANY_STIMULUS, 2, "R F"), (ANY_STIMULUS, 3, "F F"))


def robot_finds(slots: tuple[MemorySlot, ...], previous: int, current: int) -> Maneuver | None:
    """The rule by which the firmware looks its memory up in a contest (core/contest.c)."""
    table = {slot.key: slot.maneuver for slot in slots}
    for key in ((previous, current), (ANY_STIMULUS, current), (ANY_STIMULUS, current & EYES)):
        if key in table:
            return table[key]
    return None


def test_an_entry_for_every_stimulus_takes_a_slot_each() -> None:
    plan = plan_memory(SMALL, 32)
    assert [slot.key for slot in plan.slots] == [(ANY_STIMULUS, current) for current in range(4)]
    assert [str(slot.maneuver) for slot in plan.slots] == ["L L", "L F", "R F", "F F"]
    assert (plan.arms, plan.left_out) == (False, ())


def test_a_stimulus_that_never_came_up_gets_the_maneuver_that_was_tried_most() -> None:
    plan = plan_memory(make_advice((ANY_STIMULUS, 0, "L L"), (ANY_STIMULUS, 3, "F F")), 32)
    assert [str(slot.maneuver) for slot in plan.slots] == ["L L", "F F", "F F", "F F"]


@st.composite
def advices(draw: st.DrawFn) -> Advice:
    arms = draw(st.booleans())
    codes = st.integers(0, 15 if arms else EYES)
    keys = draw(st.lists(st.tuples(codes | st.just(ANY_STIMULUS), codes), min_size=1, max_size=40, unique=True))
    actions = st.lists(st.sampled_from(sorted(BASIC_ACTIONS)), min_size=1, max_size=2)
    entries = tuple(AdviceEntry(*key, tuple(draw(actions)), 0.0, draw(st.integers(1, 100))) for key in keys)
    return Advice(PalSettings(arms_in_stimulus=arms), entries)


@given(advices())
def test_with_room_enough_the_robot_chooses_as_the_host_would(advice: Advice) -> None:
    plan = plan_memory(advice, MANY)
    assert not plan.left_out
    stimuli = range(16 if plan.arms else 4)
    for current in stimuli:
        for previous in stimuli:
            assert robot_finds(plan.slots, previous, current) == advice.choose(current, previous)


@given(advices(), st.integers(4, 40))
def test_without_room_the_robot_still_has_an_answer_to_everything(advice: Advice, capacity: int) -> None:
    plan = plan_memory(advice, capacity)
    assert len(plan.slots) <= capacity
    whole = plan_memory(advice, MANY)
    assert sorted(slot.key for slot in plan.slots + plan.left_out) == [slot.key for slot in whole.slots]
    stimuli = range(16 if plan.arms else 4)
    assert all(robot_finds(plan.slots, previous, current) for current in stimuli for previous in stimuli)


def test_what_was_tried_least_is_left_out_first() -> None:
    pairs = [(previous, 0, "B") for previous in range(4)]
    plan = plan_memory(make_advice(*pairs[:3], (ANY_STIMULUS, 0, "F"), (3, 0, "R")), 6)
    assert [slot.situation for slot in plan.left_out] == ["none, before: none", "none, before: left"]


def test_fewer_slots_than_the_eyes_need_are_refused() -> None:
    with pytest.raises(DeployError, match="3 slots"):
        plan_memory(SMALL, 3)


def test_a_robot_holds_what_was_deployed_and_nothing_else() -> None:
    with connect("sim://junior?opponent=flat-light") as junior:
        assert read_memory(junior) == ([], memory_checksum([]))
        stale = Maneuver((Action.B,))
        junior.finish(write_memory(junior.peer, 2, 2, stale))
        done = deploy(junior, SMALL)
        assert (done.written, done.kept, done.erased) == (4, 0, 1)
        assert read_memory(junior) == (list(done.plan.slots), done.checksum)
        again = deploy(junior, SMALL)
        assert (again.written, again.kept, again.erased) == (0, 4, 0)
        assert again.checksum == done.checksum
        assert junior.parameter("STIM_ARMS") == 0


def test_a_robot_is_told_whether_its_arms_count() -> None:
    advice = make_advice((ANY_STIMULUS, 3, "F"), (ANY_STIMULUS, 15, "FF"), arms=True)
    with connect("sim://junior") as junior:
        done = deploy(junior, advice)
        assert junior.parameter("STIM_ARMS") == 1
        assert [slot.current for slot in done.plan.slots] == [0, 1, 2, 3, 15]  # touching alone changes nothing else


def test_a_slot_that_does_not_read_back_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def worn(junior: Junior) -> tuple[list[MemorySlot], int]:
        slots, checksum = read_memory(junior)
        return [slot if slot.current != 2 else MemorySlot(*slot.key, Maneuver((Action.S,))) for slot in slots], checksum

    with connect("sim://junior") as junior:
        monkeypatch.setattr(deploying, "read_memory", worn)
        with pytest.raises(DeployError, match=r"does not hold for right .*hil check"):
            deploy(junior, SMALL)


def test_a_wrong_checksum_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(deploying, "read_memory", lambda junior: (read_memory(junior)[0], 0x1234))
    with connect("sim://junior") as junior, pytest.raises(DeployError, match="checksum is 0x1234"):
        deploy(junior, SMALL)
