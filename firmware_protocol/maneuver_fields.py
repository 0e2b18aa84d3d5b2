"""A maneuver and its report, as the fields of messages and back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypedDict

from firmware_protocol.messages import JuniorManeuver, JuniorManeuverResult, JuniorMemoryEntry, ManeuverOption, Reason
from firmware_protocol.vocabulary import MAX_ACTIONS, Action, ActionTally, Maneuver, Outcome, Stimulus

_OPTIONS: Final = tuple((option.name.lower(), option.value) for option in ManeuverOption if option.name is not None)
"""Attributes of a maneuver that are options on the wire, and the bit of each."""


class ManeuverFields(TypedDict):
    """The fields that JUNIOR_MANEUVER and JUNIOR_MEMORY_WRITE share."""

    period: float
    options: int
    count: int
    actions: tuple[int, ...]


def to_fields(maneuver: Maneuver) -> ManeuverFields:
    """Spell a maneuver out for the wire.

    Args:
        maneuver: What is to be performed or stored.

    Returns:
        Keyword arguments for the message.
    """
    options = sum(bit for name, bit in _OPTIONS if getattr(maneuver, name))
    codes = tuple(int(action) for action in maneuver.actions)
    padded = codes + (0,) * (MAX_ACTIONS - len(codes))
    return ManeuverFields(period=maneuver.period, options=options, count=len(codes), actions=padded)


def from_fields(message: JuniorManeuver | JuniorMemoryEntry) -> Maneuver:
    """Read a maneuver out of a message.

    Args:
        message: A message with at least one action.

    Returns:
        The maneuver.

    Raises:
        ValueError: The message holds no valid maneuver.
    """
    options = ManeuverOption(message.options)
    return Maneuver(
        actions=tuple(Action(code) for code in message.actions[: message.count]),
        period=message.period,
        floor_reflex=ManeuverOption.FLOOR_REFLEX in options,
        end_on_change=ManeuverOption.END_ON_CHANGE in options,
        eyes=ManeuverOption.EYES in options,
        arms=ManeuverOption.ARMS in options,
        hold=ManeuverOption.HOLD in options,
    )


@dataclass(frozen=True)
class ManeuverReport:
    """How a maneuver went, as the robot counted it.

    Attributes:
        outcome: How it ended.
        reason: Why, where it was refused or stopped.
        done: Actions performed to the end of their period.
        tallies: One per action begun.
        before: Eyes and arms when it began.
        after: Eyes and arms when it ended.
    """

    outcome: Outcome
    reason: Reason
    done: int
    tallies: tuple[ActionTally, ...]
    before: Stimulus
    after: Stimulus


def to_report(result: JuniorManeuverResult) -> ManeuverReport:
    """Read a report out of a result.

    Args:
        result: The robot's message.

    Returns:
        The report, with a tally for every action that was begun.

    Raises:
        ValueError: The outcome or reason is none we know (a newer firmware).
    """
    begun = sum(1 for samples in result.samples if samples)
    tallies = tuple(
        ActionTally(
            samples=result.samples[i],
            eyes=(result.eye_left[i], result.eye_right[i]),
            edges=(result.edges_left[i], result.edges_right[i]),
            longest_press=(result.press_left[i], result.press_right[i]),
            pressed_travel=result.travel[i],
        )
        for i in range(begun)
    )
    return ManeuverReport(
        outcome=Outcome(result.outcome),
        reason=Reason(result.reason),
        done=result.done,
        tallies=tallies,
        before=Stimulus(result.stimulus_before),
        after=Stimulus(result.stimulus_after),
    )
