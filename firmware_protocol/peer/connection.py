"""The life of a connection with a robot, as one transition table.

    SILENT --heard--> IDENTIFYING --version good--> OPENING --opened--> READY --silence--> LOST --heard--> CHECKING --> READY

A robot that has restarted goes through the handshake again, with a new session. So does one whose link was gone and is
back, after a look at who it is and whether it has restarted:

    any state --link gone--> UNPLUGGED --link back--> IDENTIFYING --recognised--> COMPARING --same boot--> OPENING --> READY

A robot that is only being watched is READY without a session, until it is taken.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import Final


class PeerState(Enum):
    """Where a connection stands."""

    SILENT = auto()
    """Not heard yet, or it went silent before the handshake was done."""
    IDENTIFYING = auto()
    """Asked for its version."""
    OPENING = auto()
    """Asked to open a session."""
    READY = auto()
    """It takes commands."""
    LOST = auto()
    """It fell silent."""
    CHECKING = auto()
    """Heard again: asked whether it has restarted meanwhile."""
    REFUSED = auto()
    """It can't be spoken to: `failure` says why."""
    UNPLUGGED = auto()
    """The link to it is gone."""
    COMPARING = auto()
    """Its link is back and it is the same robot: asked whether it has restarted meanwhile."""


class Input(Enum):
    """What moves a connection on."""

    HEARD = auto()
    VERSION_GOOD = auto()
    VERSION_BAD = auto()
    RECOGNISED = auto()
    STRANGER = auto()
    WATCH_ONLY = auto()
    TAKEN = auto()
    OPENED = auto()
    TURNED_DOWN = auto()
    NO_ANSWER = auto()
    SAME_BOOT = auto()
    RESTARTED = auto()
    SILENCE = auto()
    LINK_GONE = auto()
    LINK_BACK = auto()


TRANSITIONS: Final[dict[tuple[PeerState, Input], PeerState]] = {
    (PeerState.SILENT, Input.HEARD): PeerState.IDENTIFYING,
    (PeerState.IDENTIFYING, Input.VERSION_GOOD): PeerState.OPENING,
    (PeerState.IDENTIFYING, Input.WATCH_ONLY): PeerState.READY,
    (PeerState.IDENTIFYING, Input.VERSION_BAD): PeerState.REFUSED,
    (PeerState.IDENTIFYING, Input.RECOGNISED): PeerState.COMPARING,
    (PeerState.IDENTIFYING, Input.STRANGER): PeerState.REFUSED,
    (PeerState.IDENTIFYING, Input.NO_ANSWER): PeerState.SILENT,
    (PeerState.IDENTIFYING, Input.SILENCE): PeerState.SILENT,
    (PeerState.IDENTIFYING, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.OPENING, Input.OPENED): PeerState.READY,
    (PeerState.OPENING, Input.TURNED_DOWN): PeerState.REFUSED,
    (PeerState.OPENING, Input.NO_ANSWER): PeerState.SILENT,
    (PeerState.OPENING, Input.SILENCE): PeerState.SILENT,
    (PeerState.OPENING, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.READY, Input.TAKEN): PeerState.OPENING,
    (PeerState.READY, Input.SILENCE): PeerState.LOST,
    (PeerState.READY, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.LOST, Input.HEARD): PeerState.CHECKING,
    (PeerState.CHECKING, Input.SAME_BOOT): PeerState.READY,
    (PeerState.CHECKING, Input.TAKEN): PeerState.OPENING,
    (PeerState.CHECKING, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.CHECKING, Input.NO_ANSWER): PeerState.LOST,
    (PeerState.CHECKING, Input.SILENCE): PeerState.LOST,
    (PeerState.REFUSED, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.REFUSED, Input.SILENCE): PeerState.SILENT,
    **{(state, Input.LINK_GONE): PeerState.UNPLUGGED for state in PeerState},
    (PeerState.UNPLUGGED, Input.LINK_BACK): PeerState.IDENTIFYING,
    (PeerState.COMPARING, Input.SAME_BOOT): PeerState.OPENING,
    (PeerState.COMPARING, Input.WATCH_ONLY): PeerState.READY,
    (PeerState.COMPARING, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.COMPARING, Input.NO_ANSWER): PeerState.SILENT,
    (PeerState.COMPARING, Input.SILENCE): PeerState.SILENT,
}
"""Every transition; an input that is not here changes nothing."""
