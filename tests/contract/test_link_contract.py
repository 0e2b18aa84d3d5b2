"""One suite for every link: as it is, with a wrapper that delays, and with one that drops, doubles and damages."""

from __future__ import annotations

import contextlib
import socket
from typing import TYPE_CHECKING, Final

import pytest
from link_kinds import KINDS, PATIENCE, MemoryEnd, Setup, closed, frames, read_all

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.link import Link
from firmware_protocol.links import FaultSpec, FaultyLink
from firmware_protocol.links.opening import open_link
from firmware_protocol.wire.codec import SPLITTERS
from firmware_protocol.wire.fields import CAN, MAVLINK

if TYPE_CHECKING:
    from collections.abc import Iterator

LATE: Final = FaultSpec(delay=0.002, jitter=0.003)
BAD: Final = FaultSpec(drop=0.15, duplicate=0.15, corrupt=0.15)
SEED: Final = 7


def faulty(link: Link, setup: Setup, down: FaultSpec, up: FaultSpec | None = None) -> FaultyLink:
    return FaultyLink(link, down, up, seed=SEED, clock=setup.clock, split=SPLITTERS[link.wire])


@pytest.fixture
def plain(request: pytest.FixtureRequest) -> Iterator[Setup]:
    """A link of the kind that is asked for."""
    setup = KINDS[str(request.param)]()
    if isinstance(setup.far, MemoryEnd):
        setup.far.link = setup.link
    yield setup
    closed(setup)


@pytest.fixture(params=[f"{kind}{how}" for kind in KINDS for how in ("", "-late")])
def setup(request: pytest.FixtureRequest) -> Iterator[Setup]:
    """A link of every kind, as it is and with frames that are late."""
    kind, _, late = str(request.param).partition("-")
    setup = KINDS[kind]()
    if late:
        setup.link = faulty(setup.link, setup, LATE)
    if isinstance(setup.far, MemoryEnd):
        setup.far.link = setup.link
    yield setup
    closed(setup)


# --- what every link does --------------------------------------------------------------------------------------------


def test_frames_come_in_intact_and_in_order(setup: Setup) -> None:
    sent = frames(setup.link.wire, 40)
    for frame in sent:
        setup.far.send(frame)
    assert read_all(setup.link, len(b"".join(sent))) == b"".join(sent)


def test_frames_go_out_intact_in_order_and_do_not_come_back(setup: Setup) -> None:
    sent = frames(setup.link.wire, 40)
    for at in range(0, len(sent), 4):  # one call may carry several
        setup.link.write(b"".join(sent[at : at + 4]))
    if isinstance(setup.link, FaultyLink):
        setup.link.read(0.02)  # a late frame leaves while somebody reads
    assert setup.far.receive(len(b"".join(sent))) == b"".join(sent)
    assert setup.link.read(0.01) == b""


def test_a_wait_ends_with_nothing_after_the_time_allowed(setup: Setup) -> None:
    assert setup.link.read(0) == b""
    began = setup.clock.now()
    assert setup.link.read(0.02) == b""
    assert setup.clock.now() - began >= 0.0199


def test_one_s_own_frames_do_not_end_a_wait(setup: Setup) -> None:
    for frame in frames(setup.link.wire, 5):
        setup.link.write(frame)
    began = setup.clock.now()
    assert setup.link.read(0.03) == b""
    assert setup.clock.now() - began >= 0.0299


def test_a_wait_ends_as_soon_as_something_is_there(setup: Setup) -> None:
    (frame,) = frames(setup.link.wire, 1)
    setup.far.send(frame)
    began = setup.clock.now()
    assert setup.link.read(PATIENCE) == frame
    assert setup.clock.now() - began < PATIENCE / 2


def test_closing_twice_does_nothing_and_a_closed_link_says_so(setup: Setup) -> None:
    (frame,) = frames(setup.link.wire, 1)
    with setup.link as link:
        assert link is setup.link
        assert link.news() == []
    link.close()
    with pytest.raises(LinkClosedError, match="closed"):
        link.read(0)
    with pytest.raises(LinkClosedError, match="closed"):
        link.write(frame)


def test_lockstep_is_said_of_memory_alone_and_can_of_buses(setup: Setup, request: pytest.FixtureRequest) -> None:
    kind = request.node.callspec.params["setup"].partition("-")[0]
    assert setup.link.lockstep == kind.startswith("memory")
    assert setup.link.wire == (CAN if kind in {"memory_can", "virtual", "udp_multicast", "slcan", "socketcan"} else MAVLINK)


@pytest.mark.parametrize("setup", ["pty", "pty-late", "tcp", "tcp-late", "slcan", "slcan-late"], indirect=True)
def test_the_other_end_closing_is_told_after_what_it_had_sent(setup: Setup, request: pytest.FixtureRequest) -> None:
    (frame,) = frames(setup.link.wire, 1)
    keeps = request.node.callspec.params["setup"].startswith("tcp")  # a pty loses what nobody has taken
    if keeps:
        setup.far.send(frame)
    setup.far.close()
    if keeps:
        assert read_all(setup.link, len(frame)) == frame
    for _ in range(2):
        with pytest.raises(LinkClosedError) as caught:
            read_all(setup.link, 1)
        assert caught.value.url == setup.link.url
    with contextlib.suppress(LinkClosedError):  # a socket may take one more write before it notices
        setup.link.write(frame)
    with pytest.raises(LinkClosedError):
        setup.link.write(frame)


# --- with faults -----------------------------------------------------------------------------------------------------


class Loop(Link):
    """A link that keeps what is written, and gives it back."""

    def __init__(self, wire: str) -> None:
        self.url, self.wire = "loop:", wire
        self.written: list[bytes] = []

    def write(self, data: bytes) -> None:
        self.written.append(data)

    def read(self, timeout: float) -> bytes:  # noqa: ARG002
        return self.written.pop(0) if self.written else b""

    def close(self) -> None:
        pass


@pytest.mark.parametrize("plain", KINDS, indirect=True)
def test_a_seed_does_the_same_to_the_frames_that_go_out_on_every_link(plain: Setup) -> None:
    loop = Loop(plain.link.wire)
    expected, link = faulty(loop, plain, BAD), faulty(plain.link, plain, BAD)
    for frame in frames(plain.link.wire, 60):
        expected.write(frame)
        link.write(frame)
    wanted = b"".join(loop.written)
    assert plain.far.receive(len(wanted)) == wanted
    assert link.down == expected.down
    assert min(link.down.dropped, link.down.duplicated, link.down.corrupted) > 0


@pytest.mark.parametrize("plain", KINDS, indirect=True)
def test_a_seed_does_the_same_to_the_frames_that_come_in_on_every_link(plain: Setup) -> None:
    loop = Loop(plain.link.wire)
    expected, link = faulty(loop, plain, BAD), faulty(plain.link, plain, BAD)
    wanted, came = b"", b""
    for number, frame in enumerate(frames(plain.link.wire, 60), 1):
        loop.written.append(frame)
        wanted += expected.read(0)
        plain.far.send(frame)
        end = plain.clock.now() + PATIENCE
        while link.up.frames < number and plain.clock.now() < end:
            came += link.read(0.005)
    assert came == wanted
    assert link.up == expected.up
    assert min(link.up.dropped, link.up.duplicated, link.up.corrupted) > 0


@pytest.mark.slow
@pytest.mark.parametrize("plain", KINDS, indirect=True)
def test_the_plug_is_pulled_at_its_time_and_not_before(plain: Setup) -> None:
    (frame,) = frames(plain.link.wire, 1)
    dies = plain.clock.now() + 0.15
    link = faulty(plain.link, plain, FaultSpec.parse("unplug:0.15"))
    plain.far.send(frame)
    assert link.read(0.1) == frame
    with pytest.raises(LinkClosedError, match="unplugged"):
        read_all(link, 1)
    assert plain.clock.now() >= dies
    with pytest.raises(LinkClosedError, match="unplugged"):
        link.write(frame)


# --- UDP alone -------------------------------------------------------------------------------------------------------


def test_a_robot_that_is_not_there_is_no_error_on_udp() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    with open_link(f"udpout://127.0.0.1:{port}") as link:
        for _ in range(5):
            link.write(b"anyone?")
            assert link.read(0.001) == b""


def test_before_anyone_has_spoken_udpin_sends_nowhere() -> None:
    with open_link("udpin://127.0.0.1:0") as link:
        link.write(b"anyone?")
        assert link.read(0) == b""
