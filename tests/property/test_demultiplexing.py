"""Whatever comes in which order over whatever line: a robot's handle knows its own robot's words and no other's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import hypothesis.strategies as st
from hypothesis import given, settings
from scripted_crowd import ScriptedCrowd
from scripted_robot import ScriptedRobot

from firmware_protocol.events import Received
from firmware_protocol.links import FaultSpec, FaultyLink, MemoryLink
from firmware_protocol.messages import JuniorSensors
from firmware_protocol.wire.mavlink import split_frames
from hil.bridge.bridge import Bridge
from hil.bridge.networks import Networks
from hil.sumo.robots import Robots

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.events import Event
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.wire.fields import Message

OPERATIONS = ("sensors", "status", "parameter", "perform", "ping", "set", "silence", "speak", "pass")


class Marked(ScriptedRobot):
    """A robot whose every word that can carry a mark carries its system id."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.parameters = {"SPD_FAST": float(self.system)}
        self.boots = 100 * self.system

    def _say(self, message: Message, component: int = 1) -> None:
        if isinstance(message, JuniorSensors):
            message = JuniorSensors(message.time, (0.0, 0.0), (self.system, self.system), (0, 0), 7.4, 0)
        super()._say(message, component)


def owner(value: object) -> int | None:
    """Whose word an answer is, where that can be told."""
    if isinstance(value, JuniorSensors):
        return value.eye[0]
    if isinstance(value, float):
        return int(value)
    if boots := getattr(value, "boot_count", 0):
        return int(boots) // 100
    return None


@settings(max_examples=40, deadline=None)
@given(
    systems=st.sets(st.integers(1, 254), min_size=2, max_size=6),
    script=st.lists(st.tuples(st.sampled_from(OPERATIONS), st.integers(0, 5)), max_size=25),
    faults=st.sampled_from(["", "drop:0.1,jitter:0.02", "corrupt:0.1,duplicate:0.1", "drop:0.05,reorder,jitter:0.01"]),
    seed=st.integers(0, 99),
)
def test_robots_are_never_mixed_up(systems: set[int], script: list[tuple[str, int]], faults: str, seed: int) -> None:
    crowd = ScriptedCrowd({system: Marked(system=system) for system in sorted(systems)})
    link = FaultyLink(MemoryLink(crowd), FaultSpec.parse(faults), seed=seed, clock=crowd, split=split_frames)
    networks = Networks()
    sessions = iter(range(1, 60000))
    networks.add("line", Bridge(link, crowd, session=lambda: next(sessions)))
    robots = Robots(networks)
    robots.find(expect=len(systems), timeout=30.0)
    members = [junior for _, junior in sorted(robots.members.items())]
    seen: list[tuple[int, Event]] = []
    for junior in members:
        junior.listen(lambda event, system=junior.peer.system: seen.append((system, event)))  # type: ignore[misc]
    asked: list[tuple[int, Ticket[Any]]] = []
    for operation, index in script:
        junior = members[index % len(members)]
        peer, robot = junior.peer, crowd.robots[junior.peer.system]
        questions: dict[str, Callable[[], Ticket[Any]]] = {
            "sensors": lambda: peer.request(JuniorSensors),  # noqa: B023 - asked in the same turn
            "status": lambda: peer.request(type(robot.status())),  # noqa: B023
            "parameter": lambda: peer.read_parameter("SPD_FAST"),  # noqa: B023
            "perform": lambda: junior.start("F", period=0.05),  # noqa: B023
            "ping": lambda: peer.ping(),  # noqa: B023, PLW0108
            "set": lambda: peer.set_parameter("SPD_FAST", float(peer.system)),  # noqa: B023
        }
        if operation in questions:
            asked.append((peer.system, questions[operation]()))
        robot.silent = operation == "silence" or (robot.silent and operation != "speak")
        robots.step(0.02)
    for robot in crowd.robots.values():
        robot.silent = False
    end = robots.now() + 20.0
    while not all(ticket.done for _, ticket in asked) and robots.now() < end:
        robots.step()
    for system, ticket in asked:
        assert ticket.done
        if ticket.error is None:
            assert owner(ticket.value()) in {None, system}
    for system, event in seen:
        assert getattr(event, "system", None) in {None, system}
        if isinstance(event, Received):
            assert owner(event.message) in {None, system}
    for junior in members:
        system = junior.peer.system
        assert junior.sensors.eye == (system, system)
        mine = {session for session, _ in crowd.robots[system].performed}
        others = {session for other in crowd.robots if other != system for session, _ in crowd.robots[other].performed}
        assert not mine & others
        assert len(crowd.robots[system].performed) == len(set(crowd.robots[system].performed))
        assert len(crowd.robots[system].performed) <= sum(1 for which, _ in asked if which == system)
    robots.close()
