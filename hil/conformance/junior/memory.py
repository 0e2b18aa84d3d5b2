"""The maneuver memory: what is stored, found, replaced, erased, and still there after power-off."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.memory_table import MemorySlot, memory_checksum
from firmware_protocol.messages import JuniorMemoryEntry, ManeuverOption, Reason
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from hil.conformance.registry import Group, given, require

if TYPE_CHECKING:
    from firmware_protocol.messages import JuniorMemoryWrite
    from hil.conformance.subject import Subject

GROUP: Final = Group("memory", role=JUNIOR.name)
_ONE: Final = (Action.FF, Action.SB)
_TWO: Final = (Action.LBRF, Action.MF, Action.LFRS)
_EIGHT: Final = (Action.LSRF, Action.LBRS, Action.LBRF, Action.LFRS, Action.LSRB, Action.LFRB, Action.S, Action.B)
_STIMULI: Final = 16


def _same(entry: JuniorMemoryEntry | None, wanted: JuniorMemoryWrite) -> None:
    """See that a slot holds what was written."""
    entry = given(entry, "what was written is not found")
    for name in ("previous", "current", "period", "options", "count", "actions"):
        found, written = getattr(entry, name), getattr(wanted, name)
        require(found == written, f"{name} was written as {written} and is read as {found}")


def _free_key(robot: Subject) -> tuple[int, int]:
    """A pair (previous, current) that has no slot."""
    used = {(entry.previous, entry.current) for entry in robot.memory_found or ()}
    return next((p, c) for p in range(_STIMULI) for c in range(_STIMULI) if (p, c) not in used)


@GROUP.check("memory-written-and-read", rule="JUNIOR_MEMORY_WRITE")
def written(robot: Subject) -> str:
    """What is written to the memory is read back, by stimuli and by index."""
    with robot.emptied_memory():
        options = ManeuverOption.FLOOR_REFLEX | ManeuverOption.ARMS
        second = robot.write(_EIGHT, current=15, previous=15, period=5.0, options=15)
        robot.expect(second, Reason.NONE)
        first = robot.write(_TWO, current=3, previous=7, period=0.123, options=options)
        robot.expect(first, Reason.NONE)
        for index, message in enumerate((first, second)):
            _same(robot.read(current=message.current, previous=message.previous), message)
            _same(robot.read(index), message)
        entry = given(robot.read(1), "the second slot is not found")
        require((entry.used, entry.index) == (2, 1), f"used and index are {(entry.used, entry.index)}, not (2, 1)")
    return "2 slots"


@GROUP.check("memory-not-found", rule="JUNIOR_MEMORY_READ")
def not_found(robot: Subject) -> str:
    """Asking for a slot that is not there is refused by NOT_FOUND."""
    robot.need_memory()
    previous, current = _free_key(robot)
    require(robot.read(current=current, previous=previous) is None, f"({previous}, {current}) is found")
    require(robot.read(254) is None, "index 254 is found")
    return "by stimuli, by index"


@GROUP.check("memory-any-is-a-key", rule="JUNIOR_MEMORY_WRITE")
def any_previous(robot: Subject) -> str:
    """The previous stimulus ANY has a slot of its own."""
    with robot.emptied_memory():
        to_any = robot.write(_ONE, current=2)
        robot.expect(to_any, Reason.NONE)
        require(robot.read(current=2, previous=1) is None, "the slot of ANY is found for a certain previous stimulus")
        certain = robot.write(_TWO, current=2, previous=1)
        robot.expect(certain, Reason.NONE)
        _same(robot.read(current=2), to_any)
        _same(robot.read(current=2, previous=1), certain)
        order = [entry.previous for entry in robot.read_memory()]
        require(order == [1, ANY_STIMULUS], f"the slots are in the order {order}")
    return "beside a certain one"


@GROUP.check("memory-replaced", rule="JUNIOR_MEMORY_WRITE")
def replaced(robot: Subject) -> str:
    """Writing to the same stimuli again replaces the maneuver."""
    with robot.emptied_memory():
        for actions in (_ONE, _TWO, _EIGHT, _ONE):
            message = robot.write(actions, current=1)
            robot.expect(message, Reason.NONE)
            entries = robot.read_memory()
            require(len(entries) == 1, f"{len(entries)} slots are used")
            _same(entries[0], message)
    return "4 times"


@GROUP.check("memory-erased", rule="JUNIOR_MEMORY_WRITE")
def erased(robot: Subject) -> str:
    """Count 0 erases a slot; erasing what is not there is accepted."""
    with robot.emptied_memory():
        for current in (1, 2):
            robot.expect(robot.write(_ONE, current=current), Reason.NONE)
        robot.expect(robot.erase(1), Reason.NONE, "that erases")
        left = [entry.current for entry in robot.read_memory()]
        require(left == [2], f"after erasing 1 of 1 and 2, {left} are left")
        robot.expect(robot.erase(1), Reason.NONE, "that erases nothing")
        robot.expect(robot.write(_ONE, current=4), Reason.NONE)
        robot.expect(robot.erase(), Reason.NONE, "that erases all")
        require(robot.read(0) is None, "after erasing all there is a slot")
    return "one, none, all"


@GROUP.check("memory-checksum", rule="JUNIOR_MEMORY_ENTRY")
def right_checksum(robot: Subject) -> str:
    """The checksum is that of the used slots, in order, as stored."""
    with robot.emptied_memory():
        for actions, current, previous in ((_ONE, 3, 2), (_TWO, 0, ANY_STIMULUS), (_EIGHT, 1, 0), (_TWO, 3, 2)):
            robot.expect(robot.write(actions, current=current, previous=previous), Reason.NONE)
            entries = robot.read_memory()
            wanted = memory_checksum(map(MemorySlot.of, entries))
            found = {entry.checksum for entry in entries}
            require(found == {wanted}, f"with {len(entries)} slots it is {sorted(found)}, not {wanted}")
    return f"{wanted:#06x}"


@GROUP.check("memory-full", rule="MEM_SLOTS")
def full(robot: Subject) -> str:
    """A full memory refuses more by MEMORY_FULL, and still replaces."""
    slots = round(robot.parameter("MEM_SLOTS").param_value)
    keys = [(p, c) for p in (*range(_STIMULI), ANY_STIMULUS) for c in range(_STIMULI)][: slots + 1]
    with robot.emptied_memory():
        for previous, current in keys[:-1]:
            robot.expect(robot.write(_ONE, current=current, previous=previous), Reason.NONE)
        previous, current = keys[-1]
        robot.expect(robot.write(_ONE, current=current, previous=previous), Reason.MEMORY_FULL, "to a full memory")
        again = robot.write(_TWO, current=keys[0][1], previous=keys[0][0])
        robot.expect(again, Reason.NONE, "that replaces, in a full memory")
        _same(robot.read(current=again.current, previous=again.previous), again)
        entry = given(robot.read(slots - 1), f"slot {slots} is not found")
        require(entry.used == slots, f"{entry.used} of {slots} slots are said to be used")
    return f"{slots} slots"


@GROUP.check("memory-survives-reboot", rule="JUNIOR_MEMORY_WRITE")
def survives(robot: Subject) -> str:
    """The memory survives power-off."""
    with robot.emptied_memory():
        for current in range(4):
            robot.expect(robot.write(_TWO[: current % 3 + 1], current=current), Reason.NONE)
        robot.expect(robot.erase(2), Reason.NONE)
        before = [(e.previous, e.current, e.actions, e.checksum) for e in robot.read_memory()]
        robot.reboot()
        after = [(e.previous, e.current, e.actions, e.checksum) for e in robot.read_memory()]
        require(after == before, f"{len(before)} slots before a reboot, {len(after)} after it, or other ones")
    return f"{len(before)} slots"
