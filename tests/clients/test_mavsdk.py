"""MAVSDK does with Junior what it does with any vehicle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from client_programs import Program

if TYPE_CHECKING:
    from client_fixtures import Served

pytest_plugins = ["client_fixtures"]
pytestmark = pytest.mark.clients

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "mavsdk_drive.py"
MORE = """
import json, math, queue, sys
from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.mavlink_direct import MavlinkDirect
from mavsdk.plugins.param import Param, ParamError

mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
mavsdk.add_any_connection(sys.argv[1])
system = mavsdk.first_autopilot(10.0)
param = Param(system)
print("unknown parameter:", param.get_param_float("NO_SUCH"))
try:
    param.set_param_float("EYE_L_ON", 3000.0)
except ParamError as error:
    print("out of range: refused")
print("it keeps", param.get_param_float("EYE_L_ON"))
direct = MavlinkDirect(system)
direct.load_custom_xml(open(sys.argv[2], encoding="utf-8").read())
heard = queue.Queue()
direct.subscribe_message("JUNIOR_SENSORS", lambda message, _: heard.put(json.loads(message.fields_json)))
fields = heard.get(timeout=10)
print("sensors:", sorted(fields)[0], fields["battery"] // 100)
"""


def python(clients: Path) -> str:
    return str(clients / "bin" / "python")


def drive(clients: Path, url: str, served: Served, folder: Path) -> None:
    with Program([python(clients), str(EXAMPLE), url], folder) as program:
        program.until("found system 1, firmware 0.1\n")
        program.until(" parameters, ")
        program.until("SPD_SLOW was 0.40, set to 0.30, and back to 0.40\n")
        program.until("battery 7.5 V, ready to arm: True\n")
        program.until("armed: True\n")
        assert served.travelled < 0.001
        program.until("drives; its heartbeats say driving\n")
        assert served.travelled > 0.05
        program.until("left alone, it stopped by itself\n")
        program.until("emergency stop while driving: it is stopped\n")
        program.until("arming is refused until it is disarmed\n")
        program.until("disarmed\n")
        assert program.end() == 0
    assert served.world.device.wheels == (0, 0)


def test_the_example_over_tcp(clients: Path, tcp: Served, tmp_path: Path) -> None:
    drive(clients, f"tcpout://127.0.0.1:{tcp.port}", tcp, tmp_path)


def test_the_example_right_after_a_coaching(clients: Path, coached: Served, tmp_path: Path) -> None:
    drive(clients, f"tcpout://127.0.0.1:{coached.port}", coached, tmp_path)


def test_the_example_over_a_serial_port(clients: Path, pty: Served, tmp_path: Path) -> None:
    drive(clients, f"serial://{pty.device}:115200", pty, tmp_path)


def test_mistakes_and_own_messages(clients: Path, tcp: Served, tmp_path: Path) -> None:
    dialect = ROOT / "firmware_protocol" / "dialect" / "junior.xml"
    with Program([python(clients), "-c", MORE, f"tcpout://127.0.0.1:{tcp.port}", str(dialect)], tmp_path) as program:
        program.until("unknown parameter: nan\n")
        program.until("out of range: refused\n")
        program.until("it keeps 250.0\n")
        program.until("sensors: battery 74\n")
