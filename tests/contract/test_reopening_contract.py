"""One test for every link, with and without faults: the plug is pulled and put back, and the same robot works again.

At the far end is the emulated robot behind the emulator's own endpoints, served by a thread; what is closed is really closed.
"""

from __future__ import annotations

import os
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

import pytest

import hil
from firmware_protocol.errors import PeerLostError
from firmware_protocol.events import Event, LinkNews, PeerBack, PeerLost
from firmware_protocol.links import SerialPort
from firmware_protocol.roles.junior import perform
from hil.bridge.clock import MonotonicClock
from hil.sumo.connecting import connect
from simdevice.serving.opening import open_endpoint
from simdevice.serving.server import Server
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from simdevice.serving.endpoints import Endpoint

pytestmark = pytest.mark.slow

PATIENCE: Final = 20.0
"""How long anything may take before a test fails, in s."""
GROUP: Final = f"can://udp_multicast/239.74.163.9?port={20000 + (os.getpid() + 7) % 20000}"
SILENT: Final = {"udp": "udp://127.0.0.1:0", "udp_multicast": GROUP, "virtual": "can://virtual/reopening"}
"""Links that cannot tell that nobody is there any more."""
CLOSED: Final = {"pty": "pty", "usb": "pty", "tcp": "tcp://127.0.0.1:0", "slcan": "slcan"}
"""Links that end with the other end. `pty` is found again by a symbolic link, `usb` and `slcan` by their hardware."""


class Plug:
    """An emulated robot on one kind of link, which can be unplugged: it stands still then, and forgets nothing.

    Args:
        kind: Kind of the link.
        folder: Where a symbolic link may be made.
    """

    def __init__(self, kind: str, folder: Path) -> None:
        self._text = (SILENT | CLOSED)[kind]
        self._name = folder / "robot" if kind == "pty" else None
        self._usb = kind in {"usb", "slcan"}
        self.ports: list[SerialPort] = []
        self._endpoint: Endpoint = open_endpoint(self._text)
        self._world = junior_world(WorldSettings(referee=False, wire=self._endpoint.wire))
        if "://" in self._text:  # a port taken by chance is kept
            self._text = self._endpoint.url.replace("udpout", "udp")
        self._serve()

    @property
    def url(self) -> str:
        """Where it is; under a name of its own, or the one it has now."""
        return f"serial://{self._name}:115200" if self._name else self._endpoint.url

    def list(self) -> list[SerialPort]:
        return self.ports

    def pull(self) -> None:
        self._stop.set()
        self._thread.join(PATIENCE)
        self._endpoint.close()
        self.ports = []
        if self._name:
            self._name.unlink()

    def put_back(self) -> None:
        self._endpoint = open_endpoint(self._text)
        self._serve()

    def _serve(self) -> None:
        device = getattr(self._endpoint, "path", "")
        if self._name:
            self._name.symlink_to(device)
        if self._usb:
            self.ports = [SerialPort(device, "Board", "SN1", 0x2341, 0x0043)]
        self._stop = threading.Event()
        server = Server(self._world, self._endpoint, MonotonicClock())
        self._thread = threading.Thread(target=server.run, args=(self._stop.is_set,), daemon=True)
        self._thread.start()


@contextmanager
def plugged(kind: str, folder: Path) -> Iterator[Plug]:
    plug = Plug(kind, folder)
    try:
        yield plug
    finally:
        plug.pull()


def until(junior: hil.Junior, done: Callable[[], bool]) -> None:
    """Serve the link until something is so."""
    end = junior.now() + PATIENCE
    while not done():
        assert junior.now() < end
        junior.step()


def with_faults(url: str, faults: str) -> str:
    return f"{url}{'&' if '?' in url else '?'}faults={faults}" if faults else url


@pytest.mark.parametrize("faults", ["", "delay:0.002,jitter:0.003"])
@pytest.mark.parametrize("kind", [*CLOSED, *SILENT])
def test_what_is_pulled_and_put_back_works_again(
    kind: str, faults: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if kind in SILENT:
        monkeypatch.setattr("firmware_protocol.peer.peer.SILENCE", 0.3)
    told: list[Event] = []
    with (
        plugged(kind, tmp_path) as plug,
        connect(with_faults(plug.url, faults), timeout=PATIENCE, reconnect=PATIENCE, ports=plug.list) as junior,
    ):
        junior.listen(lambda event: told.append(event) if isinstance(event, LinkNews | PeerLost | PeerBack) else None)
        before, name = junior.peer.session, junior.bridge.link.url
        junior.arm()
        plug.pull()
        ticket = perform(junior.peer, hil.Maneuver((hil.Action.S,)))
        until(junior, lambda: any(isinstance(event, PeerLost) for event in told))
        assert isinstance(ticket.error, PeerLostError)
        assert not junior.peer.ready
        assert not junior.armed
        with pytest.raises(PeerLostError):
            junior.drive(0.1, 0.1)
        plug.put_back()
        junior.wait_until_back()
        until(junior, lambda: any(isinstance(event, PeerBack) for event in told))
        assert not junior.armed
        junior.arm()
        assert junior.perform(["S"], period=0.02).done == 1
        assert junior.read_sensors().battery > 5
        if kind in CLOSED:
            assert junior.peer.session not in {before, None}
            news = [event.text for event in told if isinstance(event, LinkNews)]
            assert "trying for 20 s to open it again" in news[0]
            assert "the link is back" in news[-1]
            renamed = junior.bridge.link.url != name
            assert renamed == news[-1].endswith(f", as {junior.bridge.link.url}")


@pytest.mark.parametrize("faults", ["", "delay:0.002,jitter:0.003,"])
@pytest.mark.parametrize("wire", ["mavlink", "can"])
def test_so_does_the_one_in_this_process(wire: str, faults: str) -> None:
    told: list[Event] = []
    with connect(f"sim://junior?wire={wire}&faults={faults}unplug:1+2", reconnect=10.0) as junior:
        junior.listen(lambda event: told.append(event) if isinstance(event, LinkNews | PeerLost | PeerBack) else None)
        before = junior.peer.session
        junior.arm()
        ticket = perform(junior.peer, hil.Maneuver((hil.Action.S,) * 8, period=1.0))
        until(junior, lambda: any(isinstance(event, PeerLost) for event in told))
        assert isinstance(ticket.error, PeerLostError)
        junior.wait_until_back()
        assert junior.peer.session not in {before, None}
        junior.arm()
        assert junior.perform(["S"], period=0.02).done == 1
