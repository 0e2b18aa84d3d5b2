"""Plain pymavlink drives Junior: as a ground station, and as a host that opens a session."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from client_programs import Program

if TYPE_CHECKING:
    from client_fixtures import Served

pytest_plugins = ["client_fixtures"]
pytestmark = pytest.mark.clients

EXAMPLES = Path(__file__).parents[2] / "examples"


def example(clients: Path, name: str, served: Served, folder: Path) -> Program:
    return Program([str(clients / "bin" / "python"), str(EXAMPLES / name), f"tcp:127.0.0.1:{served.port}"], folder)


def ground_station(clients: Path, served: Served, folder: Path) -> None:
    """See it, set it up, arm, drive and stop it, with no session."""
    with example(clients, "plain_pymavlink.py", served, folder) as program:
        program.until("SPD_SLOW was 0.40, set to 0.30, and back to 0.40\n")
        program.until("arm: accepted; it is ready\n")
        served.stand()
        program.until("drove for a second; its heartbeats said driving\n")
        assert served.travelled > 0.05
        program.until("emergency stop while driving: accepted; it is stopped\n")
        program.until("arm: temporarily rejected, as it should be\n")
        program.until("disarm: accepted; arm: accepted; disarm: accepted; it is disarmed\n")
        assert program.end() == 0
    assert served.world.device.wheels == (0, 0)


def host(clients: Path, served: Served, folder: Path) -> None:
    """Open a session, perform, drive, fall silent, disarm."""
    with example(clients, "pymavlink_session.py", served, folder) as program:
        program.until("kept by ROBOT_ALIVE, it performed 3 actions\n")
        program.until("left alone, it stopped by itself\n")
        program.until("disarmed: it says so itself\n")
        assert program.end() == 0
    assert served.world.device.wheels == (0, 0)


def test_a_ground_station_right_after_a_coaching(clients: Path, coached: Served, tmp_path: Path) -> None:
    ground_station(clients, coached, tmp_path)


def test_a_ground_station_takes_a_robot_whose_host_was_killed(clients: Path, abandoned: Served, tmp_path: Path) -> None:
    ground_station(clients, abandoned, tmp_path)


def test_hosts_and_ground_stations_one_after_the_other(clients: Path, tcp: Served, tmp_path: Path) -> None:
    host(clients, tcp, tmp_path)
    ground_station(clients, tcp, tmp_path)
    host(clients, tcp, tmp_path)
