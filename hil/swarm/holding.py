"""How a round of a swarm goes: begun on all networks at once, and over when each robot has answered or the time is."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import SwarmMove, SwarmObservation, SwarmRanges
from firmware_protocol.peer.fleets.rounds import AskingRound, NumberedRound
from firmware_protocol.wire.rows import ROWS
from hil.connecting.connecting_all import GATHER
from hil.swarm.rounds import Round

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from firmware_protocol.wire.fields import Message
    from hil.bridge.networks import Networks
    from hil.connecting.serving import Serving
    from hil.swarm.attendance import Attendance, NetworkRows

    Numbers = NDArray[np.int64]
    Which = NDArray[np.bool_]
    OneNetwork = NumberedRound | AskingRound
    """A round on one network."""

MARGIN: Final = 1.0
"""What a round is given beyond the longest time of its robots and of its bytes, in s."""
FRAMING: Final = 12
"""Bytes of a frame that are not its payload."""
_EXCHANGE: Final = 2 * (ROWS[SwarmObservation].itemsize + ROWS[SwarmMove].itemsize + 3 * FRAMING + 20)
"""Bytes that a robot and its host exchange in a round, twice over."""
_SLACK: Final = 1e-9
_ROUNDING: Final = 1e-6
"""Slack for quotients of sums of control periods."""


class RoundHolder:
    """Holds the rounds of a swarm.

    Args:
        networks: The links.
        serving: Serves them.
        attendance: Who takes part.

    Attributes:
        attendance: As given.
    """

    def __init__(self, networks: Networks, serving: Serving, attendance: Attendance) -> None:
        self._networks = networks
        self._serving = serving
        self.attendance = attendance

    def hold(
        self,
        asked: Which,
        begin: Callable[[NetworkRows, Numbers], OneNetwork],
        longest: float,
        kind: type[Message],
        *,
        exact: bool = False,
    ) -> Round:
        """Hold a round.

        Args:
            asked: Who takes part.
            begin: Begins it on one network, with some of its robots.
            longest: How long the robots may take, in s.
            kind: What they report.
            exact: That is the deadline; else it is given a margin.
        """
        self._align()
        self.attendance.round_begins()
        start = self._serving.now()
        rounds: list[tuple[NetworkRows, OneNetwork]] = []
        lines = 0.0
        try:
            for network in self.attendance.networks:
                which = np.flatnonzero(asked[network.rows])
                if which.size:
                    one = begin(network, which)
                    network.fleet.begin(one)
                    rounds.append((network, one))
                    lines = max(lines, network.line_time(_EXCHANGE * len(which)))
            deadline = start + longest + (0.0 if exact else MARGIN + lines)
            while any(one.open.any() for _, one in rounds) and (left := deadline - self._serving.now()) > _SLACK:
                self._serving.step(left)
                for network, one in rounds:
                    if network.bridge.lost is not None or network.bridge.network in self._networks.failures:
                        one.drop(np.ones(len(one.open), bool))
                    else:
                        one.drop(~network.fleet.usable)
        finally:
            for network, one in rounds:
                network.fleet.end(one)
        return self._account(asked, rounds, kind, self._serving.now() - start)

    def _account(
        self,
        asked: Which,
        rounds: Sequence[tuple[NetworkRows, OneNetwork]],
        kind: type[Message],
        seconds: float,
    ) -> Round:
        """What has come of a round, by row; who has not answered is missing from now on."""
        count = len(asked)
        reports = np.zeros(count, ROWS[kind])
        there, refused = np.zeros(count, bool), np.zeros(count, bool)
        reasons = np.zeros(count, np.int64)
        for network, one in rounds:
            rows, systems = network.rows, network.systems
            answered = one.answered[systems]
            there[rows] = answered
            if kind is one.report:
                reports[rows] = one.reports[systems]
            if isinstance(one, NumberedRound):
                refused[rows], reasons[rows] = one.refused[systems], one.reason[systems]
        there &= asked
        self.attendance.round_ends(asked & ~there & ~refused, self._serving.now())
        if kind is not SwarmObservation and kind is not SwarmRanges:
            reports = np.zeros(count, ROWS[SwarmObservation])
        return Round(self.attendance.addresses, asked, there, reports, reasons, refused, seconds)

    def _align(self) -> None:
        """Begin a round in lock-step on all networks at once, and at a time to which what comes is gathered."""
        bridges = list(self._networks.alive.values())
        if bridges and bridges[0].link.lockstep:
            latest = ceil(max(bridge.now for bridge in bridges) / GATHER - _ROUNDING) * GATHER
            while (left := latest - self._serving.now()) > _SLACK:
                self._serving.step(left)
