"""One judge of everything that can be the matter with a link."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import pytest

from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    ROBOT_COMPONENT,
    AutopilotVersion,
    Heartbeat,
    RobotStatus,
    Statustext,
)
from firmware_protocol.peer.timing import HOST_HEARTBEAT
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN, MAVLINK
from hil.bridge.witness import Witness, speaks_mavlink_1
from hil.connecting.diagnosis import Diagnosis, Kind, Seen, judge, lost, nobody
from hil.connecting.listening import LISTENER_SYSTEM

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.wire.fields import Message

PORT, SOCKET = "serial:///dev/ttyS0:9600", "tcp://127.0.0.1:5760"
ROVER = Heartbeat(10, 0, 0, 1, 3)
COPTER = Heartbeat(2, 3, 81, 5, 4)
STATUS = RobotStatus(1.0, 0, 0, 0, 0, 0, 1, 0, 0, 1)
MAVLINK_1 = bytes.fromhex("fe0900040100050000000203510403df52")
"""HEARTBEAT of a copter, as pymavlink's `v10` dialect makes it (checked below)."""


@dataclass
class Case:
    """What is to be judged.

    Attributes:
        says: Who says what: system, component, message.
        raw: Bytes that come besides.
        wire: What the link carries.
        url: Its address.
        own: Our system id.
        seconds: How long it took.
        times: How often all of it is said.
    """

    says: list[tuple[int, int, Message]] = field(default_factory=list)
    raw: bytes = b""
    wire: str = MAVLINK
    url: str = SOCKET
    own: int = HOST_SYSTEM
    seconds: float = 5.0
    times: int = 1
    echo: bool = False
    wanted: int | None = None
    unusable: Sequence[int] = ()
    key: str = ""
    farewell: str = ""
    swept: bool = False
    shared: str = ""
    seen: Seen = field(init=False)

    def __post_init__(self) -> None:
        witness = Witness(self.own, 0.0)
        ears = open_codec(self.wire, system=self.own, component=HOST_COMPONENT)
        voices = {who[:2]: open_codec(self.wire, system=who[0], component=who[1]) for who in self.says}
        us = open_codec(self.wire, system=self.own, component=HOST_COMPONENT)
        said = us.encode(HOST_HEARTBEAT)
        witness.sent(said)
        chunks = [voices[system, component].encode(message) for system, component, message in self.says * self.times]
        for chunk in [*chunks, *([said] if self.echo else []), *([self.raw] if self.raw else [])]:
            witness.came(chunk, 1.0)
            for event in ears.receive(chunk, 1.0):
                witness.saw(event)
        for event in ears.flush(self.seconds):
            witness.saw(event)
        told = (self.wanted, self.unusable, self.key, self.farewell, self.swept, self.shared)
        self.seen = Seen(self.url, witness, self.wire, self.seconds, *told)


def robot(*messages: Message, system: int = 1) -> list[tuple[int, int, Message]]:
    """A robot that says this."""
    return [(system, ROBOT_COMPONENT, message) for message in messages]


def judged(case: Case) -> Diagnosis:
    """What is said of it; never without something to do."""
    diagnosis = judge(case.seen)
    assert diagnosis.reason
    assert diagnosis.remedy
    assert not diagnosis.remedy.endswith(".")
    return diagnosis


@pytest.mark.parametrize(
    ("case", "kind", "words"),
    [
        (Case(), Kind.SILENCE, "nothing came at all. Is it switched on, is this the right address?"),
        (Case(url=PORT), Kind.SILENCE, "are RX and TX crossed?"),
        (Case(url="udpin://127.0.0.1:14550"), Kind.SILENCE, "does it send to this address?"),
        (Case(raw=b"\x00", url=PORT), Kind.NOISE, "bytes come (1), but no MAVLink. Is the baud rate right?"),
        (Case(raw=bytes(range(128, 250)) * 9), Kind.NOISE, "bytes come (1,098), but no MAVLink. Is it the robot's port?"),
        (Case(raw=b"\x00\x81" * 40, url=PORT, swept=True), Kind.NOISE, "but no MAVLink at any usual rate"),
        (Case(raw=b"temperature: 21.5\r\n" * 9, url=PORT), Kind.TEXT, "it prints text: 'temperature: 21.5'"),
        (Case(raw=MAVLINK_1), Kind.MAVLINK_1, "MAVLink 1 is spoken there. hil speaks MAVLink 2"),
        (Case(raw=b"\x07" * 99 + MAVLINK_1 + b"\xfe\x03", url=PORT), Kind.MAVLINK_1, "MAVLink 1"),
        (Case(echo=True, url=PORT), Kind.ECHO, "it sends back what is sent to it. Are RX and TX connected"),
        (Case(echo=True), Kind.ECHO, "Does a program there return what it gets?"),
        (Case([(255, 190, HOST_HEARTBEAT)] * 2), Kind.HOSTS_ONLY, "a ground station speaks there (system 255), and no robot"),
        (Case([(250, 190, HOST_HEARTBEAT)], echo=True), Kind.HOSTS_ONLY, "(system 250)"),
        (Case(robot(Statustext(6, "hello"))), Kind.NO_ROBOT, "MAVLink is spoken there, but no robot says it is there"),
        (Case([(1, 191, ROVER)]), Kind.NO_ROBOT, "no robot says it is there"),
        (Case(robot(ROVER, system=0)), Kind.MISNUMBERED, "under system id 0, which means everybody. Give it an id of 1 to 254"),
        (Case(robot(ROVER, STATUS, system=255)), Kind.MISNUMBERED, "under system id 255, which is the hosts'. Give it an id"),
        (Case(robot(ROVER, system=255), own=LISTENER_SYSTEM), Kind.MISNUMBERED, "255"),
        (Case(robot(ROVER, STATUS, system=254), own=LISTENER_SYSTEM), Kind.DEAF, "robot 254 is heard"),
        (Case(robot(COPTER, system=4)), Kind.VEHICLE, "system 4 speaks MAVLink but is no Junior"),
        (Case(robot(ROVER, STATUS, system=4), unusable=[4]), Kind.VEHICLE, "system 4 speaks MAVLink but is no Junior"),
        (Case([*robot(COPTER), *robot(COPTER, system=7)]), Kind.VEHICLE, "systems 1, 7 speak MAVLink but are no Juniors"),
        (Case(robot(STATUS, system=2), wanted=3), Kind.OTHERS, "others are there: 2. Ask for one of them: ?system=2"),
        (Case(robot(STATUS, system=2), wanted=3, wire=CAN), Kind.OTHERS, "others are there: 2. Ask for one of them: ?node=2"),
        (Case(robot(ROVER, STATUS)), Kind.DEAF, "robot 1 is heard, but does not answer. Does what we say get to it?"),
        (Case(robot(ROVER, STATUS), url=PORT), Kind.DEAF, "Does it hear us: is our TX connected to its RX?"),
        (Case(robot(STATUS), raw=b"\xfd" * 9), Kind.DEAF, "does not answer, and 9 of 10 pieces come damaged"),
        (Case(robot(STATUS), url=PORT, times=100, seconds=5.0), Kind.FULL, "of 960 that the line carries"),
        (Case(robot(STATUS), url=PORT, times=40, seconds=5.0), Kind.DEAF, "does not answer"),
        (Case(robot(STATUS), times=500, seconds=1.0), Kind.DEAF, "does not answer"),
        (Case(robot(AutopilotVersion(0, 1, 1)), wire=CAN), Kind.BUS, "there are frames on the bus, but no robot's"),
        (Case(robot(STATUS), key="it signs"), Kind.KEY, "a robot is there, but does not answer: it signs"),
        (Case(robot(STATUS), farewell="held"), Kind.TURNED_AWAY, "at the other end it was said: held. Close the program"),
        (Case(robot(STATUS), shared="coach drives"), Kind.SHARED, "(coach drives). Look on by hil monitor"),
    ],
)
def test_what_is_the_matter(case: Case, kind: Kind, words: str) -> None:
    diagnosis = judged(case)
    assert (diagnosis.kind, words in str(diagnosis)) == (kind, True), str(diagnosis)


def test_every_kind_is_judged_above() -> None:
    marks = test_what_is_the_matter.pytestmark  # type: ignore[attr-defined]
    assert {kind for _, kind, _ in marks[0].args[1]} == set(Kind)


def test_an_error_that_was_told_is_kept_and_news_are_not() -> None:
    assert Case(robot(Statustext(3, "held"), Statustext(6, "hello"))).seen.witness.told == "held"


def test_our_own_words_that_come_back_are_nobody_elses() -> None:
    witness = Case(echo=True).seen.witness
    assert (witness.echo, witness.hosts) == (True, set())
    other = Case([(255, 190, HOST_HEARTBEAT)] * 2).seen.witness  # the second of its frames has another number than ours
    assert other.hosts == {255}


def test_mavlink_1_is_known_by_its_checksum() -> None:
    assert speaks_mavlink_1(MAVLINK_1)
    assert speaks_mavlink_1(b"\xfe\xfe" + MAVLINK_1)
    assert not speaks_mavlink_1(MAVLINK_1[:-1])
    assert not speaks_mavlink_1(MAVLINK_1[:-1] + b"\x00")
    assert not speaks_mavlink_1(b"\xfe" * 30)


def test_the_frame_of_mavlink_1_is_one() -> None:
    dialect = pytest.importorskip("pymavlink.dialects.v10.common")
    mav = dialect.MAVLink(None, srcSystem=4, srcComponent=1)
    assert mav.heartbeat_encode(2, 3, 81, 5, 4, 3).pack(mav) == MAVLINK_1


def test_what_is_said_has_the_address_the_time_and_what_to_do() -> None:
    case = Case(url=PORT)
    assert nobody(case.seen, 5.0) == (
        f"{PORT}: no robot answered within 5 s: nothing came at all. Is it switched on, is this the right port, are RX and TX "
        "crossed?"
    )
    assert nobody(Case(wanted=7).seen, 0.5).startswith(f"{SOCKET}: no robot with system id 7 answered within 0.5 s: ")
    assert nobody(Case(farewell="held").seen, 5.0).startswith(f"{SOCKET}: at the other end it was said: held. ")


def test_what_is_said_of_a_robot_that_is_lost() -> None:
    assert lost(Case().seen, "it is gone") == (
        f"{SOCKET}: it is gone. Is it switched on, does its cable hold, is its battery charged?"
    )
    noise = Case(raw=b"\x00\x81" * 30, key="from before").seen
    assert lost(noise, "it is gone").startswith(f"{SOCKET}: it is gone; since then: bytes come (60), but no MAVLink. ")
