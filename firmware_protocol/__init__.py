"""What is said on the wire and how: vocabulary, messages, codecs, links, peer, and the C firmware that speaks it.

Public names are loaded when they are first used: a codec must not load serial ports.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from firmware_protocol.address import Address, parse_address
    from firmware_protocol.clock import Clock, ManualClock
    from firmware_protocol.events import (
        Event,
        PeerBack,
        PeerFound,
        PeerLost,
        Received,
        Rejected,
        RejectReason,
        StreamBack,
        StreamStopped,
    )
    from firmware_protocol.link import Link
    from firmware_protocol.links.opening import open_link
    from firmware_protocol.peer.connection import PeerState
    from firmware_protocol.peer.exchanges.exchange import Retry, Ticket
    from firmware_protocol.peer.peer import Peer
    from firmware_protocol.vocabulary import Action, Maneuver, Outcome, Stimulus
    from firmware_protocol.wire.mavlink import MavlinkCodec

_HOMES: Final = {
    "Action": "vocabulary",
    "Address": "address",
    "Clock": "clock",
    "Event": "events",
    "Link": "link",
    "Maneuver": "vocabulary",
    "ManualClock": "clock",
    "MavlinkCodec": "wire.mavlink",
    "Outcome": "vocabulary",
    "Peer": "peer.peer",
    "PeerBack": "events",
    "PeerFound": "events",
    "PeerLost": "events",
    "PeerState": "peer.connection",
    "Received": "events",
    "RejectReason": "events",
    "Rejected": "events",
    "Retry": "peer.exchanges.exchange",
    "Stimulus": "vocabulary",
    "StreamBack": "events",
    "StreamStopped": "events",
    "Ticket": "peer.exchanges.exchange",
    "open_link": "links.opening",
    "parse_address": "address",
}

__all__ = [
    "Action",
    "Address",
    "Clock",
    "Event",
    "Link",
    "Maneuver",
    "ManualClock",
    "MavlinkCodec",
    "Outcome",
    "Peer",
    "PeerBack",
    "PeerFound",
    "PeerLost",
    "PeerState",
    "Received",
    "RejectReason",
    "Rejected",
    "Retry",
    "Stimulus",
    "StreamBack",
    "StreamStopped",
    "Ticket",
    "open_link",
    "parse_address",
]


def __getattr__(name: str) -> object:
    """Load a public name (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
