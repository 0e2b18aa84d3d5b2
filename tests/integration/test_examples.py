"""Every example is run as its docstring says."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import fake_camera
import numpy as np
import pytest

from firmware_protocol.messages import PROTOCOL_MAJOR, PROTOCOL_MINOR, JuniorSensors
from firmware_protocol.vocabulary import Action
from firmware_protocol.wire.mavlink_layout import crc_extra, payload_length
from hil.policies import load_policy

if TYPE_CHECKING:
    from hil.pytest_plugin import ServedJunior

pytest_plugins = ["pytester"]

EXAMPLES = Path(__file__).parents[2] / "examples"
NEEDS_PTY = pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")
TIME_OUT = 60
"""In s; every example takes a few."""


def run(name: str, *arguments: str) -> str:
    """Run an example as a program, and return what it prints."""
    command = [sys.executable, "-W", "error", str(EXAMPLES / name), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIME_OUT, check=False)  # noqa: S603
    assert done.returncode == 0, done.stderr or done.stdout
    assert not done.stderr
    return done.stdout


def test_every_example_is_tested() -> None:
    here = {"perform.py", "own_controller.py", "plain_pymavlink.py", "pymavlink_session.py", "test_my_robot_program.py"}
    here |= {"swarm_circle.py", "fake_camera.py", "train_policy.py"}
    tested = here | {"ci-recipe.yml"} | {"mavsdk_drive.py", "node_mavlink_drive.mjs"}  # the last two by tests/clients
    assert {path.name for path in EXAMPLES.iterdir() if path.is_file()} == tested


def test_perform() -> None:
    lines = run("perform.py").splitlines()
    assert lines[0].startswith("Junior 1 on sim://junior")
    assert "EYE_HYST was 20, is 25 now" in lines
    assert any(line.startswith("maneuver: completed, 4 actions done") for line in lines)
    assert lines[-1] == "stopped and disarmed"


@pytest.mark.slow
def test_train_policy(tmp_path: Path) -> None:
    short = ("curved-light", "--population", "8", "--steps", "60", "--generations", "3", "--bouts", "4")
    policies = []
    for workers in ("1", "2"):
        path = tmp_path / f"of{workers}.json"
        lines = run("train_policy.py", *short, "--workers", workers, "--out", str(path)).splitlines()
        assert lines[0].startswith("generation 3: ")
        assert re.match(r"against curved-light: won \d of 4 held-out bouts", lines[1])
        policies.append(load_policy(path))
    assert policies[0].opponent == "curved-light"
    np.testing.assert_array_equal(policies[0].weights, policies[1].weights)


@pytest.mark.slow
def test_swarm_circle() -> None:
    assert run("swarm_circle.py").splitlines()[-1] == "33 of 33 robots stand on the circle"


@pytest.mark.slow
def test_fake_camera_tells_where_robots_are() -> None:
    ours, theirs = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
    with ours, theirs:
        for one in (ours, theirs):
            one.bind(("127.0.0.1", 0))
        theirs.settimeout(TIME_OUT)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        addresses = f"udpin://127.0.0.1:{port}", f"udpout://127.0.0.1:{theirs.getsockname()[1]}"
        command = [sys.executable, "-W", "error", str(EXAMPLES / "fake_camera.py"), *addresses, "--hidden", "0.5"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as camera:  # noqa: S603
            told: set[str] = set()
            theirs.settimeout(0.05)
            while camera.poll() is None and len(told) < 10:
                ours.sendto(b"".join(b"1 %d 0.5 -0.25 1.5 10\n" % robot for robot in range(1, 11)), ("127.0.0.1", port))
                with suppress(TimeoutError):
                    told |= {line.split()[1] for line in theirs.recv(4096).decode().splitlines()}
            camera.send_signal(signal.SIGINT)
            assert camera.wait(TIME_OUT) == 0, camera.stderr and camera.stderr.read()
    assert told == {str(robot) for robot in range(1, 11)}


def test_a_fake_camera_hides_some_and_blurs_the_others() -> None:
    lines = [f"1 {robot} 0.5 -0.25 1.5 10" for robot in range(1, 201)]
    told = [line.split() for line in fake_camera.seen(lines, np.random.default_rng(1), 0.25)]
    assert 120 < len(told) < 180
    assert all(abs(float(x) - 0.5) < 0.006 and (heading, age) == ("1.5", "10") for _, _, x, _, heading, age in told)
    assert len({x for _, _, x, *_ in told}) > 20


@pytest.mark.slow
def test_own_controller_beats_the_simplest_one() -> None:
    own, chase = run("own_controller.py", "flat-heavy", "--trials", "10").splitlines()
    won = [int(re.search(r"won (\d+) of 10 ", line)[1]) for line in (own, chase)]  # type: ignore[index]
    assert won[0] >= 5
    assert won[0] > won[1]


@pytest.mark.slow
@NEEDS_PTY
def test_plain_pymavlink(junior_pty: ServedJunior) -> None:
    pytest.importorskip("pymavlink")
    text = run("plain_pymavlink.py", junior_pty.path)
    assert text.startswith("found system 1, disarmed\nfirmware ")
    assert "SPD_SLOW was 0.40, set to 0.30, and back to 0.40\n" in text
    assert "arm: accepted; it is ready\n" in text
    assert "its heartbeats said driving\n" in text
    assert "emergency stop while driving: accepted; it is stopped\narm: temporarily rejected, as it should be\n" in text
    assert text.endswith("disarm: accepted; arm: accepted; disarm: accepted; it is disarmed\n")


@pytest.mark.slow
@NEEDS_PTY
def test_pymavlink_session(junior_pty: ServedJunior) -> None:
    pytest.importorskip("pymavlink")
    assert run("pymavlink_session.py", junior_pty.path).splitlines() == [
        f"found system 1, protocol {PROTOCOL_MAJOR}.{PROTOCOL_MINOR}",
        "kept by ROBOT_ALIVE, it performed 3 actions",
        "left alone, it stopped by itself",
        "disarmed: it says so itself",
    ]


@pytest.mark.parametrize("name", ["plain_pymavlink.py", "pymavlink_session.py"])
def test_plain_clients_import_nothing_of_this_package(name: str) -> None:
    imports = re.findall(r"^\s*(?:from|import) (\w+)", (EXAMPLES / name).read_text(encoding="utf-8"), re.MULTILINE)
    assert "pymavlink" in imports
    assert set(imports) <= {*sys.stdlib_module_names, "pymavlink"}


def test_the_session_example_s_action_codes_are_the_protocol_s() -> None:
    text = (EXAMPLES / "pymavlink_session.py").read_text(encoding="utf-8")
    assert f"SPIN_LEFT, STAND = {Action.LBRF:d}, {Action.S:d}\n" in text
    assert f"MAJOR, MINOR = {PROTOCOL_MAJOR}, {PROTOCOL_MINOR}\n" in text


@pytest.mark.slow
@NEEDS_PTY
def test_the_tests_of_a_robot_program(pytester: pytest.Pytester) -> None:
    name = "test_my_robot_program.py"
    pytester.makepyfile(**{name.removesuffix(".py"): (EXAMPLES / name).read_text(encoding="utf-8")})
    options = ("-W", "error", "--strict-markers", "-p", "no:cacheprovider", "-p", "no:hypothesispytest")
    pytester.runpytest_inprocess(*options).assert_outcomes(passed=7)


@pytest.mark.slow
def test_the_recipe_s_options_exist(pytester: pytest.Pytester) -> None:
    recipe = (EXAMPLES / "ci-recipe.yml").read_text(encoding="utf-8")
    commands = re.findall(r"(?:hil|pytest) [^\n]*", recipe)
    known = pytester.run(sys.executable, "-m", "pytest", "--help").stdout.str()
    for verb in (["emulate", "junior"], ["coach"]):
        known += pytester.run(sys.executable, "-c", "import hil.cli; hil.cli.main()", *verb, "--help").stdout.str()
    used = {option for command in commands for option in re.findall(r" (--[a-z-]+)", command)}
    assert used >= {"--hil-opponent", "--hil-faults", "--link", "--budget"}
    assert not [option for option in used if option not in known]


def test_the_javascript_example_knows_the_message_it_decodes() -> None:
    text = (EXAMPLES / "node_mavlink_drive.mjs").read_text(encoding="utf-8")
    assert f"MSG_ID = {JuniorSensors.ID}\n" in text
    assert f"PAYLOAD_LENGTH = {payload_length(JuniorSensors)}\n" in text
    assert f"MAGIC_NUMBER = {crc_extra(JuniorSensors)}\n" in text
