"""An emulated robot served on a real pty, TCP port and UDP port. Only the clock is not real."""

from __future__ import annotations

import os
import select
import socket
import sys
from contextlib import ExitStack, closing, contextmanager
from typing import TYPE_CHECKING

import pytest
import serial

from firmware_protocol.clock import ManualClock
from firmware_protocol.events import Received
from firmware_protocol.messages import AutopilotVersion, Command, CommandLong, JuniorSensors, Statustext
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import MAVLINK
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.signing import Signing, SigningKey
from simdevice.serving.admission import HELD, SERVER_LINK, TAKEN_OVER
from simdevice.serving.endpoints import Endpoint, PtyEndpoint, TcpEndpoint, UdpEndpoint
from simdevice.serving.opening import open_endpoint
from simdevice.serving.server import Server, serve, wait_readable
from simdevice.sumo.junior_world import junior_world

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from firmware_protocol.wire.fields import Message

posix = pytest.mark.skipif(sys.platform == "win32", reason="there are no ptys on Windows")
ASK = CommandLong(1, 1, Command.REQUEST_MESSAGE, param1=float(AutopilotVersion.ID))


class Rig:
    """A server, its clock, and a host's codec."""

    def __init__(self, endpoint: Endpoint) -> None:
        self.clock = ManualClock()
        self.server = Server(junior_world(), endpoint, self.clock, wait=self.wait)
        self.codec = MavlinkCodec(system=255, component=190)

    def wait(self, files: list[int], timeout: float) -> None:
        """Let what is under way in the kernel arrive, and let the clock pass by itself."""
        wait_readable(files, 0.0)
        self.clock.advance(timeout)

    def run(self, seconds: float, read: Callable[[], bytes]) -> tuple[bytes, list[Message]]:
        """Serve for a while; returns what the client read."""
        end = self.clock.now() + seconds
        data = b""
        while self.clock.now() < end:
            self.server.turn()
            data += read()
        heard = [event.message for event in self.codec.receive(data, self.clock.now()) if isinstance(event, Received)]
        return data, heard


@contextmanager
def served(endpoint: Endpoint) -> Iterator[Rig]:
    try:
        yield Rig(endpoint)
    finally:
        endpoint.close()


def kinds(messages: list[Message]) -> set[type[Message]]:
    return {type(message) for message in messages}


@posix
def test_pyserial_talks_to_the_robot_on_a_pty() -> None:
    endpoint = PtyEndpoint()
    with served(endpoint) as rig, serial.Serial(endpoint.path, 115200, timeout=0) as port:
        assert endpoint.url == f"serial://{endpoint.path}:115200"
        _, heard = rig.run(0.5, lambda: port.read(4096))
        assert sum(isinstance(message, JuniorSensors) for message in heard) == pytest.approx(25, abs=2)
        port.write(rig.codec.encode(ASK))
        _, heard = rig.run(0.1, lambda: port.read(4096))
        assert AutopilotVersion in kinds(heard)


@posix
def test_a_pty_is_as_slow_as_its_baud_rate() -> None:
    endpoint = PtyEndpoint(9600)
    with served(endpoint) as rig, serial.Serial(endpoint.path, 9600, timeout=0) as port:
        data, _ = rig.run(1.0, lambda: port.read(4096))
        # The robot has more to say than the line carries: it carries 960 bytes a second.
        assert 900 <= len(data) <= 961


@posix
def test_the_way_to_the_device_is_paced_too() -> None:
    endpoint = PtyEndpoint(9600)
    with serial.Serial(endpoint.path, 9600, timeout=0) as port:
        port.write(b"x" * 96)
        select.select(endpoint.files(), [], [], 5.0)
        endpoint.poll(10.0)
        assert endpoint.receive(10.0) == b""
        assert len(endpoint.receive(10.05)) == 48
        assert len(endpoint.receive(10.1)) == 48
    endpoint.close()


@posix
def test_a_client_may_close_the_port_and_open_it_again() -> None:
    endpoint = PtyEndpoint()
    with served(endpoint) as rig:
        for _ in range(3):
            with serial.Serial(endpoint.path, 115200, timeout=0) as port:
                _, heard = rig.run(0.2, lambda port=port: port.read(4096))  # type: ignore[misc]
                assert JuniorSensors in kinds(heard)
            rig.run(3.0, lambda: b"")  # nobody listens, for longer than the port holds
        assert rig.server.overruns == 0


@posix
def test_a_client_that_changes_no_settings_hears_no_echo() -> None:
    endpoint = PtyEndpoint()
    with served(endpoint) as rig:
        descriptor = os.open(endpoint.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        os.write(descriptor, rig.codec.encode(ASK))
        chunks: list[bytes] = []

        def read() -> bytes:
            try:
                chunks.append(os.read(descriptor, 4096))
            except BlockingIOError:
                return b""
            return chunks[-1]

        _, heard = rig.run(0.2, read)
        os.close(descriptor)
    assert CommandLong not in kinds(heard)
    assert AutopilotVersion in kinds(heard)


def connect(endpoint: TcpEndpoint) -> socket.socket:
    client = socket.create_connection(("127.0.0.1", int(endpoint.url.rpartition(":")[2])), timeout=5.0)
    client.settimeout(0)
    return client


def reader(client: socket.socket) -> Callable[[], bytes]:
    def read() -> bytes:
        try:
            return client.recv(65536)
        except BlockingIOError:
            return b""

    return read


def until(condition: Callable[[], bool], client: socket.socket) -> None:
    """Wait for the kernel's loopback, a bounded number of times."""
    for _ in range(100):
        if condition():
            return
        select.select([client], [], [], 0.02)
    pytest.fail("nothing arrived")


def test_tcp_serves_one_client_after_the_other() -> None:
    endpoint = TcpEndpoint(port=0)
    with served(endpoint) as rig:
        for _ in range(3):
            with connect(endpoint) as client:
                heard: list[Message] = []

                def answered(client: socket.socket = client, heard: list[Message] = heard) -> bool:
                    heard += rig.run(0.05, reader(client))[1]
                    return AutopilotVersion in kinds(heard)

                client.sendall(rig.codec.encode(ASK))
                until(answered, client)
                assert JuniorSensors in kinds(heard)
            rig.run(0.05, lambda: b"")


def received(client: socket.socket, rig: Rig) -> bytes:
    """What a client is told next; nothing once it was turned away."""
    for _ in range(100):
        rig.run(0.01, lambda: b"")
        if select.select([client], [], [], 0.02)[0]:
            return client.recv(65536)
    pytest.fail("it was not turned away")


def all_of(client: socket.socket, rig: Rig) -> list[Message]:
    """Everything that a client is told until it is turned away."""
    data = b""
    while chunk := received(client, rig):
        data += chunk
    return [
        event.message for event in MavlinkCodec(system=255, component=190).receive(data, 0.0) if isinstance(event, Received)
    ]


def test_a_second_tcp_client_is_told_why_it_is_turned_away() -> None:
    endpoint = TcpEndpoint(port=0)
    with served(endpoint) as rig, connect(endpoint) as first:
        until(lambda: bool(rig.run(0.05, reader(first))[0]), first)
        for _ in range(3):
            with connect(endpoint) as second:
                second.sendall(rig.codec.encode(ASK))  # what it says before it hears does not lose what it is told
                assert all_of(second, rig) == [Statustext(3, HELD)]
        assert rig.run(0.1, reader(first))[0]
        first.close()
        with connect(endpoint) as third:
            until(lambda: bool(rig.run(0.05, reader(third))[0]), third)


@pytest.mark.parametrize("signed", [False, True])
def test_it_is_told_by_the_robot_that_is_served_signed_where_that_one_signs(*, signed: bool) -> None:
    key = SigningKey(bytes(range(1, 33)))
    robot, server, ours = (Signing(key, lambda: 1000, link=link) for link in (0, SERVER_LINK, 1))
    with closing(TcpEndpoint(port=0, signing=server)) as endpoint, connect(endpoint), connect(endpoint) as second:
        voice = open_codec(MAVLINK, system=7, component=1, signing=robot if signed else None)
        endpoint.send(voice.encode(Statustext(6, "here")), 0.0)
        while not select.select([second], [], [], 0.02)[0]:
            endpoint.poll(0.0)
        data = second.recv(65536)
    ears = open_codec(MAVLINK, system=255, component=190, signing=ours if signed else None)
    (told,) = ears.receive(data, 0.0)
    assert isinstance(told, Received)
    assert (told.system, told.component, told.message) == (7, 1, Statustext(3, HELD))


def test_a_silent_tcp_client_loses_its_place_after_10_s_and_only_when_another_asks() -> None:
    endpoint = TcpEndpoint(port=0)
    with served(endpoint) as rig, connect(endpoint) as silent:
        until(lambda: bool(rig.run(0.05, reader(silent))[0]), silent)
        rig.run(9.5, reader(silent))
        with connect(endpoint) as early:
            assert all_of(early, rig) == [Statustext(3, HELD)]
        rig.run(60.0, reader(silent))
        assert rig.run(0.1, reader(silent))[0]  # nobody has asked
        with connect(endpoint) as late:
            until(lambda: bool(rig.run(0.05, reader(late))[0]), late)
            assert all_of(silent, rig)[-1] == Statustext(3, TAKEN_OVER)


def test_a_tcp_client_that_speaks_keeps_its_place() -> None:
    endpoint = TcpEndpoint(port=0)
    with served(endpoint) as rig, connect(endpoint) as busy:
        for _ in range(5):
            busy.sendall(rig.codec.encode(ASK))
            until(lambda: AutopilotVersion in kinds(rig.run(0.05, reader(busy))[1]), busy)
            rig.run(8.0, reader(busy))
        with connect(endpoint) as other:
            assert all_of(other, rig) == [Statustext(3, HELD)]


def test_those_who_are_turned_away_and_stay_are_closed_and_many_of_them_stall_nobody() -> None:
    endpoint = TcpEndpoint(port=0)
    with served(endpoint) as rig, connect(endpoint) as first, ExitStack() as stack:
        until(lambda: bool(rig.run(0.05, reader(first))[0]), first)
        others = [stack.enter_context(connect(endpoint)) for _ in range(12)]
        for other in others:
            until(lambda other=other: bool(rig.run(0.01, reader(other))[0]), other)  # type: ignore[misc]
        assert len(endpoint.files()) <= 2 + 8
        rig.run(1.1, reader(first))
        assert len(endpoint.files()) == 2
        assert rig.run(0.1, reader(first))[0]


def test_a_tcp_client_whose_machine_vanishes_is_looked_for() -> None:
    endpoint = TcpEndpoint(port=0)
    with served(endpoint) as rig, connect(endpoint) as client:
        until(lambda: bool(rig.run(0.05, reader(client))[0]), client)
        with socket.socket(fileno=os.dup(endpoint.files()[1])) as held:
            assert held.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
            if sys.platform == "linux":
                options = (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT, socket.TCP_USER_TIMEOUT)
                assert [held.getsockopt(socket.IPPROTO_TCP, option) for option in options] == [5, 1, 5, 10_000]


def test_a_tcp_client_that_does_not_read_stalls_nobody() -> None:
    endpoint = TcpEndpoint(port=0)
    with served(endpoint) as rig, connect(endpoint):
        rig.run(60.0, lambda: b"")
        assert rig.server.steps == pytest.approx(12000, abs=2)


def test_udp_answers_whoever_asked_last() -> None:
    endpoint = UdpEndpoint(port=0)
    address = ("127.0.0.1", int(endpoint.url.rpartition(":")[2]))
    with served(endpoint) as rig:
        for _ in range(2):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
                client.settimeout(0)
                client.sendto(rig.codec.encode(ASK), address)
                heard: list[Message] = []

                def answered(client: socket.socket = client, heard: list[Message] = heard) -> bool:
                    heard += rig.run(0.05, reader(client))[1]
                    return AutopilotVersion in kinds(heard)

                until(answered, client)
            rig.run(0.1, lambda: b"")


@pytest.mark.parametrize("noise", [b"\0", b"hello", b"\xfd", "damaged"])
def test_udp_speaks_to_nobody_who_has_not_sent_a_good_frame(noise: bytes | str) -> None:
    endpoint = UdpEndpoint(port=0)
    address = ("127.0.0.1", int(endpoint.url.rpartition(":")[2]))
    with served(endpoint) as rig, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.settimeout(0)
        frame = bytearray(rig.codec.encode(ASK))
        frame[12] ^= 1
        client.sendto(bytes(frame) if isinstance(noise, str) else noise, address)
        assert select.select(endpoint.files(), [], [], 5.0)[0]
        assert rig.run(1.0, reader(client))[0] == b""
        client.sendto(rig.codec.encode(ASK), address)
        until(lambda: bool(rig.run(0.05, reader(client))[0]), client)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:  # nor does noise turn the stream to somebody else
            other.settimeout(0)
            other.sendto(bytes(frame) if isinstance(noise, str) else noise, address)
            assert select.select(endpoint.files(), [], [], 5.0)[0]
            rig.run(0.2, reader(client))
            assert rig.run(0.5, reader(client))[0]
            assert reader(other)() == b""


def test_udp_speaks_until_5_s_after_the_last_good_frame() -> None:
    endpoint = UdpEndpoint(port=0)
    address = ("127.0.0.1", int(endpoint.url.rpartition(":")[2]))
    with served(endpoint) as rig, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.settimeout(0)
        client.sendto(rig.codec.encode(ASK), address)
        assert select.select(endpoint.files(), [], [], 5.0)[0]
        began = rig.clock.now()
        data = b"x"
        while data:
            data = rig.run(0.2, reader(client))[0]
        assert rig.clock.now() - began == pytest.approx(5.2, abs=0.25)
        client.sendto(b"\0", address)
        assert select.select(endpoint.files(), [], [], 5.0)[0]
        assert rig.run(0.5, reader(client))[0] == b""


def test_serving_ends_when_told_to_and_gives_the_port_back() -> None:
    endpoint = open_endpoint("tcp://127.0.0.1:0")
    port = int(endpoint.url.rpartition(":")[2])
    clock = ManualClock()
    turns = iter(range(50))

    def stopped() -> bool:
        clock.advance(0.005)
        return next(turns, None) is None

    server = serve(junior_world(), endpoint, clock, stopped)
    assert server.steps == 50
    TcpEndpoint(port=port).close()
