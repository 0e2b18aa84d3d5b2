"""A swarm served in real time: every network has an address, lines may be bad, and a camera's poses go out."""

from __future__ import annotations

import json
import signal
import socket
from contextlib import closing
from typing import TYPE_CHECKING

import pytest
from processes import Hil
from serving import in_thread

from firmware_protocol.clock import ManualClock
from firmware_protocol.events import Received
from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM, Heartbeat
from firmware_protocol.wire.codec import open_codec
from hil.cli.app import run
from simdevice.serving.endpoints import TcpEndpoint
from simdevice.serving.networks import NetworksServer
from simdevice.swarm.disturbed import DisturbedSwarm
from simdevice.swarm.poses import PoseLines
from simdevice.swarm.settings import SwarmSettings
from simdevice.swarm.world import SwarmWorld

if TYPE_CHECKING:
    from pathlib import Path

    from firmware_protocol.links.memory import Networked


def heartbeats(data: bytes) -> set[int]:
    """Whose heartbeats these are."""
    codec = open_codec("mavlink", system=HOST_SYSTEM, component=HOST_COMPONENT)
    events = codec.receive(data, 0.0)
    return {event.system for event in events if isinstance(event, Received) and isinstance(event.message, Heartbeat)}


def served(world: Networked, seconds: float) -> list[bytes]:
    """What the clients of two networks hear in so much time of the clock."""
    clock = ManualClock()
    with closing(TcpEndpoint(port=0)) as one, closing(TcpEndpoint(port=0)) as two:
        server = NetworksServer(world, [one, two], clock, wait=lambda _files, _timeout: None)
        clients = [socket.create_connection(("127.0.0.1", int(end.url.rpartition(":")[2]))) for end in (one, two)]
        heard = [b"", b""]
        for client in clients:
            client.setblocking(False)  # noqa: FBT003 - the module's
        for _ in range(round(seconds / world.period)):
            clock.advance(world.period)
            server.turn()
            for number, client in enumerate(clients):
                try:
                    heard[number] += client.recv(65536)
                except BlockingIOError:
                    continue
        for client in clients:
            client.close()
        assert server.overruns == 0
        assert world.now() == pytest.approx(seconds, abs=0.02)
        return heard


def test_each_network_is_heard_at_its_own_address() -> None:
    heard = served(SwarmWorld(SwarmSettings(rangers=3, wilds=2, networks=2)), 1.5)
    assert list(map(heartbeats, heard)) == [{1, 2, 3, 254}, {1, 2, 254}]


def test_lines_may_be_bad_each_by_itself() -> None:
    settings = SwarmSettings(rangers=4, wilds=0, networks=2)
    whole = served(SwarmWorld(settings), 3.0)
    spec = FaultSpec.parse("drop:0.5")
    first = served(DisturbedSwarm(SwarmWorld(settings), spec, 1), 3.0)
    assert first == served(DisturbedSwarm(SwarmWorld(settings), spec, 1), 3.0)
    assert all(0.2 * len(good) < len(bad) < 0.8 * len(good) for good, bad in zip(whole, first, strict=True))


def test_a_line_that_is_cut_is_silent_until_it_is_mended() -> None:
    settings = SwarmSettings(rangers=2, wilds=0, networks=2)
    cut = DisturbedSwarm(SwarmWorld(settings), FaultSpec.parse("unplug:0.5+1"), 1)
    times = []
    while cut.now() < 3.0:
        if any(cut.run_networks([b"", b""], 10)):
            times.append(cut.now())
    assert any(time < 0.5 for time in times)
    assert not any(0.505 < time < 1.5 for time in times)
    assert any(time > 1.5 for time in times)


def test_poses_are_told_twenty_times_a_second() -> None:
    world = SwarmWorld(SwarmSettings(rangers=3, wilds=1, networks=2, fixes=False))
    lines = PoseLines(world)
    told: list[bytes] = []
    while world.now() < 1.0:
        world.run_networks([b"", b""], 4)
        told += lines.news()
    assert len(told) == 20
    fields = [line.split() for line in told[-1].decode().splitlines()]
    assert [(int(network), int(system)) for network, system, *_ in fields] == [(1, 1), (1, 2), (2, 1), (2, 2)]
    arrays = world.table.arrays
    assert [float(line[2]) for line in fields] == pytest.approx(arrays.x.tolist(), abs=0.006)
    assert [float(line[3]) for line in fields] == pytest.approx(arrays.y.tolist(), abs=0.006)
    assert all(0 <= float(line[5]) <= 15 for line in fields)


@pytest.mark.slow
def test_the_command_prints_an_address_a_line_and_serves_until_it_is_interrupted(tmp_path: Path) -> None:
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as camera:
        camera.bind(("127.0.0.1", 0))
        camera.settimeout(20.0)
        options = ["--rangers", "3", "--wilds", "1", "--networks", "2", "--link", "tcp://127.0.0.1:0", "--json"]
        poses = f"udpout://127.0.0.1:{camera.getsockname()[1]}"
        with Hil(tmp_path, "emulate", "swarm", *options, "--poses-to", poses, own_group=True) as program:
            document = ""
            while not document.rstrip().endswith("}"):
                document += program.until("\n")
            found = json.loads(document)
            assert (found["count"], found["per_network"], len(found["urls"])) == (4, 2, 2)
            for url in found["urls"]:
                with socket.create_connection(("127.0.0.1", int(url.rpartition(":")[2])), timeout=20.0) as client:
                    heard = b""
                    while heartbeats(heard) < {1, 2, 254}:
                        heard += client.recv(65536)
            assert camera.recv(2000).decode().startswith("1 1 ")
            program.send(signal.SIGTERM)
            assert program.end() == 130


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--count", "5", "--rangers", "3"], "exclude each other"),
        (["--networks", "2", "--link", "can://virtual/bus"], "give --link once for each network"),
        (["--networks", "3", "--link", "pty", "--link", "pty"], "once for each of the 3 networks, not 2 times"),
        (["--count", "300", "--link", "tcp://127.0.0.1:0"], "a network has ids for 253 robots"),
        (["--period", "7"], "--period is 5 or 10 (ms), not 7"),
        (["--noise", "loud", "--link", "tcp://127.0.0.1:0"], "default, none, or a device profile"),
        (["--poses-to", "tcp://127.0.0.1:1"], "Write it as udpout://"),
        (["--poses-to", "udpout://10.0.0.1:1"], "allow it with --public"),
        (["--faults", "stuck:eye_left", "--link", "tcp://127.0.0.1:0"], "a micro-robot has none like that"),
        (["--rooms"], "No such option"),
    ],
)
def test_what_can_t_be_is_said(capsys: pytest.CaptureFixture[str], options: list[str], told: str) -> None:
    assert run(["emulate", "swarm", *options]) == 2
    assert told in " ".join(capsys.readouterr().err.split())


@pytest.mark.slow
def test_ports_tells_of_micro_robots_and_how_to_look_at_one(capsys: pytest.CaptureFixture[str]) -> None:
    endpoint = TcpEndpoint(port=0)
    with in_thread(SwarmWorld(SwarmSettings(rangers=2, wilds=0)), endpoint):
        assert run(["ports", endpoint.url]) == 0
        told = " ".join(capsys.readouterr().out.split())
        assert run(["monitor", "--no-log", "--json", "--duration", "1", "--robot", "2", endpoint.url]) == 0
        shown = json.loads(capsys.readouterr().out)
    for system in (1, 2):
        assert f"micro-robot, system {system}, disarmed" in told
        assert f"hil monitor {endpoint.url} --robot {system}" in told
    assert (shown["robot"], shown["class"], shown["armed"]) == ("2", "RANGER", False)
