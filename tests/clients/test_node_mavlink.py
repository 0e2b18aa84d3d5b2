"""A JavaScript program drives Junior, with node-mavlink and Node's own sockets."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from client_programs import Program

from firmware_protocol.parameters import PARAMETERS

if TYPE_CHECKING:
    from client_fixtures import Served

pytest_plugins = ["client_fixtures"]
pytestmark = [pytest.mark.clients, pytest.mark.node]

EXAMPLE = Path(__file__).parents[2] / "examples" / "node_mavlink_drive.mjs"


def test_the_example(clients: Path, tcp: Served, tmp_path: Path) -> None:
    (tmp_path / "node_modules").symlink_to(clients / "node_modules")
    script = shutil.copy(EXAMPLE, tmp_path)
    with Program(["node", str(script), "127.0.0.1", str(tcp.port)], tmp_path) as program:
        program.until("found system 1, disarmed\n")
        program.until(f"{len(PARAMETERS)} parameters, SPD_SLOW is 0.40\n")
        program.until("SPD_SLOW set to 0.30\nand back to 0.40\n")
        program.until("armed: true\n")
        program.until("drives: true\n")
        assert tcp.travelled > 0.05
        program.until("left alone, it stopped by itself\n")
        program.until("emergency stop; armed again: false\n")
        program.until("disarmed: true\n")
        assert program.end() == 0
    assert tcp.world.device.wheels == (0, 0)
