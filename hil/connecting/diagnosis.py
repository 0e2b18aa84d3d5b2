"""Why no robot can be used on a link: what was seen there, in words that are the same wherever they are said.

One function judges, for every command and for Python: `judge`. It is given what was seen (`Seen`) and says what is so and what
to do next. What keeps a port from being opened is said by whoever opens it (`LinkOpenError`), and by nobody else.

    nothing came, or nothing of a robot on a bus       SILENCE, BUS
    something came, no MAVLink                         NOISE, TEXT, MAVLINK_1, ECHO
    MAVLink, and no robot that we may speak with       HOSTS_ONLY, NO_ROBOT, MISNUMBERED, OTHERS, VEHICLE, KEY
    a robot, and it does not answer                    FULL, DEAF
    somebody at the other end said why it ended        TURNED_AWAY
    another host has it, and shares its link           SHARED
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import TYPE_CHECKING, Final

from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError, VersionError
from firmware_protocol.peer.pacing import BITS_PER_BYTE
from firmware_protocol.wire.fields import CAN, MAVLINK
from firmware_protocol.wire.signing import trouble

if TYPE_CHECKING:
    from collections.abc import Collection

    from hil.bridge.bridge import Bridge
    from hil.bridge.witness import Witness

_FULL: Final = 0.85
"""A line that carries this share of what it can is full."""
_SPOILT: Final = 0.2
"""A line on which more than this share of the pieces is damaged is a bad one."""
OTHER_ROBOT: Final = "hil speaks to robots with Junior's protocol only: docs/protocol.md"


class Kind(Enum):
    """What is the matter."""

    SILENCE = auto()
    NOISE = auto()
    TEXT = auto()
    MAVLINK_1 = auto()
    ECHO = auto()
    BUS = auto()
    """Frames are on a CAN bus, and none of a robot."""
    HOSTS_ONLY = auto()
    """A ground station is heard, and no robot."""
    NO_ROBOT = auto()
    """MAVLink is spoken, and nobody says that it is a robot."""
    MISNUMBERED = auto()
    """A robot speaks under an id that no robot may have."""
    OTHERS = auto()
    """Other robots are there than the one that was asked for."""
    VEHICLE = auto()
    """Another vehicle than a Junior."""
    KEY = auto()
    """It signs with another key than ours, or none of the two, or neither believes the other's time."""
    FULL = auto()
    """The line is full of what the robot says by itself."""
    DEAF = auto()
    """A Junior is heard, and does not answer."""
    TURNED_AWAY = auto()
    """The other end has said why it does not speak with us."""
    SHARED = auto()
    """Another host drives, and shares its link: one looks on there."""


@dataclass(frozen=True)
class Diagnosis:
    """What is the matter, and what to do.

    Attributes:
        kind: What.
        reason: What is so, in words.
        remedy: What to do next.
    """

    kind: Kind
    reason: str
    remedy: str

    def __str__(self) -> str:
        """Both, as one or two sentences without the full stop at the end."""
        return f"{self.reason}. {self.remedy}"


@dataclass(frozen=True)
class Seen:
    """What was seen on a link.

    Attributes:
        url: Its address.
        witness: What came.
        wire: What it carries.
        now: When it is judged, in s.
        wanted: System id of the robot that was asked for; None for any.
        unusable: Systems that have been asked who they are, and are no Juniors.
        key: What may be wrong with the keys, from `firmware_protocol.wire.signing.trouble`; empty for nothing.
        farewell: What was said at the other end when the link ended; empty for nothing.
        swept: Every usual rate has been tried.
        shared: What was said of who drives, where another host shares the link; empty: none does.
    """

    url: str
    witness: Witness
    wire: str
    now: float
    wanted: int | None = None
    unusable: Collection[int] = ()
    key: str = ""
    farewell: str = ""
    swept: bool = False
    shared: str = ""

    @property
    def serial(self) -> bool:
        """It is a serial port."""
        return self.url.startswith("serial:")

    @property
    def capacity(self) -> float | None:
        """What the line carries, in bytes/s; None where nobody knows."""
        try:
            return parse_address(self.url).port_baud()[1] / BITS_PER_BYTE if self.serial else None
        except AddressError:  # it was made up
            return None


def seen_by(bridge: Bridge, wanted: int | None = None) -> Seen:
    """What there is to judge by why a bridge has no robot that can be used.

    Args:
        bridge: The bridge.
        wanted: System id of the robot that was asked for; None for any, or for the only one that is spoken with.
    """
    return Seen(
        url=bridge.link.url,
        witness=bridge.witness,
        wire=bridge.link.wire,
        now=bridge.now,
        wanted=bridge.acquaintances.only if wanted is None else wanted,
        unusable=[system for system, peer in bridge.peers.items() if isinstance(peer.failure, VersionError)],
        key=trouble(bridge.rejected, bridge.signed, bridge.signing),
        farewell=bridge.farewell,
        shared=bridge.acquaintances.shared,
    )


def judge(seen: Seen) -> Diagnosis:
    """Say why no robot can be used.

    Args:
        seen: What was seen.

    Returns:
        What is the matter: the first that fits, what is certain before what is likely.
    """
    if seen.farewell:
        remedy = "Close the program that has it, or wait until it has gone"
        return Diagnosis(Kind.TURNED_AWAY, f"at the other end it was said: {seen.farewell}", remedy)
    if seen.shared:
        reason = f"another program has the robots there, and shares them ({seen.shared})"
        return Diagnosis(Kind.SHARED, reason, f"Look on by hil monitor {seen.url}, or end that program")
    if seen.key:
        return Diagnosis(Kind.KEY, f"a robot is there, but does not answer: {seen.key}", "docs/signing.md tells more")
    return _robots(seen) or _mavlink(seen) or _bytes(seen)


def _robots(seen: Seen) -> Diagnosis | None:
    """Somebody is heard who says that it is a robot."""
    witness = seen.witness
    heard = witness.vehicles
    wanted = heard if seen.wanted is None else heard & {seen.wanted}
    if not wanted:
        if not heard:
            return _misnumbered(seen)
        ids = _ids(heard)
        others = f"others are there: {ids}" if seen.wanted is not None else f"systems heard: {ids}"
        option = "node" if seen.wire == CAN else "system"
        return Diagnosis(Kind.OTHERS, others, f"Ask for one of them: ?{option}={min(heard)}")
    juniors = wanted & witness.robots - set(seen.unusable)
    if not juniors:
        many = len(wanted) > 1
        speak = f"systems {_ids(wanted)} speak MAVLink but are no Juniors" if many else ""
        return Diagnosis(Kind.VEHICLE, speak or f"system {min(wanted)} speaks MAVLink but is no Junior", OTHER_ROBOT)
    who = f"robot {min(juniors)}"
    capacity, rate = seen.capacity, witness.rate(seen.now)
    if capacity is not None and rate >= _FULL * capacity:
        full = (
            f"{rate:,.0f} bytes a second come, of {capacity:,.0f} that the line carries, and what {who} answers is lost in them"
        )
        return Diagnosis(Kind.FULL, full, "Set both ends to a higher rate, 115200 if they can")
    pieces = witness.good + witness.damaged
    spoilt = f", and {witness.damaged} of {pieces} pieces come damaged" if witness.damaged > _SPOILT * pieces else ""
    remedy = "Does it hear us: is our TX connected to its RX?" if seen.serial else "Does what we say get to it?"
    return Diagnosis(Kind.DEAF, f"{who} is heard, but does not answer{spoilt}", remedy)


def _misnumbered(seen: Seen) -> Diagnosis | None:
    """A robot says that it is system 0 or 255."""
    if not seen.witness.misnumbered:
        return None
    system = min(seen.witness.misnumbered)
    whose = "which means everybody" if system == 0 else "which is the hosts'"
    reason = f"a robot is there, but under system id {system}, {whose}"
    return Diagnosis(Kind.MISNUMBERED, reason, "Give it an id of 1 to 254: its parameter SYS_ID")


def _mavlink(seen: Seen) -> Diagnosis | None:
    """Nobody says that it is a robot, but MAVLink is spoken."""
    witness = seen.witness
    if seen.wire != MAVLINK:
        return None
    if witness.hosts:
        reason = f"a ground station speaks there (system {_ids(witness.hosts)}), and no robot"
        return Diagnosis(Kind.HOSTS_ONLY, reason, "Is the robot connected to it, and does it pass on what the robot says?")
    if witness.echo:
        remedy = "Are RX and TX connected to each other?" if seen.serial else "Does a program there return what it gets?"
        return Diagnosis(Kind.ECHO, "it sends back what is sent to it", remedy)
    version = witness.mavlink
    if version == 1 and not witness.good:
        return Diagnosis(Kind.MAVLINK_1, "MAVLink 1 is spoken there", "hil speaks MAVLink 2: set the vehicle's protocol to 2")
    if witness.good or version:
        return Diagnosis(Kind.NO_ROBOT, "MAVLink is spoken there, but no robot says it is there", "Is it a robot's port?")
    return None


def _bytes(seen: Seen) -> Diagnosis:
    """No MAVLink."""
    witness = seen.witness
    if not witness.received:
        if seen.serial:
            remedy = "Is it switched on, is this the right port, are RX and TX crossed?"
        elif seen.url.startswith("udpin:"):
            remedy = "Is it switched on, and does it send to this address?"
        else:
            remedy = "Is it switched on, is this the right address?"
        return Diagnosis(Kind.SILENCE, "nothing came at all", remedy)
    if seen.wire == CAN:
        remedy = "Is it switched on, with a node id (SYS_ID) of 1 to 127?"
        return Diagnosis(Kind.BUS, "there are frames on the bus, but no robot's", remedy)
    if witness.text:
        remedy = "A robot's port must carry MAVLink and nothing else: is this its debug port?"
        return Diagnosis(Kind.TEXT, f"it prints text: {witness.text!r}", remedy)
    if seen.swept:
        reason, remedy = "bytes come, but no MAVLink at any usual rate", "Is it the robot's port? Do both ends share a ground?"
    elif seen.serial:
        reason = f"bytes come ({witness.received:,}), but no MAVLink"
        remedy = "Is the baud rate right? `hil ports` tries the usual ones"
    else:
        reason, remedy = f"bytes come ({witness.received:,}), but no MAVLink", "Is it the robot's port?"
    return Diagnosis(Kind.NOISE, reason, remedy)


def _ids(systems: Collection[int]) -> str:
    return ", ".join(map(str, sorted(systems)))


def nobody(seen: Seen, timeout: float) -> str:
    """Say that no robot answered, and why.

    Args:
        seen: What was seen.
        timeout: How long it was waited for, in s.
    """
    diagnosis = judge(seen)
    if diagnosis.kind in {Kind.TURNED_AWAY, Kind.SHARED}:  # at once, as like as not
        return f"{seen.url}: {diagnosis}"
    whom = "no robot" if seen.wanted is None else f"no robot with system id {seen.wanted}"
    return f"{seen.url}: {whom} answered within {timeout:g} s: {diagnosis}"


def lost(seen: Seen, what: str) -> str:
    """Say that a robot is lost, and what to look at.

    Args:
        seen: What was seen since.
        what: What has happened, in words.
    """
    if not seen.witness.received:
        return f"{seen.url}: {what}. Is it switched on, does its cable hold, is its battery charged?"
    return f"{seen.url}: {what}; since then: {judge(replace(seen, key=''))}"
