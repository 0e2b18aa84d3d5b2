"""Signed links end to end: coaching, logs, conformance, keys given and taken, and what is said when keys do not fit."""

from __future__ import annotations

import ipaddress
import json
import os
import signal
import socket
import stat
import threading
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from processes import Hil
from signed_pair import END, KEY, OTHER_KEY, signed_at, signed_codec

import hil
from firmware_protocol.errors import AddressError, NoRobotError
from firmware_protocol.events import Received
from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.links.opening import open_link
from firmware_protocol.messages import OpponentCode, Ping, RobotStatus, SetupSigning
from firmware_protocol.wire.signing import TIME_LIMIT, Signing, SigningKey, setup_signing, virtual_time
from hil.bridge.clock import MonotonicClock
from hil.cli.app import run
from hil.conformance import CHECKS, LAST, CheckOutcome, Subject, for_role, on_wire, perform
from hil.mcaplog import LogReader
from hil.recording.recorder import Recorder
from hil.signing.key_file import KeyFileError, create_key, load_key
from hil.sumo.coaching import Coaching, new_pal
from hil.sumo.connecting import connect
from hil.sumo.ring import open_ring
from pal_advisor.maneuvers import PalSettings
from simdevice.serving.endpoints import TcpEndpoint, UdpEndpoint
from simdevice.serving.opening import open_endpoint
from simdevice.serving.server import Server
from simdevice.sumo.crowd import Crowd
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hil.mcaplog.records import WireBytes

URL = "sim://junior?opponent=flat-light&seed=3"
BITES = [pytest.param(KEY.secret[:6], id="raw"), pytest.param(KEY.secret[:6].hex().encode(), id="hex")]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    return tmp_path


def key_file(folder: Path, key: SigningKey = KEY, name: str = "our.key") -> Path:
    """A key file with a known key."""
    path = folder / name
    path.touch(0o600)
    path.write_text(key.secret.hex() + "\n")
    return path


@contextmanager
def served(link: str = "pty", key: SigningKey | None = None, nvm: bytes | None = None) -> Iterator[str]:
    """An emulated robot in real time; gives its address."""
    endpoint = open_endpoint(link)
    stop = threading.Event()
    server = Server(junior_world(WorldSettings(signing_key=key, referee=False, nvm=nvm)), endpoint, MonotonicClock())
    thread = threading.Thread(target=server.run, args=(stop.is_set,))
    thread.start()
    try:
        yield endpoint.url
    finally:
        stop.set()
        thread.join()
        endpoint.close()


def coached(key: SigningKey | None, log: Path | None = None) -> dict[str, object]:
    """A short coaching run's advice."""
    taps = [] if log is None else [Recorder(log, run={}, config={}, link=URL, lockstep=True)]
    with connect(URL, signing_key=key, taps=taps) as junior:
        junior.arm()
        ring = open_ring(junior)
        pal = new_pal(PalSettings(budget=40), seed=3)
        Coaching(ring, pal, seed=3).run()
        assert junior.bridge.signed == (sum(p.counters.good for p in junior.bridge.peers.values()) if key else 0)
        assert sum(junior.bridge.rejected.values()) == 0
    for tap in taps:
        tap.close()
    return pal.advice(opponent=OpponentCode.FLAT_LIGHT.label, seed=3).to_dict()


def test_coaching_over_a_signed_link_learns_the_same_and_repeats_itself(folder: Path) -> None:
    assert coached(KEY, folder / "a.mcap") == coached(None)
    coached(KEY, folder / "b.mcap")
    first, second = (list(LogReader(folder / name).entries(["/wire/rx", "/wire/tx"])) for name in ("a.mcap", "b.mcap"))
    assert [entry.value for entry in first] == [entry.value for entry in second]
    assert len(first) > 100


@pytest.mark.slow
def test_the_main_job_over_a_signed_pty(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = key_file(folder)
    with served(key=KEY) as url:
        arguments = ["--budget", "2", "--held-out", "0", "--objective", "contact", "--no-report", "--no-mirror", "--json"]
        assert run(["coach", url, *arguments, "--signing-key", str(path)]) == 0
        document = json.loads(capsys.readouterr().out)
        assert document["maneuvers"] == 2
    wire: list[WireBytes] = [entry.value for entry in LogReader(Path(document["log"])).entries(["/wire/tx"])]
    assert wire
    assert all(chunk.data[2] == 1 for chunk in wire)
    assert KEY.secret.hex() not in Path(document["log"]).read_bytes().decode("latin-1")


@pytest.mark.parametrize("moving", [False, True])
def test_the_emulated_robot_keeps_the_protocol_over_a_signed_link(moving: bool) -> None:  # noqa: FBT001
    world = junior_world(WorldSettings(signing_key=KEY))
    numbers = iter(range(1, 0x10000))
    signing = Signing(KEY, lambda: virtual_time(world.now()))
    robot = Subject(MemoryLink(world), world, session=lambda: next(numbers), signing=signing)
    robot.greet()
    chosen = [check for check in for_role(on_wire(CHECKS, robot.wire), robot.role) if check.moving == moving]
    verdicts = perform(robot, chosen, LAST, moving=moving)
    robot.close()
    assert [(v.check.name, v.detail) for v in verdicts if v.outcome is not CheckOutcome.PASSED] == []


@pytest.mark.slow
def test_a_host_without_the_key_is_told_so() -> None:
    with served("tcp://127.0.0.1:0", KEY) as url:
        with pytest.raises(NoRobotError, match=r"it signs what it says.*--signing-key"):
            connect(url, timeout=1.1)
        with pytest.raises(NoRobotError, match="it signs with another key than ours"):
            connect(url, timeout=1.1, signing_key=OTHER_KEY)
        with connect(url, signing_key=KEY) as junior:
            status = junior.status()
            assert status.not_signed > 0
            assert status.bad_signature > 0


@pytest.mark.slow
def test_a_robot_without_a_key_is_not_believed_by_who_has_one(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with served("tcp://127.0.0.1:0") as url:
        with pytest.raises(NoRobotError, match="it does not sign"):
            connect(url, timeout=1.2, signing_key=KEY)
        options = ["--only", "frame-in-pieces", "--timeout", "1.1", "--signing-key", str(key_file(folder))]
        assert run(["check", url, *options]) == 3
        assert "it does not sign" in capsys.readouterr().err


@pytest.mark.slow
def test_a_key_is_given_and_taken_away_on_the_command_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ours = key_file(folder)
    with served("tcp://127.0.0.1:0") as url:
        assert run(["key", url, "--install", str(ours)]) == 0
        assert "signs with the new key" in capsys.readouterr().out
        assert run(["key", url, "--remove", "--signing-key", str(ours), "--json"]) == 0
        said = capsys.readouterr().out
        assert json.loads(said)["signs"] is False
        assert KEY.secret.hex() not in said


@pytest.mark.parametrize("arguments", [[], ["--install", "our.key", "--remove"]])
def test_key_wants_to_know_what_to_do(folder: Path, arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    key_file(folder)
    assert run(["key", "tcp://127.0.0.1:9", *arguments]) == 2
    assert "--install FILE or --remove" in capsys.readouterr().err
    assert run(["key", "sim://junior", "--remove"]) == 2


def test_keygen_makes_a_file_that_only_its_owner_can_read(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / "robots.key"
    assert run(["keygen", str(path)]) == 0
    said = capsys.readouterr().out
    assert "hil key LINK --install" in said
    text = path.read_text()
    assert len(text) == 65
    assert text.strip() not in said
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert run(["keygen", str(path)]) == 2
    assert "there already" in capsys.readouterr().err
    assert path.read_text() == text
    assert run(["keygen", str(folder / "none" / "x.key")]) == 4
    second = create_key(folder / "second.key")
    assert second != load_key(path)
    assert load_key(folder / "second.key") == second


@pytest.mark.parametrize(
    ("content", "mode", "words"),
    [
        ("00" * 32, 0o600, "is no key file"),
        ("ab" * 31, 0o600, "is no key file"),
        ("é" * 64, 0o600, "is no key file"),
        ("ab" * 32, 0o644, "chmod 600"),
        (None, 0o600, "cannot read the key file"),
    ],
)
def test_a_key_file_that_is_none(folder: Path, content: str | None, mode: int, words: str) -> None:
    path = folder / "k"
    if content is not None:
        path.write_text(content)
        path.chmod(mode)
    with pytest.raises(KeyFileError, match=words) as caught:
        load_key(path)
    assert "ab" * 10 not in f"{caught.value} {caught.value.__cause__!r} {caught.value.__context__!r}"
    assert run(["param", "sim://junior", "--signing-key", str(path)]) == (4 if content is None else 2)


@pytest.mark.parametrize("url", ["sim://junior?wire=can", "can://virtual/no-key-here"])
def test_a_can_bus_has_no_signatures(folder: Path, url: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(key_file(folder))
    assert run(["param", url, "--signing-key", path]) == 2
    assert "nothing is signed on a CAN bus" in capsys.readouterr().err
    assert run(["emulate", "--link", "can://virtual/no-key-here", "--signing-key", path]) == 2
    assert "nothing is signed on a CAN bus" in capsys.readouterr().err


@pytest.mark.slow
def test_a_key_that_passes_is_in_no_log_and_no_text(folder: Path) -> None:
    log = folder / "log.mcap"
    texts: list[str] = []
    with (
        Recorder(log, run={}, config={}, link="tcp:", lockstep=False) as recorder,
        served("tcp://127.0.0.1:0") as url,
        hil.connect(url, taps=[recorder]) as junior,
    ):
        junior.listen(lambda event: texts.append(repr(event)))
        junior.bridge.send(setup_signing(1, KEY, 1))
        junior.wait(0.3)
        recorder.received(_received(setup_signing(1, KEY, 1)))
    entries: list[Any] = list(LogReader(log).entries(["/wire/tx", "/wire/rx", "/wire/rejected"]))
    kept = b"".join(entry.value.data for entry in entries if hasattr(entry.value, "data"))
    assert b"\x2a\x00\x00" in kept  # its frame is there, with its length
    assert KEY.secret[:5] not in kept
    assert not [entry for entry in LogReader(log).entries() if isinstance(entry.value, SetupSigning)]
    for text in texts:
        assert KEY.secret.hex() not in text


def _received(message: object) -> Any:  # noqa: ANN401
    from firmware_protocol.events import Received  # noqa: PLC0415
    from firmware_protocol.wire.mavlink import MavlinkCodec  # noqa: PLC0415

    frame = MavlinkCodec(system=255, component=190).encode(message)  # type: ignore[arg-type]
    return Received(message, 255, 190, 0, 0.0, frame)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "link", ["tcp://0.0.0.0:0", "tcp://[::]:0", "udp://0.0.0.0:0", "udpin://:0", "tcp://:0", "udp://192.0.2.1:0"]
)
def test_servers_stay_on_this_machine_unless_told_otherwise(link: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["emulate", "--link", link]) == 2
    said = capsys.readouterr().err
    assert "other machines could reach this address" in said or "not host:port" in said


@pytest.mark.parametrize("link", ["tcp://127.0.0.1:0", "udp://localhost:0"])
def test_what_is_served_is_bound_to_loopback(link: str) -> None:
    endpoint = open_endpoint(link)
    assert "://127.0.0.1:" in endpoint.url
    endpoint.close()


@pytest.mark.parametrize("kind", [TcpEndpoint, UdpEndpoint])
def test_a_server_that_is_told_no_host_is_bound_to_loopback(kind: type[TcpEndpoint | UdpEndpoint]) -> None:
    endpoint = kind(port=0)
    file = endpoint.files()[0]
    with socket.socket(fileno=os.dup(file)) as bound:
        assert ipaddress.ip_address(bound.getsockname()[0]).is_loopback
    endpoint.close()


def test_a_host_that_waits_by_udp_must_say_where() -> None:
    with pytest.raises(AddressError, match="not host:port"):
        open_link("udpin://:14550")


def test_counters_of_a_lock_step_robot() -> None:
    with connect(URL, signing_key=KEY) as junior:
        status: RobotStatus = junior.status()
    assert (status.not_signed, status.bad_signature, status.replayed) == (0, 0, 0)


def test_several_robots_on_one_signed_line() -> None:
    with connect("sim://junior?count=3&system=2", signing_key=KEY) as junior:
        assert junior.peer.system == 2
        assert junior.referee is not None
        assert sum(junior.bridge.rejected.values()) == 0
        assert junior.status().not_signed == 0


# --- the end of time -------------------------------------------------------------------------------------------------


def told(time: int) -> bytes:
    """The EEPROM of a robot with our key that was told one thing, signed at this time."""
    world = junior_world(WorldSettings(signing_key=KEY, referee=False))
    world.step(signed_at(time, Ping(1, 1)))
    for _ in range(10):
        world.step(b"")
    return world.nvm


@pytest.mark.slow
def test_a_frame_from_the_end_of_time_shuts_nobody_out(folder: Path) -> None:
    path = str(key_file(folder))
    with served("tcp://127.0.0.1:0", nvm=told(END)) as url:  # switched on anew
        assert run(["param", url, "SPD_FAST", "--signing-key", path]) == 0


@pytest.mark.slow
def test_a_time_that_has_come_too_far_is_named_and_can_be_forgotten(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(key_file(folder))
    memory = folder / "robot.nvm"
    memory.write_bytes(told(TIME_LIMIT - 1))
    with served("tcp://127.0.0.1:0", nvm=memory.read_bytes()) as url:
        with pytest.raises(NoRobotError) as caught:
            connect(url, timeout=1.2, signing_key=KEY)
        options = ["--only", "frame-in-pieces", "--timeout", "1.1", "--signing-key", path]
        assert run(["check", url, *options]) == 3
    for said in (str(caught.value), capsys.readouterr().err):
        assert "it has our key, but another time: the robot's is 2100 or later, this computer's 20" in said
        assert "docs/signing.md" in said
    command = ("emulate", "junior", "--link", "tcp://127.0.0.1:0", "--no-referee", "--memory", str(memory))
    for forget in (("--forget-time",), ()):
        with Hil(folder, *command, *forget) as robot:
            url = robot.until("Junior is at").split()[-1]
            assert run(["param", url, "SPD_FAST", "--signing-key", path]) == 0, capsys.readouterr().err
            robot.send(signal.SIGTERM)
            assert robot.end() == 130
    assert KEY.secret in memory.read_bytes()


def test_all_robots_of_a_line_forget_their_time() -> None:
    images = told(TIME_LIMIT - 1) * 2
    frame = signed_codec().encode(Ping(1, 7))
    for held in (False, True):
        crowd = Crowd(2, WorldSettings(referee=False, nvm=images, start_held=held))
        said = [crowd.step(frame) for _ in range(40)]  # the second robot begins later
        events = [event for data in said for event in signed_codec(now=0).receive(data, 0.0)]
        answers = [event for event in events if isinstance(event, Received) and isinstance(event.message, Ping)]
        assert len(answers) == 2 * held  # a frame that comes again is refused


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "a new robot has no time to forget: --forget-time is for the one that --memory FILE keeps"),
        (["--board", "avr", "--memory", "x"], "built without signing: leave --forget-time out"),
    ],
)
def test_where_there_is_no_time_to_forget(options: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["emulate", "--link", "tcp://127.0.0.1:0", "--forget-time", *options]) == 2
    assert words in capsys.readouterr().err
