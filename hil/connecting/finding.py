"""Which of the robots on a link is taken, and what is said when none is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.errors import HilError, LinkClosedError, NoRobotError, VersionError, WrongRoleError
from hil.connecting.diagnosis import OTHER_ROBOT, nobody, seen_by

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.peer.peer import Peer
    from firmware_protocol.peer.role import Role
    from hil.bridge.bridge import Bridge

STEP = 0.05
"""Longest wait of one step of the bridge, in s."""
OTHERS_WAIT = 1.5
"""A robot says that it is there once a second: after this time one that can't be spoken to is no reason to wait on, in s."""


def find_robot(
    bridge: Bridge, step: Callable[[float], object], system: int | None, timeout: float, role: Role | None = None
) -> Peer:
    """Wait for a robot, and take it. Where the bridge opens no sessions by itself, no other one gets a session.

    Args:
        bridge: Speaks with the robots on the link.
        step: Serves the bridge once, for so long in s.
        system: System id of the robot; None takes the first that answers.
        timeout: Longest wait in s.
        role: The role that it must have; one of another is not taken, nor stopped. None: any.

    Returns:
        The robot, after the handshake.

    Raises:
        NoRobotError: Nobody answered in time.
        WrongRoleError: Nobody did but robots of other roles.
        VersionError: It speaks a protocol we do not.
        LinkClosedError: The link went away.
    """
    deadline = bridge.now + timeout
    patience = bridge.now + OTHERS_WAIT
    while bridge.now < deadline:
        if bridge.acquaintances.shared:
            raise NoRobotError(nobody(seen_by(bridge, system), timeout))
        chosen = _candidate(bridge, system, role)
        if chosen is not None and chosen.ready and chosen.taken:
            return chosen
        if chosen is not None and chosen.ready:
            chosen.take(bridge.now)
        elif chosen is not None and chosen.failure is not None and (system or chosen.taken or bridge.now >= patience):
            raise named(bridge.link.url, chosen.failure)
        other = None if chosen is not None else _misfit(bridge, system, role)
        if other is not None and role is not None and (system or bridge.now >= patience):
            raise wrong_role(bridge.link.url, other, role)
        try:
            step(min(STEP, deadline - bridge.now))
        except LinkClosedError as error:
            if bridge.farewell:
                raise NoRobotError(nobody(seen_by(bridge, system), timeout)) from error
            raise
    raise NoRobotError(nobody(seen_by(bridge, system), timeout))


def named(url: str, failure: HilError) -> HilError:
    """Why a robot can't be spoken to, with the address and what to do.

    Args:
        url: Address of the link.
        failure: As its peer knows it.
    """
    if not isinstance(failure, VersionError) or str(failure).startswith(url):
        return failure
    return VersionError(f"{url}: {failure}" + (f". {OTHER_ROBOT}" if "no Junior" in str(failure) else ""))


def wrong_role(url: str, peer: Peer, needed: Role) -> WrongRoleError:
    """What is said of a robot that has another role than is needed.

    Args:
        url: Address of the link.
        peer: The robot.
        needed: The role.
    """
    return WrongRoleError(
        f"{url}: robot {peer.system} is a {peer.role.name}; a {needed.name} is needed here. "
        "Connect to another address, or name a robot of the link with ?system="
    )


def _misfit(bridge: Bridge, system: int | None, role: Role | None) -> Peer | None:
    """Of the robots asked for one that answers and has another role; None where there is none."""
    asked = [peer for number, peer in bridge.peers.items() if system in {None, number}]
    return next((peer for peer in asked if peer.ready and role is not None and peer.role is not role), None)


def _candidate(bridge: Bridge, system: int | None, role: Role | None) -> Peer | None:
    """Of the robots asked for: the one that was taken, else one that answers, else one that can't be spoken to."""
    asked = [peer for number, peer in bridge.peers.items() if system in {None, number}]
    peers = [peer for peer in asked if not (peer.ready and role is not None and peer.role is not role)]
    ours = [peer for peer in peers if peer.taken and peer.failure is None]
    ready = [peer for peer in peers if peer.ready]
    failed = [peer for peer in peers if peer.failure is not None]
    return next((peer for peer in ours if peer.ready), None) or next(iter([*ours, *ready, *failed]), None)
