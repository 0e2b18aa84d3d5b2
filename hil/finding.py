"""Which of the robots on a link is taken, and what is said when none is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.errors import NoRobotError
from firmware_protocol.signing import trouble

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.peer import Peer
    from hil.bridge import Bridge

STEP = 0.05
"""Longest wait of one step of the bridge, in s."""
OTHERS_WAIT = 1.5
"""A robot says that it is there once a second: after this time one that can't be spoken to is no reason to wait on, in s."""


def find_robot(
    bridge: Bridge, now: Callable[[], float], step: Callable[[float], object], system: int | None, timeout: float
) -> Peer:
    """Wait for a robot, and take it. Where the bridge opens no sessions by itself, no other one gets a session.

    Args:
        bridge: Speaks with the robots on the link.
        now: Reads the clock, in s.
        step: Serves the bridge once, for so long in s.
        system: System id of the robot; None takes the first that answers.
        timeout: Longest wait in s.

    Returns:
        The robot, after the handshake.

    Raises:
        NoRobotError: Nobody answered in time.
        VersionError: It speaks a protocol we do not.
        LinkClosedError: The link went away.
    """
    deadline = now() + timeout
    patience = now() + OTHERS_WAIT
    while now() < deadline:
        chosen = _candidate(bridge, system)
        if chosen is not None and chosen.ready and chosen.taken:
            return chosen
        if chosen is not None and chosen.ready:
            chosen.take(now())
        elif chosen is not None and chosen.failure is not None and (system or chosen.taken or now() >= patience):
            raise chosen.failure
        step(min(STEP, deadline - now()))
    raise NoRobotError(_nobody(bridge, system, timeout))


def _candidate(bridge: Bridge, system: int | None) -> Peer | None:
    """Of the robots asked for: the one that was taken, else one that answers, else one that can't be spoken to."""
    peers = [peer for number, peer in bridge.peers.items() if system in {None, number}]
    ours = [peer for peer in peers if peer.taken and peer.failure is None]
    ready = [peer for peer in peers if peer.ready]
    failed = [peer for peer in peers if peer.failure is not None]
    return next((peer for peer in ours if peer.ready), None) or next(iter([*ours, *ready, *failed]), None)


def _nobody(bridge: Bridge, system: int | None, timeout: float) -> str:
    url = bridge.link.url
    if what := trouble(bridge.rejected, bridge.signed, bridge.signing):
        return f"{url}: a robot is there, but does not answer: {what}"
    whom = "no robot" if system is None else f"no robot with system id {system}"
    if bridge.farewell:
        return f"{url}: {whom} answered within {timeout:g} s: {bridge.farewell}"
    heard = sorted({*bridge.peers, *bridge.strangers})
    if heard:
        others = ", ".join(map(str, heard))
        return f"{url}: {whom} answered within {timeout:g} s, though MAVLink is spoken there (systems seen: {others})"
    if sum(bridge.rejected.values()):
        return f"{url}: {whom} answered within {timeout:g} s; what came was no MAVLink: is the baud rate right?"
    return f"{url}: {whom} answered within {timeout:g} s, nothing came at all: is it switched on, is this the right port?"
