"""What may stand in the place of LINK: a bare port, `auto`, and nothing."""

from __future__ import annotations

import functools
import io
import json
import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from firmware_protocol.links.serial import SerialPort
from hil.cli.app import run
from hil.connecting.discovery import survey
from hil.connecting.places import present

if TYPE_CHECKING:
    from hil.pytest_plugin import ServedJunior

NEEDS_PTY = pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")
ARDUINO = SerialPort("/dev/ttyACM7", "Arduino Leonardo", "9573535", 0x2341, 0x8036)
ONBOARD = SerialPort("/dev/ttyS0", "ttyS0", "")
CHASE = "bout --controller chase --trials 1 --no-log"
VERBS = [
    "coach", "bout --controller chase", "check", "monitor", "param", "key --remove", "deploy advice.toml", "swarm list",
    "swarm identify 1", "swarm surround",
]  # fmt: skip


class Terminal(io.StringIO):
    """A person at a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.fixture(scope="module")
def advice(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A small advice file."""
    folder = tmp_path_factory.mktemp("coached")
    command = "coach --budget 8 --held-out 0 --no-log --no-report --quiet"
    assert run([*command.split(), "--out", str(folder / "run")]) == 0
    return (folder / "run" / "advice.toml").read_bytes()


@pytest.fixture(autouse=True)
def _bare_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, advice: bytes) -> None:
    """A machine with no ports but those that a test adds, and a folder of its own with an advice in it."""
    monkeypatch.chdir(tmp_path)
    here(monkeypatch)
    Path("advice.toml").write_bytes(advice)


def here(monkeypatch: pytest.MonkeyPatch, *ports: SerialPort) -> None:
    """Make these the machine's ports."""
    listed = functools.partial(present, list_ports=lambda: list(ports), list_interfaces=list, list_adapters=list)
    monkeypatch.setattr("hil.cli.links.present", listed)
    monkeypatch.setattr("hil.cli.links.list_ports", lambda: list(ports))
    monkeypatch.setattr("hil.cli.links.LOOK", 2.0)


def usb(path: str) -> SerialPort:
    """A port of USB."""
    return SerialPort(path, "USB Serial", "A123", 0x1A86, 0x7523)


# --- nothing ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "verb", ["bout --controller chase --trials 1 --no-log", "monitor --duration 0.1 --no-log", "swarm list"]
)
def test_left_out_it_is_an_emulated_robot_and_a_port_that_is_there_is_told_in_one_line(
    verb: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    here(monkeypatch, ARDUINO, ONBOARD)
    assert run(verb.split()) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line == "This robot is emulated. /dev/ttyACM7 is there: name it, or write auto, for a robot at it."


def test_ports_of_the_main_board_and_quiet_runs_are_not_worth_a_word(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for port, more in ((ONBOARD, []), (ARDUINO, ["--quiet"])):
        here(monkeypatch, port)
        assert run([*CHASE.split(), *more]) == 0
        assert capsys.readouterr().err == ""


# --- auto ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("verb", VERBS)
def test_auto_where_there_is_no_port(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*verb.split(), "auto"]) == 3
    assert "hil: auto: there is no serial port and no CAN interface" in capsys.readouterr().err
    assert not Path("runs").exists()


@pytest.mark.slow
@NEEDS_PTY
def test_auto_where_nobody_answers_tells_what_was_looked_at(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    master, slave = os.openpty()
    try:
        here(monkeypatch, usb(os.ttyname(slave)))
        assert run(["monitor", "auto"]) == 3
    finally:
        os.close(master)
        os.close(slave)
    said = capsys.readouterr().err.splitlines()
    assert said[0].startswith("/dev/")
    assert said[1] == "    nothing came at all"
    assert said[-1].startswith("hil: auto: no robot answers at any port")


@pytest.mark.slow
@NEEDS_PTY
def test_auto_takes_the_one_that_answers_when_told_to(
    junior_pty: ServedJunior, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    here(monkeypatch, usb(junior_pty.path))
    assert run(["param", "auto", "EYE_L_ON"]) == 2
    assert "Nobody can be asked here" in capsys.readouterr().err
    assert run(["param", "auto", "EYE_L_ON", "--yes", "--json"]) == 0
    captured = capsys.readouterr()
    assert list(json.loads(captured.out)) == ["EYE_L_ON"]
    assert f"at {junior_pty.url}" in captured.err


@pytest.mark.slow
@NEEDS_PTY
def test_auto_asks_at_a_terminal(
    junior_pty: ServedJunior, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    here(monkeypatch, usb(junior_pty.path))
    for answer, status, said in (("n\n", 2, "left alone"), ("\n", 0, "take it?")):
        monkeypatch.setattr("sys.stdin", Terminal(answer))
        assert run(["param", "auto", "EYE_L_ON"]) == status
        assert said in capsys.readouterr().err


@pytest.mark.slow
@NEEDS_PTY
def test_auto_lists_several_and_takes_none(
    junior_pty: ServedJunior, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = survey(present(list_ports=lambda: [usb(junior_pty.path)], list_interfaces=list, list_adapters=list), 3.0)
    monkeypatch.setattr("hil.cli.links.present", lambda: [found[0].place] * 2)
    monkeypatch.setattr("hil.cli.links.survey", lambda *_, **__: found * 2)
    assert run(["coach", "auto", "--yes"]) == 2
    first, second, last = capsys.readouterr().err.splitlines()
    assert first == second
    assert first.startswith(f"{junior_pty.url}    Junior, system 1")
    assert last == "hil: auto: there are 2 robots: name the one that is meant by its address"


def test_auto_stands_for_all_links(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["swarm", "list", "auto", "tcp://127.0.0.1:1"]) == 2
    assert "name all links, or none beside it" in capsys.readouterr().err


# --- a bare port -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
@NEEDS_PTY
def test_a_bare_port_is_an_address(junior_pty: ServedJunior, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["param", junior_pty.path, "EYE_L_ON", "--json"]) == 0
    assert list(json.loads(capsys.readouterr().out)) == ["EYE_L_ON"]
    assert run(["ports", junior_pty.path, "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    assert found["url"] == f"serial://{junior_pty.path}:115200"
    assert run(shlex.split(f"monitor {junior_pty.path} --duration 0.2 --out run --quiet")) == 0
    assert json.loads(Path("run/run.json").read_text(encoding="utf-8"))["link"] == f"serial://{junior_pty.path}:115200"


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_takes_a_bare_port(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*verb.split(), "/dev/ttyNobody"]) == 3
    assert "hil: serial:///dev/ttyNobody:115200: there is no port /dev/ttyNobody" in capsys.readouterr().err


# --- nearly right ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("command", "meant"),
    [
        ("coach sim://junoir", "sim://junior"),
        ("coach sim://junior?oponent=flat-light", "opponent"),
        ("coach sim://junior?opponent=flat-hevy", "flat-heavy"),
        ("coach --opponent flat-hevy", "flat-heavy"),
        ("emulate --opponent cornerlight", "corner-light"),
        ("param sim://junior EYE_L_ONN", "EYE_L_ON"),
        ("check --only alive-keep", "alive-keeps"),
        ("monitor locahost:5760", "tcp://locahost:5760"),
    ],
)
def test_near_matches_are_asked_for(command: str, meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(command.split()) == 2
    assert capsys.readouterr().err.rstrip().endswith(f"Did you mean {meant}?")
