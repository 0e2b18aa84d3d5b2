"""A contest: the robot plays by itself from its memory, and the host only looks on."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import LinkError, PeerError, RefusedError
from firmware_protocol.events import PeerLost, Received
from firmware_protocol.messages import ROBOT_COMPONENT, BoutOutcome, ContestCommand, Heartbeat, Phase, Reason, State
from firmware_protocol.peer.connection import PeerState
from firmware_protocol.roles.junior import contest
from hil.connecting.serving import WAIT

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.events import Event
    from hil.sumo.junior import Junior

COUNTDOWN: Final = 5.0
"""Robots stand still this long after the start signal, as sumo rules ask, in s."""
_PLACING: Final = 0.1
"""A referee sets everybody up this long before the countdown ends, in s."""
_OVERTAKEN: Final = 0.1
"""A heartbeat that comes this soon after the start may have been sent before it, in s."""
_PLAYING: Final = frozenset((State.COUNTDOWN, State.CONTEST))


class Ending(StrEnum):
    """How a contest ended, as far as the host can tell."""

    DECIDED = "decided"
    """The referee saw one of them leave the ring, or the time of the bout is over."""
    ROBOT = "robot"
    """The robot ended it: its time (CONTEST_MAX) was over, or somebody stopped it."""
    OUT_OF_REACH = "out of reach"
    """The link was taken away; the robot plays on."""


@dataclass(frozen=True)
class Contest:
    """A contest that the host has seen the end of.

    Attributes:
        ending: How it ended.
        outcome: Who won, by a referee's word; None without one.
        elapsed: Time the bout took, in s, by a referee's word; None without one.
    """

    ending: Ending
    outcome: BoutOutcome | None = None
    elapsed: float | None = None


def start_contest(junior: Junior, countdown: float = COUNTDOWN) -> None:
    """Arm the robot and have it play from its memory after a countdown.

    Args:
        junior: The robot.
        countdown: Time to its first move, in s, 0 to 60.

    Raises:
        RefusedError: Its memory is empty, or its emergency stop is engaged.
        PeerError: The robot is gone or does not answer.
        LinkError: The link is gone.
    """
    junior.arm()
    ticket = contest(junior.peer, ContestCommand.START, countdown)
    try:
        junior.finish(ticket)
    except RefusedError as error:
        if ticket.reason is Reason.NOT_FOUND:
            raise RefusedError("a contest", "its memory is empty: there is nothing to play from") from error
        raise


def follow_contest(
    junior: Junior, countdown: float = COUNTDOWN, *, seed: int = 0, each: Callable[[State], object] = lambda _: None
) -> Contest:
    """Look on until the contest that has just been started is over.

    A referee sets everybody up in the ring as the countdown ends, and its decision ends the contest. Without one, the
    robot ends it, or a person does: an interrupt on the host stops the robot as the connection is closed. A link that is
    taken away is no failure: that is how robots go into the ring.

    Args:
        junior: The robot.
        countdown: What it was started with, in s.
        seed: Decides the start poses, where there is a referee.
        each: Called with the robot's state now and then.

    Returns:
        How it ended.
    """
    placed = junior.referee is None
    started = junior.now()
    begins = started + countdown
    try:
        while True:
            if not placed and junior.referee is not None and junior.now() >= begins - _PLACING:
                junior.referee.reset(seed)
                placed = True
            for event in junior.step(WAIT):
                if isinstance(event, PeerLost) and junior.peer.state is PeerState.LOST:
                    return Contest(Ending.OUT_OF_REACH)
                if _says_its_state(event, junior, started) and junior.state not in _PLAYING:
                    return Contest(Ending.ROBOT)
            each(junior.state)
            if placed and junior.referee is not None and junior.referee.latest.phase == Phase.OVER:
                state = junior.referee.latest
                return Contest(Ending.DECIDED, BoutOutcome(state.outcome), state.elapsed)
    except (LinkError, PeerError):
        return Contest(Ending.OUT_OF_REACH)


def _says_its_state(event: Event, junior: Junior, started: float) -> bool:
    """Whether this robot has said what it does since the start; others on the link say nothing about it."""
    return (
        isinstance(event, Received)
        and type(event.message) is Heartbeat
        and (event.system, event.component) == (junior.peer.system, ROBOT_COMPONENT)
        and event.time >= started + _OVERTAKEN
    )
