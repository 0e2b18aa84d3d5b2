"""A JavaScript program drives Junior, with node-mavlink and Node's own sockets."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from client_programs import Program

from firmware_protocol.parameters import JUNIOR_PARAMETERS

if TYPE_CHECKING:
    from client_fixtures import Served

pytest_plugins = ["client_fixtures"]
pytestmark = [pytest.mark.clients, pytest.mark.node]

EXAMPLE = Path(__file__).parents[2] / "examples" / "node_mavlink_drive.mjs"


def drive(clients: Path, served: Served, folder: Path) -> None:
    (folder / "node_modules").symlink_to(clients / "node_modules")
    script = shutil.copy(EXAMPLE, folder)
    with Program(["node", str(script), "127.0.0.1", str(served.port)], folder) as program:
        program.until("found system 1, disarmed\n")
        program.until(f"{len(JUNIOR_PARAMETERS)} parameters, SPD_SLOW is 0.40\n")
        program.until("SPD_SLOW set to 0.30\nand back to 0.40\n")
        program.until("armed: true\n")
        program.until("drives: true\n")
        assert served.travelled > 0.05
        program.until("left alone, it stopped by itself\n")
        program.until("emergency stop; armed again: false\n")
        program.until("disarmed: true\n")
        assert program.end() == 0
    assert served.world.device.wheels == (0, 0)


def test_the_example(clients: Path, tcp: Served, tmp_path: Path) -> None:
    drive(clients, tcp, tmp_path)


def test_the_example_right_after_a_coaching(clients: Path, coached: Served, tmp_path: Path) -> None:
    drive(clients, coached, tmp_path)
