"""Whatever is lost, doubled or late: every maneuver is performed once, and its result delivered once."""

from __future__ import annotations

from dataclasses import dataclass, field

from hypothesis import given, settings
from hypothesis import strategies as st
from scripted_robot import ScriptedRobot

from firmware_protocol.events import Received
from firmware_protocol.link import Link
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import JuniorManeuverResult
from firmware_protocol.roles.junior import perform
from firmware_protocol.vocabulary import Action, Maneuver
from firmware_protocol.wire.mavlink import split_frames
from hil.bridge.bridge import Bridge

QUICK = Maneuver((Action.F,), period=0.03, floor_reflex=False)


@dataclass
class Fate:
    """What befalls the frames that go one way, one letter each: o passes, x is lost, 2 comes twice, w waits for the next.

    When the letters run out, everything passes.
    """

    letters: list[str]
    held: bytes = b""
    seen: int = field(default=0)

    def of(self, data: bytes) -> bytes:
        out = b""
        for frame in split_frames(data):
            letter = self.letters[self.seen] if self.seen < len(self.letters) else "o"
            self.seen += 1
            held, self.held = self.held, b""
            if letter == "w":
                self.held = frame
                out += held
            elif letter == "2":
                out += frame + held + frame
            elif letter == "o":
                out += frame + held
            else:
                out += held
        return out


class FatefulLink(Link):
    """A lock-step link whose frames meet a fate that is written down."""

    lockstep = True

    def __init__(self, inner: Link, down: list[str], up: list[str]) -> None:
        self.url = inner.url
        self.inner = inner
        self.down, self.up = Fate(down), Fate(up)

    def write(self, data: bytes) -> None:
        if passed := self.down.of(data):
            self.inner.write(passed)

    def read(self, timeout: float) -> bytes:
        return self.up.of(self.inner.read(timeout))

    def close(self) -> None:
        self.inner.close()


fates = st.lists(st.sampled_from("ooox2w"), max_size=60)


@given(down=fates, up=fates)
@settings(max_examples=150, deadline=None)
def test_every_maneuver_once(down: list[str], up: list[str]) -> None:
    robot = ScriptedRobot(stream=False)
    bridge = Bridge(FatefulLink(MemoryLink(robot), down, up), robot, session=lambda: 3)
    results: list[int] = []
    done = 0
    ticket = None
    while done < 6:
        assert robot.now() < 60
        messages = [event.message for event in bridge.step(0.5) if isinstance(event, Received)]
        results += [message.sequence for message in messages if isinstance(message, JuniorManeuverResult)]
        if ticket is not None and ticket.done:
            ticket.value()
            done, ticket = done + 1, None
        if ticket is None and done < 6 and 1 in bridge.peers and bridge.peers[1].ready:
            ticket = perform(bridge.peers[1], QUICK)
    assert len(robot.performed) == 6
    assert len(set(robot.performed)) == 6
    assert results == [sequence for _, sequence in robot.performed]
