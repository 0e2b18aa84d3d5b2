"""What Pal has learnt, put into the robot's own memory: which slots it takes, writing them, and reading them back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import HilError, RefusedError
from firmware_protocol.memory_table import MemorySlot, memory_checksum
from firmware_protocol.messages import Reason
from firmware_protocol.roles import junior as verbs
from firmware_protocol.vocabulary import ANY_STIMULUS, Stimulus

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.messages import JuniorMemoryEntry
    from hil.sumo.junior import Junior
    from pal_advisor.maneuvers import Advice, AdviceEntry

ARMS_PARAMETER: Final = "STIM_ARMS"
"""Tells the robot whether its arms are part of the stimulus that its memory is searched for."""
SLOTS_PARAMETER: Final = "MEM_SLOTS"
_EYES: Final = int(Stimulus.EYE_LEFT | Stimulus.EYE_RIGHT)


class DeployError(HilError):
    """The robot's memory does not hold what was written to it; the text says which slot."""


@dataclass(frozen=True)
class MemoryPlan:
    """An advice as slots of a robot's memory.

    Attributes:
        slots: What is to be stored, by previous, then current stimulus.
        arms: The arms are part of the stimulus.
        left_out: Entries that had no room, least tried first to go; the robot plays what it has for any previous stimulus.
    """

    slots: tuple[MemorySlot, ...]
    arms: bool
    left_out: tuple[MemorySlot, ...] = ()


@dataclass(frozen=True)
class Deployment:
    """What was done to a robot's memory.

    Attributes:
        plan: What it holds now.
        written: Slots that had to be written.
        erased: Slots that held something else.
        kept: Slots that held the right maneuver already.
        checksum: Of the whole table, as the robot and we compute it.
    """

    plan: MemoryPlan
    written: int
    erased: int
    kept: int
    checksum: int


def plan_memory(advice: Advice, capacity: int) -> MemoryPlan:
    """Lay an advice out so that the robot chooses in a contest as the host would by this advice.

    The robot looks for its (previous, current) stimulus, then for the current one after any, then for what the eyes alone
    see of it, and turns on the spot when it finds nothing. `Advice.find` has more to fall back on, so the slots of "any"
    spell that out; those that the robot would come to anyway are saved.

    Args:
        advice: What was learnt.
        capacity: Slots that the robot has.

    Returns:
        The slots. When they do not fit, entries for a certain previous stimulus go first, the least tried of them before
        all, then those for touching arms.

    Raises:
        DeployError: There are not even slots for what the eyes can see.
    """
    arms = advice.settings.arms_in_stimulus
    stimuli = range(16 if arms else 4)
    bases = {current: advice.find(current) for current in stimuli}
    if capacity < _EYES + 1:
        raise DeployError(f"the robot's memory has {capacity} slots, and {_EYES + 1} are needed for what two eyes can see")
    wanted: list[tuple[tuple[int, int, int], MemorySlot]] = []
    for current, base in bases.items():
        if current > _EYES and base.actions == bases[current & _EYES].actions:
            continue
        rank = (0 if current <= _EYES else 1, -base.evaluations, current)
        wanted.append((rank, _slot(advice, base, ANY_STIMULUS, current)))
    for current in stimuli:
        for previous in stimuli:
            entry = advice.find(current, previous)
            if entry.actions != bases[current].actions:
                wanted.append(((2, -entry.evaluations, current), _slot(advice, entry, previous, current)))
    wanted.sort(key=lambda ranked: (ranked[0], ranked[1].key))
    slots = [slot for _, slot in wanted]
    kept = sorted(slots[:capacity], key=lambda slot: slot.key)
    return MemoryPlan(tuple(kept), arms, tuple(reversed(slots[capacity:])))


def deploy(junior: Junior, advice: Advice) -> Deployment:
    """Put an advice into a robot's memory, read it back, and compare.

    Slots that hold the right maneuver already are not written again: an EEPROM wears. What was there and is not part of the
    advice is erased.

    Args:
        junior: The robot.
        advice: What was learnt.

    Returns:
        What was done.

    Raises:
        DeployError: What is read back is not what was written, or the advice needs what this robot can't do.
        RefusedError: The robot refuses to have its memory written: it plays a contest, for instance.
        PeerError: The robot is gone or does not answer.
        LinkError: The link is gone.
    """
    plan = plan_memory(advice, round(junior.parameter(SLOTS_PARAMETER)))
    _set_arms(junior, arms=plan.arms)
    here = {entry.key: entry for entry in read_memory(junior)[0]}
    goal = {slot.key: slot for slot in plan.slots}
    stale = [key for key in here if key not in goal]
    due = [slot for key, slot in goal.items() if here.get(key) != slot]
    for key in stale:
        junior.finish(verbs.erase_memory(junior.peer, *key))
    for slot in due:
        junior.finish(verbs.write_memory(junior.peer, slot.previous, slot.current, slot.maneuver))
    found, checksum = read_memory(junior)
    _compare(junior, plan.slots, found, checksum)
    return Deployment(plan, len(due), len(stale), len(goal) - len(due), checksum)


def read_memory(junior: Junior) -> tuple[list[MemorySlot], int]:
    """Everything that a robot's memory holds.

    Args:
        junior: The robot.

    Returns:
        The slots in order, and the robot's checksum of the table (that of an empty one where it is empty).

    Raises:
        DeployError: A slot holds no maneuver that can be read.
        PeerError: The robot is gone or does not answer.
        LinkError: The link is gone.
    """
    entries: list[JuniorMemoryEntry] = []
    while not entries or len(entries) < entries[-1].used:
        ticket = verbs.read_memory(junior.peer, len(entries))
        try:
            entries.append(junior.finish(ticket))
        except RefusedError:
            if ticket.reason is not Reason.NOT_FOUND:
                raise
            break
    try:
        slots = [MemorySlot.of(entry) for entry in entries]
    except ValueError as error:
        raise DeployError(f"{junior.description}: its memory can't be read: {error}") from error
    return slots, entries[-1].checksum if entries else memory_checksum([])


def _slot(advice: Advice, entry: AdviceEntry, previous: int, current: int) -> MemorySlot:
    return MemorySlot(previous, current, advice.maneuver(entry))


def _set_arms(junior: Junior, *, arms: bool) -> None:
    """Have the robot look its memory up by what this advice counts as the stimulus."""
    try:
        junior.set_parameter(ARMS_PARAMETER, float(arms))
    except RefusedError as error:
        if arms:
            raise DeployError(
                f"{junior.description} refuses {ARMS_PARAMETER} = 1: it can't play by an advice that counts its arms"
            ) from error


def _compare(junior: Junior, wanted: Sequence[MemorySlot], found: Sequence[MemorySlot], checksum: int) -> None:
    """See that a robot's memory holds this and nothing else."""
    for slot in wanted:
        if slot not in found:
            raise DeployError(
                f"{junior.description}: its memory does not hold for {slot.situation} what was written to it. "
                "Deploy again; if that does not help, its memory is worn out or its firmware has a fault (hil check)"
            )
    if len(found) != len(wanted):
        raise DeployError(f"{junior.description}: its memory holds {len(found)} slots and should hold {len(wanted)}")
    if checksum != memory_checksum(found):
        raise DeployError(
            f"{junior.description}: its memory reads back right, but its checksum is {checksum:#06x} "
            f"and should be {memory_checksum(found):#06x}: its firmware has a fault (hil check)"
        )
