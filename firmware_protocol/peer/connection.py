"""The life of a connection with a robot, as one transition table.

    SILENT --heard--> IDENTIFYING --version good--> OPENING --opened--> READY --silence--> LOST --heard--> CHECKING --> READY

A robot that has restarted goes through the handshake again, with a new session. One that is only watched is WATCHING, without
a session, until it is taken:

    IDENTIFYING --watch only--> WATCHING --taken--> OPENING

One whose link was gone and is back is known already, and stays so until it is ready or has restarted:

    any state --link gone--> UNPLUGGED --link back--> RECOGNISING --recognised--> COMPARING --same boot--> REOPENING --> READY
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
    WATCHING = auto()
    """It is there, and only being watched."""
    LOST = auto()
    """It fell silent."""
    CHECKING = auto()
    """Heard again: asked whether it has restarted meanwhile."""
    REFUSED = auto()
    """It can't be spoken to: `failure` says why."""
    UNPLUGGED = auto()
    """The link to it is gone."""
    AWAITED = auto()
    """Its link is back, but it went silent before the handshake was done."""
    RECOGNISING = auto()
    """Its link is back: asked for its version, to see who it is."""
    COMPARING = auto()
    """Its link is back and it is the same robot: asked whether it has restarted meanwhile."""
    REOPENING = auto()
    """Its link is back: asked to open a session."""
    UNUSABLE = auto()
    """Its link is back, but it can't be spoken to, or is another robot: `failure` says why."""


USABLE: Final = frozenset({PeerState.READY, PeerState.WATCHING})
"""The handshake is done and the robot is there."""


class Input(Enum):
    """What moves a connection on."""

    HEARD = auto()
    VERSION_GOOD = auto()
    VERSION_BAD = auto()
    RECOGNISED = auto()
    """Its version is good, and it had told its status before."""
    STRANGER = auto()
    WATCH_ONLY = auto()
    """It is good, or has not restarted, and is not to be ours."""
    NO_SESSION = auto()
    """It has not restarted, but was only watched before, and is to be ours."""
    TAKEN = auto()
    """It is to be ours from now on."""
    OPENED = auto()
    TURNED_DOWN = auto()
    """It refuses to answer, or to open a session."""
    NO_ANSWER = auto()
    SAME_BOOT = auto()
    RESTARTED = auto()
    SILENCE = auto()
    LINK_GONE = auto()
    LINK_BACK = auto()


TRANSITIONS: Final[dict[tuple[PeerState, Input], PeerState]] = {
    (PeerState.SILENT, Input.HEARD): PeerState.IDENTIFYING,
    (PeerState.IDENTIFYING, Input.VERSION_GOOD): PeerState.OPENING,
    (PeerState.IDENTIFYING, Input.WATCH_ONLY): PeerState.WATCHING,
    (PeerState.IDENTIFYING, Input.VERSION_BAD): PeerState.REFUSED,
    (PeerState.IDENTIFYING, Input.STRANGER): PeerState.REFUSED,
    (PeerState.IDENTIFYING, Input.TURNED_DOWN): PeerState.REFUSED,
    (PeerState.IDENTIFYING, Input.NO_ANSWER): PeerState.SILENT,
    (PeerState.IDENTIFYING, Input.SILENCE): PeerState.SILENT,
    (PeerState.IDENTIFYING, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.OPENING, Input.OPENED): PeerState.READY,
    (PeerState.OPENING, Input.TURNED_DOWN): PeerState.REFUSED,
    (PeerState.OPENING, Input.NO_ANSWER): PeerState.SILENT,
    (PeerState.OPENING, Input.SILENCE): PeerState.SILENT,
    (PeerState.OPENING, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.READY, Input.SILENCE): PeerState.LOST,
    (PeerState.READY, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.WATCHING, Input.TAKEN): PeerState.OPENING,
    (PeerState.WATCHING, Input.SILENCE): PeerState.LOST,
    (PeerState.WATCHING, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.LOST, Input.HEARD): PeerState.CHECKING,
    (PeerState.CHECKING, Input.SAME_BOOT): PeerState.READY,
    (PeerState.CHECKING, Input.WATCH_ONLY): PeerState.WATCHING,
    (PeerState.CHECKING, Input.NO_SESSION): PeerState.OPENING,
    (PeerState.CHECKING, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.CHECKING, Input.TURNED_DOWN): PeerState.LOST,
    (PeerState.CHECKING, Input.NO_ANSWER): PeerState.LOST,
    (PeerState.CHECKING, Input.SILENCE): PeerState.LOST,
    (PeerState.REFUSED, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.REFUSED, Input.SILENCE): PeerState.SILENT,
    **{(state, Input.LINK_GONE): PeerState.UNPLUGGED for state in PeerState},
    (PeerState.UNPLUGGED, Input.LINK_BACK): PeerState.RECOGNISING,
    (PeerState.AWAITED, Input.HEARD): PeerState.RECOGNISING,
    (PeerState.RECOGNISING, Input.RECOGNISED): PeerState.COMPARING,
    (PeerState.RECOGNISING, Input.VERSION_GOOD): PeerState.REOPENING,
    (PeerState.RECOGNISING, Input.WATCH_ONLY): PeerState.WATCHING,
    (PeerState.RECOGNISING, Input.VERSION_BAD): PeerState.UNUSABLE,
    (PeerState.RECOGNISING, Input.STRANGER): PeerState.UNUSABLE,
    (PeerState.RECOGNISING, Input.TURNED_DOWN): PeerState.UNUSABLE,
    (PeerState.RECOGNISING, Input.NO_ANSWER): PeerState.AWAITED,
    (PeerState.RECOGNISING, Input.SILENCE): PeerState.AWAITED,
    (PeerState.RECOGNISING, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.COMPARING, Input.SAME_BOOT): PeerState.REOPENING,
    (PeerState.COMPARING, Input.WATCH_ONLY): PeerState.WATCHING,
    (PeerState.COMPARING, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.COMPARING, Input.NO_ANSWER): PeerState.AWAITED,
    (PeerState.COMPARING, Input.SILENCE): PeerState.AWAITED,
    (PeerState.REOPENING, Input.OPENED): PeerState.READY,
    (PeerState.REOPENING, Input.TURNED_DOWN): PeerState.UNUSABLE,
    (PeerState.REOPENING, Input.NO_ANSWER): PeerState.AWAITED,
    (PeerState.REOPENING, Input.SILENCE): PeerState.AWAITED,
    (PeerState.REOPENING, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.UNUSABLE, Input.RESTARTED): PeerState.IDENTIFYING,
    (PeerState.UNUSABLE, Input.SILENCE): PeerState.AWAITED,
}
"""Every transition; an input that is not here changes nothing."""
