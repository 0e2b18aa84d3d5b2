"""Who is on a link, found out without disturbing anybody: bytes in, robots out. No I/O, no clock.

No session is opened, since that would stop and disarm a robot that somebody else drives. What is sent goes out under a
system id of its own, so that it keeps no other host's robot awake: a heartbeat, and to a robot that is not armed the question
for its version. An armed robot is listened to and nothing else. On a CAN bus nothing is sent until a robot has been heard, and
never while another host speaks there: frames carry no sender, and the two could not be told apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from firmware_protocol.events import Received, RejectReason
from firmware_protocol.messages import (
    ARMED_FLAG,
    GENERIC_AUTOPILOT,
    GROUND_STATION,
    HOST_COMPONENT,
    HOST_SYSTEM,
    PROTOCOL_MAJOR,
    ROBOT_COMPONENT,
    AutopilotVersion,
    Command,
    CommandLong,
    Heartbeat,
    JuniorSensors,
    RobotStatus,
    State,
    SysStatus,
)
from firmware_protocol.peer.role import role_of
from firmware_protocol.peer.timing import HOST_HEARTBEAT
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.roles.known import ROLES
from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.versions import other_version
from firmware_protocol.wire.can.frame import CanFrame, split_records
from firmware_protocol.wire.can.layout import FUNCTION_SHIFT
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN
from firmware_protocol.wire.mavlink_layout import FLAG_SIGNED
from hil.bridge.witness import EVERYBODY, Witness

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.signing import Signing

LISTENER_SYSTEM: Final = 254
"""System id we speak under: not the one that hosts have."""
HEARTBEATS: Final = 1.3
"""After this long everybody who sends a heartbeat once a second has been heard, in s."""
_HELLO_PERIOD: Final = 1.0
_ASK_PERIOD: Final = 0.3
_ASK_TIMES: Final = 3
_AT_FLAGS: Final = 2


class Signed(StrEnum):
    """What a robot signs with."""

    NOT = "not"
    """It does not sign."""
    OUR_KEY = "our key"
    """With the key we have."""
    OTHER_KEY = "another key"
    """With another than the one we have."""
    UNKNOWN_KEY = "a key"
    """It signs, and we have no key to see with which."""


@dataclass(frozen=True)
class HeardRobot:
    """A robot as it was heard.

    Attributes:
        system: Its system id, on a CAN bus its node.
        junior: It is a Junior; else it is some other vehicle.
        role: What kind of robot it is, in words; None for a vehicle that does not speak our protocol.
        armed: It said so in its last heartbeat.
        state: What it is doing; None for another vehicle.
        firmware: Version of its firmware, as `0.1`; None where it was not asked or did not say.
        protocol: Version of the protocol it speaks; likewise.
        uid: Unique id of its board, 16 hexadecimal digits; likewise.
        battery: In V; None where it did not say.
        signed: What it signs with.
    """

    system: int
    junior: bool
    armed: bool
    state: State | None
    firmware: str | None
    protocol: str | None
    uid: str | None
    battery: float | None
    signed: Signed = Signed.NOT
    role: str | None = None

    @property
    def usable(self) -> bool:
        """A Junior or a micro-robot that believes us and whose protocol we speak, as far as is known."""
        known = self.junior or self.micro
        return known and self._understood and self.signed in {Signed.NOT, Signed.OUR_KEY}

    @property
    def micro(self) -> bool:
        """It is a micro-robot."""
        return self.role == MICRO_ROBOT.name

    @property
    def _understood(self) -> bool:
        return self.protocol is None or self.protocol.partition(".")[0] == str(PROTOCOL_MAJOR)

    def __str__(self) -> str:
        """In words, as `Junior, system 1, disarmed, firmware 0.1, battery 7.5 V`."""
        if not self.junior and not self.micro and self.role is not None:
            return f"system {self.system} is a {self.role}, and no {JUNIOR.name}{', armed' if self.armed else ''}"
        if not self.junior and not self.micro:
            return f"system {self.system} speaks MAVLink but is no Junior{', armed' if self.armed else ''}"
        who = MICRO_ROBOT.name if self.micro else "Junior"
        parts = [f"{who}, system {self.system}", self.state.name.lower() if self.state is not None else "state unknown"]
        if self.firmware is not None:
            parts.append(f"firmware {self.firmware}")
        if self.battery is not None:
            parts.append(f"battery {self.battery:.1f} V")
        if self.armed:
            parts.append("armed: somebody may be driving it")
        if self.signed is not Signed.NOT:
            parts.append(_SIGNS[self.signed])
        if self.protocol is not None and not self._understood:
            parts.append(other_version(self.protocol))
        return ", ".join(parts)


_SIGNS: Final = {
    Signed.OUR_KEY: "signs with this key",
    Signed.OTHER_KEY: "signs with another key; pass its own with --signing-key",
    Signed.UNKNOWN_KEY: "signs; pass --signing-key",
}


class _Heard:
    """What one system has said so far."""

    def __init__(self, heartbeat: Heartbeat) -> None:
        self.heartbeat = heartbeat
        self.is_ours = False
        self.version: AutopilotVersion | None = None
        self.battery: float | None = None
        self.signed = Signed.NOT
        self.asked = 0
        self.ask_due = float("-inf")

    @property
    def armed(self) -> bool:
        return bool(self.heartbeat.base_mode & ARMED_FLAG)

    def robot(self, system: int) -> HeardRobot:
        ours, version, role = self.is_ours, self.version, JUNIOR  # which it is taken for before it has said what it is
        if version is not None and self.heartbeat.autopilot == GENERIC_AUTOPILOT and version.middleware_sw_version >> 24:
            ours = True
        if version is not None:
            role = role_of(version.product_id, ROLES)
        junior = ours and role is JUNIOR
        known = {int(state) for state in State}
        mode = self.heartbeat.custom_mode
        return HeardRobot(
            system=system,
            junior=junior,
            armed=self.armed,
            state=State(mode) if ours and (role is JUNIOR or role is MICRO_ROBOT) and mode in known else None,
            firmware=None if version is None else _version(version.flight_sw_version),
            protocol=None if version is None else _version(version.middleware_sw_version),
            uid=None if version is None else f"{version.uid:016x}",
            battery=self.battery,
            signed=self.signed,
            role=role.name if ours else None,
        )


def _version(number: int) -> str:
    return f"{number >> 24}.{number >> 16 & 0xFF}"


class Listener:
    """Listens on one link.

    Args:
        wire: What the link carries.
        now: Time in s.
        signing: Signs what is said, and tells who has our key; heard is everybody.

    Attributes:
        witness: What was seen.
        host: Somebody else speaks to robots here.
        behind: Messages signed with our key at times that have been: their sender does not follow ours.
    """

    def __init__(self, wire: str, now: float, signing: Signing | None = None) -> None:
        self.witness = Witness(LISTENER_SYSTEM, now)
        self.host = False
        self.behind = 0
        self._wire = wire
        self._signing = signing
        self._speaker = open_codec(wire, system=LISTENER_SYSTEM, component=HOST_COMPONENT, signing=signing)
        self._codec = open_codec(wire, system=LISTENER_SYSTEM, component=HOST_COMPONENT)
        self._begun = now
        self._hello_due = now
        self._systems: dict[int, _Heard] = {}
        self._early: set[int] = set()

    @property
    def robots(self) -> tuple[HeardRobot, ...]:
        """The robots heard so far, by system id."""
        return tuple(heard.robot(system) for system, heard in sorted(self._systems.items()))

    def settled(self, now: float) -> bool:
        """Whether everybody has had time to be heard, and who can be asked has been.

        Args:
            now: Time in s.
        """
        if not self._systems or now < self._begun + HEARTBEATS:
            return False
        return all(not self._wants_asking(heard) for heard in self._systems.values())

    def take(self, data: bytes, now: float) -> None:
        """Take what the link brought.

        Args:
            data: Bytes; may be empty.
            now: Their stamp in s.
        """
        if data:
            self.witness.came(data, now)
        if self._wire == CAN:
            self._look_for_hosts(data)
        for event in self._codec.receive(data, now) if data else self._codec.flush(now):
            self.witness.saw(event)
            if isinstance(event, Received):
                self._hear(event)

    def due(self, now: float) -> bytes:
        """What is to be sent now; it counts as sent.

        Args:
            now: Time in s.
        """
        messages: list[Message] = []
        if self._wire != CAN and now >= self._hello_due:
            self._hello_due = now + _HELLO_PERIOD
            messages.append(HOST_HEARTBEAT)
        for system, heard in self._systems.items():
            if self._wants_asking(heard, done=1) and now >= heard.ask_due:
                heard.asked += 1
                heard.ask_due = now + _ASK_PERIOD
                messages.append(_question(system))
        data = b"".join(map(self._speaker.encode, messages))
        self.witness.sent(data)
        return data

    def _wants_asking(self, heard: _Heard, done: int = 0) -> bool:
        """Whether its version is still missing and may be asked for (`done` 0: or an answer may still come)."""
        if heard.signed in {Signed.OTHER_KEY, Signed.UNKNOWN_KEY}:  # it would not believe us
            return False
        if heard.version is not None or heard.armed or (self._wire == CAN and self.host):
            return False
        return heard.asked < _ASK_TIMES + 1 - done

    def _look_for_hosts(self, data: bytes) -> None:
        for record in split_records(data):
            frame = CanFrame.unpack(record)
            if not frame.extended and not frame.identifier >> FUNCTION_SHIFT & 1:
                self.host = True

    def _hear(self, event: Received) -> None:
        message, system = event.message, event.system
        if not self._is_robot(event):
            return
        signed = self._judged(event)
        heard = self._systems.get(system)
        if signed is None or (heard is not None and heard.signed is Signed.OUR_KEY is not signed):
            return  # sent again by somebody, or in the name of a robot that signs
        if heard is None:
            if not isinstance(message, Heartbeat):
                if isinstance(message, (JuniorSensors, RobotStatus)):
                    self._early.add(system)
                return
            heard = self._systems[system] = _Heard(message)
            heard.is_ours = system in self._early
        heard.signed = signed
        match message:
            case Heartbeat():
                heard.heartbeat = message
            case AutopilotVersion():
                heard.version = message
            case JuniorSensors():
                heard.is_ours = True
                heard.battery = message.battery
            case RobotStatus():
                heard.is_ours = True
            case SysStatus() if message.voltage_battery != 0xFFFF:
                heard.battery = message.voltage_battery * 1e-3
            case _:
                pass

    def _is_robot(self, event: Received) -> bool:
        """Whether a robot may have said this; others are noted."""
        if isinstance(event.message, Heartbeat) and event.message.type == GROUND_STATION:
            self.host = self.host or not self.witness.is_ours(event)
            return False
        return event.component == ROBOT_COMPONENT and event.system not in {EVERYBODY, HOST_SYSTEM}

    def _judged(self, event: Received) -> Signed | None:
        """What a message is signed with; None where its time has been."""
        if self._wire == CAN or not event.raw[_AT_FLAGS] & FLAG_SIGNED:
            return Signed.NOT
        if self._signing is None:
            return Signed.UNKNOWN_KEY
        match self._signing.check(event.raw):
            case None:
                return Signed.OUR_KEY
            case RejectReason.BAD_SIGNATURE:
                return Signed.OTHER_KEY
            case _:
                self.behind += 1
                return None


def _question(system: int) -> CommandLong:
    """Asks who it is."""
    return CommandLong(system, ROBOT_COMPONENT, Command.REQUEST_MESSAGE, param1=float(AutopilotVersion.ID))
