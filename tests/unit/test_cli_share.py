"""`--share`: what goes with it, and what is said of an address that others get to."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING

import pytest

from firmware_protocol.errors import AddressError, LinkOpenError
from hil.bridge.operator import Operator
from hil.cli import share
from hil.cli.app import run
from hil.cli.common import UsageError
from hil.recording.process import RecorderProcess

if TYPE_CHECKING:
    from pathlib import Path

ROBOT = ["tcp://127.0.0.1:5760"]
THERE = "tcp://127.0.0.1:0"


@pytest.mark.parametrize(
    "verb", [["coach", *ROBOT], ["bout", *ROBOT, "--controller", "chase"], ["swarm", "surround", *ROBOT], ["monitor", *ROBOT]]
)
def test_a_link_is_shared_where_it_is_recorded(verb: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*verb, "--share", THERE, "--no-log"]) == 2
    assert "leave out --no-log" in capsys.readouterr().err


@pytest.mark.parametrize(
    "verb", [["coach"], ["coach", "sim://junior"], ["bout", "--controller", "chase"], ["swarm", "surround"], ["monitor"]]
)
def test_what_runs_faster_than_time_is_not_shared(verb: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*verb, "--share", THERE]) == 2
    assert "hil emulate" in capsys.readouterr().err


def test_several_links_are_not_shared(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["swarm", "surround", *ROBOT, "tcp://127.0.0.1:5761", "--share", THERE]) == 2
    assert "shares one link" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [("5770", "127.0.0.1", 5770), ("0", "127.0.0.1", 0), ("tcp://[::1]:5770", "::1", 5770), ("tcp://0.0.0.0:1", "0.0.0.0", 1)],  # noqa: S104 - nothing is opened
)
def test_addresses(text: str, host: str, port: int) -> None:
    found = share.shared_address(text, ROBOT, "coach", no_log=False)
    assert found is not None
    assert (found.host, found.port) == (host, port)


@pytest.mark.parametrize("text", ["udpin://127.0.0.1:5770", "tcp://127.0.0.1", "tcp://x:99999", "70000", "tcp://x:1?a=b", ""])
def test_what_is_no_address_for_it(text: str) -> None:
    with pytest.raises((AddressError, UsageError)):
        share.shared_address(text, ROBOT, "coach", no_log=False)


def test_nothing_is_shared_unasked() -> None:
    assert share.shared_address(None, None, "coach", no_log=True) is None


def recorder(tmp_path: Path, address: share.SharedAddress) -> RecorderProcess:
    return RecorderProcess(
        tmp_path / "log.mcap", run={}, config={}, link="memory:", lockstep=True, share=address.served(Operator())
    )


@pytest.mark.parametrize(
    ("host", "warned"),
    [("127.0.0.1", False), ("localhost", False), ("0.0.0.0", True)],  # noqa: S104 - that it is told of
)
def test_where_it_is_and_who_gets_there_is_told(host: str, warned: bool, tmp_path: Path) -> None:  # noqa: FBT001 - a parameter
    address = share.SharedAddress(host, 0, "coach")
    made = recorder(tmp_path, address)
    said: list[str] = []
    address.announce(made, said.append)
    made.end()
    assert said[0] == f"Shared: {made.shared}"
    assert made.shared.startswith(f"tcp://{host}:")
    assert not made.shared.endswith(":0")
    assert any("Other machines" in one for one in said) is warned


def test_where_it_cannot_be_shared_nothing_is_begun(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(LinkOpenError, match=f"tcp://127.0.0.1:{port}: .* in use.*Choose another port"):
            recorder(tmp_path, share.SharedAddress("127.0.0.1", port, "coach"))
    assert list(tmp_path.iterdir()) == []
