"""Where a served robot can be reached: a pty that behaves as a serial port, a TCP port, a UDP port.

Nothing here blocks, and nothing but `admission` knows what the bytes mean. A client may go and come back at any time; what
is sent while nobody listens is lost, as on a wire. Times are arguments.
"""

from __future__ import annotations

import contextlib
import math
import os
import socket
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import LinkOpenError
from firmware_protocol.links.tcp import notice_half_open
from firmware_protocol.wire.fields import MAVLINK
from simdevice.serving.admission import HELD, INVITED, SILENT, TAKEN_OVER, Farewells, Interpreter

if TYPE_CHECKING:
    from firmware_protocol.wire.signing import Signing

BITS_PER_BYTE: Final = 10
"""On a serial line: start bit, eight data bits, stop bit."""
DEFAULT_BAUD: Final = 115200
"""In bit/s."""
_CHUNK: Final = 4096
_BUFFERED: Final = 0.25
"""What a sender on a serial line holds back at most, in s of the line: what robots say beyond what it carries is lost."""
_LEAST_BUFFER: Final = 192
"""But so many bytes in any case: a micro-controller has so many (`BOARD_TX_SIZE`)."""
_BACKLOG: Final = 65536
"""Bytes kept for a client that is slow to take them; what comes on top is lost."""
_ASKING: Final = 4
"""Most clients looked at in one turn."""
_DATAGRAM: Final = 1400
"""Greatest datagram sent, in bytes: fits any path."""


class Line:
    """One direction of a serial line: bytes come out no faster than the baud rate lets them.

    Args:
        baud: In bit/s.
    """

    def __init__(self, baud: int) -> None:
        self._per_byte = BITS_PER_BYTE / baud
        self._waiting = bytearray()
        self._begun = -math.inf

    def __len__(self) -> int:
        return len(self._waiting)

    def push(self, data: bytes, now: float) -> None:
        """Begin to send bytes at a time in s, behind those that are on their way."""
        if not data:
            return
        if not self._waiting:
            self._begun = max(now, self._begun)
        self._waiting += data

    def pop(self, now: float) -> bytes:
        """Bytes whose stop bit has passed by this time."""
        count = min(len(self._waiting), int((now - self._begun) / self._per_byte + 1e-6)) if self._waiting else 0
        if count <= 0:
            return b""
        self._begun += count * self._per_byte
        done = bytes(self._waiting[:count])
        del self._waiting[:count]
        return done

    def due(self) -> float:
        """When everything that waits has passed, in s; infinite when nothing waits."""
        return self._begun + len(self._waiting) * self._per_byte if self._waiting else math.inf


class Endpoint(ABC):
    """Where a client can reach the device.

    Attributes:
        url: What a client opens.
        wire: What goes through: MAVLink, or CAN frames in serial form.
    """

    url: str
    wire: str = MAVLINK

    @abstractmethod
    def files(self) -> list[int]:
        """File descriptors that become readable when something arrives."""

    @abstractmethod
    def poll(self, now: float) -> None:
        """Take in what has come from the client by this time (s)."""

    @abstractmethod
    def receive(self, now: float) -> bytes:
        """Bytes from the client that have arrived at the device by this time (s)."""

    def room(self) -> int | None:
        """Bytes that a sender's buffer takes now, in front of a line that is paced; None where nothing is paced."""
        return None

    @abstractmethod
    def send(self, data: bytes, now: float) -> None:
        """Send bytes of the device (none is allowed: then only go on with what waits); the time is in s."""

    def due(self) -> float:
        """When `send` must be called again because something waits, in s."""
        return math.inf

    @abstractmethod
    def close(self) -> None:
        """Give everything back."""


class PtyEndpoint(Endpoint):
    """A pseudo-terminal; the client opens it as a serial port. POSIX only.

    A pty ignores the baud rate, so both directions are paced here.

    Args:
        baud: In bit/s.

    Attributes:
        path: The client's end, such as `/dev/pts/3`.

    Raises:
        LinkOpenError: This system has no ptys.
    """

    def __init__(self, baud: int = DEFAULT_BAUD) -> None:
        try:
            import tty  # noqa: PLC0415 - POSIX only

            # The client's end stays open here too, so that the port's settings outlive the client.
            self._master, self._slave = os.openpty()
            tty.setraw(self._slave)
            os.set_blocking(self._master, False)
            self.path = os.ttyname(self._slave)
        except (ImportError, AttributeError, OSError) as error:
            raise LinkOpenError("pty:", f"no pseudo-terminal: {error}", "Serve on tcp://127.0.0.1:5760 instead") from error
        self.url = f"serial://{self.path}:{baud}"
        self._in = Line(baud)
        self._out = Line(baud)
        self._most = max(_LEAST_BUFFER, int(_BUFFERED * baud / BITS_PER_BYTE))

    def files(self) -> list[int]:
        """The pty's own end, unless enough is on its way already: then the client has to wait, as for a serial port."""
        return [self._master] if len(self._in) < _CHUNK else []

    def poll(self, now: float) -> None:
        """Put what the client has written on the line."""
        if len(self._in) < _CHUNK:
            with contextlib.suppress(BlockingIOError, InterruptedError):
                self._in.push(os.read(self._master, _CHUNK), now)

    def receive(self, now: float) -> bytes:
        """Bytes whose stop bit has passed."""
        self.poll(now)
        return self._in.pop(now)

    def room(self) -> int:
        """What the sender's buffer takes: a robot's firmware looks at it before it says anything."""
        return max(0, self._most - len(self._out))

    def send(self, data: bytes, now: float) -> None:
        """Queue bytes, and deliver what the baud rate lets through; what does not fit into the sender's buffer is lost."""
        if len(self._out) + len(data) <= self._most:
            self._out.push(data, now)
        ready = self._out.pop(now)
        if not ready:
            return
        try:
            written = os.write(self._master, ready)
        except (BlockingIOError, InterruptedError):
            written = 0
        if written < len(ready):
            self._forget()

    def _forget(self) -> None:
        """Nobody reads: what lies in the port is stale and would only puzzle the next client."""
        import termios  # noqa: PLC0415 - POSIX only

        termios.tcflush(self._slave, termios.TCIFLUSH)

    def due(self) -> float:
        """When the bytes under way have passed."""
        return self._out.due()

    def close(self) -> None:
        """Close both ends."""
        os.close(self._master)
        os.close(self._slave)


class TcpEndpoint(Endpoint):
    """A listening TCP port; one client at a time, the next when it has gone.

    A second one is told by a STATUSTEXT of the robot that another holds it, and turned away. A client that has said nothing
    for 10 s loses its place to it. A client whose machine has vanished is found gone after 10 s.

    Args:
        host: Address to bind to.
        port: Port; 0 takes a free one.
        signing: Signs what is said for a robot that signs; None signs nothing.

    Raises:
        LinkOpenError: The port cannot be had.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 5760, signing: Signing | None = None) -> None:
        try:
            self._server = socket.create_server((host, port), family=_family(host))
        except OSError as error:
            raise LinkOpenError(f"tcp://{host}:{port}", str(error), "Choose another port") from error
        self._server.settimeout(0)
        self.url = _url("tcp", self._server)
        self._client: socket.socket | None = None
        self._heard = -math.inf
        self._interpreter = Interpreter(signing)
        self._farewells = Farewells()
        self._in = bytearray()
        self._out = bytearray()

    def files(self) -> list[int]:
        """The listening socket, and those of clients."""
        client = [self._client.fileno()] if self._client is not None else []
        return [self._server.fileno(), *client, *self._farewells.files()]

    def poll(self, now: float) -> None:
        """Take what the client has sent; a client that has gone, or is silent, makes room for the next."""
        self._farewells.poll(now)
        if self._client is not None:
            self._read(self._client, now)
        for _ in range(_ASKING):
            try:
                asking, _ = self._server.accept()
            except OSError:  # nobody there, or gone before we looked
                return
            asking.settimeout(0)
            if self._client is not None and now - self._heard < SILENT:
                self._farewells.add(asking, self._interpreter.line(HELD), now)
                continue
            if self._client is not None:
                self._farewells.add(self._client, self._interpreter.line(TAKEN_OVER), now)
                self._forget()
            asking.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            notice_half_open(asking)
            self._client, self._heard = asking, now
            self._read(asking, now)

    def _read(self, client: socket.socket, now: float) -> None:
        try:
            data = client.recv(_CHUNK)
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            data = b""
        if data:
            self._heard = now
            self._in += data
        else:
            self._drop()

    def receive(self, now: float) -> bytes:
        """What the client has sent."""
        self.poll(now)
        data = bytes(self._in)
        self._in.clear()
        return data

    def _drop(self) -> None:
        """The client has gone."""
        if self._client is not None:
            self._client.close()
        self._forget()

    def _forget(self) -> None:
        """There is no client any more, and nothing on its way to it."""
        self._client = None
        self._out.clear()

    def send(self, data: bytes, now: float) -> None:  # noqa: ARG002 - a socket is not paced
        """Send to the client, if there is one; whole chunks are lost when it does not take them."""
        self._interpreter.overhear(data)
        if self._client is None:
            return
        if len(self._out) + len(data) <= _BACKLOG:
            self._out += data
        if not self._out:
            return
        try:
            del self._out[: self._client.send(self._out)]
        except (BlockingIOError, InterruptedError):
            pass
        except OSError:
            self._drop()

    def close(self) -> None:
        """Close all sockets."""
        self._drop()
        self._farewells.close()
        self._server.close()


class UdpEndpoint(Endpoint):
    """A UDP port; answers go to whoever sent a good frame last, until 5 s after it.

    What anybody sends reaches the robot, which counts what is damaged. But nobody is spoken to who has not shown that he
    speaks the robot's language: a single byte under a forged address would turn the robot's stream on somebody else.

    Args:
        host: Address to bind to.
        port: Port; 0 takes a free one.

    Raises:
        LinkOpenError: The port cannot be had.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 14550) -> None:
        self._socket = socket.socket(_family(host), socket.SOCK_DGRAM)
        try:
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise LinkOpenError(f"udp://{host}:{port}", str(error), "Choose another port") from error
        self._socket.settimeout(0)
        self.url = _url("udpout", self._socket)
        self._client: tuple[str, int] | None = None
        self._heard = -math.inf
        self._interpreter = Interpreter()
        self._in = bytearray()

    def files(self) -> list[int]:
        """The socket."""
        return [self._socket.fileno()]

    def poll(self, now: float) -> None:
        """Take every datagram that has arrived."""
        while len(self._in) < _BACKLOG:
            try:
                datagram, sender = self._socket.recvfrom(_BACKLOG)
            except OSError:  # nothing more; or a client's port was found closed, which changes nothing
                return
            self._in += datagram
            if self._interpreter.is_good(datagram, now):
                self._client, self._heard = sender, now

    def receive(self, now: float) -> bytes:
        """Everything that has arrived."""
        self.poll(now)
        data = bytes(self._in)
        self._in.clear()
        return data

    def send(self, data: bytes, now: float) -> None:
        """Send datagrams to the client, if one has been heard lately."""
        if self._client is None or now - self._heard > INVITED:
            return
        for start in range(0, len(data), _DATAGRAM):
            try:
                self._socket.sendto(data[start : start + _DATAGRAM], self._client)
            except OSError:  # its port is closed, or the buffer is full: lost, as datagrams are
                return

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def _family(host: str) -> socket.AddressFamily:
    """IPv6 for numbers that look like it, else IPv4."""
    return socket.AF_INET6 if ":" in host else socket.AF_INET


def _url(scheme: str, bound: socket.socket) -> str:
    """What a client opens to reach a bound socket."""
    host, port = bound.getsockname()[:2]
    return f"{scheme}://[{host}]:{port}" if ":" in host else f"{scheme}://{host}:{port}"
