"""An emulated robot for other people's clients, and where those are installed.

These tests are left out of the usual run: `.ci/clients` installs the clients and runs them.
"""

from __future__ import annotations

import os
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from client_programs import Program
from sharer import sharing

from hil.bridge.clock import MonotonicClock
from simdevice.serving.opening import open_endpoint
from simdevice.serving.server import serve
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sharer import Sharer

    from simdevice.sumo.world import World

SERVING: float = 10.0
"""Longest wait for the server's end, in s."""


@pytest.fixture(scope="session")
def clients() -> Path:
    """Folder in which the clients are installed: a Python environment with `node_modules` in it."""
    return Path(os.environ["HIL_CLIENTS"])


@dataclass
class Served:
    """A robot that is served in real time.

    Attributes:
        url: Where, as this package writes it.
        world: The robot and its ring.
    """

    url: str
    world: World

    @property
    def port(self) -> int:
        """TCP port."""
        return int(self.url.rpartition(":")[2])

    @property
    def device(self) -> str:
        """Serial device."""
        return self.url.removeprefix("serial://").rpartition(":")[0]

    @property
    def travelled(self) -> float:
        """Distance from where it stood at first, in m."""
        body = self.world.match.robot.body
        return float(((body.x - self.start[0]) ** 2 + (body.y - self.start[1]) ** 2) ** 0.5)

    def __post_init__(self) -> None:
        self.stand()

    def stand(self) -> None:
        """Count what it travels from where it stands now."""
        body = self.world.match.robot.body
        self.start = (body.x, body.y)


def coach(served: Served, folder: Path, *options: str) -> Program:
    """`hil coach` of a served robot, as a program of its own: a host that opens a session and leaves it open."""
    start = [sys.executable, "-c", "import hil.cli; hil.cli.main()", "coach", served.url]
    return Program([*start, "--held-out", "0", "--no-log", "--no-report", *options], folder)


def _serve(link: str) -> Iterator[Served]:
    endpoint = open_endpoint(link)
    world = junior_world(WorldSettings(referee=False))
    stop = threading.Event()
    thread = threading.Thread(target=serve, args=(world, endpoint, MonotonicClock(), stop.is_set))
    thread.start()
    try:
        yield Served(endpoint.url, world)
    finally:
        stop.set()
        thread.join(SERVING)
    assert not thread.is_alive()


@pytest.fixture
def tcp() -> Iterator[Served]:
    """A robot on a TCP port."""
    yield from _serve("tcp://127.0.0.1:0")


@pytest.fixture
def coached(tcp: Served, tmp_path: Path) -> Served:
    """A robot on a TCP port that has just been coached: disarmed, and with the session that `hil coach` opened still open."""
    with coach(tcp, tmp_path, "--budget", "8") as program:
        program.until("8/8 maneuvers")
        assert program.end() == 0
    tcp.stand()
    return tcp


@pytest.fixture
def abandoned(tcp: Served, tmp_path: Path) -> Served:
    """A robot on a TCP port whose `hil coach` was killed: armed, and nobody keeps it."""
    with coach(tcp, tmp_path, "--budget", "40") as program:
        program.until("8/40 maneuvers")
    tcp.stand()
    return tcp


@pytest.fixture
def pty() -> Iterator[Served]:
    """A robot on a serial port at 115200 baud."""
    yield from _serve("pty")


@pytest.fixture
def sharer(tcp: Served, tmp_path: Path) -> Iterator[Sharer]:
    """A robot on a TCP port that is being coached, and a port at which others look on."""
    with sharing(tmp_path, "coach", tcp.url, "--held-out", "0", "--no-report", "--budget", "100000") as host:
        host.program.until("Pal coaches it")
        yield host
