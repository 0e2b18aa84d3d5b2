"""The other ends that `links.py` measures against: what answers, on a link of any kind."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import threading
from collections.abc import Callable
from time import perf_counter_ns
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.links.opening import open_link
from firmware_protocol.wire.can.frame import CanFrame, pack_frames, split_records
from firmware_protocol.wire.fields import CAN
from hil.bridge.clock import MonotonicClock
from simdevice._host import ffi, lib
from simdevice.serving.can_endpoints import SlcanEndpoint

if TYPE_CHECKING:
    from collections.abc import Iterator

Answer = Callable[[bytes], bytes]
"""What the other end sends back for what it gets."""

FAST: Final = 100_000_000
"""Rate of the adapter's line in bit/s: what is measured is software, not a line."""
UP: Final = 0x80
"""In an identifier, the bit that tells a robot's frames from a host's."""


def echo(data: bytes) -> bytes:
    """The same bytes."""
    return data


def echo_frames(data: bytes) -> bytes:
    """The same frames as if from the robot."""
    frames = [CanFrame.unpack(record) for record in split_records(data)]
    return pack_frames(CanFrame(frame.identifier ^ UP, frame.data) for frame in frames)


def firmware(wire: str) -> Answer:
    """The robot's own program (C), run whenever something comes; it answers in the same call."""
    robot: Any = ffi.new("host_robot *")
    ffi.buffer(robot.io.nvm)[:] = b"\xff" * len(ffi.buffer(robot.io.nvm))
    robot.io.can = wire == CAN
    lib.host_power_on(robot, 0)
    began, sent = perf_counter_ns(), ffi.buffer(robot.io.tx)

    def answer(data: bytes) -> bytes:
        return bytes(sent[: lib.host_tick(robot, (perf_counter_ns() - began) // 1000, data, len(data))])

    return answer


def _serve_file(file: int, answer: Answer) -> None:
    with contextlib.suppress(OSError):
        while True:
            select.select([file], [], [], None)
            if data := answer(os.read(file, 4096)):
                os.write(file, data)


def _serve_tcp(server: socket.socket, answer: Answer) -> None:
    client, _ = server.accept()
    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    while data := client.recv(4096):
        if out := answer(data):
            client.sendall(out)


def _serve_udp(bound: socket.socket, answer: Answer) -> None:
    while True:
        data, sender = bound.recvfrom(65536)
        if out := answer(data):
            bound.sendto(out, sender)


def _serve_bus(url: str, answer: Answer, stopped: Callable[[], bool]) -> None:
    with open_link(url) as link:
        while not stopped():
            if (data := link.read(0.05)) and (out := answer(data)):
                link.write(out)


def _serve_adapter(endpoint: SlcanEndpoint, answer: Answer) -> None:
    clock = MonotonicClock()
    while True:
        select.select(endpoint.files(), [], [], 0.0002)
        endpoint.poll(clock.now())
        data = endpoint.receive(clock.now() + 1e-4)  # what is on the line has passed: it is no line that is measured
        endpoint.send(answer(data) if data else b"", clock.now())
        endpoint.send(b"", clock.now() + 1e-4)


@contextlib.contextmanager
def far_end(kind: str, number: int, answer: Answer) -> Iterator[str]:
    """Something that answers, on a link of its own.

    Args:
        kind: Of link.
        number: One for each of the same kind at the same time.
        answer: What it answers.

    Yields:
        The address at which it does.
    """
    serve: Callable[[], None]
    with contextlib.ExitStack() as stack:
        if kind == "virtual":
            url, stop = f"can://virtual/bench{number}", threading.Event()
            thread = threading.Thread(target=_serve_bus, args=(url, answer, stop.is_set))
            thread.start()
            stack.callback(thread.join)
            stack.callback(stop.set)
            yield url
            return
        if kind == "pty":
            master, slave = os.openpty()
            stack.callback(os.close, master)
            stack.callback(os.close, slave)
            url, serve = f"serial://{os.ttyname(slave)}:115200", lambda: _serve_file(master, answer)
        elif kind == "tcp":
            server = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
            url, serve = f"tcp://127.0.0.1:{server.getsockname()[1]}", lambda: _serve_tcp(server, answer)
        elif kind == "udp":
            bound = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            bound.bind(("127.0.0.1", 0))
            url, serve = f"udpout://127.0.0.1:{bound.getsockname()[1]}", lambda: _serve_udp(bound, answer)
        elif kind == "slcan":
            endpoint = SlcanEndpoint(FAST)
            stack.callback(endpoint.close)
            url, serve = endpoint.url, lambda: _serve_adapter(endpoint, answer)
        else:
            url = f"can://udp_multicast/239.74.163.2?port={43200 + number}"
            serve = lambda: _serve_bus(url, answer, lambda: False)  # noqa: E731
        child = os.fork()
        if child == 0:
            try:
                serve()
            finally:
                os._exit(0)
        stack.callback(os.waitpid, child, 0)
        stack.callback(os.kill, child, signal.SIGKILL)
        yield url
