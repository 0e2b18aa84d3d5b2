"""Every command says the same of the same line: each against each, over real ptys and TCP."""

from __future__ import annotations

import random
import sys
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

import pytest
from at_night import all_at_night_but, all_by_day_but
from serving import in_thread

import hil
from firmware_protocol.errors import HilError
from firmware_protocol.links.serial import SerialLink
from firmware_protocol.messages import HOST_COMPONENT, ROBOT_COMPONENT, Heartbeat, JuniorSensors, RobotStatus, State
from firmware_protocol.peer.timing import HOST_HEARTBEAT
from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from firmware_protocol.wire.mavlink import MavlinkCodec
from hil.cli.app import run
from hil.connecting.connecting import connect_as
from hil.connecting.connecting_all import connect_all_as
from hil.sumo.advice_file import save_advice
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings
from simdevice.serving.admission import HELD
from simdevice.serving.endpoints import PtyEndpoint, TcpEndpoint
from simdevice.sumo.junior_world import junior_world

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from pathlib import Path

    from firmware_protocol.wire.fields import Message

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="there are no ptys on Windows"),
]

RARER: Final = {"another vehicle", "a ground station", "id 0", "id 255", "text", "full", "MAVLink 1"}
"""Every command is tried with them at night; what is judged of them is tried in `test_diagnosis.py` each time."""
WAIT: Final = 0.6
"""How long every command waits for a robot here, in s."""
EVERY: Final = 20
"""Those who speak say something every so many control periods: ten times a second."""
SENSORS: Final = JuniorSensors(1.0, (0.0, 0.0), (60, 60), (120, 120), 7.4, 1)
STATUS: Final = RobotStatus(1.0, 0, 0, 0, 0, 0, 1, 0, 0, State.DISARMED)
MAVLINK_1: Final = bytes.fromhex("fe09000401000500000002035104 03df52")


class Speaker:
    """Somebody at the other end of a line, who answers nothing.

    Args:
        says: What is said.
        returns: What comes of what is sent to it.
        every: Control periods from one time to the next.
    """

    period = 0.005

    def __init__(
        self, says: Callable[[], bytes] = lambda: b"", returns: Callable[[bytes], bytes] = lambda _: b"", every: int = EVERY
    ) -> None:
        self._says = says
        self._every = every
        self._returns = returns
        self._ticks = 0

    def step(self, inbound: bytes) -> bytes:
        """One control period."""
        self._ticks += 1
        return self._returns(inbound) + (self._says() if self._ticks % self._every == 0 else b"")


def voice(system: int, component: int, *messages: Message) -> Callable[[], bytes]:
    """Says these messages in frames of this sender."""
    codec = MavlinkCodec(system=system, component=component)
    return lambda: b"".join(map(codec.encode, messages))


def robot(*messages: Message, system: int = 1) -> Callable[[], bytes]:
    """A robot that says these."""
    return voice(system, ROBOT_COMPONENT, Heartbeat(10, 0, 0, State.DISARMED, 3), *messages)


NOISE = random.Random(4)


class Line(NamedTuple):
    """A line on which no robot can be used.

    Attributes:
        speaker: Who is at its other end.
        words: What every command says.
        but: What one of them says instead, since it looks further.
        baud: Its rate in bit/s.
    """

    speaker: Callable[[], Speaker]
    words: str
    but: dict[str, str] = {}  # noqa: RUF012 - nobody changes it
    baud: int = 115200


LINES: Final = {
    "silence": Line(Speaker, "nothing came at all", {}),
    "noise": Line(
        lambda: Speaker(lambda: bytes(NOISE.choices(range(128, 250), k=90))),
        "but no MAVLink. Is the baud rate right? `hil ports` tries the usual ones",
        {"ports": "bytes come, but no MAVLink at any usual rate"},
    ),
    "text": Line(lambda: Speaker(lambda: b"temperature 21.5\r\n"), "it prints text: 'temperature 21.5'"),
    "MAVLink 1": Line(lambda: Speaker(lambda: MAVLINK_1), "MAVLink 1 is spoken there"),
    "another vehicle": Line(
        lambda: Speaker(voice(4, ROBOT_COMPONENT, Heartbeat(2, 3, 81, 5, 4))), "system 4 speaks MAVLink but is no Junior"
    ),
    "a ground station": Line(
        lambda: Speaker(voice(255, HOST_COMPONENT, HOST_HEARTBEAT)), "a ground station speaks there (system 255), and no robot"
    ),
    "an echo": Line(lambda: Speaker(returns=bytes), "it sends back what is sent to it"),
    "id 0": Line(lambda: Speaker(robot(SENSORS, system=0)), "under system id 0, which means everybody"),
    "id 255": Line(lambda: Speaker(robot(SENSORS, system=255)), "under system id 255, which is the hosts'"),
    "deaf": Line(
        lambda: Speaker(robot(SENSORS, STATUS)),
        "robot 1 is heard, but does not answer. Does it hear us: is our TX connected to its RX?",
        {"ports": "Junior, system 1, disarmed"},
    ),
    "full": Line(
        lambda: Speaker(robot(SENSORS), every=1),
        "of 960 that the line carries, and what robot 1 answers is lost",
        {"ports": "Junior, system 1, disarmed"},
        baud=9600,
    ),
    "too slow": Line(
        Speaker,
        "a line of 4,800 baud is too slow: driving a robot takes 9,100 baud",
        {
            "ports": "nothing came at all",
            "check": "a line of 4,800 baud is too slow: checking all that a robot says takes 42,600",
        },
        baud=4800,
    ),
}
VERBS: Final = ("monitor", "bout", "coach", "deploy", "param", "check", "ports", "key", "connect", "connect_all")
LIKE_COACH: Final = {"bout", "deploy", "param"}
"""They open a robot by the function by which `coach` does: each of them is tried with every line at night, and with silence."""


@pytest.fixture(autouse=True)
def impatient(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder with an advice; no command waits for long."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")
    advice = Advice(PalSettings(), (AdviceEntry(ANY_STIMULUS, 0, (Action.FF,), 1.0, 10),), "flat-light")
    save_advice(advice, tmp_path / "advice.toml")
    for where in ("hil.jobs.session", "hil.cli.keygen"):
        monkeypatch.setattr(f"{where}.connect_as", partial(connect_as, timeout=WAIT))
    monkeypatch.setattr("hil.jobs.session.connect_all_as", partial(connect_all_as, timeout=WAIT))


def told(verb: str, url: str, capsys: pytest.CaptureFixture[str]) -> str:
    """What a command says of a line on which it can do nothing."""
    if verb in {"connect", "connect_all"}:
        with pytest.raises(HilError) as failure:
            (hil.connect if verb == "connect" else hil.connect_all)(url, timeout=WAIT)
        return f"hil: {failure.value}"
    look = [f"--timeout={WAIT}"]
    arguments = {
        "monitor": [url, "--no-log"],
        "bout": [url, "--no-log", "--controller", "random"],
        "coach": [url, "--no-log", "--budget", "2"],
        "deploy": ["advice.toml", url, "--no-log"],
        "param": [url],
        "check": [url, "--no-log", *look],
        "ports": [url, *look],
        "key": [url, "--remove"],
    }[verb]
    status = run([verb, *arguments])
    said = capsys.readouterr()
    listed = verb == "ports" and "hil monitor" in said.out
    assert status == (0 if listed else 3), said
    assert "Traceback" not in said.err
    return said.out if verb == "ports" else said.err


@contextmanager
def opposite(line: Line) -> Iterator[str]:
    """Put somebody at the other end of a pty."""
    endpoint = PtyEndpoint(line.baud)
    with in_thread(line.speaker(), endpoint):
        yield endpoint.url


def said_of(name: str, verbs: Iterable[str], capsys: pytest.CaptureFixture[str]) -> None:
    """Commands say of a line what they are to say."""
    line = LINES[name]
    with opposite(line) as url:
        for verb in verbs:
            if name == "full" and verb == "check":
                continue  # it needs a faster line in any case
            words = line.but.get(verb, line.words)
            said = told(verb, url, capsys)
            assert words in said, f"hil {verb}: {said}"
            assert verb == "ports" or f"hil: {url}: " in said, f"hil {verb}: {said}"


@pytest.mark.parametrize("name", all_by_day_but(RARER, LINES))
def test_every_command_says_what_is_the_matter(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    said_of(name, [verb for verb in VERBS if verb not in LIKE_COACH], capsys)


@pytest.mark.parametrize("name", all_at_night_but({"silence"}, LINES))
def test_those_that_open_a_robot_alike_say_the_same(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    said_of(name, sorted(LIKE_COACH), capsys)


def test_every_command_says_who_has_the_port(capsys: pytest.CaptureFixture[str]) -> None:
    endpoint = PtyEndpoint()
    try:
        port = SerialLink(endpoint.url, endpoint.path, 115200)
        for verb in VERBS:
            said = told(verb, endpoint.url, capsys)
            assert f"{endpoint.path} is in use by" in said, f"hil {verb}: {said}"
            assert "Close " in said
        port.close()
    finally:
        endpoint.close()


def test_every_command_says_that_the_server_has_another_client(capsys: pytest.CaptureFixture[str]) -> None:
    endpoint = TcpEndpoint("127.0.0.1", 0)
    world = junior_world()
    with in_thread(world, endpoint), hil.connect(endpoint.url) as holder:
        for verb in VERBS:
            said = told(verb, endpoint.url, capsys)
            assert f"at the other end it was said: {HELD}" in said, f"hil {verb}: {said}"
            assert "Close the program that has it" in said
            holder.wait(world.period)


def test_no_port_there_is_said_alike(capsys: pytest.CaptureFixture[str]) -> None:
    for verb in VERBS:
        assert "there is no port /dev/ttyNobody" in told(verb, "serial:///dev/ttyNobody:115200", capsys)
    for verb in VERBS:
        assert "nothing listens on port 9" in told(verb, "tcp://127.0.0.1:9", capsys)
