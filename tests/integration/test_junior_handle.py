"""The robot as a program holds it: what has no other place."""

from __future__ import annotations

import pytest

import hil
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import State
from hil.bridge.bridge import Bridge
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings


class Mute:
    """A world whose robot hears, and from some time on is not heard."""

    def __init__(self) -> None:
        self.world = junior_world(WorldSettings(seed=2))
        self.mute = False

    def now(self) -> float:
        return self.world.now()

    def step(self, inbound: bytes) -> bytes:
        sent = self.world.step(inbound)
        return b"" if self.mute else sent


def handle(world: Mute) -> hil.Junior:
    junior = hil.Junior(Bridge(MemoryLink(world), world, session=lambda: 77))
    junior.find()
    return junior


def test_a_maneuver_may_be_written_in_words() -> None:
    with handle(Mute()) as junior:
        junior.arm()
        report = junior.perform("MF LBRF S", period=0.05)
        assert (report.outcome, report.done) == (hil.Outcome.COMPLETED, 3)
        with pytest.raises(ValueError, match="no action is called 'X'"):
            junior.perform("FF X")


def test_a_robot_that_is_not_heard_any_more_is_disarmed_all_the_same() -> None:
    world = Mute()
    with handle(world) as junior:
        junior.arm()
        world.mute = True
        junior.wait(4.0)
        assert not junior.peer.ready
    world.mute = False
    with Bridge(MemoryLink(world), world, open_sessions=False) as bridge:
        while 1 not in bridge.peers or (heartbeat := bridge.peers[1].heartbeat) is None:
            bridge.step(1.5)
        assert heartbeat.custom_mode == State.DISARMED


def test_listeners_do_not_get_between_a_robot_and_its_stop() -> None:
    world = Mute()
    junior = handle(world)
    junior.arm()
    junior.drive(0.5, 0.5)
    heard: list[object] = []
    junior.listen(heard.append)
    junior.close()
    assert heard == []
    assert world.world.device.wheels == (0.0, 0.0)


def test_a_handle_says_who_it_is_and_how_it_stands() -> None:
    found = hil.Junior(Bridge(MemoryLink(Mute()), Mute(), session=lambda: 77))
    assert repr(found).endswith(": not found yet>")
    with handle(Mute()) as junior:
        assert repr(junior) == f"<Junior 1 at {junior.bridge.link.url}: disarmed>"
        junior.arm()
        assert repr(junior).endswith(": ready>")
    assert repr(junior).endswith(": left>")


def test_several_say_how_many_they_are() -> None:
    with hil.connect_all("sim://junior?count=3") as robots:
        assert repr(robots) == "<Robots: 3 there>"
