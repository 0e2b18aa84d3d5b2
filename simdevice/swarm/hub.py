"""What comes from the host on one network of a swarm, until it is cut into frames and handed out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.wire.mavlink_layout import MARKER

if TYPE_CHECKING:
    from simdevice.kernel.swarm import SwarmArrays

_SILENCE: Final = 0.02
"""A part of a frame that nothing has followed for this long is none, in s: as a robot sees it."""
NEVER: Final = 2**63
"""A control period that does not come."""


class Hub:
    """One network's.

    Args:
        arrays: The robots.
        network: Which network, from 0.
        period: Control period, in s.

    Attributes:
        due: The control period in which `take` is to be called at the latest.
    """

    def __init__(self, arrays: SwarmArrays, network: int, period: float) -> None:
        self._arrays = arrays
        self._network = network
        self._silence = round(_SILENCE / period)
        self._part = b""
        self.due = NEVER

    def take(self, data: bytes, ticks: int) -> bytes:
        """Take bytes, and hand out the frames that are complete.

        Args:
            data: What has come by now.
            ticks: Control periods so far.

        Returns:
            Frames that are for the table.
        """
        if not data and ticks < self.due:
            return b""
        if data:
            self._arrays.pass_on(self._network, data)
        part, for_table = self._part, b""
        if part and ticks >= self.due:
            part = _after_marker(part)
        if waiting := part + data:
            done, for_table = self._arrays.take(self._network, waiting)
            part = waiting[done:]
        while part and not data and ticks >= self.due:
            part = _after_marker(part)
            if part:
                done, more = self._arrays.take(self._network, part)
                part, for_table = part[done:], for_table + more
        self._part = part
        self.due = ticks + self._silence if part else NEVER
        return for_table


def _after_marker(part: bytes) -> bytes:
    """What is left of a frame that is none: from the next one's first byte on."""
    at = part.find(MARKER, 1)
    return part[at:] if at > 0 else b""
