"""Whether a robot that is lost is armed, nobody knows: `armed` says so, and never what it was."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from peer_bench import Bench
from scripted_robot import ScriptedRobot

from firmware_protocol.errors import LinkClosedError, PeerLostError
from firmware_protocol.links import MemoryLink
from firmware_protocol.peer.connection import PeerState
from hil.bridge.bridge import Bridge
from hil.bridge.reopening import Reopening
from hil.sumo.junior import Junior

if TYPE_CHECKING:
    from collections.abc import Callable


class Plug(MemoryLink):
    """A link that can be pulled."""

    pulled = False

    def read(self, timeout: float) -> bytes:
        if self.pulled:
            raise LinkClosedError(self.url, "pulled")
        return super().read(timeout)


class Opener:
    """Opens nothing any more."""

    def __init__(self, robot: ScriptedRobot) -> None:
        self._robot = robot

    def open(self) -> Plug:
        raise LinkClosedError("memory:", "still pulled")

    def let_pass(self, duration: float) -> None:
        end = self._robot.now() + duration
        while self._robot.now() < end:
            self._robot.step(b"")


def silent(robot: ScriptedRobot, link: Plug) -> None:
    del link
    robot.silent = True


def pulled(robot: ScriptedRobot, link: Plug) -> None:
    del robot
    link.pulled = True


def restarted(robot: ScriptedRobot, link: Plug) -> None:
    del link
    robot.reboot()
    robot.mute = lambda message: type(message).__name__ == "Heartbeat"


@pytest.mark.parametrize("patience", [0.0, 10.0])
@pytest.mark.parametrize("happens", [silent, pulled, restarted])
def test_it_is_none(happens: Callable[[ScriptedRobot, Plug], None], patience: float) -> None:
    robot = ScriptedRobot(uid=1)
    link = Plug(robot)
    sessions = iter(range(100, 200))
    reopening = Reopening(Opener(robot), patience) if patience else None
    bridge = Bridge(link, robot, session=lambda: next(sessions), reopening=reopening)
    junior = Junior(bridge)
    junior.find()
    junior.arm()
    assert junior.armed is True
    happens(robot, link)
    seen = []
    end = robot.now() + 4.0
    while robot.now() < end and junior.peer.ready:
        try:
            junior.step(0.05)
        except (PeerLostError, LinkClosedError):
            break
    seen.append(junior.armed)
    assert seen == [None]
    assert not bool(junior.peer.kept)


def test_it_is_none_where_it_falls_silent_during_the_handshake() -> None:
    bench = Bench()
    bench.heartbeat(armed=True)
    bench.version()
    assert bench.state() is PeerState.OPENING
    seen = [bench.peer.armed]
    bench.wait(4.0)
    seen.append(bench.peer.armed)
    assert bench.state() is PeerState.SILENT
    assert seen == [True, None]
    assert not bench.peer.kept


def test_it_is_none_where_it_falls_silent_after_it_was_refused() -> None:
    bench = Bench()
    bench.heartbeat(armed=True)
    bench.version(major=1)
    assert bench.state() is PeerState.REFUSED
    bench.wait(4.0)
    assert bench.state() is PeerState.SILENT
    assert bench.peer.armed is None
