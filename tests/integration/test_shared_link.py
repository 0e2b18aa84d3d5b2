"""A shared link end to end: `hil coach` or `hil monitor` drives, others look on, and the stop of one of them is in the log."""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
from contextlib import closing
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

import pytest
from guest import ROBOT, STOP, Guest
from processes import Hil
from serving import MULTICAST, served
from sharer import sharing

import hil
from firmware_protocol.errors import NoRobotError, PeerError
from firmware_protocol.messages import (
    HOST_SYSTEM,
    AutopilotVersion,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    JuniorSensors,
    MissionCount,
    MissionRequestList,
    ParamRequestList,
    ParamSet,
    ParamValue,
    RobotAlive,
    RobotSession,
    Statustext,
    SwarmMove,
    SwarmObservation,
)
from firmware_protocol.messages.robot import State
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from firmware_protocol.peer.timing import HOST_HEARTBEAT
from hil.mcaplog import LogReader
from hil.signing.key_file import create_key
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.slow
TCP: Final = "tcp://127.0.0.1:0"
LONG: Final = ("--no-report", "--budget", "100000", "--held-out", "0")


def asks_as_qgroundcontrol(guest: Guest) -> None:
    """Ask what it asks of a vehicle that it meets, and see that a watcher is told everything, and obeyed in nothing."""
    guest.wait_for(Heartbeat, lambda one: one.type == 10)
    guest.say(HOST_HEARTBEAT)
    guest.socket.sendall(bytes.fromhex("fd0600000001be4200000400010100017e0f"))  # REQUEST_DATA_STREAM, which is none of ours
    guest.say(CommandLong(*ROBOT, Command.REQUEST_MESSAGE, 0, 148.0))
    assert guest.wait_for(AutopilotVersion).uid
    guest.say(ParamRequestList(*ROBOT))
    guest.say(MissionRequestList(*ROBOT))
    guest.wait_for(MissionCount)
    guest.say(CommandLong(*ROBOT, Command.SET_MESSAGE_INTERVAL, 0, float(JuniorSensors.ID), 10_000.0))
    denied = guest.wait_for(CommandAck, lambda ack: ack.command == Command.SET_MESSAGE_INTERVAL)
    guest.say(CommandLong(*ROBOT, Command.ARM_DISARM, 0, 1.0))
    arming = guest.wait_for(CommandAck, lambda ack: ack.command == Command.ARM_DISARM)
    assert {denied.result, arming.result} == {CommandResult.DENIED}
    assert (arming.target_system, arming.target_component) == (250, 190)
    last = len(JUNIOR_PARAMETERS) - 1
    if not any(one.param_index == last for one in guest.of_kind(ParamValue)):
        guest.wait_for(ParamValue, lambda one: one.param_index == last)
    known = {one.param_id: one for one in guest.of_kind(ParamValue)}
    assert known.keys() == {parameter.name for parameter in JUNIOR_PARAMETERS}
    guest.say(ParamSet(*ROBOT, "SPD_SLOW", 0.11))
    assert guest.wait_for(ParamValue) == known["SPD_SLOW"]


@pytest.mark.parametrize("link", [TCP, pytest.param(MULTICAST, id="can")])
def test_a_guest_of_a_coaching_asks_is_refused_and_stops_it(link: str, tmp_path: Path) -> None:
    with served(link) as url, sharing(tmp_path, "coach", url, *LONG) as host, Guest(host.port, 250) as guest:
        assert guest.welcome.text == "watching, coach drives"
        asks_as_qgroundcontrol(guest)
        guest.wait_for(RobotAlive)
        guest.wait_for(JuniorSensors)
        guest.say(STOP)
        ack = guest.wait_for(CommandAck, lambda one: one.command == STOP.command and one.target_system == 250)
        assert ack.result == CommandResult.ACCEPTED
        guest.wait_for(Heartbeat, lambda one: one.custom_mode == State.STOPPED)
        assert host.program.end() == 1, host.program.text
        assert "emergency stop" in host.program.text
        guest.to_the_end()
        assert guest.of_kind(Statustext)[-1].text == "coach has ended: nobody drives"
        assert not [one for one in guest.of_kind(Heartbeat) if one.custom_mode > State.STOPPED]
    assert ("guest stop", "") in host.inputs()
    host.check_replay()


def test_parameters_that_nobody_has_read_are_read_for_a_guest(tmp_path: Path) -> None:
    with served(TCP) as url, sharing(tmp_path, "monitor", url, "--duration", "600") as host, Guest(host.port, 250) as guest:
        asks_as_qgroundcontrol(guest)
        guest.say(STOP)
        guest.wait_for(Heartbeat, lambda one: one.custom_mode == State.STOPPED)
        host.program.send(signal.SIGINT)
        host.program.end()
    assert host.inputs()[:2] == [("parameters", "1"), ("guest stop", "")]
    host.check_replay()


def test_hil_monitor_looks_on_and_takes_nothing(tmp_path: Path) -> None:
    with served(TCP) as url, sharing(tmp_path, "coach", url, *LONG) as host:
        with Hil(tmp_path, "monitor", host.url, "--duration", "3", "--out", "watched") as watcher:
            watcher.until("watching, coach drives")
            watcher.until("eyes")
            assert watcher.end() == 0
        with Guest(host.port, 250) as guest:  # it goes on
            guest.wait_for(JuniorSensors)
            guest.wait_for(RobotAlive)
        host.program.send(signal.SIGINT)
        host.program.end()
    sent = {entry.topic for entry in LogReader(tmp_path / "watched" / "log.mcap").entries(["/robot/session"])}
    assert not sent
    assert hil.replay(tmp_path / "watched" / "log.mcap").difference is None
    assert [what for what, _ in host.inputs()] == ["interrupt"]


def test_hil_view_looks_on_and_stops(tmp_path: Path) -> None:
    view = ("view", "--duration", "3", "--no-open", "--reconnect", "0", "--out", "watched")
    with (
        served(TCP) as url,
        sharing(tmp_path, "coach", url, *LONG) as host,
        Hil(tmp_path, *view, host.url) as watcher,
    ):
        page = urlsplit(watcher.until("Live: ").split()[1])
        watcher.until("watching, coach drives")
        with closing(http.client.HTTPConnection(page.netloc, timeout=60)) as connection:
            connection.request("POST", f"{page.path}stop", headers={"Origin": f"http://{page.netloc}"})
            assert json.load(connection.getresponse()) == {"confirmed": True, "robots": 1, "missing": 0}
        assert host.program.end() == 1
        watcher.end()
    assert ("guest stop", "") in host.inputs()
    host.check_replay()
    log = tmp_path / "watched" / "log.mcap"
    assert not list(LogReader(log).entries(["/robot/session"]))
    assert hil.replay(log).difference is None


def test_who_would_drive_is_told_that_another_does(tmp_path: Path) -> None:
    with served(TCP) as url, sharing(tmp_path, "monitor", url, "--duration", "600") as host:
        with Hil(tmp_path, "coach", host.url, *LONG) as second:
            assert second.end() == 3
            assert f"Look on by hil monitor {host.url}" in second.text
        with pytest.raises(NoRobotError, match="watching, monitor drives"):
            hil.connect_all(host.url, timeout=1.0)
        with hil.connect_all(host.url, watch=True) as robots:
            (robot,) = robots
            with pytest.raises(PeerError, match="another program's"):
                robot.take()
            robot.emergency_stop()
            assert robot.state is State.STOPPED
        host.program.send(signal.SIGINT)
        host.program.end()
    assert host.inputs()[0] == ("guest stop", "")
    host.check_replay()


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_guests_are_told_that_who_drives_was_interrupted_or_killed(tmp_path: Path) -> None:
    for number, words in ((signal.SIGINT, "monitor has ended"), (signal.SIGKILL, "monitor has died")):
        folder = tmp_path / number.name
        folder.mkdir()
        with served(TCP) as url, sharing(folder, "monitor", url, "--duration", "600") as host, Guest(host.port) as guest:
            guest.wait_for(Heartbeat, lambda one: one.type == 10)
            host.program.send(number)
            guest.to_the_end()
            assert guest.of_kind(Statustext)[-1].text.startswith(words)
            assert host.program.end() == (130 if number == signal.SIGINT else -signal.SIGKILL)


def test_on_a_signed_link_guests_see_frames_without_signatures_and_no_key(tmp_path: Path) -> None:
    key = tmp_path / "key"
    world = junior_world(WorldSettings(signing_key=create_key(key)))
    with (
        served(TCP, world) as url,
        sharing(tmp_path, "monitor", url, "--duration", "600", "--signing-key", str(key)) as host,
        Guest(host.port, 250) as guest,
    ):
        asks_as_qgroundcontrol(guest)
        assert not any(event.raw[2] & 1 for event in guest.heard)
        guest.say(RobotSession(5, 0, 9, *ROBOT, 2, 1))
        guest.say(STOP)
        guest.wait_for(Heartbeat, lambda one: one.custom_mode == State.STOPPED)
        assert {event.system for event in guest.heard} == {1, HOST_SYSTEM}
        host.program.send(signal.SIGINT)
        host.program.end()


def test_a_guest_stops_a_swarm_and_sees_all_of_it(tmp_path: Path) -> None:
    with Hil(tmp_path, "emulate", "swarm", "--rangers", "6", "--wilds", "2", "--link", TCP) as robots:
        url = robots.until("tcp://").strip()
        robots.until("For instance")
        swarm = ("swarm", "surround", url, "--yes", "--no-input", "--no-report", "--steps", "5000")
        with sharing(tmp_path, *swarm) as host, Guest(host.port, 250) as guest:
            assert guest.welcome.text == "watching, surround drives"
            for system in range(1, 9):
                guest.until(lambda event, of=system: event.system == of and type(event.message) is SwarmObservation)  # type: ignore[misc]
            guest.wait_for(SwarmMove)
            with Hil(tmp_path, "monitor", host.url, "--duration", "3", "--out", "watched") as watcher:
                watcher.until("watching, surround drives")
                assert watcher.end() == 0
                assert re.search(r"^8  WILD  \w+ \(armed\)  at -?\d.*heading", watcher.text, re.MULTILINE)
            guest.say(CommandLong(0, 0, Command.FLIGHT_TERMINATION, 0, 1.0))
            assert guest.wait_for(CommandAck, lambda ack: ack.target_system == 250).result == CommandResult.ACCEPTED
            assert host.program.end() == 1
            assert "emergency stop by who looks on: 8 robots have said that they are stopped" in host.program.text
        host.check_replay()
