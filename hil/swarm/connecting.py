"""From addresses to a swarm: all the micro-robots that are there."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.links.serial import list_ports
from firmware_protocol.messages import SwarmObservation, SwarmRanges
from firmware_protocol.peer.fleets.fleet import Fleet
from firmware_protocol.vocabulary import SwarmOutcome
from hil.connecting.connecting_all import connect_all_as
from hil.connecting.handles import SETTLE
from hil.swarm.handle import QUORUM, Swarm

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from firmware_protocol.address import Address
    from firmware_protocol.links.serial import SerialPort
    from firmware_protocol.wire.rows import Rows
    from firmware_protocol.wire.signing import SigningKey
    from hil.bridge.networks import RobotAddress
    from hil.bridge.operator import Operator
    from hil.bridge.taps import Tap
    from hil.connecting.connecting import NetworkOpener

FINDING: Final = 5.0
"""Longest that robots are waited for, in s."""


def open_fleet(capacity: float | None) -> Fleet:
    """The micro-robots of one network, of whom nobody has been heard.

    Args:
        capacity: What its line carries each way, in bytes/s; None: nobody knows.
    """
    return Fleet({SwarmObservation: _ends, SwarmRanges: _never}, capacity=capacity)


def _ends(rows: Rows) -> NDArray[np.bool_]:
    """Which observations end a move."""
    ends: NDArray[np.bool_] = rows["outcome"] != SwarmOutcome.NONE
    return ends


def _never(rows: Rows) -> NDArray[np.bool_]:
    """Ranges end nothing: an observation comes with them."""
    return np.zeros(len(rows), bool)


def connect_swarm(
    *urls: str,
    expect: int | Collection[int | RobotAddress] | None = None,
    settle: float = SETTLE,
    timeout: float = FINDING,
    taps: Sequence[Tap] = (),
    operator: Operator | None = None,
    reconnect: float = 0.0,
    quorum: float = QUORUM,
    watch: bool = False,
    ports: Callable[[], Sequence[SerialPort]] = list_ports,
    signing_key: SigningKey | Path | str | None = None,
    opener_of: Callable[[Address], NetworkOpener] | None = None,
) -> Swarm:
    """Connect to all micro-robots on a link, or on several. They are stopped and disarmed by that.

    Args:
        *urls: Addresses as for `hil.connect`; each is a network of its own.
        expect: How many, or which, are expected: the wait is over when they are there, and no sooner. Who is named and does
            not answer has a row all the same, and takes part when it does.
        settle: Else the wait is over when no further robot was heard for this long, in s.
        timeout: Longest wait in s; those who are there by then are taken.
        taps: What is shown everything that passes, on every network.
        operator: Whose keys and signals are taken in by the bridges' steps; None: nobody's.
        reconnect: How long each link that is lost is tried to be opened again, and how long it is waited for enough robots,
            in s.
        quorum: Least share of each class that must be there.
        watch: Open no sessions: the robots are looked at and neither stopped nor disarmed.
        ports: Lists the serial ports of this machine, among which a lost one is looked for.
        signing_key: Key that host and robots sign with, on every network, or the file that holds it.
        opener_of: Gives what opens the link of an address; None opens what it names.

    Returns:
        The swarm; use it in a `with` block, which stops and disarms all on every way out.

    Raises:
        AddressError: A URL is no address we know.
        LinkOpenError: A link could not be opened; the text says what to do.
        NoRobotError: Nobody answered.
        WrongRoleError: Nobody but robots that are no micro-robots.
        VersionError: Nobody but robots with a protocol that we do not speak.
        DoubleIdError: Two robots answer by one id.
        ValueError: No address is given, one twice, or emulated ones together with others; a number is out of range.
        KeyFileError: The key file can't be used.
    """
    if not 0.0 <= quorum <= 1.0:
        raise ValueError(f"the quorum is a share of each class, 0 to 1, not {quorum:g}")
    return connect_all_as(
        partial(Swarm, quorum=quorum, patience=reconnect),
        *urls,
        settle=settle,
        expect=expect,
        timeout=timeout,
        taps=taps,
        watch=watch,
        reconnect=reconnect,
        ports=ports,
        signing_key=signing_key,
        operator=operator,
        opener_of=opener_of,
        fleet_of=open_fleet,
    )
