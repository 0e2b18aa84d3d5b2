"""cantools' own programs read Junior's frames with the DBC, from a candump log and live from a bus."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from firmware_protocol.events import Received
from firmware_protocol.messages import JuniorSensors
from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.can.frame import CanFrame, split_records
from firmware_protocol.wire.fields import CAN
from hil.bridge.clock import MonotonicClock
from simdevice.serving.opening import open_endpoint
from simdevice.serving.server import serve
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from firmware_protocol.events import Rejected

can = pytest.importorskip("can")
pytest.importorskip("cantools")

ROOT = Path(__file__).parents[2]
DATABASE = str(ROOT / "firmware_protocol" / "dialect" / "junior.dbc")
MASK = "0x1FFFFF80"
"""As docs/can.md says: the node is masked out, and the long messages stay apart."""
PATIENCE = 60.0


def test_the_page_says_this_mask() -> None:
    page = (ROOT / "docs" / "can.md").read_text(encoding="utf-8")
    assert page.count(f"-m {MASK}") >= 2
    assert "-m 0x780" not in page + (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")


def test_a_candump_log_is_decoded(tmp_path: Path) -> None:
    world, codec = junior_world(WorldSettings(wire=CAN)), CanCodec(system=255, component=190)
    events: list[Received | Rejected] = []
    log = tmp_path / "candump.log"
    with can.CanutilsLogWriter(log, channel="can0") as writer:
        for _ in range(100):
            data = world.step(b"")
            events += codec.receive(data, world.now())
            for frame in map(CanFrame.unpack, split_records(data)):
                message = can.Message(
                    timestamp=1e9 + world.now(), arbitration_id=frame.identifier, data=frame.data, channel="can0"
                )
                message.is_extended_id = frame.extended
                writer.on_message_received(message)
    done = subprocess.run(  # noqa: S603 - cantools
        [sys.executable, "-m", "cantools", "decode", "--single-line", "-m", MASK, DATABASE],
        input=log.read_text(encoding="ascii"), capture_output=True, text=True, timeout=PATIENCE, check=True,
    )  # fmt: skip
    assert not done.stderr  # cantools warns of messages that it can't tell apart
    expected = [event.message for event in events if isinstance(event, Received) and isinstance(event.message, JuniorSensors)]
    eyes = re.findall(
        r"JUNIOR_SENSORS_EYES\(eye_left: (\d+), eye_right: (\d+), floor_left: (\d+), floor_right: (\d+)\)", done.stdout
    )
    assert len(expected) == 25
    assert [tuple(map(int, found)) for found in eyes] == [(*sensors.eye, *sensors.floor) for sensors in expected]


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")
def test_the_monitor_shows_a_bus() -> None:
    pytest.importorskip("curses")
    port = 20000 + os.getpid() % 20000
    endpoint = open_endpoint(f"can://udp_multicast/239.74.163.2?port={port}")
    world = junior_world(WorldSettings(wire=CAN))
    stop = threading.Event()
    thread = threading.Thread(target=serve, args=(world, endpoint, MonotonicClock(), stop.is_set))
    thread.start()
    master, slave = os.openpty()
    bus = ["-i", "udp_multicast", "-c", "239.74.163.2"]
    command = ["cantools", "monitor", "-m", MASK, *bus, DATABASE, "--bus-kwargs", f"port={port}"]
    environment = {**os.environ, "TERM": "xterm", "LINES": "40", "COLUMNS": "120"}
    text = b""
    try:
        with subprocess.Popen(  # noqa: S603 - cantools
            [sys.executable, "-m", *command], stdin=slave, stdout=slave, stderr=slave, env=environment
        ) as monitor:
            killer = threading.Timer(PATIENCE, monitor.kill)
            killer.start()
            os.close(slave)
            shown = ("JUNIOR_SENSORS_EYES", "JUNIOR_SENSORS_SWITCHES", "JUNIOR_SENSORS_TRAVEL")
            while not all(name.encode() in text for name in shown):
                try:
                    text += os.read(master, 65536)
                except OSError as error:  # it has ended
                    raise AssertionError(text.decode("utf-8", "replace")) from error
            os.write(master, b"q")
            while True:
                try:
                    os.read(master, 65536)
                except OSError:
                    break
            assert monitor.wait(PATIENCE) == 0
            killer.cancel()
    finally:
        os.close(master)
        stop.set()
        thread.join(10)
    assert b"eye_left:" in text
