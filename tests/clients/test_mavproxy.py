"""MAVProxy does with Junior what it does with any vehicle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from client_programs import Program

from firmware_protocol.parameters import JUNIOR_PARAMETERS

if TYPE_CHECKING:
    from pathlib import Path

    from client_fixtures import Served
    from sharer import Sharer

pytest_plugins = ["client_fixtures"]
pytestmark = pytest.mark.clients


def mavproxy(clients: Path, folder: Path, *options: str) -> Program:
    """MAVProxy with its usual modules, asking for the parameters as the standard says from the beginning."""
    command = [str(clients / "bin" / "python"), str(clients / "bin" / "mavproxy.py"), "--source-system=255"]
    return Program([*command, "--cmd=set param_ftp False", f"--state-basedir={folder}", *options], folder)


def session(program: Program, served: Served) -> None:
    program.until("Detected vehicle 1:1")
    program.until(f"Received {len(JUNIOR_PARAMETERS)} parameters")
    program.say("param set SPD_SLOW 0.3")
    program.ask("param show SPD_SLOW", "SPD_SLOW         0.3")
    program.say("wp list")
    program.until("Requesting 0 waypoints")
    program.say("arm throttle")
    program.until("COMPONENT_ARM_DISARM: ACCEPTED")
    program.until("ARMED")
    program.say("module load message")
    program.until("Loaded module message")
    assert served.travelled < 0.001
    program.say("repeat add 0.05 message MANUAL_CONTROL 1 500 0 0 100 0")
    program.until("Mode LEARNING")  # what MAVProxy calls custom mode 2 of a rover: driving
    program.say("long DO_FLIGHTTERMINATION 1")
    program.until("DO_FLIGHTTERMINATION: ACCEPTED")
    program.until("Emergency stop: disarm, then arm")
    assert served.travelled > 0.05
    program.say("repeat clean")
    program.say("arm throttle")
    program.until("COMPONENT_ARM_DISARM: TEMPORARILY_REJECTED")
    program.say("disarm")
    program.until("COMPONENT_ARM_DISARM: ACCEPTED")
    assert "fence breach" not in program.text
    assert served.world.device.wheels == (0, 0)


def test_a_session_over_tcp(clients: Path, tcp: Served, tmp_path: Path) -> None:
    with mavproxy(clients, tmp_path, f"--master=tcp:127.0.0.1:{tcp.port}") as program:
        session(program, tcp)


def test_a_session_right_after_a_coaching(clients: Path, coached: Served, tmp_path: Path) -> None:
    with mavproxy(clients, tmp_path, f"--master=tcp:127.0.0.1:{coached.port}") as program:
        session(program, coached)


def test_a_session_over_a_serial_port(clients: Path, pty: Served, tmp_path: Path) -> None:
    with mavproxy(clients, tmp_path, f"--master={pty.device}", "--baudrate=115200") as program:
        session(program, pty)


def test_it_looks_on_while_pal_coaches_and_may_stop_and_no_more(clients: Path, sharer: Sharer, tmp_path: Path) -> None:
    with mavproxy(clients, tmp_path, f"--master=tcp:127.0.0.1:{sharer.port}") as program:
        program.until("watching, coach drives")
        program.until("Detected vehicle 1:1")
        program.until(f"Received {len(JUNIOR_PARAMETERS)} parameters")
        program.say("wp list")
        program.until("Requesting 0 waypoints")
        program.say("disarm")
        program.until("COMPONENT_ARM_DISARM: DENIED")
        program.say("long DO_FLIGHTTERMINATION 1")
        program.until("DO_FLIGHTTERMINATION: ACCEPTED")
    sharer.program.until("emergency stop")
    assert sharer.program.end() == 1
