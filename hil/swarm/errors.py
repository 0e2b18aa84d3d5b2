"""What can go wrong with a swarm as a whole."""

from __future__ import annotations

from firmware_protocol.errors import PeerError


class QuorumError(PeerError):
    """Too few robots of a class are there to go on."""


class DoubleIdError(PeerError):
    """Two robots answer by one id: what is said to one of them, both take."""
