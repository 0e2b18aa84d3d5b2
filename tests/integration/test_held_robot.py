"""A robot that another client holds: what a program is told that comes second."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING

import pytest
from serving import served

import hil
from firmware_protocol.errors import NoRobotError
from hil.cli.app import run

if TYPE_CHECKING:
    from collections.abc import Iterator

HELD = "another client holds the robot"


@pytest.fixture
def held() -> Iterator[str]:
    """A robot on TCP that another client holds."""
    with served("tcp://127.0.0.1:0") as url:
        host, _, port = url.removeprefix("tcp://").partition(":")
        with socket.create_connection((host, int(port))) as other:
            assert other.recv(1)
            yield url


def test_connecting_says_that_another_holds_it(held: str) -> None:
    with pytest.raises(NoRobotError, match=f"{held}: at the other end it was said: {HELD}. Close the program"):
        hil.connect(held)


def test_waiting_for_it_says_so_too_when_the_time_is_over(held: str) -> None:
    with pytest.raises(NoRobotError, match=HELD):
        hil.connect(held, reconnect=10.0, timeout=0.3)
    with pytest.raises(NoRobotError, match=HELD):
        hil.connect_all(held, reconnect=10.0, timeout=0.3)


@pytest.mark.parametrize(
    "verb", [["monitor", "--no-log", "--duration", "1"], ["coach", "--no-log", "--budget", "2"], ["param"]]
)
def test_the_commands_say_so(held: str, capsys: pytest.CaptureFixture[str], verb: list[str]) -> None:
    options = [] if verb == ["param"] else ["--reconnect", "0"]
    assert run([verb[0], held, *verb[1:], *options]) == 3
    assert HELD in capsys.readouterr().err


def test_the_list_of_ports_says_so(held: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["ports", held]) == 3
    assert HELD in capsys.readouterr().out
